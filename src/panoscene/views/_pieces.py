"""A scene as shapes on the page: footprints, fronts, collisions, parts outside, contacts."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
import torch
from jaxtyping import Float, Int64
from torch import Tensor

from panoscene.geometry import OrientedBoxes, box_footprint, penetration_depth, wall_normals
from panoscene.scene import (
    BUILT_IN,
    CATEGORIES,
    Objects,
    Relations,
    Scene,
    nested,
    relations_from_boxes,
)
from panoscene.style import MOST_WALL, NO_FRONT, OVERHEAD, WALL_THICKNESS

TOLERANCE = 0.01
"""Metres of penetration, or of sticking out of the room, from which it is shown."""
FAR = 2.0
"""Metres outside the room from which an object may lie outside the picture, and length from which
no line is drawn between two that should touch: it would cross what has nothing to do with it."""
IN_WALL = 0.5
"""Metres behind the surface of a wall in which doors and windows are at home."""
Bounds = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class View:
    """How the world lies on the page: turned, scaled, moved."""

    turn: float
    """Radians, counter-clockwise, by which the world is turned."""
    scale: float = 1.0
    """Pixels per metre."""
    offset: tuple[float, float] = (0.0, 0.0)
    """Pixel on which the world's origin lies."""

    def page(self, points: Float[np.ndarray, "*points 2"]) -> Float[np.ndarray, "*points 2"]:
        """Return points of the world in metres as pixels."""
        sine, cosine = np.sin(self.turn), np.cos(self.turn)
        page_from_world = self.scale * np.array([[cosine, -sine], [sine, cosine]])
        return points @ page_from_world.T + np.array(self.offset)


@dataclass(frozen=True, slots=True)
class Piece:
    """One object on the page."""

    index: int
    category: str
    footprint: shapely.Polygon
    front: Float[np.ndarray, "2 2"]
    """The edge of the footprint where the front is, from its left to its right end."""
    overhead: bool
    colliding: bool
    outside: shapely.Polygon | shapely.MultiPolygon
    """The part outside the room; empty when that is at most a centimetre."""

    @property
    def extent(self) -> tuple[float, float]:
        """Width and depth in pixels."""
        width = float(np.linalg.norm(self.front[1] - self.front[0]))
        return width, self.footprint.area / max(width, 1e-9)

    @property
    def tip(self) -> shapely.Polygon:
        """The triangle before the front that shows where it faces; empty for small pieces."""
        width, depth = self.extent
        length = min(8.0, 0.3 * depth, 0.3 * width)
        if length < 2.5 or self.category in NO_FRONT:
            return shapely.Polygon()
        middle = self.front.mean(0)
        side = (self.front[1] - self.front[0]) / width * length
        forward = np.array([-side[1], side[0]])
        return shapely.Polygon([middle - side, middle + side, middle + forward])


@dataclass(frozen=True, slots=True)
class Contact:
    """A touching relation: a short line across the contact.

    A dot where start and end agree: the piece stands on, or hangs over, the other one.
    """

    start: Float[np.ndarray, " 2"]
    end: Float[np.ndarray, " 2"]
    objects: tuple[int, ...] = ()
    """The one or two that touch."""

    @property
    def shape(self) -> shapely.Geometry:
        """The place it takes on the page."""
        return shapely.LineString([self.start, self.end]).buffer(4.0)


@dataclass(frozen=True, slots=True)
class Plan:
    """Everything that is drawn of one scene, in pixels."""

    floor: shapely.Polygon
    walls: shapely.Geometry
    pieces: tuple[Piece, ...]
    """In paint order: what is higher comes later."""
    clashes: tuple[shapely.Geometry, ...]
    """Where the footprints of colliding objects overlap."""
    contacts: tuple[Contact, ...]
    camera: Float[np.ndarray, " 2"]
    thinner: float
    """Width of marks, as a share of the usual, so that they do not cover plans of small scale."""


