"""Pictures of single models for the shape networks: ray cast, simply shaded, without a room."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from jaxtyping import Float32, Float64, Int64, UInt8

from panoscene.geometry import (
    OrientedBoxes,
    bfov_from_boxes,
    bfov_from_directions,
    perspective_directions,
)
from panoscene.synth.assets import CadModel

_FACING = 0.75
"""Share of pictures that show a model from about its front, as furniture at walls is seen."""
_PROBE = 32
_CAMERA_HEIGHT = (1.0, 1.9)
_DISTANCE = (0.8, 6.0)


@dataclass(frozen=True, slots=True)
class ModelViews:
    """Pictures of one model, each the perspective crop of the BFoV around what is seen."""

    image: UInt8[np.ndarray, "views rows rows 3"]
    """sRGB; black where the model is not."""
    alpha: UInt8[np.ndarray, "views rows rows"]
    """255 on the model."""
    bfov: Float32[np.ndarray, "views 4"]
    view_yaw: Float32[np.ndarray, " views"]
    """Yaw relative to the line of sight to the middle of the box."""


def render_views(
    model: CadModel, rng: np.random.Generator, views: int, rows: int = 96
) -> ModelViews:
    """Return pictures of a model from places where a panorama could be taken.

    Args:
        model: To look at; it stands, or hangs, where its placement says.
        rng: Of places, yaws and light.
        views: Number of pictures.
        rows: Of each picture, and columns.
    """
    import trimesh  # noqa: PLC0415 (it takes a second)

    mesh = trimesh.Trimesh(model.vertices, model.faces, process=False)
    caster = mesh.ray
    found: list[tuple[np.ndarray, np.ndarray, np.ndarray, float]] = []
    for _ in range(views):
        box, height = _place(model, rng)
        bfov = bfov_from_boxes(box, height)[0]
        turn = float(box.yaw[0])
        eye = np.array([0.0, 0.0, height]) - box.centre[0].double().numpy()
        eye = _turned(eye[None], -turn)[0]
        probe = perspective_directions(bfov, (_PROBE, _PROBE)).reshape(-1, 3)
        hit = _cast(caster, eye, _turned(probe.double().numpy(), -turn))[0] >= 0
        if hit.sum() > 4:
            seen = bfov_from_directions(probe[torch.from_numpy(hit)])
            bfov = torch.cat((seen[:2], seen[2:] * (1 + 1 / _PROBE)))
        direction = perspective_directions(bfov, (rows, rows)).reshape(-1, 3).double().numpy()
        colour, alpha = _shaded(model, mesh, eye=eye, direction=_turned(direction, -turn), rng=rng)
        lon = math.atan2(float(box.centre[0, 0]), float(box.centre[0, 1]))
        found.append((colour, alpha, bfov.numpy(), -lon - turn))
    return ModelViews(
        image=np.stack([one[0].reshape(rows, rows, 3) for one in found]),
        alpha=np.stack([one[1].reshape(rows, rows) for one in found]),
        bfov=np.stack([one[2] for one in found]).astype(np.float32),
        view_yaw=np.array([one[3] for one in found], np.float32),
    )


def _place(model: CadModel, rng: np.random.Generator) -> tuple[OrientedBoxes, float]:
    """Return the box of the model around a camera, and the height of the camera."""
    size = torch.tensor(model.size).clamp(min=0.01)
    reach = 0.6 * float(size[:2].norm())
    distance = math.exp(rng.uniform(*np.log(np.array(_DISTANCE)))) + reach
    lon, turn = rng.uniform(-math.pi, math.pi, 2)
    if rng.random() < _FACING:
        turn = math.pi - lon + rng.normal(0, 0.7)
    rise = model.elevation
    if model.placement == "on_top" and rise < 0.2:
        rise = rng.uniform(0.4, 1.0)
    z = float(rise + size[2] / 2)
    centre = torch.tensor([[distance * math.sin(lon), distance * math.cos(lon), z]])
    height = float(rng.uniform(*_CAMERA_HEIGHT))
    return OrientedBoxes(centre.float(), size[None].float(), torch.tensor([turn]).float()), height


def _turned(points: Float64[np.ndarray, "n 3"], yaw: float) -> Float64[np.ndarray, "n 3"]:
    """Return points turned counter-clockwise about the vertical."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    x, y, z = points.T
    return np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=1)


