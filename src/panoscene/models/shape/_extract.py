"""Surfaces of fields: marching cubes on grids that are fine only near the surface."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import torch
from jaxtyping import Bool, Float, Int64
from scipy import ndimage
from torch import Tensor

from panoscene.scene import Mesh

from ._blocks import GAIN, Blocks, finer_blocks, first_blocks, with_border
from ._config import ISO_LEVEL, ShapeConfig
from ._cubes import CELLS, at, march, mixed, numbers_of
from ._fast_field import FastField, fast_field
from ._fewer import fewer_faces, simplified
from ._network import ShapeNetwork
from ._quads import gathered_surface
from ._threads import alone, side_by_side

COARSEST = 16
"""Cells along each axis of the grid that is evaluated everywhere."""
_MARGIN = 0.5
"""Where the surface may be: this times the differences within a cell, beside its values."""
_LEVELS = (ISO_LEVEL, -0.055, -0.04, -0.025)
_FILLED = 0.85
_CRUMB = 0.01
_OUTSIDE = 1e-4
"""Value of nodes on the border of the grid, at least: surfaces that reach it end there."""
_INNER = (slice(1, -1),) * 3
_CUT = 15 / 16
"""Where the box cuts off a solid, the field is asked so far within the border of the grid: of 32
cells to the nodes beside it. Beyond, it is as there."""
_ACROSS = (8 / 3, -2.0, 1 / 3)
"""Weights of nodes at 15, 14 and 12 in a parabola at 16."""
_DECIMALS = 4
"""Of vertices: a tenth of a millimetre for each metre, and files of half the size."""


@torch.inference_mode()
def extract_meshes(
    network: ShapeNetwork,
    code: Float[Tensor, "shapes code"],
    *,
    resolution: int = 64,
    most: int | None = None,
) -> tuple[Mesh | None, ...]:
    """Return the surface of each shape in the canonical box [-1/2, 1/2]^3.

    The field is evaluated on 16 cells along each axis, and on 32 where the surface may be; then
    only cells that the surface passes through are divided, until the resolution is reached
    (marching cubes: Lorensen and Cline 1987). Where parabolas through the values on the coarser
    grid are as good, to a tenth of a cell, they are taken instead of the field. Shapes are worked
    on side by side, as many as PyTorch has threads. Loose pieces of less than 1 percent of the
    volume are left out. Meshes are fitted to the box, axis by axis, as in the paper. A shape
    of a network that works in the box (``compact``) is drawn at a level above -0.07 when less would
    not fill the box; if that does not help, it stays where it is.

    Args:
        network: In evaluation mode.
        code: Of the shapes.
        resolution: Cells along each axis: 32, 64, 128 or 256.
        most: Triangles that a mesh should have at most; some keep more. Where it is flat cells
            have vertices in common, then edges are collapsed; vertices have four decimals. None
            keeps all.

    Returns:
        Closed meshes, faces counter-clockwise from outside; None where nothing is inside.

    Raises:
        ValueError: ``resolution`` is not 32 times a power of two, or above 256.
    """
    if resolution not in (32, 64, 128, 256):
        raise ValueError(f"resolution: found {resolution}, expected 32, 64, 128 or 256")
    if len(code) == 0:
        return ()
    config = network.config

    @torch.inference_mode()
    def surface(index: int) -> Mesh | None:
        return _surface(_Shape(field, index, config), config, resolution, most)

    with alone() as threads:
        field = fast_field(network, network.elements(code))
        if len(code) > 1:
            return side_by_side(surface, range(len(code)), threads)
    return (surface(0),)


@dataclass(frozen=True, slots=True)
class _Grid:
    """Values at the nodes of a grid, and how well parabolas through them do between them."""

    values: Float[Tensor, "n n n"]
    error: Float[Tensor, "c c c"]
    """In each cell, expected of parabolas; infinite where nothing is known."""


@dataclass(frozen=True, slots=True)
class _Shape:
    """One shape on grids."""

    field: FastField
    index: int
    config: ShapeConfig

    def axis(self, nodes: int) -> Float[Tensor, " nodes"]:
        """Return where the field is evaluated for the nodes along an axis."""
        like, reach = self.field.polynomial, self.config.reach
        places = torch.linspace(-reach, reach, nodes, dtype=like.dtype, device=like.device)
        return places.clamp(-_CUT * reach, _CUT * reach) if self.config.cut else places

    def everywhere(self) -> Float[Tensor, "m m m"]:
        """Return the field on 32 cells along each axis, on parabolas through those of 16."""
        order = _by_place(COARSEST + 1, self.field.polynomial.device)
        values = self.field.polynomial.new_empty(len(order))
        values[order] = self.on(COARSEST, order)
        values = values.reshape((COARSEST + 1,) * 3)
        if not self.config.cut:
            return _between(values)
        return with_border(_between(with_border(values, _ACROSS, first=0)), (1.0,))

    def on(self, cells: int, number: Int64[Tensor, " n"]) -> Float[Tensor, " n"]:
        """Return the field at some nodes of a grid."""
        nodes = cells + 1
        number = number.int()  # divided in half the time
        line = number // nodes
        plane = line // nodes
        ticks = torch.stack((plane, line - plane * nodes, number - line * nodes), 1)
        return self.field(self.index, at(self.axis(nodes), ticks))

    def near(self, guess: Float[Tensor, "m m m"], levels: tuple[float, ...]) -> _Grid:
        """Return the grid with exact values where the surfaces of rising levels may be."""
        least, most = _extremes(guess[::2, ::2, ::2])
        margin = _MARGIN * (most - least)
        cells = (least - margin < levels[-1]) & (most + margin > levels[0])
        nodes = len(guess)
        wanted = _nodes_of(cells, nodes)
        wanted[::2, ::2, ::2] = False
        wanted = _inner(wanted)
        order = _by_place(nodes, guess.device)
        place = at(order, numbers_of(at(wanted, order)))
        finer = guess.flatten().index_copy(0, place, self.on(nodes - 1, place)).view_as(guess)
        if self.config.cut:
            finer = with_border(finer, (1.0,))
        error = torch.where(cells, _most_of((guess - finer).abs_()) / GAIN, torch.inf)
        return _Grid(finer, _each_twice(error))


def _surface(shape: _Shape, config: ShapeConfig, resolution: int, most: int | None) -> Mesh | None:
    guess = shape.everywhere()
    grid = shape.near(guess, _LEVELS[:1])
    level, fitted, values = _level(grid.values, config)
    if not fitted:
        # the choice of another level needs exact values around all of them
        grid = shape.near(guess, _LEVELS)
        level, fitted, values = _level(grid.values, config)
    error = grid.error
    moved = _inner(values != grid.values - level)
    if bool(moved.any()):
        error = torch.where(_each_twice(_most_of(moved.to(values))) > 0, torch.inf, error)
    cells = len(grid.error)
    blocks = first_blocks(values, error, rim=config.cut and cells < resolution)
    if len(blocks.place) == 0:
        return None
    while cells < resolution:
        cells *= 2

        def exact(number: Int64[Tensor, " n"], cells: int = cells) -> Tensor:
            return shape.on(cells, number) - level

        blocks = finer_blocks(blocks, exact, last=cells == resolution)
    mesh = _mesh(blocks, cells // CELLS, most)
    vertices = mesh.vertices * (2 * config.reach / cells) - config.reach
    vertices = vertices.clamp(-config.surface_reach, config.surface_reach)
    if fitted:
        first, last = vertices.amin(0), vertices.amax(0)
        vertices = (vertices - (first + last) / 2) / (last - first)
    vertices = vertices.clamp(-0.5, 0.5)
    return Mesh(vertices if most is None else vertices.round(decimals=_DECIMALS), mesh.faces)


def _mesh(blocks: Blocks, count: int, most: int | None) -> Mesh:
    """Return the surface with about that many triangles; vertices in cells from the corner."""
    parts = blocks.values, blocks.cases, blocks.place, count
    # of marching cubes, a cell has two triangles
    if most is not None and int(mixed(blocks.cases).count_nonzero()) > most / 2:
        found = simplified(*gathered_surface(*parts, least=most), most)
        if found is not None:
            return Mesh(torch.from_numpy(found[0]).float(), torch.from_numpy(found[1]))
    vertices, faces = march(*parts)
    mesh = Mesh(vertices.cpu(), faces.cpu())
    return mesh if most is None else fewer_faces(mesh, most)


@cache
def _by_place(nodes: int, device: torch.device) -> Int64[Tensor, " n"]:
    """Return the nodes of a grid so that those behind one another are close (Morton 1966)."""
    ticks = torch.arange(nodes, device=device)
    spread = torch.stack([(ticks >> bit & 1) << 3 * bit for bit in range(nodes.bit_length())]).sum(
        0
    )
    x, y, z = torch.cartesian_prod(spread, spread, spread).unbind(1)
    return (x << 2 | y << 1 | z).argsort()


def _between(values: Float[Tensor, "n n n"]) -> Float[Tensor, "m m m"]:
    """Return values on twice as many cells, on parabolas through three nodes, axis by axis."""
    for axis in range(3):
        first, middle, last = _threes(values, axis)
        after = torch.add(first, last, alpha=-1 / 3).mul_(0.375).add_(middle, alpha=0.75)
        before = torch.add(last, first, alpha=-1 / 3).mul_(0.375).add_(middle, alpha=0.75)
        rows = torch.stack((first, after, middle, before), axis + 1).flatten(axis, axis + 1)
        end = values.narrow(axis, values.shape[axis] - 1, 1)
        values = torch.cat((rows, end), axis)
    return values


def _threes(values: Float[Tensor, "x y z"], axis: int) -> list[Float[Tensor, "p q r"]]:
    """Return the first, middle and last nodes of all two cells along an axis."""
    even = [slice(None)] * 3
    even[axis] = slice(None, None, 2)
    parts = [values.narrow(axis, first, values.shape[axis] - 2) for first in range(3)]
    return [part[tuple(even)] for part in parts]


def _most_of(values: Float[Tensor, "n n n"]) -> Float[Tensor, "c c c"]:
    """Return the greatest of the 27 values in each two by two by two cells."""
    for axis in range(3):
        first, middle, last = _threes(values, axis)
        values = torch.maximum(torch.maximum(first, middle), last)
    return values


def _each_twice(cells: Float[Tensor, "c c c"]) -> Float[Tensor, "d d d"]:
    """Return cells divided in eight."""
    count = 2 * len(cells)
    wide = cells[:, None, :, None, :, None].expand(-1, 2, -1, 2, -1, 2)
    return wide.reshape(count, count, count)


def _level(
    values: Float[Tensor, "n n n"], config: ShapeConfig
) -> tuple[float, bool, Float[Tensor, "n n n"]]:
    """Return the value on the surface, whether the mesh is to be fitted to the box, and the solid.

    A shape touches all sides of its box. Where the network works in the box and is so unsure of
    legs that none are left, a level nearer to 0 brings them back.
    """
    if config.frame == "longest":
        return ISO_LEVEL, True, _solid(values, ISO_LEVEL)[0]
    step = 2 * config.reach / (len(values) - 1)
    best, most, kept = ISO_LEVEL, 0.0, None
    for level in _LEVELS:
        solid, nodes = _solid(values, level)
        share = nodes * step
        if share >= _FILLED:
            return level, True, solid
        if kept is None or share > most + step:
            best, most, kept = level, share, solid
    return best, False, values if kept is None else kept


def _inner(nodes: Bool[Tensor, "n n n"]) -> Bool[Tensor, "n n n"]:
    """Return nodes without those on the border, which are outside whatever the field says."""
    found = torch.zeros_like(nodes)
    found[_INNER] = nodes[_INNER]
    return found


def _close(values: Float[Tensor, "n n n"]) -> None:
    """Let the outermost nodes be outside, so that every surface is closed."""
    for axis in range(3):
        for end in (0, -1):
            values.select(axis, end).clamp_(min=_OUTSIDE)


def _solid(values: Float[Tensor, "n n n"], level: float) -> tuple[Float[Tensor, "n n n"], int]:
    """Return the field less a level, closed, and with small loose pieces taken out.

    The other number is how many nodes are inside along the axis along which they are the fewest.
    """
    values = values - level
    _close(values)
    inside = (values < 0).cpu().numpy()
    bounds = _bounds(inside)
    if bounds is None:
        return values, 0
    label = np.zeros([part.stop - part.start for part in bounds], np.int32)
    count = ndimage.label(inside[bounds], np.ones((3, 3, 3), bool), output=label)
    if count > 1:
        size = np.bincount(label.ravel())
        size[0] = 0
        crumb = inside[bounds] & (size < _CRUMB * size.sum())[label]
        if crumb.any():
            part = values[bounds]
            some = torch.from_numpy(crumb).to(values.device)
            part.copy_(torch.where(some, part.abs() + 1e-6, part))
            inside[bounds] &= ~crumb
            bounds = _bounds(inside)
            if bounds is None:
                return values, 0
    return values, min(part.stop - part.start for part in bounds)


def _extremes(
    values: Float[Tensor, "n n n"],
) -> tuple[Float[Tensor, "m m m"], Float[Tensor, "m m m"]]:
    """Return the least and the greatest value at the corners of each cell."""
    least = most = values
    for axis in range(3):
        count = least.shape[axis] - 1
        least = torch.minimum(least.narrow(axis, 0, count), least.narrow(axis, 1, count))
        most = torch.maximum(most.narrow(axis, 0, count), most.narrow(axis, 1, count))
    return least, most


def _nodes_of(cells: Bool[Tensor, "m m m"], nodes: int) -> Bool[Tensor, "n n n"]:
    """Return the nodes that cells get when each is divided in eight."""
    found = cells
    for axis in range(3):
        shape = list(found.shape)
        shape[axis] = nodes
        wider = found.new_zeros(shape)
        for first in range(3):
            part = wider.narrow(axis, first, nodes - 2)
            steps = [slice(None)] * 3
            steps[axis] = slice(None, None, 2)
            part[tuple(steps)] |= found
        found = wider
    return found


def _bounds(inside: Bool[np.ndarray, "n n n"]) -> tuple[slice, slice, slice] | None:
    """Return from where to where nodes are inside; None if none is."""
    used = [np.flatnonzero(np.any(inside, others)) for others in ((1, 2), (0, 2), (0, 1))]
    if len(used[0]) == 0:
        return None
    x, y, z = (slice(int(line[0]), int(line[-1]) + 1) for line in used)
    return x, y, z
