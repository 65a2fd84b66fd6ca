"""The field at very many points of many shapes: only elements that matter there are decoded."""

from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, Int64
from torch import Tensor

from ._cubes import numbers_of
from ._elements import Elements
from ._network import ShapeNetwork

NEGLIGIBLE = 2e-3
"""Elements whose Gaussian times constant is smaller at all points of a group are left out there."""
_GROUP = 32
"""Neighbouring points that are worked on together."""
_ROWS, _BLOCKS = 8, 128
"""Groups of one element in a block, and blocks worked on together: as the cache of a core holds."""
_POINTS = 65_536


@dataclass(frozen=True, slots=True)
class FastField:
    """Shapes in a form that is quick to evaluate.

    The exponents of all Gaussians at a point are one matrix product: they are polynomials of the
    second degree. They tell which elements matter, and are used again for those that do. The first
    layer of the local decoder is linear, and so is what goes past the others; each layer is merged
    with the normalisations around it.
    """

    polynomial: Float[Tensor, "shapes elements 10"]
    """Exponents plus the logarithm of the constant: above 0 where an element matters."""
    enter: Float[Tensor, "shapes elements width_and_2 4"]
    """From a point to the first layer, 1, and the linear part of the result."""
    middle: Float[Tensor, "shapes elements width width_and_1"]
    leave: Float[Tensor, "shapes elements 1 width"]
    """Weights of the middle layer in the result."""

    def __call__(self, shape: int, points: Float[Tensor, "n 3"]) -> Float[Tensor, " n"]:
        """Return the field of one shape.

        Args:
            shape: Number of the shape.
            points: In the network's frame; the closer those behind one another, the better.
        """
        if len(points) == 0:
            return points.new_zeros(0)
        return torch.cat([self._together(shape, some) for some in points.split(_POINTS)])

    def _together(self, shape: int, points: Float[Tensor, "n 3"]) -> Float[Tensor, " n"]:
        """Return the field of one shape: elements that matter to a group are added to all of it."""
        terms = _terms(points, -len(points) % _GROUP + _GROUP)
        exponents = (self.polynomial[shape] @ terms).unflatten(-1, (-1, _GROUP))
        element, group = _in_blocks(exponents.amax(-1)[:, :-1] > 0)
        place = terms[6:].unflatten(-1, (-1, _GROUP))
        found = terms.new_zeros(place.shape[1:])
        row = (element * len(found)).repeat_interleave(_ROWS) + group
        exponents = exponents.flatten(0, 1)
        width = self.middle.shape[-2]
        parts = (self.enter[shape], self.middle[shape], self.leave[shape])
        size = _BLOCKS * _ROWS
        for number, near, which in zip(
            element.split(_BLOCKS), group.split(size), row.split(size), strict=True
        ):
            enter, middle, leave = (part.index_select(0, number) for part in parts)
            here = place.index_select(1, near).view(4, len(number), _ROWS * _GROUP)
            first = enter @ here.transpose(0, 1)
            hidden = first[:, : width + 1].relu_()
            second = (middle @ hidden).relu_()
            value = torch.baddbmm(first[:, width + 1 :], leave, second).view(-1, _GROUP)
            value *= exponents.index_select(0, which).exp_()
            found.index_add_(0, near, value)
        return found.flatten()[: len(points)]


def _in_blocks(
    active: Bool[Tensor, "elements groups"],
) -> tuple[Int64[Tensor, " blocks"], Int64[Tensor, " rows"]]:
    """Return the element of each block, and its groups: as many in all, a spare one fills up."""
    number = numbers_of(active)
    element = number // active.shape[1]
    group = number - element * active.shape[1]
    count = torch.bincount(element, minlength=len(active))
    blocks = (count + _ROWS - 1) // _ROWS
    skipped = (blocks.cumsum(0) - blocks) * _ROWS - (count.cumsum(0) - count)
    row = torch.arange(len(group), device=group.device) + skipped.index_select(0, element)
    number = torch.arange(len(count), device=group.device).repeat_interleave(blocks)
    rows = group.new_full((len(number) * _ROWS,), active.shape[1])
    return number, rows.index_copy_(0, row, group)


def _terms(points: Float[Tensor, "n 3"], more: int) -> Float[Tensor, "10 n_and_more"]:
    """Return what polynomials of the second degree are made of; the last point comes again."""
    found = points.new_ones(10, len(points) + more)
    place = found[6:9]
    place[:, : len(points)] = points.t()
    if more:
        place[:, len(points) :] = points[-1:].t()
    torch.mul(place, place, out=found[:3])
    torch.mul(place[:1], place[1:], out=found[3:5])
    torch.mul(place[1], place[2], out=found[5])
    return found


def fast_field(network: ShapeNetwork, elements: Elements) -> FastField:
    """Return shapes ready for evaluation at many points.

    Args:
        network: Whose elements they are; the running values of its norms are used.
        elements: Of the shapes.
    """
    decoder = network.decoder
    matrix = elements.local_from_shape
    moved = (matrix @ elements.centre[..., None])[..., 0]
    square = matrix.transpose(-1, -2) @ matrix
    linear = -2 * (matrix.transpose(-1, -2) @ moved[..., None])[..., 0]
    limit = 2 * (elements.constant.abs().clamp(min=1e-12) / NEGLIGIBLE).log()
    polynomial = -0.5 * torch.stack(
        (square[..., 0, 0], square[..., 1, 1], square[..., 2, 2],
         2 * square[..., 0, 1], 2 * square[..., 0, 2], 2 * square[..., 1, 2],
         linear[..., 0], linear[..., 1], linear[..., 2],
         moved.square().sum(-1) - limit), -1,
    )  # fmt: skip
    g1, b1, g2, b2, g3, b3 = decoder.modulation(elements.latent).unbind(-2)
    norms = (decoder.norm1, decoder.norm2, decoder.norm3)
    scale = [(norm.variance + 1e-5).rsqrt() for norm in norms]
    g1, g2, g3 = (gain * s for gain, s in zip((g1, g2, g3), scale, strict=True))
    b1, b2, b3 = (
        b - norm.mean * g for b, norm, g in zip((b1, b2, b3), norms, (g1, g2, g3), strict=True)
    )
    into, out = decoder.enter, decoder.leave.weight[0]
    local = into.weight @ matrix
    shift = into.bias - (into.weight @ moved[..., None])[..., 0]
    first = torch.cat((local * g1[..., None], (shift * g1 + b1)[..., None]), -1)
    weight = g3 * out
    straight = weight[..., None, :] @ first
    straight[..., -1] += (weight * decoder.outer.bias + b3 * out).sum(-1)[..., None]
    straight[..., -1] += decoder.leave.bias + 1
    one = torch.zeros_like(straight)
    one[..., -1] = 1
    middle = decoder.inner.weight * g2[..., :, None]
    bias = b2 + g2 * decoder.inner.bias
    # what an exponential is multiplied by, that of an exponent 0 being negligible
    return FastField(
        polynomial=polynomial,
        enter=torch.cat((first, one, -NEGLIGIBLE * straight), -2),
        middle=torch.cat((middle, bias[..., None]), -1),
        leave=-NEGLIGIBLE * (weight @ decoder.outer.weight)[..., None, :],
    )
