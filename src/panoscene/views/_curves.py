"""Layout, boxes and fronts of a scene as curves of its panorama."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
import torch
from jaxtyping import Bool, Float, Int64

from panoscene.geometry import (
    OrientedBoxes,
    box_corners,
    corner_visible,
    polygon_contains,
    wall_distance,
)
from panoscene.scene import CATEGORIES, Layout, Scene
from panoscene.style import NO_FRONT
from panoscene.views._arcs import cut_curves, sample_lines

CurveKind = Literal["floor", "ceiling", "corner", "edge", "front"]
_ROOM = ("floor", "ceiling", "corner")
_EDGES = np.array([[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5],
                   [2, 6], [3, 7]])  # fmt: skip
"""Corners at the ends of a box's edges; edge 1 is where the front meets the floor."""
ARROW = (0.12, 0.45)
"""Shortest and longest arrow in metres; it is 0.4 times as long as the front is wide."""
_AHEAD = 0.01
"""Metres by which something must be nearer, and thick, to hide what is behind it."""
_BEHIND_WALL = 0.5
"""Metres behind a wall from which objects are hidden by it; estimates are less exact than walls."""


@dataclass(frozen=True, slots=True)
class Curve:
    """A smooth piece of a line of the scene, as the panorama shows it."""

    kind: CurveKind
    """``floor`` and ``ceiling``: where they meet a wall; ``corner``: where two walls meet;
    ``edge`` of a box; ``front``: arrow before a box, at the height of its lower face."""
    index: int
    """Of the wall, the corner or the object."""
    part: int
    """Of an edge: 0 to 11, along x, y and z of the box, four each; edge 1 is the lower edge of
    the front. Of an arrow: 0 for its shaft, 1 and 2 for its head. Else 0."""
    visible: bool
    """Whether nothing is before it: its own box, another box, a wall."""
    lonlat: Float[np.ndarray, "points 2"]
    """Lon in [-pi, pi], lat; at most a degree from point to point, never across the picture."""


def overlay_curves(scene: Scene) -> tuple[Curve, ...]:
    """Return the lines of a scene as curves of its panorama: layout, box edges, front arrows.

    Every point lies exactly on its line. Curves are cut where they become hidden or visible, at
    the seam (one ends at lon = pi, the next starts at -pi) and at a pole that they pass through.

    Convention:
        - order: floor lines, ceiling lines, corners, then the objects; each from start to end
        - objects hide what is behind their boxes; walls hide the room behind them, and objects
          more than 0.5 m behind them, unless the camera is outside of the room
        - lines through the camera are left out

    Raises:
        ValueError: boxes or corners that are not finite.

    Examples:
        >>> from panoscene.sample import sample_room_path
        >>> from panoscene.scene import read_scene
        >>> curves = overlay_curves(read_scene(sample_room_path()))
        >>> sorted({curve.kind for curve in curves})
        ['ceiling', 'corner', 'edge', 'floor', 'front']
    """
    check_finite(scene)
    lines = _scene_lines(scene)
    camera = np.array([0.0, 0.0, scene.panorama.camera_height])
    samples = sample_lines(lines.start - camera, lines.end - camera)
    room = lines.room[samples.line]
    hidden = _behind_walls(scene.layout, samples.place, samples.lon, room)
    hidden |= _behind_boxes(scene.objects.boxes, samples.place, camera)
    # corners lie on the very edge of what walls hide: asked for as corners
    corners = corner_visible(scene.layout.floor_polygon.double()).numpy(force=True)
    if _camera_inside(scene.layout):
        concealed = np.flatnonzero(~corners)
        is_corner = lines.kind[samples.line] == "corner"
        hidden |= is_corner & np.isin(lines.index[samples.line], concealed)
    bounds = np.searchsorted(samples.line, np.arange(len(lines.start) + 1))
    return tuple(
        Curve(lines.kind[k].item(), int(lines.index[k]), int(lines.part[k]), visible, lonlat)
        for k, (low, high) in enumerate(pairwise(bounds))
        if high > low
        for visible, lonlat in cut_curves(
            samples.lon[low:high], samples.lat[low:high], ~hidden[low:high]
        )
    )


def check_finite(scene: Scene) -> None:
    """Refuse a scene that cannot be drawn.

    Raises:
        ValueError: boxes or corners that are not finite.
    """
    boxes = scene.objects.boxes
    for name, values in (
        ("boxes.centre", boxes.centre),
        ("boxes.size", boxes.size),
        ("boxes.yaw", boxes.yaw),
        ("floor_polygon", scene.layout.floor_polygon),
    ):
        if not bool(torch.isfinite(values).all()):
            raise ValueError(f"{name}: found numbers that are not finite")


@dataclass(frozen=True, slots=True)
class _Lines:
    """Straight lines of the world and what they are."""

    start: Float[np.ndarray, "lines 3"]
    end: Float[np.ndarray, "lines 3"]
    kind: np.ndarray
    index: Int64[np.ndarray, " lines"]
    part: Int64[np.ndarray, " lines"]

    @property
    def room(self) -> Bool[np.ndarray, " lines"]:
        """Whether each line belongs to the layout."""
        return np.isin(self.kind, _ROOM)


