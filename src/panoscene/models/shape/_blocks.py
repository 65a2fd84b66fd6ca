"""Grids that are fine only near the surface: blocks of 4 x 4 x 4 cells that it passes through."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import product

import torch
from jaxtyping import Bool, Float, Int8, Int64, UInt8
from torch import Tensor
from torch.nn import functional as F

from ._cubes import ALL_INSIDE, CELLS, at, cell_cases, mixed, numbers_of

TOLERANCE = 0.1
"""Error of parabolas that is let pass, in differences within a cell."""
GAIN = 4.0
"""Parabolas on half as large cells are better by at least this, in smooth places by 8."""
_LEAST = 1e-4
"""Value, or less it, of nodes that have to be outside or inside and are not."""
_NODES = CELLS + 1

Evaluate = Callable[[Int64[Tensor, " n"]], Float[Tensor, " n"]]
"""Exact values at nodes of the finer grid, by their numbers in it."""


@dataclass(frozen=True, slots=True)
class Blocks:
    """Those blocks of a grid in which the surface is."""

    values: Float[Tensor, "blocks 125"]
    """At the nodes; below 0 inside. Blocks side by side have the same there."""
    cases: UInt8[Tensor, "blocks 64"]
    """Of the cells; see ``cell_cases``."""
    error: Float[Tensor, "blocks 64"]
    """In each cell, expected of parabolas; infinite where nothing is known."""
    place: Int64[Tensor, "blocks 3"]
    sides: Int8[Tensor, "n n n"]
    """Of each cell of the grid, and one more all around: -1 inside, 1 outside, 0 both."""
    rim: int
    """Cells along the border, if any, in which the field is as at their inner end. Their nodes but
    those there are outside."""


@dataclass(frozen=True, slots=True)
class _Tables:
    """Constants in memory of a device. A part is an eighth of a block: one that comes of it."""

    parts: Int64[Tensor, "8 27"]
    """Nodes of each part."""
    cells: Int64[Tensor, "8 8"]
    """Cells of each part."""
    eighth: Int64[Tensor, " 64"]
    """The part that each cell comes of."""
    corners: Int64[Tensor, "8 8"]
    """Nodes, of the 27, of each of the eight cells of a part."""
    steps: Int64[Tensor, "8 3"]
    own: Int64[Tensor, " 64"]
    """Nodes that are on no upper side: each node of a grid is one of them in one block."""
    between: Float[Tensor, "27 125"]
    """Parabolas through three nodes, axis by axis."""
    fresh: Float[Tensor, "8 125"]
    """Which nodes each of eight cells gets when it is divided."""
    around: Int64[Tensor, "64 3"]
    touching: Float[Tensor, "64 125"]
    """Which nodes eight cells and those around them have, once divided."""


def first_blocks(
    values: Float[Tensor, "n n n"], error: Float[Tensor, "c c c"], *, rim: bool = False
) -> Blocks:
    """Return the blocks of a grid, of which all nodes on the border are outside.

    Args:
        values: On a multiple of four cells along each axis.
        error: In each cell, expected of parabolas.
        rim: Whether the field beyond the nodes beside the border is as at those.
    """
    count = len(error) // CELLS
    cases = cell_cases(_in_blocks(values) < 0)
    if rim:
        # parabolas are to go on across the nodes beside the border
        values = with_border(values, (3.0, -3.0, 1.0))
    wide = _in_blocks(values)
    for axis in range(3):
        error = error.unfold(axis, CELLS, CELLS)
    ticks = torch.arange(count, device=values.device)
    place = torch.cartesian_prod(ticks, ticks, ticks)
    sides = values.new_ones((count * CELLS + 2,) * 3, dtype=torch.int8)
    _mark(sides, place, cases)
    some = numbers_of(mixed(cases).any(1))
    error = error.flatten(3).flatten(0, 2)
    parts = (part.index_select(0, some) for part in (wide, cases, error, place))
    return Blocks(*parts, sides, int(rim))


def with_border(
    values: Float[Tensor, "n n n"], weights: tuple[float, ...], *, first: int = 1
) -> Float[Tensor, "n n n"]:
    """Return values with those on the border made of those within it, axis by axis.

    Args:
        values: At the nodes of a grid.
        weights: Of nodes one behind the other, inwards.
        first: The one that the first weight is for; 0 is on the border.
    """
    values = values.clone()
    for axis in range(3):
        for end, step in ((0, 1), (-1, -1)):
            rows = [values.select(axis, end + step * (first + k)) for k in range(len(weights))]
            made = torch.stack(rows, -1) @ values.new_tensor(weights)
            values.select(axis, end).copy_(made)
    return values


def finer_blocks(blocks: Blocks, evaluate: Evaluate, *, last: bool = False) -> Blocks:
    """Return blocks of half the size, on twice as many cells along each axis.

    Values at new nodes are those of parabolas where they are known to be good enough, else exact.
    Nodes of cells that are all inside or all outside stay so.

    Args:
        blocks: Of the coarser grid.
        evaluate: Gives exact values.
        last: Whether nothing needs to be known of errors and sides any more: they are those of
            the coarser grid.
    """
    tables = _tables(blocks.values.device)
    block, part = mixed(blocks.cases)[:, tables.cells].any(2).nonzero().unbind(1)
    values = at(blocks.values, 125 * block[:, None] + tables.parts.index_select(0, part))
    known = at(blocks.error, 64 * block[:, None] + tables.cells.index_select(0, part))
    place = 2 * blocks.place.index_select(0, block) + tables.steps.index_select(0, part)
    corners = _columns(values, tables.corners)
    differ = (corners.amax(1) - corners.amin(1)).t()
    # where only the border is outside, it is the surface: no value is needed
    border = _outer(2 * place, 3, len(blocks.sides) - 2, max(blocks.rim, 1))
    most = _columns(values.masked_fill(border, -torch.inf), tables.corners).amax(1).t()
    least = _columns(values.masked_fill(border, torch.inf), tables.corners).amin(1).t()
    rough = (least < 0) & (most >= 0) & (known > TOLERANCE * differ)

    cells, rim = 2 * (len(blocks.sides) - 2), 2 * blocks.rim
    own = _numbers(CELLS * place, cells + 1)
    index = _numbers(CELLS * place, cells + 1, rim) if rim else own
    grid = _Sparse(values.new_zeros((cells + 1) ** 3), own, index)
    guess = values @ tables.between
    grid.values.index_copy_(0, own.flatten(), guess.flatten())
    if rim:
        guess = at(grid.values, index)
    found = _exact(grid, rough, tables, evaluate)
    around = _flat(2 * place, tables.around, len(blocks.sides))
    side = at(blocks.sides, around).to(values) @ tables.touching
    found = torch.where(side > 0, found.clamp(min=_LEAST), found)
    found = torch.where(side < 0, found.clamp(max=-_LEAST), found)
    error = known
    if not last:
        away = _columns((found - guess).abs_(), tables.parts).amax(1).t()
        error = torch.where(rough, away / GAIN, known)
    error = error.index_select(1, tables.eighth)
    if rim:
        border = _outer(CELLS * place, _NODES, cells, rim)
        found = torch.where(border, found.clamp(min=_LEAST), found)
    cases = cell_cases(found < 0)
    sides = blocks.sides
    if not last:
        sides = sides[1:-1, 1:-1, 1:-1]
        for axis in range(3):
            sides = sides.repeat_interleave(2, axis)
        sides = F.pad(sides, (1,) * 6, value=1)
        _mark(sides, place, cases)
    return Blocks(found, cases, error, place, sides, rim)


@dataclass(frozen=True, slots=True)
class _Sparse:
    """A grid of which only some blocks have values."""

    values: Float[Tensor, " nodes"]
    own: Int64[Tensor, "blocks 125"]
    """Of the nodes of each block."""
    index: Int64[Tensor, "blocks 125"]
    """Where their values are: for those in the rim, at its inner end."""


def _exact(
    grid: _Sparse, rough: Bool[Tensor, "blocks 8"], tables: _Tables, evaluate: Evaluate
) -> Float[Tensor, "blocks 125"]:
    """Return values of a grid after those in rough cells have been made exact."""
    wanted = torch.zeros_like(grid.values, dtype=torch.bool)
    fresh = numbers_of(rough.to(grid.values) @ tables.fresh > 0)
    wanted.index_fill_(0, at(grid.index, fresh), True)
    own = grid.own.index_select(1, tables.own)
    # block after block: points that come one after the other are close together
    place = at(own, numbers_of(at(wanted, own)))
    grid.values.index_copy_(0, place, evaluate(place))
    return at(grid.values, grid.index)


def _in_blocks(values: Float[Tensor, "n n n"]) -> Float[Tensor, "blocks 125"]:
    """Return the nodes of all blocks of a grid."""
    for axis in range(3):
        values = values.unfold(axis, _NODES, CELLS)
    return values.flatten(3).flatten(0, 2)


def _outer(
    first: Int64[Tensor, "blocks 3"], side: int, cells: int, rim: int
) -> Bool[Tensor, "blocks nodes"]:
    """Return which nodes, so many along each axis from the first, are less than the rim within."""
    ticks = first[..., None] + torch.arange(side, device=first.device)
    x, y, z = ((ticks < rim) | (ticks > cells - rim)).unbind(1)
    return (x[:, :, None, None] | y[:, None, :, None] | z[:, None, None]).flatten(1)


def _numbers(
    first: Int64[Tensor, "blocks 3"], count: int, rim: int = 0
) -> Int64[Tensor, "blocks 125"]:
    """Return the numbers of nodes of blocks in a grid; of those in the rim, of its inner end."""
    ticks = first[..., None] + torch.arange(_NODES, device=first.device)
    x, y, z = ticks.clamp(rim, count - 1 - rim).unbind(1)
    plane = (x * count)[:, :, None] + y[:, None]
    return ((plane * count)[..., None] + z[:, None, None]).flatten(1)


def _columns(
    values: Float[Tensor, "blocks nodes"], chosen: Int64[Tensor, "n m"]
) -> Float[Tensor, "n m blocks"]:
    """Return columns, as rows: numbers that are worked on together lie side by side."""
    return values.t().contiguous().index_select(0, chosen.flatten()).view(*chosen.shape, -1)


def _mark(
    sides: Int8[Tensor, "n n n"],
    place: Int64[Tensor, "blocks 3"],
    cases: UInt8[Tensor, "blocks 64"],
) -> None:
    """Write the sides of all cells of some blocks."""
    ticks = torch.arange(1, CELLS + 1, device=place.device)
    index = _flat(CELLS * place, torch.cartesian_prod(ticks, ticks, ticks), len(sides))
    side = (cases == 0).to(sides) - (cases == ALL_INSIDE).to(sides)
    sides.view(-1).index_copy_(0, index.flatten(), side.flatten())


def _flat(
    first: Int64[Tensor, "n 3"], more: Int64[Tensor, "m 3"], count: int
) -> Int64[Tensor, "n m"]:
    """Return numbers of places in a grid: each of the first and all those from there."""
    steps = torch.tensor([count * count, count, 1], device=first.device)
    return (first * steps).sum(1)[:, None] + (more * steps).sum(1)


@cache
def _tables(device: torch.device) -> _Tables:
    def places(count: int) -> Int64[Tensor, "n 3"]:
        return torch.tensor(list(product(range(count), repeat=3)))

    halves, nodes = places(2), places(_NODES)
    along = torch.zeros(3, _NODES)
    along[[0, 1, 2], [0, 2, 4]] = 1
    along[:, 1] = torch.tensor([0.375, 0.75, -0.125])
    along[:, 3] = along[:, 1].flip(0)
    between = torch.einsum("ax,by,cz->abcxyz", along, along, along)
    low = 2 * halves[:, None]
    within = ((nodes >= low) & (nodes <= low + 2)).all(2)
    around = places(4)
    start = 2 * (around[:, None] - 1)
    touching = ((nodes >= start) & (nodes <= start + 2)).all(2)
    found = _Tables(
        parts=_flat(2 * halves, places(3), _NODES),
        cells=_flat(2 * halves, halves, CELLS),
        eighth=_flat(torch.zeros(1, 3, dtype=torch.int64), places(CELLS) // 2, 2)[0],
        corners=_flat(halves, halves, 3),
        steps=halves,
        own=_flat(torch.zeros(1, 3, dtype=torch.int64), places(CELLS), _NODES)[0],
        between=between.reshape(27, -1),
        fresh=(within & (nodes % 2 > 0).any(1)).float(),
        around=around,
        touching=touching.float(),
    )
    return _Tables(*(getattr(found, name).to(device) for name in _Tables.__slots__))
