"""The field-of-view protocol: what a predictor loses when it sees the room in horizontal slices."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

import torch
from jaxtyping import Float, Int64
from torch import Tensor

from panoscene.geometry import OrientedBoxes
from panoscene.scene import Detections, Mesh, Objects, Relations, Scene, Shapes, ShapeSource, select

FOV_DEG = (360, 180, 120, 90, 60, 30)
"""Horizontal fields of view of the paper's experiment, degrees; the first is the whole room."""

Seen = TypeVar("Seen", Scene, Detections)


def fov_sector(lon: Float[Tensor, " n"], fov_deg: int) -> Int64[Tensor, " n"]:
    """Return for each lon the camera that sees it, of the 360 / fov_deg cameras around.

    Camera k looks along lon = k fov (to the right of the centre column) and sees the half-open
    sector [k fov - fov / 2, k fov + fov / 2): sectors are centred on the cameras, and camera 0 is
    the original one. The sectors tile the circle, so every lon is in exactly one of them.

    Args:
        lon: radians, not necessarily wrapped.
        fov_deg: degrees; a divisor of 360.

    Raises:
        ValueError: A field of view that does not divide 360, or a lon that is not finite.

    Source: DeepPanoContext, Sec. 4, experiment on the field of view, and the authors' release.

    Examples:
        >>> fov_sector(torch.tensor([0.0, 0.8, -0.7, -0.8, 3.1]), 90).tolist()
        [0, 1, 0, 3, 2]
    """
    cameras = _cameras(fov_deg)
    if not torch.isfinite(lon).all():
        raise ValueError("lon holds a number that is not finite")
    turns = lon.detach().double() / (2 * torch.pi)
    return torch.floor(turns * cameras + 0.5).long() % cameras


def split_by_fov(seen: Seen, fov_deg: int) -> list[Seen]:
    """Return what each of the 360 / fov_deg cameras sees, camera 0 first.

    An object belongs to the camera whose sector contains the centre of its BFoV, whole even where
    it reaches into the next sector. Objects keep their order. Nothing is turned or cut: BFoVs and
    boxes stay in the panorama and the world, and every split has the full layout, as in the
    authors' release. Relations are those among the objects of the split and with all walls.
    Cameras that see nothing get a scene without objects.

    Args:
        seen: a scene, or the detections alone.
        fov_deg: degrees; a divisor of 360. With 360 the only split is all of it.

    Raises:
        ValueError: A field of view that does not divide 360, or a BFoV that is not finite.

    Source: DeepPanoContext, Sec. 4, experiment on the field of view, and the authors' release.
    """
    if isinstance(seen, Detections):
        sector = fov_sector(seen.bfov[:, 0], fov_deg)
        return [_part_of_detections(seen, chosen) for chosen in _members(sector, fov_deg)]  # ty: ignore[invalid-explicit-return]
    sector = fov_sector(seen.objects.bfov[:, 0], fov_deg)
    return [select(seen, chosen) for chosen in _members(sector, fov_deg)]  # ty: ignore[invalid-explicit-return]


def run_by_fov(predictor: Callable[[Scene], Scene], scene: Scene, fov_deg: int) -> Scene:
    """Return what a predictor makes of a scene that it sees one split at a time.

    The predictor is called once for each split with objects, and its results are put together:

    - Objects return to their original order by their id. A predictor may drop objects, and may
      add some, which come last in the order of the cameras. Objects without ids are lent some,
      which are taken away again; a predictor that returns objects without ids must return as
      many as it was given, in order.
    - Relations among objects of one split and with walls are kept. About two objects of different
      splits nothing is known, and all scores are 0. There are no relations if no split has any.
    - Everything else, the layout too, is that of the given scene: every split was given it.

    With 360 degrees the result is that of a plain call, whatever it is.

    Args:
        predictor: takes a scene and returns one, for example
            ``lambda scene: arrange(scene).scene``.
        scene: with the BFoVs of its objects.
        fov_deg: degrees; a divisor of 360.

    Raises:
        ValueError: As ``split_by_fov``; an id that two splits return; objects that cannot be told
            apart; relations with another number of walls; or shape codes of some splits only.

    Source: DeepPanoContext, Sec. 4, experiment on the field of view, and the authors' release.
    """
    if _cameras(fov_deg) == 1:
        return predictor(scene)
    lent = not scene.objects.id
    if lent:
        names = tuple(f"object_{index}" for index in range(len(scene.objects.boxes)))
        scene = replace(scene, objects=replace(scene.objects, id=names))
    splits = [split for split in split_by_fov(scene, fov_deg) if len(split.objects.boxes)]
    results = [_named_as(predictor(split), split) for split in splits]
    merged = _merged(scene, results) if results else scene
    if lent:
        merged = replace(merged, objects=replace(merged.objects, id=()))
    return merged


