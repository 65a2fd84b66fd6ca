"""What is checked of one panorama. Each check returns what is wrong, nothing when all is well."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Float64, Int32, UInt8

from panoscene.scene import Relations, Scene, relations_from_boxes
from panoscene.synth.assets import CadModel

from ._format import ObjectLabel, PanoramaLabels
from ._label import boxes_record
from ._pixels import pixel_directions, pixel_solid_angle
from ._semantic import UNLABELLED, semantic_value
from ._things import Box, moved, tight_box

_MILLIMETRE = 0.001
_RELATIONS = (
    "touching", "touching_wall", "on_floor", "under_ceiling", "inside_room", "farther_than",
    "relative_yaw", "relative_yaw_wall",
)  # fmt: skip


@dataclass(frozen=True)
class Loaded:
    """A panorama as it was read from disk, for the checks."""

    name: str
    scene: Scene
    labels: PanoramaLabels
    rgb: UInt8[np.ndarray, "height width 3"]
    distance: Float64[np.ndarray, "height width"]
    """Metres."""
    instance: Int32[np.ndarray, "height width"]
    semantic: Int32[np.ndarray, "height width"]
    library: Mapping[str, CadModel] | None = None
    """Models by id, for checks against the meshes."""

    @cached_property
    def upright(self) -> Float64[np.ndarray, "3 3"]:
        """Rotation from the photo's directions to the world's."""
        return np.array(self.scene.panorama.upright_from_photo)

    @cached_property
    def directions(self) -> Float64[np.ndarray, "height width 3"]:
        """Unit directions of the pixels in the world frame."""
        return pixel_directions(*self.instance.shape) @ self.upright.T

    @property
    def eye(self) -> Float64[np.ndarray, "3"]:
        """The camera in the world frame."""
        return np.array([0.0, 0.0, self.scene.panorama.camera_height])

    @cached_property
    def object_pixels(self) -> "ObjectPixels":
        """Pixels of the labelled objects in their boxes' frames."""
        return _object_pixels(self)


@dataclass(frozen=True, slots=True)
class ObjectPixels:
    """The pixels of all labelled objects, sorted by object; object k has those from start[k]."""

    start: np.ndarray
    owner: np.ndarray
    eye: np.ndarray
    """The camera in each object's frame."""
    half: np.ndarray
    """Half sizes of the boxes."""
    ray: np.ndarray
    """Directions of the pixels, in the frames of their objects."""
    distance: np.ndarray
    flat: np.ndarray
    """Place of each pixel in the picture, row by row."""


def check_distance(panorama: Loaded) -> list[str]:
    """Compare distances on walls, floor and ceiling with those to the planes of the layout."""
    layout, labels = panorama.scene.layout, panorama.labels
    corners = layout.floor_polygon.double().numpy()
    after = np.roll(corners, -1, axis=0)
    planes: dict[int, tuple[float, float, float, float]] = {}
    for part in labels.structure:
        if part.room != labels.camera.room:
            continue
        if part.kind == "floor":
            planes[part.instance] = (0.0, 0.0, 1.0, layout.floor_height)
        elif part.kind == "ceiling":
            planes[part.instance] = (0.0, 0.0, 1.0, layout.ceiling_height)
        elif part.kind == "wall" and part.index < len(corners):
            along = after[part.index] - corners[part.index]
            normal = np.array([-along[1], along[0]]) / np.linalg.norm(along)
            offset = float(normal @ corners[part.index])
            planes[part.instance] = (float(normal[0]), float(normal[1]), 0.0, offset)
    table = np.zeros((65536, 4))
    for instance, plane in planes.items():
        table[instance] = plane
    plane = table[panorama.instance]
    chosen = (plane[..., :3] != 0).any(axis=-1)
    if chosen.mean() < 0.01:
        return ["the camera's room covers less than 1 % of the picture"]
    plane, rays = plane[chosen], panorama.directions[chosen]
    slope = (plane[:, :3] * rays).sum(axis=1)
    expected = (plane[:, 3] - plane[:, :3] @ panorama.eye) / np.where(slope == 0, 1e-9, slope)
    error = np.abs(expected - panorama.distance[chosen])
    within = error <= 2 * _MILLIMETRE + 2e-4 * np.abs(expected)
    if within.mean() < 0.99:
        return [
            f"{1 - within.mean():.1%} of the room's pixels are off its planes, by "
            f"{np.median(error[~within]):.3g} m in the median"
        ]
    return []


