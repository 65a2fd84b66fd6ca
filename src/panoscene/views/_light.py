"""Light in a model: sky, a lamp at the camera, and the dark of corners and contacts."""

import numpy as np
from jaxtyping import Float, Int32

from panoscene.views._model import Model

_KEY = np.array([-0.42, -0.62, 0.66], np.float32)
"""Where the fixed light comes from, world frame, unit length."""
_AMBIENT, _SKY, _FIXED, _HEAD = 0.71, 0.10, 0.12, 0.13
_REACH = 0.9
"""Metres within which surfaces darken each other."""
_LIFT = 2e-3
"""Metres above a surface from which its occlusion is measured."""
_TILE = 4
"""Neighbouring pixels in a tile of this many rows and columns share a set of directions."""

Samples = Float[np.ndarray, "n 3"]
OcclusionMap = Float[np.ndarray, "rows columns"]


def face_light(model: Model) -> Float[np.ndarray, " faces"]:
    """Return the part of each triangle's brightness that does not depend on the camera."""
    normal = model.soup.normal
    fixed = np.abs(normal @ _KEY)
    return (_AMBIENT + _SKY * (0.5 + 0.5 * normal[:, 2]) + _FIXED * fixed).astype(np.float32)


def head_light(facing: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Return what the lamp at the camera adds, from the cosine between ray and normal."""
    return _HEAD * np.abs(facing)


def hemisphere(rays: int) -> Float[np.ndarray, "phases rays 3"]:
    """Return directions about +z, denser near it, stratified over a tile of pixels."""
    phases = _TILE * _TILE
    number = np.arange(phases * rays)
    # golden-ratio points cover the disk evenly however many are taken
    square = (number + 0.5) / len(number)
    angle = number * (np.pi * (3.0 - np.sqrt(5.0)))
    across = np.sqrt(square)
    points = np.stack(
        [across * np.cos(angle), across * np.sin(angle), np.sqrt(1.0 - square)], axis=-1
    )
    # every pixel of the tile gets rays from the middle to the rim
    return points.reshape(rays, phases, 3).swapaxes(0, 1).astype(np.float32)


def occlusion_map(
    model: Model,
    points: Float[np.ndarray, "rows columns 3"],
    face: Int32[np.ndarray, "rows columns"],
    normal: Float[np.ndarray, "rows columns 3"],
    rays: int,
    *,
    circular: bool,
) -> OcclusionMap:
    """Return how much of the light around each point is blocked nearby, from 0 to 1.

    Args:
        model: what blocks it.
        points: on surfaces, world frame.
        face: the triangle of each point; -1 where there is none.
        normal: towards the camera.
        rays: rays for each point; neighbours share theirs on the same facet.
        circular: whether the last column is next to the first.
    """
    rows, columns = face.shape
    phase = _scrambled_tile()[np.arange(rows)[:, None] % _TILE, np.arange(columns) % _TILE]
    hit = face >= 0
    local = hemisphere(rays)[phase[hit]]
    n = normal[hit]
    # a frame about each normal (Duff et al. 2017, "Building an Orthonormal Basis, Revisited")
    sign = np.where(n[:, 2] >= 0, np.float32(1), np.float32(-1))
    a = -1.0 / (sign + n[:, 2])
    b = n[:, 0] * n[:, 1] * a
    first = np.stack([1 + sign * n[:, 0] ** 2 * a, sign * b, -sign * n[:, 0]], axis=-1)
    second = np.stack([b, sign + n[:, 1] ** 2 * a, -n[:, 1]], axis=-1)
    frame = np.stack([first, second, n], axis=1)
    direction = local @ frame
    origin = np.repeat(points[hit] + _LIFT * n, rays, axis=0)
    clear = model.caster.clear_distance(origin, direction.reshape(-1, 3), _REACH)
    dark = (1.0 - clear / _REACH).reshape(-1, rays).mean(axis=1)
    occlusion = np.zeros((rows, columns), np.float32)
    occlusion[hit] = dark
    facet = np.where(hit, model.facet[face], -1)
    return _shared(occlusion, facet, circular=circular)


def _scrambled_tile() -> Int32[np.ndarray, "tile tile"]:
    """Return the order of the pixels of a tile; neighbours are far apart in it."""
    order = [0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5]
    return np.array(order, np.int32).reshape(_TILE, _TILE)


def _shared(
    values: OcclusionMap, facet: Int32[np.ndarray, "rows columns"], *, circular: bool
) -> OcclusionMap:
    """Return the mean over each pixel's neighbours on the same facet."""
    reach = _TILE // 2
    weights = np.array([0.5] + [1.0] * (_TILE - 1) + [0.5], np.float32)
    padded, labels = pad(values, reach, circular=circular), pad(facet, reach, circular=circular)
    rows, columns = values.shape
    total, weight = np.zeros_like(values), np.zeros_like(values)
    for i, down in enumerate(weights):
        for j, right in enumerate(weights):
            window = slice(i, i + rows), slice(j, j + columns)
            same = (labels[window] == facet) * (down * right)
            total += same * padded[window]
            weight += same
    return total / weight


def pad(
    values: np.ndarray,
    reach: int,
    *,
    circular: bool,
) -> np.ndarray:
    """Return the map with its border repeated, or its other end where it is circular."""
    sides = "wrap" if circular else "edge"
    wide = np.pad(values, ((0, 0), (reach, reach)), mode=sides)
    return np.pad(wide, ((reach, reach), (0, 0)), mode="edge")
