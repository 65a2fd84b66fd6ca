"""What is checked of the pixels of one panorama's objects: masks and points against boxes."""

import numpy as np

from ._amodal import points_seen_alone
from ._format import ObjectLabel
from ._loaded import Loaded
from ._pixels import pixel_directions
from ._semantic import UNLABELLED, semantic_value
from ._things import moved

_MILLIMETRE = 0.001
_THIN_SHARE = 1 / 3
"""Of the size that may be thin; for checks without meshes."""
_ALIKE = 0.01
"""Metres by which the ends of points may differ."""


def check_masks(panorama: Loaded) -> list[str]:
    """Look for mask pixels outside the projection of their object's box."""
    found = panorama.object_pixels
    half = found.half[found.owner] + 0.01
    ray = np.where(np.abs(found.ray) < 1e-12, 1e-12, found.ray)
    near = (-half - found.eye[found.owner]) / ray
    far = (half - found.eye[found.owner]) / ray
    enter, leave = np.minimum(near, far).max(axis=1), np.maximum(near, far).min(axis=1)
    outside = ~((enter <= leave) & (leave >= 0))
    problems = [
        f"{label.id}: {share:.1%} of its mask is outside the projection of its box"
        for label, share in zip(panorama.labels.objects, _means(outside, found.start), strict=True)
        if share > 0.01
    ]
    counts = np.diff(found.start)
    problems += [
        f"{label.id}: {count} pixels in instance.png, {label.pixels} in labels.json"
        for label, count in zip(panorama.labels.objects, counts, strict=True)
        if count != label.pixels
    ]
    return problems + _semantic_problems(panorama)


def check_points(panorama: Loaded) -> list[str]:
    """Compare boxes with the points of their objects that the distance map gives.

    All points must be in the box. And of an object that nothing hides, the outermost point on
    each side that faces the camera is in sight, so there the points must reach the box's face.
    Only a thin part that is seen edge-on, such as a sheet of glass at eye level, falls between
    the pixels. With a library the same rays, cast at the mesh alone, tell; without, points may
    end a third of the size before a face.
    """
    found = panorama.object_pixels
    points = found.eye[found.owner] + found.ray * found.distance[:, None]
    slack = 0.01 + 2 * _MILLIMETRE
    outside = np.any(np.abs(points) > found.half[found.owner] + slack, axis=1)
    shares = _means(outside, found.start)
    columns = panorama.instance.shape[1]
    problems = []
    for k, label in enumerate(panorama.labels.objects):
        if shares[k] > 0.01:
            problems.append(f"{label.id}: {shares[k]:.1%} of its points are outside its box")
        elif _is_clear(label):
            mine = slice(found.start[k], found.start[k + 1])
            seen, eye, half = points[mine], found.eye[k], found.half[k]
            gap = _largest_gap(seen, eye, half, found.distance[mine], columns)
            if gap is not None and _is_thin_there(panorama, label, seen, eye, half):
                gap = None
            if gap is not None:
                problems.append(f"{label.id}: its points end {gap:.2g} m before a face of its box")
    return problems


def _means(values: np.ndarray, start: np.ndarray) -> np.ndarray:
    total = np.concatenate([[0], np.cumsum(values)])
    return (total[start[1:]] - total[start[:-1]]) / np.maximum(np.diff(start), 1)


def _is_clear(label: ObjectLabel) -> bool:
    """Return whether an object is seen well enough that its faces can be checked."""
    return (
        label.in_scene
        and label.occlusion < 0.02
        and label.pixels >= 300
        and not {"zenith", "nadir"} & set(label.truncated)
    )


def _is_thin_there(
    panorama: Loaded, label: ObjectLabel, seen: np.ndarray, eye: np.ndarray, half: np.ndarray
) -> bool:
    """Return whether points end before a face because what reaches it falls between pixels."""
    gaps = _gaps(seen, eye, half)
    if panorama.library is None or label.model not in panorama.library:
        return bool((gaps <= 0.02 + _THIN_SHARE * 2 * half).all())
    model = panorama.library[label.model]
    turn = _upright_turn(label.box.yaw)
    vertices = moved(np.array(label.world_from_object), model.vertices.astype(np.float64))
    own = (vertices - label.box.centre) @ turn.T
    if (_gaps(own, eye, half) > _ALIKE).any():
        return False  # the box is larger than the mesh
    # in the photo's own frame, where directions fall from row to row
    rays = pixel_directions(*panorama.instance.shape).reshape(-1, 3).astype(np.float32)
    local = (vertices - panorama.eye) @ panorama.upright
    alone = points_seen_alone(local, model.faces.astype(np.int32), rays)
    if len(alone) == 0:
        return False
    alone = (alone @ panorama.upright.T + panorama.eye - label.box.centre) @ turn.T
    return bool((gaps <= _gaps(alone, eye, half) + _ALIKE).all())


def _largest_gap(
    points: np.ndarray, eye: np.ndarray, half: np.ndarray, distance: np.ndarray, columns: int
) -> float | None:
    """Return how far points end before a face that looks at the camera, None if near enough.

    Thin tips fall between pixels: a tenth of the size and two pixels are let pass.
    """
    pixel = 2 * np.pi / columns * float(np.median(distance))
    allowed = 0.02 + 0.2 * half + 2 * pixel
    gap = _gaps(points, eye, half)
    return float(gap.max()) if (gap > allowed).any() else None


def _gaps(points: np.ndarray, eye: np.ndarray, half: np.ndarray) -> np.ndarray:
    """Return how far points end before the faces that look at the camera, along each axis."""
    return np.where(
        eye > half, half - points.max(axis=0),
        np.where(eye < -half, points.min(axis=0) + half, 0.0),
    )  # fmt: skip


def _upright_turn(yaw: float) -> np.ndarray:
    """Return the rotation from the world's axes to those of a box."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])


def _semantic_problems(panorama: Loaded) -> list[str]:
    table = np.full(65536, -1)
    table[0] = UNLABELLED
    for label in panorama.labels.objects:
        table[label.instance] = semantic_value(label.category)
    for part in panorama.labels.structure:
        table[part.instance] = semantic_value(part.kind)
    expected = table[panorama.instance]
    problems = []
    if (expected < 0).any():
        problems.append(f"{(expected < 0).sum()} pixels have ids that labels.json does not list")
    differing = float(((expected != panorama.semantic) & (expected >= 0)).mean())
    if differing:
        problems.append(f"semantic.png differs from the instances in {differing:.2%} of its pixels")
    return problems