def _scene_lines(scene: Scene) -> _Lines:
    layout, boxes = scene.layout, scene.objects.boxes
    polygon = layout.floor_polygon.double().numpy(force=True)
    low, high = (
        np.concatenate([polygon, np.full((len(polygon), 1), height)], axis=1)
        for height in (layout.floor_height, layout.ceiling_height)
    )
    corners = box_corners(_double(boxes)).numpy(force=True).reshape(-1, 8, 3)
    arrows, arrow_index = _arrows(scene)
    ends = [
        np.stack([low, np.roll(low, -1, 0)], 1),
        np.stack([high, np.roll(high, -1, 0)], 1),
        np.stack([low, high], 1),
        corners[:, _EDGES].reshape(-1, 2, 3),
        arrows.reshape(-1, 2, 3),
    ]
    walls, objects = np.arange(len(polygon)), np.arange(len(boxes))
    kinds = ["floor", "ceiling", "corner", "edge", "front"]
    indices = [walls, walls, walls, np.repeat(objects, 12), np.repeat(arrow_index, 3)]
    zeros = np.zeros(3 * len(walls), dtype=np.int64)
    parts = [zeros, np.tile(range(12), len(objects)), np.tile(range(3), len(arrow_index))]
    both, index, part = (np.concatenate(some) for some in (ends, indices, parts))
    kind = np.repeat(kinds, [len(some) for some in ends])
    # stable: the room, then for each object its edges and its arrow
    order = np.argsort(np.where(np.isin(kind, _ROOM), -1, index), kind="stable")
    return _Lines(
        both[order, 0],
        both[order, 1],
        kind[order],
        index[order],
        part[order],
    )


def _arrows(
    scene: Scene,
) -> tuple[Float[np.ndarray, "arrows 3 2 3"], Int64[np.ndarray, " arrows"]]:
    """Return the strokes of the arrows in the world, and the objects they belong to."""
    names = [CATEGORIES[int(k)] for k in scene.objects.category]
    index = np.array([k for k, name in enumerate(names) if name not in NO_FRONT], dtype=np.int64)
    boxes = _double(scene.objects.boxes)[index]
    centre, size = boxes.centre.numpy(force=True), boxes.size.numpy(force=True)
    yaw = boxes.yaw.numpy(force=True)
    flat = np.zeros_like(yaw)
    front = np.stack([-np.sin(yaw), np.cos(yaw), flat], axis=-1)
    right = np.stack([np.cos(yaw), np.sin(yaw), flat], axis=-1)
    length = np.clip(0.4 * size[:, :1], *ARROW)
    start = centre + front * size[:, 1:2] / 2
    start[:, 2] -= size[:, 2] / 2
    tip = start + front * length
    wings = [tip + (0.45 * length) * (side * right - front) for side in (-0.7, 0.7)]
    strokes = [(start, tip), (wings[0], tip), (tip, wings[1])]
    return np.stack([np.stack(stroke, axis=1) for stroke in strokes], axis=1), index


def _camera_inside(layout: Layout) -> bool:
    polygon = layout.floor_polygon.double()
    return bool(polygon_contains(polygon.new_zeros(1, 2), polygon).all())


def _behind_walls(
    layout: Layout,
    place: Float[np.ndarray, "samples 3"],
    lon: Float[np.ndarray, " samples"],
    room: Bool[np.ndarray, " samples"],
) -> Bool[np.ndarray, " samples"]:
    """Return whether a wall is before each place, as seen from inside the room."""
    if not _camera_inside(layout):
        return np.zeros(len(lon), dtype=bool)
    wall = wall_distance(layout.floor_polygon.double(), torch.as_tensor(lon)).numpy(force=True)
    distance = np.hypot(place[:, 0], place[:, 1])
    return distance > wall * 1.001 + np.where(room, _AHEAD, _BEHIND_WALL)


def _behind_boxes(
    boxes: OrientedBoxes,
    place: Float[np.ndarray, "samples 3"],
    camera: Float[np.ndarray, " 3"],
) -> Bool[np.ndarray, " samples"]:
    """Return whether a box is before each place; a box around the camera hides nothing."""
    hidden = np.zeros(len(place), dtype=bool)
    length = np.linalg.norm(place, axis=-1)
    boxes = _double(boxes)
    for centre, size, yaw in zip(
        boxes.centre.numpy(force=True),
        boxes.size.numpy(force=True),
        boxes.yaw.numpy(force=True),
        strict=True,
    ):
        cosine, sine = np.cos(yaw), np.sin(yaw)
        own_from_world = np.array([[cosine, sine, 0.0], [-sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        start, ray = own_from_world @ (camera - centre), place @ own_from_world.T
        ray = np.where(np.abs(ray) < 1e-12, 1e-12, ray)
        faces = (np.stack([-size, size]) / 2 - start)[:, None] / ray
        enter, leave = faces.min(0).max(-1), faces.max(0).min(-1)
        before = (enter > 0) & ((1 - enter) * length > _AHEAD)
        hidden |= before & ((leave - enter) * length > _AHEAD)
    return hidden


def _double(boxes: OrientedBoxes) -> OrientedBoxes:
    return OrientedBoxes(boxes.centre.double(), boxes.size.double(), boxes.yaw.double())
