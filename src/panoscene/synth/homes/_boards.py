"""Boards inside shelves, found in their meshes: where things can stand."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

_FLAT = 0.95
_THICK = 0.035
_LEAST = (0.18, 0.14)
"""Width and depth of a board in metres, at least."""
_HEADROOM = 0.16
_RIM = 0.03
"""Metres at the rim of a board where partitions and rear walls may be."""
_HIGHEST = 1.9
"""Metres; what stands higher is not seen."""


class Board(NamedTuple):
    """A free flat part of a board, in the frame of its model; metres."""

    height: float
    """Above the model's lower edge."""
    left: float
    right: float
    rear: float
    front: float
    headroom: float
    """Free above the board."""


def boards_of(
    vertices: Float[np.ndarray, "vertices 3"], faces: Int[np.ndarray, "faces 3"]
) -> tuple[Board, ...]:
    """Return the boards of a shelf between its partitions, from below; not its uppermost one.

    Boards on which the model itself has something, or behind doors, are left out.

    Args:
        vertices: Of the model, in its frame.
        faces: Of the model.
    """
    corners = vertices[faces].astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.linalg.norm(cross, axis=1)
    normal = cross / np.maximum(twice, 1e-12)[:, None]
    low, high = vertices.min(axis=0).astype(float), vertices.max(axis=0).astype(float)
    up = corners[normal[:, 2] > _FLAT]
    level = np.round((up[..., 2].mean(axis=1) - low[2]) / 0.01).astype(int)
    area = np.bincount(level, twice[normal[:, 2] > _FLAT] / 2) if len(up) else np.zeros(1)
    heights = np.flatnonzero(area > 0.3 * (high[0] - low[0]) * (high[1] - low[1]) * 0.5)
    across = corners[np.abs(normal[:, 0]) > _FLAT]
    least, most = corners.min(axis=1), corners.max(axis=1)
    found: list[Board] = []
    for here, above in pairwise(heights.tolist()):
        room = (above - here) * 0.01 - _THICK
        if room < _HEADROOM or here * 0.01 > _HIGHEST:
            continue
        part = up[level == here].reshape(-1, 3)
        (x0, y0), (x1, y1) = part[:, :2].min(axis=0), part[:, :2].max(axis=0)
        z = low[2] + here * 0.01
        for left, right in pairwise([x0, *_partitions(across, z, (x0, x1)), x1]):
            inner = np.array([[left, y0, z], [right, high[1] + _RIM, z + room]])
            inner += [[_RIM, _RIM, _RIM], [-_RIM, 0.0, -_RIM / 3]]
            empty = not ((least < inner[1]).all(axis=1) & (most > inner[0]).all(axis=1)).any()
            if right - left > _LEAST[0] and y1 - y0 > _LEAST[1] and empty:
                board = (here * 0.01, left, right, y0, y1, room)
                found.append(Board(*map(float, board)))
    return tuple(found)


def _partitions(
    across: Float[np.ndarray, "n 3 3"], z: float, span: tuple[float, float]
) -> list[float]:
    """Return where upright parts stand on a board."""
    low, high = across[..., 2].min(axis=1), across[..., 2].max(axis=1)
    x = across[(low < z + 0.05) & (high > z + 0.08), 0, 0]
    return sorted({round(float(v), 3) for v in x if span[0] + 0.03 < v < span[1] - 0.03})


def has_top(
    vertices: Float[np.ndarray, "vertices 3"],
    faces: Int[np.ndarray, "faces 3"],
    support: float,
) -> bool:
    """Return whether a cupboard is closed above, at the height where things would stand on it."""
    corners = vertices[faces].astype(np.float64)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    middle = corners[..., 2].mean(axis=1) - vertices[:, 2].min()
    use = (cross[:, 2] > 0) & (np.abs(middle - support) < 0.12)
    width, depth = np.ptp(vertices[:, :2], axis=0)
    return bool(cross[use, 2].sum() / 2 > 0.6 * width * depth)
