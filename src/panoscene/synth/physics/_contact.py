"""How two meshes touch: how far one can move before they meet, or must move to part."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64

from ._columns import Columns, Hits, column_hits, columns_over
from ._shapes import INSIDE, SURFACE
from ._solids import Solid, turned

_THIN = 0.025
"""Two cuts of a line nearer than this are the two sides of a board, with nothing between."""
_SHEET = 0.0005
"""Half the thickness of a lone sheet."""
TOUCH = 0.0002
"""Overlap that is rounding and not contact."""
_NOT_ROUNDING = np.array([TOUCH, -TOUCH])
_CLEAR = 0.002
"""Boxes that overlap by less are not looked into: the overlap itself is the answer."""

UPRIGHT = np.eye(3)
"""The frame of moves straight up."""

Intervals = Float64[np.ndarray, "_ 2"]


@dataclass(frozen=True, slots=True)
class Overlap:
    """How deep two meshes are in each other."""

    depth: float
    """Least way in metres, over the axes of both, by which the first must move to part."""
    move: Float64[np.ndarray, " 3"]
    """That way."""


def blocked_moves(
    first: Solid, second: Solid, frame: Float64[np.ndarray, "3 3"], reach: float
) -> Intervals:
    """Return the moves of the first mesh at which it overlaps the second, as sorted intervals.

    Both meshes are cut by parallel lines at most 1 cm apart. On a line, a stretch is solid when it
    lies between two cuts no more than 2.5 cm apart, or inside a body; a lone sheet is a millimetre
    thick. Everything is exact but for what fits between two lines.

    Args:
        first: Moves.
        second: Stays.
        frame: Orthonormal rows; the moves are along the last one.
        reach: Only moves up to this length are of interest.
    """
    columns = shared_columns(first, second, frame, reach)
    return np.zeros((0, 2)) if columns is None else blocked_on(first, second, frame, columns)


def shared_columns(
    first: Solid, second: Solid, frame: Float64[np.ndarray, "3 3"], reach: float
) -> Columns | None:
    """Return the lines that may cut both meshes; None where no move up to a length joins them."""
    shared = []
    for row in frame[:2]:
        a_span, b_span = first.span(row), second.span(row)
        shared.append((max(a_span[0], b_span[0]), min(a_span[1], b_span[1])))
        if shared[-1][1] <= shared[-1][0]:  # nearly all pairs end here
            return None
    low, high = np.array(shared).T
    a_span, b_span = first.span(frame[2]), second.span(frame[2])
    if b_span[0] - a_span[1] > reach or a_span[0] - b_span[1] > reach:
        return None
    return columns_over(low, high)


def blocked_on(
    first: Solid, second: Solid, frame: Float64[np.ndarray, "3 3"], columns: Columns
) -> Intervals:
    """Return the moves of ``blocked_moves``, however long, as some lines tell them."""
    a_cell, a_part = _solid_parts(first, frame, columns)
    b_cell, b_part = _solid_parts(second, frame, columns)
    start = np.searchsorted(b_cell, a_cell, side="left")
    count = np.searchsorted(b_cell, a_cell, side="right") - start
    owner = np.repeat(np.arange(len(a_cell)), count)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    other = b_part[start[owner] + within]
    found = np.stack([other[:, 0] - a_part[owner, 1], other[:, 1] - a_part[owner, 0]], axis=1)
    return merged(found + _NOT_ROUNDING)


def merged(intervals: Intervals) -> Intervals:
    """Return the union of intervals, sorted.

    Examples:
        >>> merged(np.array([[3.0, 4.0], [0.0, 1.0], [0.5, 2.0]])).tolist()
        [[0.0, 2.0], [3.0, 4.0]]
    """
    intervals = intervals[intervals[:, 1] > intervals[:, 0]]
    if not len(intervals):
        return np.zeros((0, 2))
    ordered = intervals[np.argsort(intervals[:, 0], kind="stable")]
    ends = np.maximum.accumulate(ordered[:, 1])
    first = np.r_[True, ordered[1:, 0] > ends[:-1]]
    return np.stack([ordered[first, 0], ends[np.r_[first[1:], True]]], axis=1)


def overlap(first: Solid, second: Solid, level: bool = False) -> Overlap:
    """Return how deep two meshes are in each other; depth 0 where they are apart.

    Where the oriented boxes overlap by less than 2 mm along an axis, that is the answer, which
    may be too much but not too little. Overlaps of two sheets that both have no thickness are
    found only when they are oblique to each other.

    Args:
        first: Would move.
        second: Would stay.
        level: Whether only horizontal ways out count; ``depth`` is the length of the shortest.
    """
    vertical = np.array([0.0, 0.0, 1.0])
    plain, other = turned(first.yaw).T, turned(second.yaw).T
    axes = [vertical, plain[0], plain[1]]
    if abs(np.sin(2 * (first.yaw - second.yaw))) > 1e-3:
        axes += [other[0], other[1]]
    exits = [_box_exits(first, second, axis) for axis in axes]
    depth, move = 1e9, np.zeros(3)
    for k, (axis, (down, up)) in enumerate(zip(axes, exits, strict=True)):
        if down >= 0 or up <= 0:
            return Overlap(0.0, np.zeros(3))
        if level and k == 0:
            continue
        depth, move = min((depth, move), (-down, axis * down), (up, axis * up), key=lambda x: x[0])
    if depth <= _CLEAR:
        return Overlap(depth, move)
    frames = [np.stack([axes[(k + 1) % 3], axes[(k + 2) % 3], axes[k]]) for k in range(3)]
    frames += [np.stack([vertical, axes[7 - k], axes[k]]) for k in range(3, len(axes))]
    met = False
    best, least = move, depth
    for k, frame in enumerate(frames):
        blocked = blocked_moves(first, second, frame, least + TOUCH)
        inside = blocked[(blocked[:, 0] < 0) & (blocked[:, 1] > 0)]
        if not len(inside):
            continue
        met = True
        if level and k == 0:
            continue
        down, up = (float(v) for v in inside[0])
        way = down if -down < up else up
        if abs(way) < least:
            least, best = abs(way), frame[2] * way
    return Overlap(least, best) if met else Overlap(0.0, np.zeros(3))


def _box_exits(first: Solid, second: Solid, axis: Float64[np.ndarray, " 3"]) -> tuple[float, float]:
    """Return the moves down and up an axis that part the boxes; of one sign when they are apart."""
    a, b = first.span(axis), second.span(axis)
    return b[0] - a[1] + TOUCH, b[1] - a[0] - TOUCH


def _solid_parts(
    body: Solid, frame: Float64[np.ndarray, "3 3"], columns: Columns
) -> tuple[Int64[np.ndarray, " n"], Intervals]:
    """Return cells, sorted, and stretches where lines run through a body."""
    high = np.array(columns.low) + np.array(columns.shape) * np.array(columns.spacing)
    triangles = body.triangles if frame is UPRIGHT else body.triangles @ frame.T
    a, b, c = np.moveaxis(triangles[..., :2], 1, 0)
    near = np.maximum(np.maximum(a, b), c) >= columns.low
    near &= np.minimum(np.minimum(a, b), c) <= high
    near = near[:, 0] & near[:, 1]
    hits = column_hits(triangles[near], columns)
    cell, height = hits.cell, hits.height
    if not len(cell):
        return cell, np.zeros((0, 2))
    pair = np.flatnonzero(cell[1:] == cell[:-1])
    length = height[pair + 1] - height[pair]
    middle = np.column_stack([columns.places(cell[pair]), (height[pair] + height[pair + 1]) / 2])
    state = body.states(middle @ frame)
    step = float(np.linalg.norm(body.shape.step * body.scale * (frame[2] @ turned(body.yaw))))
    near_surface = (length < 2 * step) | _enclosed(hits)[pair]
    full = (length < _THIN) | (state == INSIDE) | ((state == SURFACE) & near_surface)
    pair = pair[full]
    lone = np.ones(len(cell), bool)
    lone[pair] = lone[pair + 1] = False
    lone = np.flatnonzero(lone)
    cells = np.concatenate([cell[pair], cell[lone]])
    parts = np.concatenate(
        [
            np.stack([height[pair], height[pair + 1]], axis=1),
            np.stack([height[lone] - _SHEET, height[lone] + _SHEET], axis=1),
        ]
    )
    order = np.argsort(cells, kind="stable")
    return cells[order], parts[order]


def _enclosed(hits: Hits) -> Bool[np.ndarray, " hits"]:
    """Return after which cuts a line is inside, by the sense of the triangles.

    Boards seen from their edge have no voxel that is all inside. A line counts only when it enters
    as often as it leaves.
    """
    turns = np.cumsum(hits.side.astype(np.int64))
    last = np.flatnonzero(np.r_[hits.cell[1:] != hits.cell[:-1], True])
    size = np.diff(np.r_[-1, last])
    before = np.r_[0, turns[last[:-1]]]
    balanced = turns[last] == before
    return np.repeat(balanced, size) & (turns != np.repeat(before, size))
