"""A scene as an architect's model: what a camera may see of it, and in which colours."""

from collections.abc import Container
from dataclasses import dataclass

import numpy as np
import shapely
import torch
from jaxtyping import Bool, Float, Int32, Int64

from panoscene.geometry import box_contains
from panoscene.scene import CATEGORIES, Layout, Scene, Surface
from panoscene.style import (
    FLOOR,
    GROUP_COLOURS,
    INK,
    NO_FRONT,
    PAPER,
    WALL,
    WALL_THICKNESS,
    group_of,
)
from panoscene.views._facets import facets
from panoscene.views._rays import RayCaster, Soup, checked_surfaces, join_surfaces

_LONGEST_MITRE = 3.0
"""Of wall corners, in wall thicknesses."""
_FRONT_TINT = 0.16
"""How much ink darkens the front of a box."""
SHELL, CUT, OBJECT = 0, 1, 2


@dataclass(frozen=True, slots=True)
class Model:
    """Triangles, with what is needed to colour a place on each."""

    soup: Soup
    caster: RayCaster
    facet: Int32[np.ndarray, " faces"]
    """Triangles of one surface that meet without a crease share a number."""
    colour: Float[np.ndarray, "faces 3"]
    kind: Int32[np.ndarray, " faces"]
    """Room shell, cut through a wall, or object."""
    item: Int64[np.ndarray, " faces"]
    """Index of the object; -1 for the room."""
    across: Float[np.ndarray, "faces 4"]
    """Plane whose signed distance is metres to the right of an object's middle."""
    behind: Float[np.ndarray, "faces 4"]
    """Plane whose signed distance is metres from the upper front edge of a box, on its front and
    on its top."""
    mark: Float[np.ndarray, " faces"]
    """Metres that the mark of a front takes on a top face; negative on a front face, else 0."""


def build_model(scene: Scene, eye: Float[np.ndarray, " 3"], *, cut: bool) -> Model:
    """Return what a camera sees of a scene.

    Convention:
        - walls, floor and ceiling that face away from the camera are left out, so that it looks
          into the room from anywhere; with ``cut``, doors and windows in them too
        - boxes around the camera are left out: they would hide everything

    Args:
        scene: what to look at.
        eye: where the camera is.
        cut: whether walls get their thickness, as if the room was cut open.
    """
    surfaces = [surface for surface in checked_surfaces(scene) if is_seen(surface, scene, eye)]
    seen = {surface.index for surface in surfaces if surface.kind == "wall"}
    trims = wall_cuts(scene.layout, seen) if cut else ()
    if cut:
        gone = _gone_with_walls(scene, seen)
        surfaces = [s for s in surfaces if s.kind != "object" or s.index not in gone]
    kept = surfaces + list(trims)
    soup = join_surfaces(kept)
    count = [len(surface.faces) for surface in kept]
    kinds = [OBJECT if s.kind == "object" else SHELL for s in surfaces] + [CUT] * len(trims)
    items = [s.index if s.kind == "object" else -1 for s in kept]
    colours = np.array([_colour(s, scene) for s in surfaces] + [rgb(WALL)] * len(trims))
    item = np.repeat(np.array(items, np.int64), count)
    across, behind, mark, front = front_marks(scene, soup.normal, item)
    colour = np.repeat(colours.reshape(-1, 3), count, axis=0)
    colour = np.where(front[:, None], _mix(colour, rgb(INK), _FRONT_TINT), colour)
    return Model(
        soup,
        RayCaster(soup),
        facets(soup),
        colour.astype(np.float32),
        np.repeat(np.array(kinds, np.int32), count),
        item,
        across,
        behind,
        mark,
    )


def wall_cuts(layout: Layout, seen: Container[int]) -> tuple[Surface, ...]:
    """Return the tops and open ends of the walls that are seen, and the feet of the others.

    Walls are as thick as in plans.
    """
    inner = layout.floor_polygon.double().numpy(force=True)
    edge = np.roll(inner, -1, axis=0) - inner
    out = np.stack([edge[:, 1], -edge[:, 0]], 1) / np.maximum(
        np.linalg.norm(edge, axis=1, keepdims=True), 1e-9
    )
    before = np.roll(out, 1, axis=0)
    mitre = (out + before) / np.maximum(1 + (out * before).sum(1, keepdims=True), 0.05)
    length = np.linalg.norm(mitre, axis=1, keepdims=True)
    mitre *= np.minimum(1.0, _LONGEST_MITRE / np.maximum(length, 1e-9))
    outer = inner + WALL_THICKNESS * mitre
    quad = torch.tensor([[0, 1, 2], [0, 2, 3]])
    low, high = layout.floor_height, layout.ceiling_height
    cuts = []
    for k, wall in enumerate(np.stack([inner, outer], axis=1)):
        after = np.concatenate([inner[[(k + 1) % len(inner)]], outer[[(k + 1) % len(inner)]]])
        ring = np.concatenate([wall, after[::-1]])
        strip = np.column_stack([ring, np.full(4, high if k in seen else low)])
        cuts.append(Surface(f"cut-{k}", "wall", k, _points(strip), quad))
        if (k in seen) != ((k - 1) % len(inner) in seen):
            end = np.column_stack([wall[[0, 1, 1, 0]], [low, low, high, high]])
            cuts.append(Surface(f"end-{k}", "wall", k, _points(end), quad))
    return tuple(cuts)


