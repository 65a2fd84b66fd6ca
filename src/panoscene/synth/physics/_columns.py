"""Where parallel lines cut triangles, all at once and exactly."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int8, Int64

_AT_ONCE = 4_000_000
"""Pairs of a triangle and a line that are looked at together."""
_FLAT = 1e-12
"""Cells of a triangle's plan; those of less are parallel to the lines."""
_WHERE = np.array([0.5137, 0.4771])
"""Place of a line in its cell: not the middle, where diagonals of faces often run."""


@dataclass(frozen=True, slots=True)
class Columns:
    """Lines along the third axis through the cells of a grid over the first two."""

    low: tuple[float, float]
    """First corner of the grid."""
    spacing: tuple[float, float]
    """Between neighbouring lines; the first one is about half a spacing inside the grid."""
    shape: tuple[int, int]

    @property
    def number(self) -> int:
        """Number of lines."""
        return self.shape[0] * self.shape[1]

    def places(self, cells: Int64[np.ndarray, " n"]) -> Float64[np.ndarray, "n 2"]:
        """Return where the lines of flat cell numbers are."""
        index = np.stack(np.divmod(cells, self.shape[1]), axis=1)
        return np.array(self.low) + (index + _WHERE) * np.array(self.spacing)


def columns_over(
    low: Float64[np.ndarray, " 2"],
    high: Float64[np.ndarray, " 2"],
    wanted: int = 4000,
    finest: float = 0.002,
    coarsest: float = 0.01,
) -> Columns:
    """Return lines over a rectangle.

    Args:
        low: First corner in metres.
        high: Opposite corner.
        wanted: Number of lines, as long as the spacing is within the next two.
        finest: Least spacing in metres.
        coarsest: Greatest spacing in metres.
    """
    extent = np.maximum(high - low, 1e-6)
    spacing = float(np.clip(np.sqrt(extent[0] * extent[1] / wanted), finest, coarsest))
    rows, columns = np.ceil(extent / spacing).astype(int).tolist()
    width, depth = (extent / (rows, columns)).tolist()
    return Columns((float(low[0]), float(low[1])), (width, depth), (rows, columns))


@dataclass(frozen=True, slots=True)
class Hits:
    """Cuts of lines and triangles."""

    cell: Int64[np.ndarray, " hits"]
    """Flat cell numbers of the lines."""
    height: Float64[np.ndarray, " hits"]
    """Third coordinate."""
    side: Int8[np.ndarray, " hits"]
    """1 where the line enters, coming from below, by the sense of the triangle; -1 where it
    leaves."""


def column_hits(triangles: Float64[np.ndarray, "faces 3 3"], columns: Columns) -> Hits:
    """Return where lines cut triangles, sorted by cell, then upwards.

    Triangles that are parallel to the lines are never hit; a line through the common edge of two
    triangles hits both.

    Args:
        triangles: Corners; the lines run along the last coordinate.
        columns: The lines.
    """
    low, spacing = np.array(columns.low), np.array(columns.spacing)
    plan = (triangles[..., :2] - low) / spacing - _WHERE
    a, b, c = np.moveaxis(plan, 1, 0)
    least, most = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    first = np.ceil(least - 1e-9).clip(min=0).astype(np.int64)
    last = np.floor(most + 1e-9).astype(np.int64)
    last = np.minimum(last, np.array(columns.shape) - 1)
    span = (last - first + 1).clip(min=0)
    edge_b, edge_c = b - a, c - a
    area = edge_b[:, 0] * edge_c[:, 1] - edge_b[:, 1] * edge_c[:, 0]
    count = np.where(np.abs(area) < _FLAT, 0, span[:, 0] * span[:, 1])
    keep = np.flatnonzero(count)
    found = [
        _cut(
            triangles[part, :, 2],
            plan[part],
            first[part],
            span[part],
            area=area[part],
            columns=columns,
        )
        for part in _parts(keep, count[keep])
    ]
    if not found:
        return Hits(np.zeros(0, np.int64), np.zeros(0), np.zeros(0, np.int8))
    cell = np.concatenate([hits.cell for hits in found])
    height = np.concatenate([hits.height for hits in found])
    side = np.concatenate([hits.side for hits in found])
    order = np.lexsort((height, cell))
    return Hits(cell[order], height[order], side[order])


def _parts(keep: Int64[np.ndarray, " n"], count: Int64[np.ndarray, " n"]) -> list[np.ndarray]:
    if not len(keep):
        return []
    block = np.cumsum(count) // _AT_ONCE
    return np.split(keep, np.flatnonzero(np.diff(block)) + 1)


def _cut(
    heights: Float64[np.ndarray, "n 3"],
    plan: Float64[np.ndarray, "n 3 2"],
    first: Int64[np.ndarray, "n 2"],
    span: Int64[np.ndarray, "n 2"],
    *,
    area: Float64[np.ndarray, " n"],
    columns: Columns,
) -> Hits:
    count = span[:, 0] * span[:, 1]
    owner = np.repeat(np.arange(len(count)), count)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    row, column = np.divmod(within, np.repeat(span[:, 1], count))
    row += np.repeat(first[:, 0], count)
    column += np.repeat(first[:, 1], count)
    edge_b, edge_c = plan[:, 1] - plan[:, 0], plan[:, 2] - plan[:, 0]
    inverse = np.repeat(1.0 / area, count)
    x, y = row - np.repeat(plan[:, 0, 0], count), column - np.repeat(plan[:, 0, 1], count)
    b = (x * np.repeat(edge_c[:, 1], count) - y * np.repeat(edge_c[:, 0], count)) * inverse
    c = (y * np.repeat(edge_b[:, 0], count) - x * np.repeat(edge_b[:, 1], count)) * inverse
    hit = np.flatnonzero((b >= -1e-9) & (c >= -1e-9) & (b + c <= 1 + 1e-9))
    owner, b, c = owner[hit], b[hit], c[hit]
    rise_b, rise_c = heights[:, 1] - heights[:, 0], heights[:, 2] - heights[:, 0]
    height = heights[owner, 0] + b * rise_b[owner] + c * rise_c[owner]
    side = np.where(area > 0, -1, 1).astype(np.int8)[owner]
    return Hits(row[hit] * columns.shape[1] + column[hit], height, side)
