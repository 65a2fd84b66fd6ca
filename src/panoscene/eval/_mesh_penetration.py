"""Penetration of object meshes: what boxes cannot see, a chair under a table for one."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from operator import attrgetter

import numpy as np
import shapely
import torch
from jaxtyping import Float

from panoscene.eval._plausibility import ratio
from panoscene.eval._solid_depth import common_depth
from panoscene.eval._solids import SolidKind, common_space, object_solid
from panoscene.geometry import (
    OrientedBoxes,
    box_footprint,
    boxes_collide,
    paired_intersection_volume,
    penetration_depth,
)
from panoscene.scene import Scene

PENETRATION_TOLERANCE = 0.01
"""Metres that two meshes may be in each other before they count as penetrating."""


@dataclass(frozen=True, slots=True)
class Penetration:
    """How far two objects whose boxes overlap are in each other."""

    first: int
    second: int
    """Indices of the two objects, the smaller one first."""
    depth: float
    """Metres by which one must at least move to come out of the other; 0 when they do not meet."""
    volume: float
    """Cubic metres that they share."""
    kinds: tuple[SolidKind, SolidKind]
    """What stood for each of them: its mesh, its convex hull (the mesh is not closed) or its box
    (there is no mesh)."""


@dataclass(frozen=True, slots=True)
class PenetrationRecord:
    """Penetration in one scene: plain numbers, to be added up over scenes."""

    objects: int
    pairs: int
    """Unordered pairs of objects: n (n - 1) / 2."""
    overlapping_boxes: int
    """Pairs whose boxes overlap; only these were looked at."""
    penetrating_pairs: int
    """Pairs of solids that are deeper than 1 cm in each other."""
    depth: float
    """Metres, added up over all pairs."""
    worst_depth: float
    volume: float
    """Cubic metres shared, added up over pairs."""
    looked_at: int
    """Objects in at least one pair of overlapping boxes."""
    as_hull: int
    """Those of them for which the convex hull stood in."""
    as_box: int
    """Those of them for which the box stood in."""

    def as_dict(self) -> dict[str, int | float]:
        """Return the fields as plain values, for JSON."""
        return asdict(self)


def mesh_penetrations(scene: Scene, *, resolution: int = 40) -> tuple[Penetration, ...]:
    """Return how far the objects of each pair with overlapping boxes are in each other.

    The volume is sampled by ``resolution`` x ``resolution`` vertical lines over the rectangle in
    which the two footprints overlap, and exact along them. The depth is the largest sum of the
    depths of a common point below both surfaces: the length that one object must at least move;
    exact for boxes with parallel faces. Where an object is made of parts that overlap, their
    inner faces count as surface, and the depth is a lower bound still. Two boxes are measured in
    closed form.

    Objects without a mesh are boxes. Meshes that are not closed have no inside: their convex hull
    is taken instead, or the box when they are flat, and ``kinds`` says so.

    Args:
        scene: the objects, with or without meshes.
        resolution: lines along each side of the rectangle.

    Raises:
        ValueError: ``resolution`` is less than 2.

    Examples:
        >>> from panoscene.geometry import OrientedBoxes
        >>> from panoscene.scene import Layout, objects_from_boxes, scene_from_boxes
        >>> room = Layout(torch.tensor([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]]))
        >>> boxes = OrientedBoxes(
        ...     torch.tensor([[0.0, 1.0, 0.5], [0.75, 1.0, 0.5]]), torch.ones(2, 3), torch.zeros(2)
        ... )
        >>> objects = objects_from_boxes(boxes, ["chair", "sofa"], camera_height=1.6)
        >>> mesh_penetrations(scene_from_boxes(objects, room, camera_height=1.6))
        (Penetration(first=0, second=1, depth=0.25, volume=0.25, kinds=('box', 'box')),)
    """
    if resolution < 2:
        raise ValueError(f"resolution: expected at least 2, found {resolution}")
    objects = scene.objects
    boxes = OrientedBoxes(
        *(part.detach().cpu().double() for part in attrgetter(*_BOX_PARTS)(objects.boxes))
    )
    overlap = boxes_collide(boxes[:, None], boxes[None]).triu(diagonal=1)
    first, second = overlap.nonzero(as_tuple=True)
    depths = penetration_depth(boxes[first], boxes[second]).tolist()
    volumes = paired_intersection_volume(boxes[first], boxes[second]).tolist()
    pairs = list(zip(first.tolist(), second.tolist(), strict=True))
    solids = {k: object_solid(objects, k) for k in sorted({k for pair in pairs for k in pair})}
    found: list[Penetration] = []
    for (a, b), depth, volume in zip(pairs, depths, volumes, strict=True):
        kinds = (solids[a].kind, solids[b].kind)
        if kinds != ("box", "box"):
            rectangle = _common_rectangle(boxes[torch.tensor([a, b])])
            common = common_space(solids[a], solids[b], rectangle, resolution=resolution)
            depth, volume = common_depth(solids[a], solids[b], common.points), common.volume  # noqa: PLW2901
        found.append(Penetration(a, b, depth, volume, kinds))
    return tuple(found)


def penetration_record(scene: Scene, *, resolution: int = 40) -> PenetrationRecord:
    """Return the penetration in a scene, added up; see ``mesh_penetrations``.

    Raises:
        ValueError: ``resolution`` is less than 2.
    """
    found = mesh_penetrations(scene, resolution=resolution)
    kind = {
        index: kind
        for pair in found
        for index, kind in zip((pair.first, pair.second), pair.kinds, strict=True)
    }
    n = len(scene.objects.boxes)
    return PenetrationRecord(
        objects=n,
        pairs=n * (n - 1) // 2,
        overlapping_boxes=len(found),
        penetrating_pairs=sum(pair.depth > PENETRATION_TOLERANCE for pair in found),
        depth=sum((pair.depth for pair in found), 0.0),
        worst_depth=max((pair.depth for pair in found), default=0.0),
        volume=sum((pair.volume for pair in found), 0.0),
        looked_at=len(kind),
        as_hull=sum(value == "hull" for value in kind.values()),
        as_box=sum(value == "box" for value in kind.values()),
    )


def score_penetration(records: Sequence[PenetrationRecord]) -> dict[str, float | None]:
    """Return the penetration in a data set; scenes without objects count with zeros.

    - ``penetrating_pairs``, ``penetration_depth`` (m), ``penetration_volume`` (m3): per scene
    - ``penetration_rate``: penetrating pairs per pair of objects, None without pairs
    - ``worst_penetration``: metres, over all scenes
    - ``hull_share``, ``box_share``: of the objects that were looked at, those for which the convex
      hull or the box stood in; None when none was looked at

    Raises:
        ValueError: there are no records.
    """
    if not records:
        raise ValueError("records: expected those of at least one scene, found none")
    worst = max(record.worst_depth for record in records)
    return {
        **penetration_of_sums(penetration_sums(records).sum(axis=0)),
        "worst_penetration": worst,
    }


def penetration_sums(records: Sequence[PenetrationRecord]) -> Float[np.ndarray, "scenes columns"]:
    """Return for each scene a 1 and the numbers of its record, to be added up."""
    return np.array([(1, *_numbers(record)) for record in records], dtype=np.float64)


def penetration_of_sums(sums: Float[np.ndarray, " columns"]) -> dict[str, float | None]:
    """Return ``score_penetration`` for added rows of ``penetration_sums``, without the worst."""
    scenes, *numbers = sums.tolist()
    total = dict(zip(_NAMES, numbers, strict=True))
    return {
        "scenes": scenes,
        "penetrating_pairs": total["penetrating_pairs"] / scenes,
        "penetration_depth": total["depth"] / scenes,
        "penetration_volume": total["volume"] / scenes,
        "penetration_rate": ratio(total["penetrating_pairs"], total["pairs"]),
        "hull_share": ratio(total["as_hull"], total["looked_at"]),
        "box_share": ratio(total["as_box"], total["looked_at"]),
    }


_BOX_PARTS = ("centre", "size", "yaw")
_NAMES = tuple(field.name for field in fields(PenetrationRecord))
_numbers = attrgetter(*_NAMES)


def _common_rectangle(pair: OrientedBoxes) -> Float[np.ndarray, "4 2"]:
    """Return the smaller of the rectangles, along either box, around what the footprints share."""
    footprints = box_footprint(pair).numpy()
    first, second = footprints
    shared = shapely.intersection(shapely.Polygon(first), shapely.Polygon(second))
    places = shapely.get_coordinates(shared)
    smallest: tuple[float, np.ndarray] | None = None
    for corner in footprints:
        right = (corner[1] - corner[0]) / np.linalg.norm(corner[1] - corner[0])
        plan_from_box = np.array([[right[0], -right[1]], [right[1], right[0]]])
        local = places @ plan_from_box
        low, high = local.min(axis=0), local.max(axis=0)
        area = float((high - low).prod())
        if smallest is None or area < smallest[0]:
            around = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
            smallest = (area, around @ plan_from_box.T)
    if smallest is None:
        raise ValueError("pair: expected two boxes")
    return smallest[1]
