"""Surfaces of blocks as quads with corners in cells: few of them where the surface is flat."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import torch
from jaxtyping import Bool, Float, Int32, Int64, UInt8
from torch import Tensor

from ._cubes import (
    ALL_INSIDE,
    CELLS,
    CORNERS,
    EDGES,
    at,
    case_loops,
    crossings,
    mixed,
    numbers_of,
)
from ._fewer import fitted, unfolded

_FLAT = (0.97, 0.9)
"""A block, and an eighth of one, are flat where normals add up to that share of their number."""
_BITS = 6
_OWN = 1 << _BITS
"""Cells of a block, and edges along each axis."""


@dataclass(frozen=True, slots=True)
class _Tables:
    """Constants of blocks of 4 x 4 x 4 cells."""

    cells: Int32[Tensor, "64 3"]
    eighth: Int32[Tensor, " 64"]
    """Of the block, that each cell is in."""
    around: Int32[Tensor, "3 4 3"]
    """From where an edge along each axis starts to the cells around it, counter-clockwise."""
    number: Int32[Tensor, "3 4"]
    """Of that edge, in each of the four."""
    loop: Int32[Tensor, "256 12"]
    """Which of the surface's parts in a cell of each case goes through each edge."""
    parts: Int32[Tensor, " 256"]
    """How many there are."""
    within: Bool[Tensor, "2 192"]
    """Whether all cells around an edge are in the same block, and in the same eighth."""


@dataclass(frozen=True, slots=True)
class _Parts:
    """Parts of the surface, one or more in each cell that it passes through."""

    block: Int32[Tensor, " parts"]
    eighth: Int32[Tensor, " parts"]
    flat: tuple[Bool[Tensor, " blocks"], Bool[Tensor, " eighths"]]
    known: Int32[Tensor, " cells"]
    """Number of each cell's first part, times 256, plus the case."""

    def vertices(self) -> Int32[Tensor, " parts"]:
        """Return the vertex of each part."""
        count, blocks = len(self.block), len(self.flat[0])
        found = torch.arange(count, dtype=torch.int32)
        found = torch.where(at(self.flat[1], self.eighth), count + blocks + self.eighth, found)
        found = torch.where(at(self.flat[0], self.block), count + self.block, found)
        used = torch.zeros(count + 9 * blocks, dtype=torch.int32).index_fill_(0, found.long(), 1)
        return at(used.cumsum(0, dtype=torch.int32) - 1, found)


def gathered_surface(
    values: Float[Tensor, "blocks 125"],
    cases: UInt8[Tensor, "blocks 64"],
    place: Int64[Tensor, "blocks 3"],
    count: int,
    *,
    least: int = 0,
) -> tuple[Float[np.ndarray, "vertices 3"], Int64[np.ndarray, "faces 3"]]:
    """Return a surface like that of ``march``, in the same bounds, with much fewer triangles.

    Each part of the surface in a cell has a vertex, in the middle of where it crosses edges, and
    around each crossed edge there is a quad, cut in two (dual marching cubes: Nielson 2004). Where
    the surface is flat, 64 or 8 cells have one vertex. Some edges may have more than two
    triangles, always as many on one side as on the other.

    Args:
        values: This and the others are what ``march`` takes.
        cases: Of the cells.
        place: Of the blocks.
        count: Blocks along each axis of the grid.
        least: Triangles. If there would be fewer, only eighths are taken for flat, then nothing.
    """
    tables = _tables()
    values, cases, place = values.cpu(), cases.cpu(), place.cpu()
    points, block, edge, rises = crossings(values, place)
    steps = torch.tensor([(CELLS * count) ** 2, CELLS * count, 1])
    # numbers of 32 bits: half of the memory
    base, local = ((first * steps).sum(1).int() for first in (CELLS * place, tables.cells))
    parts = _parts(values, cases, base, local, (CELLS * count) ** 3)
    axis, cell = edge >> _BITS, edge & (_OWN - 1)
    start = at(base, block) + at(local, cell)
    eighth = 8 * block + at(tables.eighth, cell)
    inner = [at(within, edge) for within in tables.within]
    around = (tables.around * steps).sum(2).int()
    blocks, eighths = parts.flat
    none = torch.zeros_like(blocks), torch.zeros_like(eighths)
    for flat in ((blocks, eighths), (none[0], eighths), none):
        parts = replace(parts, flat=flat)
        # edges within a cube that has one vertex are not seen
        gone = inner[0] & at(flat[0], block) | inner[1] & at(flat[1], eighth)
        seen = numbers_of(~gone)
        along = at(axis, seen)
        found = at(parts.known, at(start, seen)[:, None] + around.index_select(0, along))
        number = (found & ALL_INSIDE) * len(EDGES) + tables.number.index_select(0, along)
        corner = at(parts.vertices(), (found >> 8) + at(tables.loop, number))
        faces = _triangles(corner, at(rises, seen))
        if len(faces) >= least:
            break
    mean = _means(corner, points.index_select(0, seen))
    used = np.zeros(len(mean), bool)
    used[faces] = True
    bounds = torch.stack(points.aminmax(dim=0)).numpy()
    return fitted(mean.compress(used, axis=0), bounds), (used.cumsum() - 1).take(faces)