def scene_bounds(scenes: Sequence[Scene], turn: float) -> Bounds:
    """Return left, bottom, right, top in metres of rooms and objects in the turned world.

    Objects farther than 2 m outside their room do not count.
    """
    view = View(turn)
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for scene in scenes:
        walls = view.page(scene.layout.floor_polygon.double().numpy(force=True))
        near_low, near_high = walls.min(0) - FAR, walls.max(0) + FAR
        corners = view.page(_footprints(scene.objects.boxes)).reshape(-1, 2)
        near = ((corners >= near_low) & (corners <= near_high)).all(-1)
        points = np.concatenate(
            [walls - WALL_THICKNESS, walls + WALL_THICKNESS, corners[near]], axis=0
        )
        low, high = np.minimum(low, points.min(0)), np.maximum(high, points.max(0))
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def make_plan(scene: Scene, view: View, *, relations: bool, tolerance: float = TOLERANCE) -> Plan:
    """Return the shapes of a scene on the page.

    Args:
        scene: with finite boxes.
        view: where the world lies on the page.
        relations: whether contacts are wanted; a scene without relations gets those that follow
            from its boxes.
        tolerance: metres of overlap, or of sticking out of the room, from which they are shown.
    """
    boxes = scene.objects.boxes
    floor = shapely.Polygon(view.page(scene.layout.floor_polygon.double().numpy(force=True)))
    thickness = min(WALL_THICKNESS * view.scale, MOST_WALL)
    corners = view.page(_footprints(boxes))
    footprints = [shapely.Polygon(corner) for corner in corners]
    pairs = colliding_pairs(scene.objects, tolerance)
    colliding = set(pairs.flatten().tolist())
    grown = floor.buffer(tolerance * view.scale, join_style="mitre")
    with_walls = floor.buffer(max(tolerance, IN_WALL) * view.scale, join_style="mitre")
    categories = [CATEGORIES[k] for k in scene.objects.category.tolist()]
    bottom = (boxes.centre[:, 2] - boxes.size[:, 2] / 2 - scene.layout.floor_height).tolist()
    top = (boxes.centre[:, 2] + boxes.size[:, 2] / 2).tolist()
    pieces = [
        Piece(
            index=index,
            category=categories[index],
            footprint=footprint,
            front=corners[index, [3, 2]],
            overhead=bottom[index] > OVERHEAD,
            colliding=index in colliding,
            outside=_outside(
                footprint, floor, with_walls if categories[index] in BUILT_IN else grown
            ),
        )
        for index, footprint in enumerate(footprints)
    ]
    pieces.sort(key=lambda piece: (piece.overhead, top[piece.index]))
    clashes = [footprints[a].intersection(footprints[b]) for a, b in pairs.tolist()]
    return Plan(
        floor=floor,
        walls=floor.buffer(thickness, join_style="mitre").difference(floor),
        pieces=tuple(pieces),
        clashes=tuple(clashes),
        contacts=tuple(
            contact
            for contact in (_contacts(scene, footprints, view) if relations else ())
            if np.linalg.norm(contact.end - contact.start) < FAR * view.scale
        ),
        camera=view.page(np.zeros(2)),
        thinner=min(1.0, max(0.6, view.scale / 95.0)),
    )


def _footprints(boxes: OrientedBoxes) -> Float[np.ndarray, "n 4 2"]:
    return box_footprint(boxes).double().numpy(force=True)


def colliding_pairs(objects: Objects, tolerance: float = TOLERANCE) -> Int64[np.ndarray, "pairs 2"]:
    """Return the pairs of objects that overlap by more than some metres and should not."""
    return (overlaps(objects).triu(diagonal=1) > tolerance).nonzero().numpy(force=True)


def overlaps(objects: Objects) -> Float[Tensor, "n n"]:
    """Return by how many metres boxes overlap; 0 for such as a cushion on its sofa."""
    boxes = objects.boxes
    depth = penetration_depth(boxes[:, None], boxes[None, :])
    return depth.masked_fill(nested(objects.category), 0.0).fill_diagonal_(0.0)


def _outside(
    footprint: shapely.Polygon, floor: shapely.Polygon, grown: shapely.Geometry
) -> shapely.Polygon | shapely.MultiPolygon:
    if footprint.within(grown):
        return shapely.Polygon()
    parts = shapely.get_parts(footprint.difference(floor))
    return shapely.MultiPolygon([part for part in parts if part.geom_type == "Polygon"])