def _cameras(fov_deg: int) -> int:
    if fov_deg < 1 or fov_deg > 360 or 360 % fov_deg:
        raise ValueError(f"fov_deg must be a divisor of 360, found {fov_deg}")
    return 360 // fov_deg


def _members(sector: Int64[Tensor, " n"], fov_deg: int) -> list[Int64[Tensor, " chosen"]]:
    return [torch.nonzero(sector == camera)[:, 0] for camera in range(_cameras(fov_deg))]


def _part_of_detections(seen: Detections, chosen: Int64[Tensor, " chosen"]) -> Detections:
    mask = None if seen.mask is None else seen.mask[chosen]
    return Detections(seen.bfov[chosen], seen.category[chosen], seen.score[chosen], mask)


def _named_as(result: Scene, split: Scene) -> Scene:
    """Return the result with ids; those of the split when the predictor returned none."""
    objects, given = result.objects, split.objects
    if objects.id or not len(objects.boxes):
        return result
    if len(objects.boxes) != len(given.boxes):
        raise ValueError(
            f"the predictor returned {len(objects.boxes)} objects without ids for "
            f"{len(given.boxes)}; expected ids, or as many objects"
        )
    return replace(result, objects=replace(objects, id=given.id))


def _merged(scene: Scene, results: Sequence[Scene]) -> Scene:
    """Return the results in the place of the scene's objects and relations, in its order."""
    objects = _joined_objects([result.objects for result in results])
    if len(set(objects.id)) < len(objects.id):
        twice = next(name for name in objects.id if objects.id.count(name) > 1)
        raise ValueError(f"the predictor returned the id {twice!r} more than once")
    place = {name: index for index, name in enumerate(scene.objects.id)}
    order = sorted(range(len(objects.id)), key=lambda k: place.get(objects.id[k], len(place)))
    joined = replace(scene, objects=objects, relations=_joined_relations(scene, results))
    return select(joined, torch.tensor(order, dtype=torch.int64))


def _joined_objects(parts: Sequence[Objects]) -> Objects:
    codes = [part.shapes.code for part in parts if part.shapes.code is not None]
    if codes and len(codes) < len(parts):
        raise ValueError(f"{len(codes)} of {len(parts)} splits have shape codes; expected all")
    meshes: tuple[Mesh | None, ...] = ()
    if any(part.shapes.mesh for part in parts):
        padded = [part.shapes.mesh or (None,) * len(part.boxes) for part in parts]
        meshes = tuple(mesh for part in padded for mesh in part)
    told = all(part.shapes.source for part in parts if len(part.boxes))
    sources: tuple[ShapeSource, ...] = ()
    if told:
        sources = tuple(source for part in parts for source in part.shapes.source)
    return Objects(
        boxes=OrientedBoxes(
            torch.cat([part.boxes.centre for part in parts]),
            torch.cat([part.boxes.size for part in parts]),
            torch.cat([part.boxes.yaw for part in parts]),
        ),
        category=torch.cat([part.category for part in parts]),
        score=torch.cat([part.score for part in parts]),
        bfov=torch.cat([part.bfov for part in parts]),
        distance_score=torch.cat([part.distance_score for part in parts]),
        yaw_score=torch.cat([part.yaw_score for part in parts]),
        id=tuple(name for part in parts for name in part.id),
        shapes=Shapes(code=torch.cat(codes) if codes else None, mesh=meshes, source=sources),
    )


def _joined_relations(scene: Scene, results: Sequence[Scene]) -> Relations | None:
    """Return the relations of all results as blocks on the diagonal, zeros elsewhere."""
    known = [result.relations for result in results if result.relations is not None]
    if not known:
        return None
    walls = len(scene.layout.floor_polygon)
    sizes = [len(result.objects.boxes) for result in results]
    n = sum(sizes)
    like = known[0].touching
    joined = Relations(
        touching=like.new_zeros(n, n),
        touching_wall=like.new_zeros(n, walls),
        on_floor=like.new_zeros(n),
        under_ceiling=like.new_zeros(n),
        inside_room=like.new_zeros(n),
        farther_than=like.new_zeros(n, n),
        relative_yaw=like.new_zeros(n, n, 8),
        relative_yaw_wall=like.new_zeros(n, walls, 8),
    )
    first = 0
    for result, size in zip(results, sizes, strict=True):
        part, own = result.relations, slice(first, first + size)
        first += size
        if part is None:
            continue
        if part.touching_wall.shape[1] != walls:
            raise ValueError(
                f"the predictor returned relations with {part.touching_wall.shape[1]} walls; "
                f"expected the {walls} of the layout"
            )
        for name in ("touching", "farther_than", "relative_yaw"):
            getattr(joined, name)[own, own] = getattr(part, name)
        for name in (
            "touching_wall", "on_floor", "under_ceiling", "inside_room", "relative_yaw_wall",
        ):  # fmt: skip
            getattr(joined, name)[own] = getattr(part, name)
    return joined
