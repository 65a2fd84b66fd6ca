"""Straight segments of a panorama: arcs of great circles, as they are in the room."""

from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Float64, Int64

from panoscene.geometry import connected_components

from ._edges import EdgePoints

_BINS = 8
_LEAST_POINTS = 10
_MOST_BENT = 0.6
"""Pixels of root mean square distance from the line; segments above it are halved."""
_HALVINGS = 2
_POINT_ERROR = 0.4
"""Pixels that an edge point is off its line."""


@dataclass(frozen=True, slots=True)
class Segments:
    """Arcs of great circles, in the axes of the photo."""

    normal: Float64[np.ndarray, "n 3"]
    """Unit normal of the plane through the camera that holds the arc; of either sign."""
    middle: Float64[np.ndarray, "n 3"]
    """Direction of the middle of the arc."""
    length: Float64[np.ndarray, " n"]
    """Angle between its ends in radians."""
    shift_error: Float64[np.ndarray, " n"]
    """Standard error in radians of the place of the arc, across it."""
    turn_error: Float64[np.ndarray, " n"]
    """Standard error in radians of its bearing, about its middle."""

    @property
    def bearing(self) -> Float64[np.ndarray, "n 3"]:
        """Directions along the arcs, a quarter turn from their middles."""
        return np.cross(self.normal, self.middle)

    def at(self, index: Int64[np.ndarray, " m"]) -> "Segments":
        """Return some of them."""
        return Segments(*(getattr(self, each.name)[index] for each in fields(self)))

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.length)


def find_segments(points: EdgePoints) -> Segments:
    """Return the straight segments that edge points form.

    Neighbouring points whose gradients have similar angles belong together (Burns, Hanson and
    Riseman 1986): the angles are binned twice, the second time by half a bin further, and each
    point joins the longer one of its two groups. A line is fitted to each; a group that is bent
    is halved.
    """
    group, count = _groups(points)
    points, group, count = _large(points, group, count)
    for _ in range(_HALVINGS):
        lines = _fit(points, group, count)
        bent = lines.bend > _MOST_BENT * points.pixel
        along = ((points.plane - lines.centre[group]) * lines.along[group]).sum(1) > 0
        group = group + np.where(bent[group] & along, count, 0)
        group, count = _renumbered(group)
    lines = _fit(points, group, count)
    return _arcs(points, lines, group)


def _groups(points: EdgePoints) -> tuple[Int64[np.ndarray, " n"], int]:
    number = len(points.turn)
    if number == 0:
        return np.zeros(0, dtype=np.int64), 0
    side, views = points.side, len(points.camera_from_view)
    at = (points.view * side + points.row) * side + points.column
    index = np.full(views * side * side + side + 2, -1, dtype=np.int64)
    index[at] = np.arange(number)
    turn = points.turn / (2 * np.pi) * _BINS
    labels, sizes = [], []
    for shift in (0.0, 0.5):
        angle = np.floor(turn + shift).astype(np.int64) % _BINS
        starts, ends = [], []
        for step in (1, side - 1, side, side + 1):
            other = index[at + step]
            joined = (other >= 0) & (angle[other] == angle)
            starts.append(np.flatnonzero(joined))
            ends.append(other[joined])
        start, end = np.concatenate(starts), np.concatenate(ends)
        label = connected_components(number, start, end)
        labels.append(label)
        sizes.append(np.bincount(label)[label])
    second = sizes[1] > sizes[0]
    return _renumbered(np.where(second, labels[1] + number, labels[0]))


def _large(
    points: EdgePoints, group: Int64[np.ndarray, " n"], count: int
) -> tuple[EdgePoints, Int64[np.ndarray, " m"], int]:
    """Return the points of groups that are large enough, so that the rest costs no more time."""
    keep = (np.bincount(group, minlength=count) >= _LEAST_POINTS)[group]
    kept = {
        name: getattr(points, name)[keep] for name in ("view", "row", "column", "plane", "turn")
    }
    return replace(points, **kept), *_renumbered(group[keep])


def _renumbered(group: Int64[np.ndarray, " n"]) -> tuple[Int64[np.ndarray, " n"], int]:
    """Return the groups numbered without gaps, and how many there are."""
    used = np.bincount(group) > 0
    return (np.cumsum(used) - 1)[group], int(used.sum())


@dataclass(frozen=True, slots=True)
class _Lines:
    """Lines on the image planes of the views, one for each group of points."""

    points: Float64[np.ndarray, " n"]
    centre: Float64[np.ndarray, "n 2"]
    along: Float64[np.ndarray, "n 2"]
    half: Float64[np.ndarray, " n"]
    """Half the length."""
    bend: Float64[np.ndarray, " n"]
    """Root mean square distance of the points from the line."""


def _fit(points: EdgePoints, group: Int64[np.ndarray, " n"], count: int) -> _Lines:
    x, y = points.plane.astype(np.float64).T

    def mean(values: np.ndarray) -> np.ndarray:
        return np.bincount(group, values, count) / number

    number = np.bincount(group, minlength=count).astype(np.float64)
    centre = np.stack((mean(x), mean(y)), axis=1)
    x, y = x - centre[group, 0], y - centre[group, 1]
    xx, xy, yy = mean(x * x), mean(x * y), mean(y * y)
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)
    spread = np.hypot(0.5 * (xx - yy), xy)
    half_sum = 0.5 * (xx + yy)
    # points spread evenly over a line have a third of its half length squared as their variance
    half = np.sqrt(3 * (half_sum + spread))
    bend = np.sqrt(np.maximum(half_sum - spread, 0))
    return _Lines(number, centre, np.stack((np.cos(angle), np.sin(angle)), axis=1), half, bend)


def _arcs(points: EdgePoints, lines: _Lines, group: Int64[np.ndarray, " n"]) -> Segments:
    keep = (lines.points >= _LEAST_POINTS) & (lines.bend <= _MOST_BENT * points.pixel)
    view = np.zeros(len(keep), dtype=np.int64)
    view[group] = points.view
    keep = np.flatnonzero(keep)
    frame = points.camera_from_view[view[keep]].astype(np.float64)

    def direction(plane: np.ndarray) -> np.ndarray:
        ray = np.concatenate((plane, np.ones((len(plane), 1))), axis=1)
        ray /= np.linalg.norm(ray, axis=1, keepdims=True)
        return np.einsum("nij,nj->ni", frame, ray)

    centre, reach = lines.centre[keep], lines.along[keep] * lines.half[keep, None]
    first, last = direction(centre - reach), direction(centre + reach)
    normal = np.cross(first, last)
    sine = np.linalg.norm(normal, axis=1)
    length = np.arctan2(sine, (first * last).sum(1))
    normal /= np.maximum(sine, 1e-12)[:, None]
    middle = first + last
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    distance = np.sqrt(1 + (centre**2).sum(1))
    shift = _POINT_ERROR * points.pixel / distance / np.sqrt(lines.points[keep])
    return Segments(normal, middle, length, shift, shift * np.sqrt(12) / np.maximum(length, 1e-6))
