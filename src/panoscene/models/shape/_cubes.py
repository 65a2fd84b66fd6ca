"""Marching cubes: which triangles a cube gets, and those of many cubes at once."""

from dataclasses import dataclass
from functools import cache
from itertools import pairwise, product

import numpy as np
import torch
from jaxtyping import Bool, Float, Int, Int32, Int64, UInt8
from torch import Tensor

CELLS = 4
"""Of a block, along each axis: it has one node more."""
ALL_INSIDE = 255
"""Case of a cell of which all corners are inside; 0 is that of one of which none is."""
_NODES = CELLS + 1
CORNERS = tuple(product((0, 1), repeat=3))
"""Of a cube."""
EDGES = tuple(
    (one, other)
    for one, other in product(range(8), repeat=2)
    if one < other and (one ^ other) in (1, 2, 4)
)
"""Of a cube, from corner to corner."""
_OWN = CELLS**3
_EDGES = 3 * _OWN
"""That a block owns."""
_STEPS = (_NODES * _NODES, _NODES, 1)
"""From a node to the next along each axis."""

Triangle = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class _Tables:
    """Constants of blocks of 4 x 4 x 4 cells, in memory of a device."""

    place: Float[Tensor, "125 3"]
    """Of each node."""
    owns: Bool[Tensor, " 125"]
    """Nodes from which a block owns edges: those on no upper side."""
    own: Int32[Tensor, " 125"]
    """Their numbers."""
    owner: Int64[Tensor, "64 12"]
    """For each edge of each cell, which of the eight blocks from here on upwards owns it."""
    owned: Int32[Tensor, "64 12"]
    """And its number there."""
    first: Int64[Tensor, " 256"]
    """Triangle of each case."""
    count: Int64[Tensor, " 256"]
    triangles: Int64[Tensor, "n 3"]
    """Edges on which they stand."""


def cell_cases(inside: Bool[Tensor, "blocks 125"]) -> UInt8[Tensor, "blocks 64"]:
    """Return the case of each cell of each block: a bit for each corner that is inside."""
    # block beside block: many at once
    found = inside.t().contiguous().to(torch.uint8).view(_NODES, _NODES, _NODES, len(inside))
    found = found[:, :, :-1] | found[:, :, 1:] << 1
    found = found[:, :-1] | found[:, 1:] << 2
    found = found[:-1] | found[1:] << 4
    return found.view(_OWN, len(inside)).t().contiguous()


def mixed(cases: UInt8[Tensor, "blocks cells"]) -> Bool[Tensor, "blocks cells"]:
    """Return in which cells the surface is."""
    return cases - 1 < ALL_INSIDE - 1  # 0 less 1 is 255 here


def march(
    values: Float[Tensor, "blocks 125"],
    cases: UInt8[Tensor, "blocks 64"],
    place: Int64[Tensor, "blocks 3"],
    count: int,
) -> tuple[Float[Tensor, "vertices 3"], Int64[Tensor, "faces 3"]]:
    """Return the surface between values below 0 and others; vertices in cells from the corner.

    Each crossing of an edge is one vertex, and on the side of a cube all cubes agree: corners that
    are inside are told apart where they meet only across. So surfaces are closed if values at the
    border are not below 0. They turn counter-clockwise as seen from the higher values.

    Args:
        values: At the nodes of blocks, which share those on their sides.
        cases: What ``cell_cases`` returns.
        place: Of the blocks. All that have a part of the surface must be there.
        count: Blocks along each axis of the grid.

    Source: Lorensen and Cline 1987.
    """
    tables = _tables(values.device)
    vertices, block, edge, _ = crossings(values, place)
    number = torch.zeros(len(values) * _EDGES, dtype=torch.int64, device=place.device)
    number[(block * _EDGES + edge).long()] = torch.arange(len(edge), device=place.device)

    index = place.new_zeros((count + 1,) * 3)
    index[place.unbind(1)] = torch.arange(len(place), device=place.device)
    upper = place[:, None] + torch.tensor(CORNERS, device=place.device)
    owners = (index[upper.unbind(2)] * _EDGES).to(torch.int32)
    cell = numbers_of(mixed(cases))
    case = at(cases, cell).long()
    block, cell = cell // _OWN, cell % _OWN
    owner = (block * 8)[:, None] + tables.owner.index_select(0, cell)
    edges = tables.owned.index_select(0, cell) + at(owners, owner)
    edges = at(number, edges)
    some = tables.count[case]
    row = torch.arange(len(case), device=case.device).repeat_interleave(some)
    skipped = at(tables.first, case) - (some.cumsum(0) - some)
    triangle = torch.arange(len(row), device=row.device) + at(skipped, row)
    corner = tables.triangles.index_select(0, triangle)
    return vertices, at(edges, (row * len(EDGES))[:, None] + corner)