def _contacts(scene: Scene, footprints: list[shapely.Polygon], view: View) -> list[Contact]:
    relations = scene.relations
    if relations is None:
        relations = relations_from_boxes(
            scene.objects.boxes, scene.layout, scene.panorama.camera_height
        )
    contacts = [
        replace(_object_contact(footprints[a], footprints[b]), objects=(a, b))
        for a, b in _touching_pairs(relations)
    ]
    polygon = scene.layout.floor_polygon
    corners = view.page(polygon.double().numpy(force=True))
    normals = View(view.turn).page(wall_normals(polygon).double().numpy(force=True))
    for index, wall in (relations.touching_wall >= 0.5).nonzero().tolist():
        ends = corners[wall], corners[(wall + 1) % len(corners)]
        contact = _wall_contact(footprints[index], *ends, normals[wall])
        contacts.append(replace(contact, objects=(index,)))
    return contacts


def _touching_pairs(relations: Relations) -> list[list[int]]:
    either = torch.maximum(relations.touching, relations.touching.T)
    return (either.triu(diagonal=1) >= 0.5).nonzero().tolist()


def _object_contact(a: shapely.Polygon, b: shapely.Polygon) -> Contact:
    """Return the contact of two footprints, drawn from 7 px inside one to 7 px inside the other."""
    shared = a.intersection(b)
    small = a if a.area <= b.area else b
    if shared.area > 0.3 * small.area:
        # one above the other: a dot towards the lower right corner, clear of the label
        corners = np.array(small.exterior.coords)[:4]
        corner = corners[np.argmax(corners @ np.array([1.0, -1.0]))]
        middle = np.array(small.centroid.coords[0])
        inset = min(9.0, 0.5 * float(np.hypot(*(middle - corner))))
        place = corner + (middle - corner) * inset / max(float(np.hypot(*(middle - corner))), 1e-9)
        return Contact(place, place)
    gap = a.distance(b)
    reach = gap / 2 + 3.0
    shared = a.buffer(reach).intersection(b.buffer(reach))
    if shared.is_empty:  # so far apart that the corners of rounded outlines do not meet
        shared = shapely.shortest_line(a, b)
    middle = np.array(shared.centroid.coords[0])
    direction = _facing_axis(a, b)
    half = gap / 2 + 7.0
    return Contact(middle - half * direction, middle + half * direction)


def _facing_axis(a: shapely.Polygon, b: shapely.Polygon) -> Float[np.ndarray, " 2"]:
    """Return the face normal of either rectangle along which the two overlap least.

    If they are apart, it is the one along which they are farthest apart.
    """
    first, second = (np.array(shape.exterior.coords)[:4] for shape in (a, b))
    edges = np.concatenate([np.diff(first[:3], axis=0), np.diff(second[:3], axis=0)])
    axes = edges / np.maximum(np.linalg.norm(edges, axis=1, keepdims=True), 1e-9)
    p, q = first @ axes.T, second @ axes.T
    overlap = np.minimum(p.max(0) - q.min(0), q.max(0) - p.min(0))
    return axes[int(np.argmin(overlap))]


def _wall_contact(
    footprint: shapely.Polygon,
    start: Float[np.ndarray, " 2"],
    end: Float[np.ndarray, " 2"],
    normal: Float[np.ndarray, " 2"],
) -> Contact:
    """Return the contact of a footprint and a wall: from 5 px inside the wall to the object."""
    wall = shapely.LineString([start, end])
    gap = footprint.distance(wall)
    touching = footprint.intersection(wall.buffer(gap + 3.0, cap_style="flat"))
    foot, tip = shapely.get_coordinates(shapely.shortest_line(wall, footprint))
    if touching.is_empty or (tip - foot) @ normal < 0.5 * gap:  # beside the wall, or behind it
        direction = (tip - foot) / max(gap, 1e-9)
        return Contact(foot - 5.0 * direction, tip + 5.0 * direction)
    foot = np.array(wall.interpolate(wall.project(touching.centroid)).coords[0])
    return Contact(foot - 5.0 * normal, foot + (gap + 7.0) * normal)
