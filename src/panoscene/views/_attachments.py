"""Contacts and collisions in space, as short lines and as the volumes that boxes share."""

from dataclasses import dataclass

import numpy as np
import shapely
import torch
from jaxtyping import Float, Int64

from panoscene.geometry import OrientedBoxes, box_footprint, wall_normals
from panoscene.scene import Layout, Relations

_INTO = 0.09
"""Metres that the line of a contact reaches into what it joins."""
Segments = Float[np.ndarray, "segments 2 3"]


@dataclass(frozen=True, slots=True)
class Clash:
    """What two boxes share: a convex footprint between two heights."""

    footprint: shapely.Polygon
    low: float
    high: float

    @property
    def corners(self) -> Float[np.ndarray, "corners 3"]:
        """World frame, the lower ones first."""
        ring = np.array(self.footprint.exterior.coords)[:-1]
        return np.concatenate([np.column_stack([ring, np.full(len(ring), z)]) for z in
                               (self.low, self.high)])  # fmt: skip


@dataclass(frozen=True, slots=True)
class Joints:
    """Which relations join what; at least one half is a yes."""

    pairs: Int64[np.ndarray, "pairs 2"]
    walls: Int64[np.ndarray, "contacts 2"]
    """Object and wall."""
    floor: Int64[np.ndarray, " standing"]
    ceiling: Int64[np.ndarray, " hanging"]

    def among(self, objects: Int64[np.ndarray, " objects"]) -> "Joints":
        """Return the attachments of these objects only."""
        return Joints(
            self.pairs[np.isin(self.pairs, objects).all(axis=1)],
            self.walls[np.isin(self.walls[:, 0], objects)],
            self.floor[np.isin(self.floor, objects)],
            self.ceiling[np.isin(self.ceiling, objects)],
        )


def joints_from_relations(relations: Relations) -> Joints:
    """Return the attachments that are more likely than not."""
    either = torch.maximum(relations.touching, relations.touching.T).triu(diagonal=1)
    found = (either, relations.touching_wall, relations.on_floor, relations.under_ceiling)
    pairs, walls, floor, ceiling = ((s >= 0.5).nonzero().numpy(force=True) for s in found)
    return Joints(pairs, walls, floor[:, 0], ceiling[:, 0])


def footprints(boxes: OrientedBoxes) -> list[shapely.Polygon]:
    """Return the boxes from above."""
    return [shapely.Polygon(ring) for ring in box_footprint(boxes).double().numpy(force=True)]


def clashes(boxes: OrientedBoxes, pairs: Int64[np.ndarray, "pairs 2"]) -> list[Clash]:
    """Return what colliding pairs of boxes share."""
    shapes, (low, high) = footprints(boxes), _heights(boxes)
    found = []
    for a, b in pairs.tolist():
        shared = shapes[a].intersection(shapes[b])
        if isinstance(shared, shapely.Polygon) and not shared.is_empty:
            bottom, top = max(low[a], low[b]), min(high[a], high[b])
            found.append(Clash(shared, bottom, max(top, bottom)))
    return found


def object_contacts(boxes: OrientedBoxes, joints: Joints) -> Segments:
    """Return a line across each contact of two objects, along which they could part."""
    shapes, (low, high) = footprints(boxes), _heights(boxes)
    segments = [_object_contact(shapes[a], shapes[b], (low[a], high[a]), (low[b], high[b]))
                for a, b in joints.pairs.tolist()]  # fmt: skip
    return np.array(segments).reshape(-1, 2, 3)


def wall_contacts(boxes: OrientedBoxes, layout: Layout, joints: Joints) -> Segments:
    """Return a line from each wall to the objects that touch it."""
    polygon = layout.floor_polygon.double().numpy(force=True)
    normals = wall_normals(layout.floor_polygon).double().numpy(force=True)
    shapes, height = footprints(boxes), boxes.centre[:, 2].tolist()
    segments = []
    for k, wall in joints.walls.tolist():
        line = shapely.LineString([polygon[wall], polygon[(wall + 1) % len(polygon)]])
        gap = shapes[k].distance(line)
        near = shapes[k].intersection(line.buffer(gap + 0.03, cap_style="flat"))
        foot, tip = shapely.get_coordinates(shapely.shortest_line(line, shapes[k]))
        if near.is_empty or (tip - foot) @ normals[wall] < 0.5 * gap:  # beside it, or behind it
            into = _INTO * (tip - foot) / max(gap, 1e-9)
            ends = foot - into, tip + into
        else:
            foot = np.array(line.interpolate(line.project(near.centroid)).coords[0])
            ends = foot - _INTO * normals[wall], foot + (gap + _INTO) * normals[wall]
        z = min(max(height[k], layout.floor_height + 0.05), layout.ceiling_height - 0.05)
        segments.append([[*end, z] for end in ends])
    return np.array(segments).reshape(-1, 2, 3)


def level_contacts(
    boxes: OrientedBoxes, layout: Layout, joints: Joints, eye: Float[np.ndarray, " 3"]
) -> Segments:
    """Return upright lines where objects stand on the floor or hang from the ceiling.

    Each is at the corner that is nearest to the eye, where it is not hidden.
    """
    rings, (low, high) = box_footprint(boxes).double().numpy(force=True), _heights(boxes)
    segments = []
    for objects, edge, level, sign in (
        (joints.floor, low, layout.floor_height, 1.0),
        (joints.ceiling, high, layout.ceiling_height, -1.0),
    ):
        for k in objects.tolist():
            corner = rings[k][np.linalg.norm(rings[k] - eye[:2], axis=1).argmin()]
            ends = (level - sign * 0.03, edge[k] + sign * _INTO)
            segments.append([[*corner, end] for end in ends])
    return np.array(segments).reshape(-1, 2, 3)


def _heights(boxes: OrientedBoxes) -> tuple[list[float], list[float]]:
    half = boxes.size[:, 2] / 2
    return (boxes.centre[:, 2] - half).tolist(), (boxes.centre[:, 2] + half).tolist()


def _object_contact(
    a: shapely.Polygon,
    b: shapely.Polygon,
    heights_a: tuple[float, float],
    heights_b: tuple[float, float],
) -> Float[np.ndarray, "2 3"]:
    bottom, top = max(heights_a[0], heights_b[0]), min(heights_a[1], heights_b[1])
    axis, overlap = _parting_axis(a, b)
    reach = a.distance(b) / 2 + 0.02
    x, y = a.buffer(reach).intersection(b.buffer(reach)).centroid.coords[0]
    middle = np.array([x, y, (bottom + top) / 2])
    if top - bottom < overlap:
        direction, gap = np.array([0.0, 0.0, 1.0]), bottom - top
    else:
        direction, gap = np.array([*axis, 0.0]), -overlap
    half = (max(gap, 0.0) / 2 + _INTO) * direction
    return np.stack([middle - half, middle + half])


def _parting_axis(a: shapely.Polygon, b: shapely.Polygon) -> tuple[Float[np.ndarray, " 2"], float]:
    """Return the edge direction of either rectangle along which they overlap least, and how far.

    A negative overlap is a gap.
    """
    first, second = (np.array(shape.exterior.coords)[:4] for shape in (a, b))
    edges = np.concatenate([np.diff(first[:3], axis=0), np.diff(second[:3], axis=0)])
    axes = edges / np.maximum(np.linalg.norm(edges, axis=1, keepdims=True), 1e-9)
    p, q = first @ axes.T, second @ axes.T
    overlap = np.minimum(p.max(0) - q.min(0), q.max(0) - p.min(0))
    k = int(np.argmin(overlap))
    return axes[k], float(overlap[k])
