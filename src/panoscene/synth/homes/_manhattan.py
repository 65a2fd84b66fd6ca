"""Rooms with right angles: unions of rectangles, walls, and what two rooms share."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import shapely
from jaxtyping import Float

Rect = tuple[float, float, float, float]
"""x and y of the lower left and of the upper right corner, metres."""

_SAME = 1e-6
"""Metres within which two coordinates are one."""


@dataclass(frozen=True, slots=True)
class Walls:
    """The walls of one room; wall i runs from corner i to corner i + 1."""

    start: Float[np.ndarray, "walls 2"]
    along: Float[np.ndarray, "walls 2"]
    """Unit vector from the first corner to the second."""
    normal: Float[np.ndarray, "walls 2"]
    """Unit vector into the room."""
    length: Float[np.ndarray, " walls"]
    yaw: Float[np.ndarray, " walls"]
    """Yaw of what stands with its back to the wall."""


@dataclass(frozen=True, slots=True)
class SharedWall:
    """The part of two rooms' walls that face each other through one wall."""

    wall: int
    """Index in the first room."""
    other_wall: int
    """Index in the second room."""
    start: float
    """Metres along the first room's wall."""
    stop: float

    @property
    def length(self) -> float:
        """Metres that both rooms share."""
        return self.stop - self.start


def outline(rects: Sequence[Rect]) -> Float[np.ndarray, "corners 2"] | None:
    """Return the corners of the rectangles' union, counter-clockwise; None if not one piece.

    A union with a hole, or whose parts meet in no more than a point, is not one piece either.

    Examples:
        >>> outline([(0.0, 0.0, 2.0, 1.0), (0.0, 1.0, 1.0, 2.0)]).shape
        (6, 2)
    """
    union = shapely.union_all([shapely.box(*rect) for rect in rects])
    return corners_of(union)


def corners_of(shape: shapely.Geometry) -> Float[np.ndarray, "corners 2"] | None:
    """Return the corners of a polygon without holes, counter-clockwise; None for other shapes."""
    if not isinstance(shape, shapely.Polygon) or shape.is_empty or len(shape.interiors) > 0:
        return None
    ring = np.array(shapely.geometry.polygon.orient(shape, 1.0).exterior.coords)[:-1]
    after = np.concatenate((ring[1:], ring[:1])) - ring  # np.roll is ten times slower
    before = np.concatenate((after[-1:], after[:-1]))
    turns = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]) > _SAME
    return ring[turns]


def walls_of(polygon: Float[np.ndarray, "corners 2"]) -> Walls:
    """Return the walls of a room; those of the last rooms are remembered."""
    return _walls(np.ascontiguousarray(polygon, dtype=np.float64).tobytes())


@lru_cache(maxsize=256)
def _walls(corners: bytes) -> Walls:
    polygon = np.frombuffer(corners).reshape(-1, 2)
    step = np.concatenate((polygon[1:], polygon[:1])) - polygon
    length = np.abs(step).sum(axis=1)
    along = np.round(step / length[:, None])
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
    yaw = np.arctan2(along[:, 1], along[:, 0])
    for array in (along, normal, length, yaw):
        array.flags.writeable = False
    return Walls(polygon, along, normal, length, yaw)


def inset(
    polygon: Float[np.ndarray, "corners 2"], distance: float
) -> Float[np.ndarray, "corners 2"]:
    """Return the room whose walls lie so far inside those of another one (outside if negative).

    Examples:
        >>> inset(np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]]), 0.5).tolist()
        [[0.5, 0.5], [3.5, 0.5], [3.5, 2.5], [0.5, 2.5]]
    """
    normal = walls_of(polygon).normal
    return polygon + distance * (normal + np.concatenate((normal[-1:], normal[:-1])))


def area_of(polygon: Float[np.ndarray, "corners 2"]) -> float:
    """Return the area in square metres."""
    x, y = polygon.T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2.0


def blocks_around(polygon: Float[np.ndarray, "corners 2"]) -> Float[np.ndarray, "blocks 4"]:
    """Return the rectangles that fill what the room leaves free of its bounding box."""
    xs, ys = np.unique(polygon[:, 0]), np.unique(polygon[:, 1])
    mid_x, mid_y = (xs[1:] + xs[:-1]) / 2, (ys[1:] + ys[:-1]) / 2
    grid_x, grid_y = np.meshgrid(mid_x, mid_y, indexing="ij")
    inside = shapely.contains_xy(shapely.Polygon(polygon), grid_x, grid_y)
    rows = [(xs[i], ys[j], xs[i + 1], ys[j + 1]) for i, j in np.argwhere(~inside)]
    return np.array(rows, dtype=np.float64).reshape(-1, 4)


def shared_walls(a: Walls, b: Walls, thickness: float) -> list[SharedWall]:
    """Return where walls of two rooms face each other at the distance of the wall's thickness."""
    opposite = a.normal @ b.normal.T < -0.5
    behind = np.einsum("iak,ik->ia", a.start[:, None] - b.start[None], a.normal)
    low = np.einsum("iak,ik->ia", b.start[None] - a.start[:, None], a.along)
    far = b.start + b.along * b.length[:, None]
    high = np.einsum("iak,ik->ia", far[None] - a.start[:, None], a.along)
    start = np.minimum(low, high).clip(min=0.0)
    stop = np.minimum(np.maximum(low, high), a.length[:, None])
    meet = opposite & (np.abs(behind - thickness) < _SAME) & (stop - start > _SAME)
    return [
        SharedWall(int(i), int(j), float(start[i, j]), float(stop[i, j]))
        for i, j in np.argwhere(meet)
    ]
