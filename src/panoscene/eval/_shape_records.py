"""What each scene says about shapes, object by object, in canonical space and in the world."""

from dataclasses import dataclass

import torch
from jaxtyping import Int64
from torch import Tensor

from panoscene.eval._matching import match_objects
from panoscene.eval._shape_errors import (
    SHAPE_POINTS,
    SHAPE_THRESHOLD,
    ShapeErrors,
    missed_shape,
    shape_errors,
)
from panoscene.scene import Mesh, Objects, Scene, object_mesh, place_vertices

WORLD_THRESHOLD = 0.05
"""Metres within which surfaces agree in the world, where the error of the box counts too."""


@dataclass(frozen=True, slots=True)
class ShapePair:
    """The errors of one predicted object and the target that it was matched with."""

    prediction: int
    target: int
    canonical: ShapeErrors
    """In canonical space: both meshes centred and scaled, per axis, to the unit box. Lengths are
    parts of the box."""
    world: ShapeErrors
    """In metres, both meshes in their boxes."""
    box_stands_in: bool
    """The prediction had no mesh, so its box was its shape."""


@dataclass(frozen=True, slots=True)
class ShapeRecord:
    """The shape measures of one scene."""

    name: str
    pairs: tuple[ShapePair, ...]
    """Of every target with a mesh that was found."""
    missed: tuple[ShapeErrors, ...]
    """Of every target with a mesh that was not."""
    targets_without_mesh: int
    """Targets whose shape is not known; they do not count."""
    scene: ShapeErrors | None = None
    """Of all objects of the scene as one mesh, in metres, when that was asked for."""


def canonical_mesh(mesh: Mesh) -> Mesh:
    """Return a mesh moved and scaled, axis by axis, so that it fills [-1/2, 1/2]^3.

    An axis along which the mesh is flat is only moved.

    Source: placement of shapes in the authors' release.

    Examples:
        >>> from panoscene.scene import box_mesh
        >>> box = box_mesh()
        >>> canonical_mesh(Mesh(box.vertices * 3 + 1, box.faces)).vertices.amax(0)
        tensor([0.5000, 0.5000, 0.5000])
    """
    low, high = mesh.vertices.amin(0), mesh.vertices.amax(0)
    extent = high - low
    scale = torch.where(extent > 0, extent, 1.0)
    return Mesh((mesh.vertices - (low + high) / 2) / scale, mesh.faces)


def shape_record(
    prediction: Scene | None,
    target: Scene,
    *,
    generator: torch.Generator,
    match: Int64[Tensor, " n"] | None = None,
    points: int = SHAPE_POINTS,
    threshold: float = SHAPE_THRESHOLD,
    world_threshold: float = WORLD_THRESHOLD,
    scene_points: int = 0,
) -> ShapeRecord:
    """Return the shape measures of one scene.

    Args:
        prediction: What was predicted; None for a missing one.
        target: The true scene; objects without a mesh are left out and counted.
        generator: Source of the samples.
        match: Target of each predicted object, or -1; by default that of ``match_objects``.
        points: Samples of each surface of an object.
        threshold: Of the F-score in canonical space, a part of the box.
        world_threshold: Of the F-score in the world, in metres.
        scene_points: Samples of the surface of all objects together (the paper takes 100,000);
            0 leaves that measure out. Objects without a mesh take part as boxes there.

    Raises:
        ValueError: ``match`` is not one number for each predicted object, or out of range.
    """
    count = len(target.objects.boxes)
    known = [k for k in range(count) if _has_mesh(target.objects, k)]
    targets = _checked_match(prediction, target, match)
    pairs: list[ShapePair] = []
    for number, partner in enumerate(targets):
        if prediction is None or partner not in known:
            continue
        own, true = object_mesh(prediction.objects, number), object_mesh(target.objects, partner)
        own, true = canonical_mesh(own), canonical_mesh(true)
        pairs.append(
            ShapePair(
                prediction=number,
                target=partner,
                canonical=shape_errors(
                    own, true, generator=generator, points=points, threshold=threshold
                ),
                world=shape_errors(
                    _placed(own, prediction.objects, number),
                    _placed(true, target.objects, partner),
                    generator=generator,
                    points=points,
                    threshold=world_threshold,
                ),
                box_stands_in=not _has_mesh(prediction.objects, number),
            )
        )
    missed = set(known) - {pair.target for pair in pairs}
    scene = None
    if scene_points and count:
        scene = shape_errors(
            _merged(prediction.objects) if prediction else _nothing(),
            _merged(target.objects),
            generator=generator,
            points=scene_points,
            threshold=world_threshold,
            volume=False,
        )
    return ShapeRecord(
        name=target.name,
        pairs=tuple(pairs),
        missed=tuple(missed_shape(object_mesh(target.objects, k)) for k in sorted(missed)),
        targets_without_mesh=count - len(known),
        scene=scene,
    )


def _checked_match(
    prediction: Scene | None, target: Scene, match: Int64[Tensor, " n"] | None
) -> list[int]:
    if prediction is None:
        return []
    if match is None:
        match = match_objects(prediction.objects, target.objects)
    found: list[int] = match.tolist()
    count, others = len(prediction.objects.boxes), len(target.objects.boxes)
    if len(found) != count or any(not -1 <= index < others for index in found):
        raise ValueError(f"match: expected {count} numbers from -1 to {others - 1}, found {found}")
    matched = [index for index in found if index >= 0]
    if len(set(matched)) < len(matched):
        raise ValueError(f"match: expected each target once at most, found {found}")
    return found


def _has_mesh(objects: Objects, index: int) -> bool:
    mesh = objects.shapes.mesh[index] if objects.shapes.mesh else None
    return mesh is not None and len(mesh.faces) > 0


def _placed(mesh: Mesh, objects: Objects, index: int) -> Mesh:
    return Mesh(place_vertices(mesh.vertices, objects.boxes[index]), mesh.faces)


def _nothing() -> Mesh:
    return Mesh(torch.zeros(0, 3), torch.zeros(0, 3, dtype=torch.int64))


def _merged(objects: Objects) -> Mesh:
    """Return all objects as one mesh in the world frame."""
    merged = _nothing()
    for index in range(len(objects.boxes)):
        one = _placed(canonical_mesh(object_mesh(objects, index)), objects, index)
        faces = torch.cat((merged.faces, one.faces + len(merged.vertices)))
        merged = Mesh(torch.cat((merged.vertices.to(one.vertices), one.vertices)), faces)
    return merged