def check_holes(panorama: Loaded) -> list[str]:
    """Look for places where one sees out of the home without a window."""
    weight = pixel_solid_angle(*panorama.instance.shape)
    share = float(((panorama.instance == 0) * weight[:, None]).sum() / (4 * np.pi))
    lost = float(((panorama.instance > 0) & (panorama.distance == 0)).mean())
    problems = []
    if share > 0.003:
        problems.append(f"nothing is seen in {share:.2%} of the sphere")
    if lost > 0.001:
        problems.append(f"{lost:.2%} of the pixels have an instance but no distance")
    return problems


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
    """
    found = panorama.object_pixels
    points = found.eye[found.owner] + found.ray * found.distance[:, None]
    slack = 0.01 + 2 * _MILLIMETRE
    outside = np.any(np.abs(points) > found.half[found.owner] + slack, axis=1)
    shares = _means(outside, found.start)
    problems = []
    for k, label in enumerate(panorama.labels.objects):
        if shares[k] > 0.01:
            problems.append(f"{label.id}: {shares[k]:.1%} of its points are outside its box")
        elif _is_clear(label):
            mine = slice(found.start[k], found.start[k + 1])
            gap = _largest_gap(
                points[mine], found.eye[k], found.half[k], found.distance[mine],
                panorama.instance.shape[1],
            )  # fmt: skip
            if gap is not None:
                problems.append(f"{label.id}: its points end {gap:.2g} m before a face of its box")
    return problems


def check_relations(panorama: Loaded) -> list[str]:
    """Compare relations with those recomputed from boxes, and boxes with the meshes."""
    scene = panorama.scene
    if scene.relations is None:
        return ["scene.json has no relations"]
    kept = [label for label in panorama.labels.objects if label.in_scene]
    boxes = scene.objects.boxes
    if tuple(label.id for label in kept) != scene.objects.id:
        return ["scene.json and labels.json list different objects"]
    problems = []
    told = boxes_record([Box(label.box.centre, label.box.size, label.box.yaw) for label in kept])
    for name in ("centre", "size"):
        apart = (getattr(told, name) - getattr(boxes, name)).abs()
        if apart.numel() and float(apart.max()) > _MILLIMETRE:
            problems.append(f"boxes of scene.json and labels.json differ by {float(apart.max())} m")
    again = relations_from_boxes(boxes, scene.layout, scene.panorama.camera_height)
    problems += _differing(scene.relations, again, 0.0, "the boxes")
    if panorama.library is not None:
        meshes, missing = _mesh_boxes(kept, panorama.library)
        for label, box in zip(kept, meshes, strict=True):
            off = max(np.abs(np.subtract(box.centre, label.box.centre)).max(),
                      np.abs(np.subtract(box.size, label.box.size)).max())  # fmt: skip
            if off > 2 * _MILLIMETRE and label.category not in ("window", "door"):
                problems.append(f"{label.id}: its box is {off:.3g} m off its mesh")
        problems += [f"{name}: the library has no model of this id" for name in missing]
        again = relations_from_boxes(
            boxes_record(meshes), scene.layout, scene.panorama.camera_height
        )
        problems += _differing(scene.relations, again, 0.01, "the meshes")
    return problems


def check_mirrored(panorama: Loaded) -> list[str]:
    """Look whether objects are on the side of the picture where their boxes are."""
    right = wrong = 0
    found = panorama.object_pixels
    rays = panorama.directions.reshape(-1, 3)[found.flat]
    for k, label in enumerate(panorama.labels.objects):
        centre = np.array(label.box.centre)
        lon = float(np.arctan2(centre[0], centre[1]))
        mine = rays[found.start[k] : found.start[k + 1]]
        told = min(abs(2 * lon), 2 * np.pi - abs(2 * lon)) > 0.4
        if len(mine) and told and label.occlusion < 0.3 and "nadir" not in label.truncated:
            mean = mine.mean(axis=0)
            seen = float(np.arctan2(mean[0], mean[1]))
            apart, mirrored = (abs((seen - s * lon + np.pi) % (2 * np.pi) - np.pi) for s in (1, -1))
            right, wrong = right + (apart < mirrored), wrong + (apart >= mirrored)
    if wrong > 0.1 * (right + wrong):
        return [f"{wrong} of {right + wrong} objects are nearer to the mirrored place of their box"]
    return []


def _object_pixels(panorama: Loaded) -> ObjectPixels:
    objects = panorama.labels.objects
    place = np.full(65536, -1, np.int64)
    for k, label in enumerate(objects):
        place[label.instance] = k
    flat = np.flatnonzero(place[panorama.instance.reshape(-1)] >= 0)
    owner = place[panorama.instance.reshape(-1)[flat]]
    order = np.argsort(owner, kind="stable")
    flat, owner = flat[order], owner[order]
    start = np.searchsorted(owner, np.arange(len(objects) + 1))
    yaw = np.array([label.box.yaw for label in objects])
    centre = np.array([label.box.centre for label in objects]).reshape(-1, 3)
    half = np.array([label.box.size for label in objects]).reshape(-1, 3) / 2
    cos, sin, zero = np.cos(yaw), np.sin(yaw), np.zeros(len(objects))
    turn = np.stack(
        [np.stack([cos, sin, zero], -1), np.stack([-sin, cos, zero], -1),
         np.stack([zero, zero, zero + 1], -1)], axis=1
    )  # fmt: skip
    eye = np.einsum("nij,nj->ni", turn, panorama.eye - centre)
    rays = panorama.directions.reshape(-1, 3)[flat]
    local = np.einsum("pij,pj->pi", turn[owner], rays)
    return ObjectPixels(start, owner, eye, half, local, panorama.distance.reshape(-1)[flat], flat)


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


def _largest_gap(
    points: np.ndarray, eye: np.ndarray, half: np.ndarray, distance: np.ndarray, columns: int
) -> float | None:
    """Return how far points end before a face that looks at the camera, None if near enough.

    Thin tips fall between pixels: a tenth of the size and two pixels are let pass.
    """
    pixel = 2 * np.pi / columns * float(np.median(distance))
    allowed = 0.02 + 0.2 * half + 2 * pixel
    gap = np.where(
        eye > half, half - points.max(axis=0),
        np.where(eye < -half, points.min(axis=0) + half, 0.0),
    )  # fmt: skip
    return float(gap.max()) if (gap > allowed).any() else None


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


def _mesh_boxes(
    labels: list[ObjectLabel], library: Mapping[str, CadModel]
) -> tuple[list[Box], list[str]]:
    """Return boxes from the meshes; those of the labels for what the building made itself."""
    boxes, missing = [], []
    for label in labels:
        if label.model in library:
            matrix = np.array(label.world_from_object)
            vertices = library[label.model].vertices.astype(np.float64)
            boxes.append(tight_box(moved(matrix, vertices), matrix))
        else:
            if not label.model.startswith("shell/"):
                missing.append(label.model)
            boxes.append(Box(label.box.centre, label.box.size, label.box.yaw))
    return boxes, missing


def _differing(told: Relations, again: Relations, share: float, source: str) -> list[str]:
    problems = []
    for name in _RELATIONS:
        one, two = getattr(told, name), getattr(again, name)
        if one.shape != two.shape:
            problems.append(f"{name} has shape {tuple(one.shape)}, not {tuple(two.shape)}")
            continue
        differ = torch.count_nonzero(one != two)
        if int(differ) > max(share * one.numel(), 4 if share else 0):
            problems.append(f"{name}: {int(differ)} entries differ from those of {source}")
    return problems