def _parts(
    values: Float[Tensor, "blocks 125"],
    cases: UInt8[Tensor, "blocks 64"],
    base: Int32[Tensor, " blocks"],
    local: Int32[Tensor, " 64"],
    cells: int,
) -> _Parts:
    """Return the parts of the surface.

    Args:
        values: At the nodes.
        cases: Of the cells.
        base: Number of each block's first cell in the grid.
        local: What is added for the others.
        cells: Of the grid.
    """
    tables = _tables()
    number = numbers_of(mixed(cases)).int()
    block, cell = number >> _BITS, number & (_OWN - 1)
    eighth = 8 * block + at(tables.eighth, cell)
    case = at(cases, number).int()
    count = at(tables.parts, case)
    place = cell * len(values) + block
    x, y, z = (at(slope, place) for slope in _slopes(values))
    length = (x * x + y * y + z * z).sqrt_().clamp_min_(1e-9)
    normal = [along / length for along in (x, y, z)]
    # where a cell has several parts nothing is flat
    least = torch.where(count == 1, 1.0, torch.inf)
    flat = []
    for cube, share, cubes in ((block, _FLAT[0], len(base)), (eighth, _FLAT[1], 8 * len(base))):
        total = [torch.bincount(cube, along, cubes).square_() for along in normal]
        flat.append(sum(total) > (share * torch.bincount(cube, least, cubes)).square_())
    known = torch.zeros(cells, dtype=torch.int32)
    place = at(base, block) + at(local, cell)
    known[place.long()] = ((count.cumsum(0, dtype=torch.int32) - count) << 8) + case
    eighth = eighth.repeat_interleave(count)
    return _Parts(eighth >> 3, eighth, (flat[0], flat[1]), known)


def _slopes(values: Float[Tensor, "blocks 125"]) -> tuple[Float[Tensor, "4 4 4 blocks"], ...]:
    """Return four times the slopes along each axis in the middle of each cell."""
    # block beside block: many at once
    x = values.t().contiguous().view(*(CELLS + 1,) * 3, len(values))
    along, across = x[:, :, 1:] + x[:, :, :-1], x[:, :, 1:] - x[:, :, :-1]
    both, y = along[:, 1:] + along[:, :-1], along[:, 1:] - along[:, :-1]
    z = across[:, 1:] + across[:, :-1]
    return both[1:] - both[:-1], y[1:] + y[:-1], z[1:] + z[:-1]


def _triangles(
    corner: Int32[Tensor, "quads 4"], rises: Bool[Tensor, " quads"]
) -> Int64[np.ndarray, "faces 3"]:
    """Return two triangles of each quad, as far as they have an area."""
    one, two, three, four = corner.t().contiguous()
    two, four = torch.where(rises, two, four), torch.where(rises, four, two)
    found = []
    for triangle in ((one, two, three), (one, three, four)):
        a, b, c = triangle
        some = numbers_of((a != b) & (b != c) & (c != a))
        found.append(torch.stack([at(part, some) for part in triangle], 1))
    return unfolded(torch.cat(found).numpy())


def _means(
    corner: Int32[Tensor, "quads 4"], points: Float[Tensor, "quads 3"]
) -> Float[np.ndarray, "vertices 3"]:
    """Return the middle of the points of each vertex."""
    member = corner.flatten()
    size = torch.bincount(member).clamp_(min=1)
    total = [torch.bincount(member, along.repeat_interleave(4)) for along in points.double().t()]
    return (torch.stack(total, 1) / size[:, None]).numpy()


@cache
def _tables() -> _Tables:
    axes = torch.eye(3, dtype=torch.int64)
    turns = ((1, 1), (0, 1), (0, 0), (1, 0))
    around = -torch.stack(
        [
            torch.stack([one * axes[axis - 2] + other * axes[axis - 1] for one, other in turns])
            for axis in range(3)
        ]
    )
    corner = {place: number for number, place in enumerate(CORNERS)}
    number = [
        [
            EDGES.index((corner[(*low,)], corner[(*high,)]))
            for low, high in zip(lows, highs, strict=True)
        ]
        for lows, highs in zip((-around).tolist(), (axes[:, None] - around).tolist(), strict=True)
    ]
    loop = torch.zeros(1 << 8, len(EDGES), dtype=torch.int32)
    rings = [case_loops(case) for case in range(len(loop))]
    for case, found in enumerate(rings):
        for place, ring in enumerate(found):
            loop[case, ring] = place
    cells = torch.cartesian_prod(*(torch.arange(CELLS),) * 3)
    across = axes.repeat_interleave(_OWN, 0) > 0
    first = cells.repeat(3, 1)
    return _Tables(
        cells=cells.int(),
        eighth=(cells // 2 * torch.tensor([4, 2, 1])).sum(1).int(),
        around=around.int(),
        number=torch.tensor(number).int(),
        loop=loop,
        parts=torch.tensor([len(found) for found in rings]).int(),
        within=torch.stack([(across | (first % size > 0)).all(1) for size in (CELLS, 2)]),
    )