def crossings(
    values: Float[Tensor, "blocks 125"], place: Int64[Tensor, "blocks 3"]
) -> tuple[
    Float[Tensor, "edges 3"],
    Int32[Tensor, " edges"],
    Int32[Tensor, " edges"],
    Bool[Tensor, " edges"],
]:
    """Return where edges are crossed, their blocks and numbers there, and which begin inside."""
    tables = _tables(values.device)
    inside = (values < 0).flatten()
    found = []
    for step in _STEPS:
        crossed = torch.zeros_like(inside)
        torch.ne(inside[:-step], inside[step:], out=crossed[:-step])
        crossed.view(-1, _NODES**3).logical_and_(tables.owns)
        found.append(numbers_of(crossed))
    node = torch.cat(found).int()  # half of the memory, and divided in half the time
    block = node // _NODES**3
    local = node - block * _NODES**3
    one = at(values, node)
    points = (place * float(CELLS)).index_select(0, block)
    points += tables.place.index_select(0, local)
    edge = at(tables.own, local)
    last = 0
    for axis, (step, some) in enumerate(zip(_STEPS, found, strict=True)):
        mine = slice(last, last + len(some))
        points[mine, axis] += one[mine] / (one[mine] - at(values, some + step))
        edge[mine] += axis * _OWN
        last += len(some)
    return points, block, edge, one < 0


def at(values: Tensor, index: Int[Tensor, "*batch"]) -> Tensor:
    """Return values by number; several times as quick as brackets."""
    return values.flatten().index_select(0, index.flatten()).view(index.shape)


@cache
def _tables(device: torch.device) -> _Tables:
    nodes = torch.cartesian_prod(*(torch.arange(_NODES),) * 3)
    cells = torch.cartesian_prod(*(torch.arange(CELLS),) * 3)
    corners = torch.tensor(CORNERS)
    owns = (nodes < CELLS).all(1)
    ends = torch.tensor(EDGES)
    low = cells[:, None] + corners[ends[:, 0]]
    axis = (corners[ends[:, 1]] - corners[ends[:, 0]]).argmax(1)
    behind = low // CELLS
    steps = torch.tensor([CELLS * CELLS, CELLS, 1])
    triangles = case_triangles()
    count = torch.tensor([len(found) for found in triangles])
    found = _Tables(
        place=nodes.float(),
        owns=owns,
        own=(owns.cumsum(0) - 1).int(),
        owner=(behind * torch.tensor([4, 2, 1])).sum(-1),
        owned=(axis * _OWN + (low % CELLS * steps).sum(-1)).int(),
        first=count.cumsum(0) - count,
        count=count,
        triangles=torch.tensor([triangle for found in triangles for triangle in found]),
    )
    return _Tables(*(getattr(found, name).to(device) for name in _Tables.__slots__))


@cache
def case_triangles() -> tuple[tuple[Triangle, ...], ...]:
    """Return the triangles of each of the 256 cases, as edges of the cube on which they stand."""
    return tuple(
        tuple(triangle for loop in case_loops(case) for triangle in _cut(loop))
        for case in range(256)
    )


@cache
def _sides() -> tuple[tuple[int, ...], ...]:
    """Return the corners of each side of the cube, counter-clockwise from outside."""
    found = []
    for axis, end in product(range(3), (0, 1)):
        ring = []
        for one, other in ((0, 0), (1, 0), (1, 1), (0, 1)):
            place = [0, 0, 0]
            place[axis], place[(axis + 1) % 3], place[(axis + 2) % 3] = end, one, other
            ring.append(CORNERS.index((place[0], place[1], place[2])))
        found.append(tuple(ring if end else reversed(ring)))
    return tuple(found)


def case_loops(case: int) -> list[list[int]]:
    """Return the rings of crossed edges around what is inside, counter-clockwise from outside."""
    following: dict[int, int] = {}
    for side in _sides():
        steps = [
            (EDGES.index((min(pair), max(pair))), case >> pair[1] & 1)
            for pair in pairwise((*side, side[0]))
            if (case >> pair[0] & 1) != (case >> pair[1] & 1)
        ]
        # from where the side's ring comes in to where it leaves next
        for number, (edge, enters) in enumerate(steps):
            if enters:
                following[edge] = steps[(number + 1) % len(steps)][0]
    found = []
    while following:
        ring = [next(iter(following))]
        while (edge := following.pop(ring[-1])) != ring[0]:
            ring.append(edge)
        found.append(ring)
    return found


def _cut(ring: list[int]) -> list[Triangle]:
    """Return triangles that fill a ring, with no line between them in a side of the cube.

    In a side the cube behind it could have the same line: an edge with four triangles.
    """
    if len(ring) == 3:
        return [(ring[0], ring[1], ring[2])]
    for number in range(len(ring)):
        one, middle, other = (ring[(number + k) % len(ring)] for k in range(3))
        if not _in_one_side(one, other):
            rest = _cut([edge for edge in ring if edge != middle])
            if rest:
                return [(one, middle, other), *rest]
    return []


def _in_one_side(one: int, other: int) -> bool:
    corners = {*EDGES[one], *EDGES[other]}
    return any(corners <= set(side) for side in _sides())


def numbers_of(chosen: Bool[Tensor, "*batch"]) -> Int64[Tensor, " n"]:
    """Return the numbers of what is true; in memory of the processor NumPy is quicker."""
    if chosen.device.type == "cpu":
        return torch.from_numpy(np.flatnonzero(chosen.numpy()))
    return chosen.flatten().nonzero()[:, 0]
