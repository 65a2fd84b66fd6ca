"""Dimension lines around a floor plan."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from jaxtyping import Float

from panoscene.exports._plan_openings import Opening
from panoscene.style import WALL_THICKNESS

FIRST_MM, ROW_MM = 9.0, 7.0
"""On paper: from the plan to the first row of dimensions, and between rows."""
NARROW_MM = 20.0
"""On paper, between inner faces: in a nook as narrow as this there is room for one dimension."""
SHORTEST = 0.02
"""Metres; shorter pieces of wall are not dimensioned."""
_SQUARE = 1e-3
Bounds = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Dimension:
    """A length and where it is written."""

    start: Float[np.ndarray, " 2"]
    """First of the two measured points."""
    end: Float[np.ndarray, " 2"]
    line: Float[np.ndarray, "2 2"]
    """The dimension line, parallel to what it measures, beside both points."""
    wall: int | None
    """The wall it measures all of; None for a part, or for the whole room."""

    @property
    def length(self) -> float:
        """Metres."""
        return float(np.linalg.norm(self.line[1] - self.line[0]))

    @property
    def text(self) -> str:
        """The length in metres, as it is written."""
        return f"{self.length:.2f}"

    def strip(self, half_width: float) -> shapely.Polygon:
        """Return the strip around the dimension line."""
        return shapely.LineString(self.line).buffer(half_width)


@dataclass(frozen=True, slots=True)
class _Run:
    """What is measured along one wall, or along one side of the room."""

    start: Float[np.ndarray, " 2"]
    along: Float[np.ndarray, " 2"]
    stops: tuple[float, ...]
    wall: int | None

    def dimensions(self, line: Float[np.ndarray, " 2"]) -> list[Dimension]:
        """Return the dimensions between stops, on the parallel line through a point."""
        out = np.array([self.along[1], -self.along[0]])
        shift = float((line - self.start) @ out) * out
        places = self.start + np.array(self.stops)[:, None] * self.along
        return [
            Dimension(a, b, np.stack([a, b]) + shift, self.wall)
            for a, b in pairwise(places)
            if np.linalg.norm(b - a) >= SHORTEST
        ]


def plan_dimensions(
    corners: Float[np.ndarray, "corners 2"],
    openings: tuple[Opening, ...],
    taken: Bounds,
    scale: int,
) -> tuple[Dimension, ...]:
    """Return the dimensions of all walls, of their openings, and of the whole room.

    Walls along the page's edges are dimensioned in rows outside of everything: parts between
    openings, walls, the whole side. Other walls, and those that look at another wall across a
    nook, are dimensioned next to themselves; of two equal walls on both sides of a narrow nook only
    the first.

    Args:
        corners: Inner faces of the walls, counter-clockwise.
        openings: Doors and windows.
        taken: Left, bottom, right, top of walls and furniture.
        scale: 1 : scale is the size on paper.
    """
    first, row = FIRST_MM * scale / 1000, ROW_MM * scale / 1000
    ends = np.roll(corners, -1, axis=0)
    length = np.linalg.norm(ends - corners, axis=1)
    along = (ends - corners) / length[:, None]
    sides: dict[tuple[int, int], list[int]] = {}
    found: list[Dimension] = []
    for wall in range(len(corners)):
        out = np.array([along[wall, 1], -along[wall, 0]])
        square = np.abs(out).max() > 1 - _SQUARE
        if square and _is_free(corners, wall, out, taken):
            sides.setdefault((round(out[0]), round(out[1])), []).append(wall)
            continue
        gap, twin = _across(corners, wall)
        if twin is not None and twin < wall and gap < NARROW_MM * scale / 1000:
            continue
        place = corners[wall] + min(WALL_THICKNESS + first / 2, gap / 2) * out
        for run in _rows(corners, along, length, wall, openings):
            found += run.dimensions(place)
            place = place + row * out
    for (x, y), walls in sides.items():
        out = np.array([x, y], dtype=np.float64)
        reach = {(-1, 0): -taken[0], (0, -1): -taken[1], (1, 0): taken[2], (0, 1): taken[3]}
        place = (reach[x, y] + first) * out
        rows = [_rows(corners, along, length, wall, openings) for wall in walls]
        if any(len(runs) > 1 for runs in rows):
            for runs in rows:
                found += runs[0].dimensions(place) if len(runs) > 1 else []
            place = place + row * out
        for runs in rows:
            found += runs[-1].dimensions(place)
        if len(walls) > 1:
            found += _whole(corners, walls, along[walls[0]]).dimensions(place + row * out)
    return tuple(found)


def _rows(
    corners: Float[np.ndarray, "corners 2"],
    along: Float[np.ndarray, "corners 2"],
    length: Float[np.ndarray, " corners"],
    wall: int,
    openings: tuple[Opening, ...],
) -> list[_Run]:
    """Return what to measure along a wall: parts between openings if there are any, and all."""
    cuts = {stop for one in openings if one.wall == wall for stop in (one.start, one.end)}
    total = float(length[wall])
    whole = _Run(corners[wall], along[wall], (0.0, total), wall)
    if not cuts:
        return [whole]
    stops = [0.0]
    for stop in [*sorted(cuts), total]:
        if stop - stops[-1] >= SHORTEST:
            stops.append(stop)
    stops[-1] = total
    return [_Run(corners[wall], along[wall], tuple(stops), None), whole]


def _whole(
    corners: Float[np.ndarray, "corners 2"], walls: list[int], along: Float[np.ndarray, " 2"]
) -> _Run:
    """Return the run from the first to the last corner of the room, seen from one side."""
    place = corners @ along
    low, high = float(place.min()), float(place.max())
    start = corners[walls[0]]
    return _Run(start + (low - float(start @ along)) * along, along, (0.0, high - low), None)


def _across(corners: Float[np.ndarray, "corners 2"], wall: int) -> tuple[float, int | None]:
    """Return how far behind a wall the next parallel one is, and that one if it mirrors it.

    Infinity and None when there is none; behind is outside of the room.
    """
    ends = np.roll(corners, -1, axis=0)
    length = float(np.linalg.norm(ends[wall] - corners[wall]))
    along = (ends[wall] - corners[wall]) / length
    out = np.array([along[1], -along[0]])
    # from the wall's start: along it, and outwards
    starts, stops = (
        (points - corners[wall]) @ np.stack([along, out], axis=1) for points in (corners, ends)
    )
    level = np.abs(starts[:, 1] - stops[:, 1]) < _SQUARE
    facing = (starts[:, 0] > _SQUARE) & (stops[:, 0] < length - _SQUARE)
    behind = level & facing & (starts[:, 0] > stops[:, 0]) & (starts[:, 1] > _SQUARE)
    if not behind.any():
        return np.inf, None
    nearest = int(np.argmin(np.where(behind, starts[:, 1], np.inf)))
    same = abs(starts[nearest, 0] - length) < SHORTEST and abs(stops[nearest, 0]) < SHORTEST
    return float(starts[nearest, 1]), nearest if same else None


def _is_free(
    corners: Float[np.ndarray, "corners 2"],
    wall: int,
    out: Float[np.ndarray, " 2"],
    taken: Bounds,
) -> bool:
    """Return whether nothing of the room lies between the wall and the outside."""
    start, end = corners[wall], np.roll(corners, -1, axis=0)[wall]
    reach = max(taken[2] - taken[0], taken[3] - taken[1]) + 1.0
    inset = 1e-3 * (end - start)
    near = np.stack([start + inset, end - inset]) + 1e-3 * out
    strip = shapely.Polygon([*near, *(near + reach * out)[::-1]])
    return strip.intersection(shapely.Polygon(corners)).area < 1e-6
