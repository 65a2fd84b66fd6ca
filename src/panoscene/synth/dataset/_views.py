"""How one camera sees one object: box, outline, what is hidden."""

import functools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import torch
from jaxtyping import Float, Float32, Float64
from torch import Tensor

from panoscene.geometry import bfov_from_directions
from panoscene.scene import Mesh
from panoscene.synth.render import Camera, home_from_camera

from ._amodal import whole_solid_angle
from ._hulls import hull_area
from ._pixels import Regions, outline_directions, pixel_box, pixel_directions, pixel_solid_angle
from ._things import Box, Thing, home_from_world, moved, tight_box

_TOGETHER = 8
"""BFoVs that are fitted in one go; they have about equally many points."""


class View(NamedTuple):
    """A thing as one camera sees it."""

    thing: Thing
    region: int
    """Place in the regions."""
    box: Box
    world_from_object: Float64[np.ndarray, "4 4"]
    vertices: Float64[np.ndarray, "vertices 3"]
    """World frame."""
    outline: Float64[np.ndarray, "points 3"]
    """Directions around its visible pixels in the world frame."""
    pixels: int
    box_2d: tuple[int, int, int, int]
    solid_angle: float
    amodal_solid_angle: float
    hull_share: float
    truncated: tuple[str, ...]


def view_of(thing: Thing, camera: Camera, regions: Regions) -> View:
    """Return a thing as a camera sees it."""
    region = int(np.searchsorted(regions.instance, thing.instance))
    world_from_home = np.linalg.inv(home_from_world(camera))
    matrix = world_from_home @ thing.home_from_object
    vertices = moved(world_from_home, thing.vertices)
    box = tight_box(vertices, matrix)
    rows = regions.first_row[region], regions.last_row[region]
    upright = upright_from_photo(camera)
    outline = outline_directions(*rows, camera.height) @ upright.T
    eye = np.array([0.0, 0.0, camera.position[2]])
    seen = (regions.place == region).reshape(-1)
    flat, weight = _pixel_lists(camera.height, camera.width)
    local = (vertices - eye) @ upright
    whole = whole_solid_angle(local, thing.faces, flat, weight, seen)
    cuts = (
        ("seam", bool(regions.crosses_seam[region])),
        ("zenith", int(rows[0].min()) == 0),
        ("nadir", int(rows[1].max()) == camera.height - 1),
    )
    return View(
        thing,
        region,
        box,
        matrix,
        vertices,
        outline,
        int(regions.pixels[region]),
        pixel_box(*rows),
        float(regions.solid_angle[region]),
        whole,
        _hull_share(outline, box, eye),
        tuple(name for name, cut in cuts if cut),
    )


def _hull_share(outline: np.ndarray, box: Box, eye: np.ndarray) -> float:
    bits = (np.arange(8)[:, None] >> np.arange(3)) & 1
    cos, sin = np.cos(box.yaw), np.sin(box.yaw)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    reach = np.abs(turn.T @ (eye - np.array(box.centre))) - np.array(box.size) / 2
    if (reach <= 0.0).all():  # around the camera
        return 1.0
    corners = ((bits - 0.5) * np.array(box.size)) @ turn.T + np.array(box.centre) - eye
    corners /= np.maximum(np.linalg.norm(corners, axis=1, keepdims=True), 1e-9)
    axis = np.array(box.centre) - eye
    whole = hull_area(corners, axis)
    return min(hull_area(outline, axis) / max(whole, 1e-9), 1.0)


def visible_bfovs(views: Sequence[View]) -> Float[Tensor, "n 4"]:
    """Return the BFoV around the visible pixels of each view."""
    outlines = [view.outline for view in views]
    result = torch.zeros(len(outlines), 4)
    order = sorted(range(len(outlines)), key=lambda k: len(outlines[k]))
    for start in range(0, len(order), _TOGETHER):
        chosen = order[start : start + _TOGETHER]
        longest = max(len(outlines[k]) for k in chosen)
        padded = np.stack([np.resize(outlines[k], (longest, 3)) for k in chosen])
        result[chosen] = bfov_from_directions(torch.from_numpy(padded.astype(np.float32)))
    return result


def upright_from_photo(camera: Camera) -> Float64[np.ndarray, "3 3"]:
    """Return the rotation from the photo's directions to the world frame's."""
    return home_from_world(camera)[:3, :3].T @ home_from_camera(camera)


def canonical_mesh(view: View) -> Mesh:
    """Return a view's mesh scaled into the box from -1/2 to 1/2."""
    cos, sin = np.cos(view.box.yaw), np.sin(view.box.yaw)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    local = (view.vertices - np.array(view.box.centre)) @ turn / np.array(view.box.size)
    return Mesh(
        torch.from_numpy(local.astype(np.float32)),
        torch.from_numpy(view.thing.faces.astype(np.int64)),
    )


@functools.lru_cache(maxsize=2)
def _pixel_lists(
    height: int, width: int
) -> tuple[Float32[np.ndarray, "n 3"], Float64[np.ndarray, " n"]]:
    """Return directions, in single precision, and solid angles of all pixels, row by row."""
    directions = pixel_directions(height, width).reshape(-1, 3).astype(np.float32)
    return directions, np.repeat(pixel_solid_angle(height, width), width)