def _cast(
    caster: Any, eye: Float64[np.ndarray, "3"], direction: Float64[np.ndarray, "n 3"]
) -> tuple[Int64[np.ndarray, " n"], Float64[np.ndarray, "n 3"]]:
    """Return the first face that each ray hits, or -1, and where."""
    face = np.full(len(direction), -1, np.int64)
    place = np.zeros((len(direction), 3))
    triangle, ray, location = caster.intersects_id(
        np.broadcast_to(eye, direction.shape),
        direction,
        multiple_hits=False,
        return_locations=True,
    )
    face[ray], place[ray] = triangle, location
    return face, place


def _shaded(
    model: CadModel,
    mesh: Any,
    *,
    eye: Float64[np.ndarray, "3"],
    direction: Float64[np.ndarray, "n 3"],
    rng: np.random.Generator,
) -> tuple[UInt8[np.ndarray, "n 3"], UInt8[np.ndarray, " n"]]:
    """Return the colour of each ray under a lamp and light from all sides, and what is hit."""
    face, place = _cast(mesh.ray, eye, direction)
    hit = np.flatnonzero(face >= 0)
    colour = np.zeros((len(direction), 3))
    if len(hit):
        triangle = face[hit]
        normal = np.asarray(mesh.face_normals)[triangle]
        normal = np.where((normal * direction[hit]).sum(1, keepdims=True) > 0, -normal, normal)
        lamp = rng.normal(size=3) * (1.0, 1.0, 0.4) + (0.0, 0.0, 1.2)
        lamp /= np.linalg.norm(lamp)
        towards = np.abs((normal * direction[hit]).sum(1))
        light = 0.35 + 0.15 * normal[:, 2] + 0.45 * np.clip(normal @ lamp, 0, 1) + 0.15 * towards
        colour[hit] = _albedo(model, triangle, place[hit]) * light[:, None]
    alpha = np.where(face >= 0, 255, 0)
    return (np.clip(colour, 0, 1) * 255).astype(np.uint8), alpha.astype(np.uint8)


def _albedo(
    model: CadModel, triangle: Int64[np.ndarray, " n"], place: Float64[np.ndarray, "n 3"]
) -> Float64[np.ndarray, "n 3"]:
    """Return the colour of the surface at places on triangles."""
    corner = model.vertices[model.faces[triangle]].astype(np.float64)
    first, other = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    away = place - corner[:, 0]
    aa, ab, bb = ((x * y).sum(1) for x, y in ((first, first), (first, other), (other, other)))
    pa, pb = (away * first).sum(1), (away * other).sum(1)
    scale = np.maximum(aa * bb - ab * ab, 1e-20)
    s, t = (bb * pa - ab * pb) / scale, (aa * pb - ab * pa) / scale
    weight = np.stack([1 - s - t, s, t], axis=1)
    uv = np.einsum("nk,nkx->nx", weight, model.uv[model.faces[triangle]].astype(np.float64))
    found = np.zeros((len(triangle), 3))
    for index, material in enumerate(model.materials):
        mine = np.flatnonzero(model.face_material[triangle] == index)
        colour = np.tile(np.array(material.colour), (len(mine), 1))
        if material.texture is not None and len(mine):
            height, width = material.texture.shape[:2]
            column = (uv[mine, 0] % 1.0 * width).astype(np.int64) % width
            row = ((1 - uv[mine, 1]) % 1.0 * height).astype(np.int64) % height
            colour *= material.texture[row, column] / 255.0
        found[mine] = colour
    return found