def _points(values: Float[np.ndarray, "points 3"]) -> torch.Tensor:
    return torch.as_tensor(values, dtype=torch.float32)


def is_seen(surface: Surface, scene: Scene, eye: Float[np.ndarray, " 3"]) -> bool:
    """Return whether a surface is drawn: walls that face the camera, boxes not around it."""
    if surface.kind == "object":
        if not _is_box(scene, surface.index):
            return True
        box = scene.objects.boxes[surface.index]
        return not bool(box_contains(box, torch.as_tensor(eye)[None].to(box.centre)))
    soup = join_surfaces([surface])
    largest = np.linalg.norm(soup.normal, axis=1).argmax()
    return bool((eye - soup.vertices[soup.faces[largest, 0]]) @ soup.normal[largest] > 0)


def _is_box(scene: Scene, index: int) -> bool:
    """Return whether an object has no shape but its box."""
    meshes = scene.objects.shapes.mesh
    mesh = meshes[index] if meshes else None
    return mesh is None or len(mesh.faces) == 0


def _gone_with_walls(scene: Scene, seen: Container[int]) -> set[int]:
    """Return the doors and windows whose nearest wall is not seen."""
    polygon = scene.layout.floor_polygon.double().numpy(force=True)
    walls = shapely.linestrings(np.stack([polygon, np.roll(polygon, -1, axis=0)], axis=1))
    places = scene.objects.boxes.centre[:, :2].double().numpy(force=True)
    centres = np.asarray(shapely.points(places))
    nearest = shapely.distance(centres[:, None], walls).argmin(axis=1)
    names = [CATEGORIES[k] for k in scene.objects.category.tolist()]
    return {
        k
        for k, name in enumerate(names)
        if group_of(name) == "doors and windows" and nearest[k] not in seen
    }


def _colour(surface: Surface, scene: Scene) -> Float[np.ndarray, " 3"]:
    if surface.kind == "object":
        category = CATEGORIES[int(scene.objects.category[surface.index])]
        return rgb(GROUP_COLOURS[group_of(category)])
    if surface.kind == "ceiling":
        return rgb(PAPER)
    ink = 0.10 if surface.kind == "floor" else 0.02
    return _mix(rgb(FLOOR), rgb(WALL), ink)


def front_marks(
    scene: Scene, normal: Float[np.ndarray, "faces 3"], item: Int64[np.ndarray, " faces"]
) -> tuple[
    Float[np.ndarray, "faces 4"],
    Float[np.ndarray, "faces 4"],
    Float[np.ndarray, " faces"],
    Bool[np.ndarray, " faces"],
]:
    """Return two planes for each triangle, the size of its mark, and whether it is a front."""
    boxes = scene.objects.boxes
    yaw = boxes.yaw.double().numpy(force=True)
    centre, size = (t.double().numpy(force=True) for t in (boxes.centre, boxes.size))
    zero = np.zeros_like(yaw)
    right = np.stack([np.cos(yaw), np.sin(yaw), zero], axis=-1)
    front = np.stack([-np.sin(yaw), np.cos(yaw), zero], axis=-1)
    proxies = [
        CATEGORIES[int(scene.objects.category[k])] not in NO_FRONT and _is_box(scene, k)
        for k in range(len(yaw))
    ]
    own = np.flatnonzero(item >= 0)
    own = own[np.array(proxies, bool)[item[own]]]
    k, up = item[own], np.array([0.0, 0.0, 1.0])
    is_front = (normal[own] * front[k]).sum(1) > 0.9
    is_top = np.abs(normal[own, 2]) > 0.9
    across, behind = np.zeros((2, len(item), 4), np.float32)
    mark, fronts = np.zeros(len(item), np.float32), np.zeros(len(item), bool)
    across[own] = np.column_stack([right[k], -(right[k] * centre[k]).sum(1)])
    edge = np.where(is_front[:, None], up, front[k])
    half = np.where(is_front, size[k, 2], size[k, 1]) / 2
    behind[own] = np.column_stack([-edge, half + (edge * centre[k]).sum(1)])
    length = np.minimum(0.16, 0.35 * size[k, :2].min(axis=1))
    mark[own] = np.where(is_front, -length, np.where(is_top, length, 0.0))
    fronts[own] = is_front
    return across, behind, mark, fronts


def rgb(colour: str) -> Float[np.ndarray, " 3"]:
    """Return a colour of the style as three numbers in [0, 1]."""
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0


def _mix(
    colour: Float[np.ndarray, "*any 3"], other: Float[np.ndarray, " 3"], part: float
) -> Float[np.ndarray, "*any 3"]:
    return colour * (1 - part) + other * part
