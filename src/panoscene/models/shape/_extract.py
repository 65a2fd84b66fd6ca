"""Surfaces of fields: marching cubes on grids that are fine only near the surface."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import torch
from jaxtyping import Bool, Float
from scipy import ndimage
from torch import Tensor

from panoscene.scene import Mesh

from ._config import ISO_LEVEL
from ._fast_field import FastField, fast_field
from ._network import ShapeNetwork

COARSEST = 32
"""Cells along each axis of the grid that is evaluated everywhere."""
_CRUMB = 0.02
_OUTSIDE = 0.01


@torch.inference_mode()
def extract_meshes(
    network: ShapeNetwork, code: Float[Tensor, "shapes code"], *, resolution: int = 64
) -> tuple[Mesh | None, ...]:
    """Return the surface of each shape, fitted to the canonical box [-1/2, 1/2]^3.

    The field is evaluated on 32 cells along each axis; cells that the surface passes through are
    divided until the resolution is reached (marching cubes: Lorensen and Cline 1987). Shapes are
    worked on side by side, as many as PyTorch has threads. Loose pieces of less than 2 percent of
    the volume are left out.

    Args:
        network: In evaluation mode.
        code: Of the shapes.
        resolution: Cells along each axis: 32, 64, 128 or 256.

    Returns:
        Closed meshes, faces counter-clockwise from outside; None where nothing is inside.

    Raises:
        ValueError: ``resolution`` is not 32 times a power of two, or above 256.
    """
    if resolution not in (32, 64, 128, 256):
        raise ValueError(f"resolution: found {resolution}, expected 32, 64, 128 or 256")
    if len(code) == 0:
        return ()
    field = fast_field(network, network.elements(code))
    config = network.config

    @torch.inference_mode()
    def surface(index: int) -> Mesh | None:
        values = _everywhere(field, index, config.reach)
        level, filled = _level(values, config)
        return _mesh(_refined(field, index, values, level, resolution), config.reach, fit=filled)

    if len(code) == 1 or torch.get_num_threads() == 1:
        return tuple(surface(index) for index in range(len(code)))
    with ThreadPoolExecutor(torch.get_num_threads()) as pool:
        return tuple(pool.map(surface, range(len(code))))


def _everywhere(field: FastField, index: int, reach: float) -> Float[Tensor, "n n n"]:
    """Return the field of one shape at all nodes of the coarsest grid."""
    axis = _axis(COARSEST + 1, reach, field.polynomial)
    values = field(index, torch.cartesian_prod(axis, axis, axis))
    return values.reshape(COARSEST + 1, COARSEST + 1, COARSEST + 1)


def _level(values: Float[Tensor, "n n n"], config: ShapeConfig) -> tuple[float, bool]:
    """Return the value on the surface, and whether the mesh is to be fitted to the box.

    A shape touches all sides of its box. Where the network works in the box and is so unsure of
    legs that none are left, a level nearer to 0 brings them back.
    """
    if config.frame == "longest":
        return ISO_LEVEL, True
    step = 2 * config.reach / (len(values) - 1)
    best, most = ISO_LEVEL, 0.0
    for level in _LEVELS:
        inside = values < level
        if bool(inside.any()):
            low, high = _bounds(inside)
            share = min(stop - start - 2 for start, stop in zip(low, high, strict=True)) * step
            if share >= _FILLED:
                return level, True
            if share > most + step:
                best, most = level, share
    return best, False


def _refined(
    field: FastField, index: int, values: Float[Tensor, "n n n"], level: float, resolution: int
) -> Float[Tensor, "m m m"]:
    """Return the field less its value on the surface, exact near the surface."""
    reach = -float(field.polynomial.new_zeros(())) if False else _reach_of(field)
    values = values - level
    _close(values)
    values = _without_crumbs(values)
    while len(values) <= resolution:
        values = _finer(field, index, values, level)
        _close(values)
    return values


def _axis(nodes: int, reach: float, like: Tensor) -> Float[Tensor, " nodes"]:
    return torch.linspace(-reach, reach, nodes, dtype=like.dtype, device=like.device)


def _close(values: Float[Tensor, "n n n"]) -> None:
    """Let the outermost nodes be outside, so that every surface is closed."""
    for axis in range(3):
        for end in (0, -1):
            values.select(axis, end).clamp_(min=_OUTSIDE)


def _without_crumbs(values: Float[Tensor, "n n n"]) -> Float[Tensor, "n n n"]:
    """Return the field with small loose pieces taken out."""
    inside = (values < 0).cpu().numpy()
    label = np.asarray(ndimage.label(inside, np.ones((3, 3, 3), bool))[0])
    size = np.bincount(label.ravel())
    size[0] = 0
    crumb = inside & (size < _CRUMB * size.sum())[label]
    if not crumb.any():
        return values
    return torch.where(torch.from_numpy(crumb).to(values.device), values.abs() + 1e-6, values)


def _finer(
    field: FastField, index: int, values: Float[Tensor, "n n n"], reach: float
) -> Float[Tensor, "m m m"]:
    """Return the field on twice as many cells: new where the surface passes, else a neighbour's."""
    nodes = 2 * len(values) - 1
    doubled = values[:, None, :, None, :, None].expand(-1, 2, -1, 2, -1, 2)
    finer = doubled.reshape(nodes + 1, nodes + 1, nodes + 1)[:nodes, :nodes, :nodes].contiguous()
    wanted = _nodes_of(_crossed(values), nodes)
    wanted[::2, ::2, ::2] = False
    place = wanted.flatten().nonzero()[:, 0]
    axis = _axis(nodes, reach, values)
    x, y, z = place // (nodes * nodes), place // nodes % nodes, place % nodes
    fresh = field(index, torch.stack((axis[x], axis[y], axis[z]), 1)) - ISO_LEVEL
    finer.view(-1).index_copy_(0, place, fresh)
    return finer


def _crossed(values: Float[Tensor, "n n n"]) -> Bool[Tensor, "m m m"]:
    """Return the cells with corners on both sides of the surface."""
    least = most = values < 0
    for axis in range(3):
        count = least.shape[axis] - 1
        pairs = [
            (part.narrow(axis, 0, count), part.narrow(axis, 1, count)) for part in (least, most)
        ]
        least, most = pairs[0][0] & pairs[0][1], pairs[1][0] | pairs[1][1]
    return least != most


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


def _mesh(values: Float[Tensor, "n n n"]) -> Mesh | None:
    """Return the zero level of a grid, fitted to the canonical box."""
    from skimage.measure import marching_cubes  # noqa: PLC0415 (it takes a second)

    inside = values < 0
    if not bool(inside.any()):
        return None
    low, high = _bounds(inside)
    part = values[low[0] : high[0], low[1] : high[1], low[2] : high[2]]
    vertices, faces, _, _ = marching_cubes(
        part.cpu().numpy(), 0.0, gradient_direction="descent", allow_degenerate=False
    )
    found = torch.from_numpy(vertices.copy())
    first, last = found.amin(0), found.amax(0)
    return Mesh((found - (first + last) / 2) / (last - first), torch.from_numpy(faces).long())


def _bounds(inside: Bool[Tensor, "n n n"]) -> tuple[list[int], list[int]]:
    """Return the first node and the one behind the last, with one node outside around."""
    low: list[int] = []
    high: list[int] = []
    for axis in range(3):
        others = [k for k in range(3) if k != axis]
        used = inside.any(others[1]).any(others[0]).nonzero()[:, 0]
        low.append(int(used[0]) - 1)
        high.append(int(used[-1]) + 2)
    return low, high
