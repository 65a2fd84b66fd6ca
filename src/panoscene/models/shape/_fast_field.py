"""The field at very many points of many shapes: only elements that matter there are decoded."""

from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

from ._elements import Elements
from ._network import ShapeNetwork

NEGLIGIBLE = 1e-3
"""Elements whose Gaussian times constant is smaller at a point are left out there."""
_POINTS = 32_768


@dataclass(frozen=True, slots=True)
class FastField:
    """Shapes in a form that is quick to evaluate.

    The exponents of all Gaussians at a point are one matrix product: they are polynomials of the
    second degree. Each layer of the local decoder is merged with the normalisations around it.
    """

    polynomial: Float[Tensor, "shapes 10 elements"]
    """Exponents less the largest that is not negligible: negative where an element matters."""
    enter: Float[Tensor, "shapes elements 4 width"]
    """(x, y, z, 1) to the first layer."""
    middle: Float[Tensor, "shapes elements width width"]
    shift: Float[Tensor, "shapes elements width"]
    leave: Float[Tensor, "shapes elements 2 width"]
    """Weights of the first layer and of the middle one in the result."""
    added: Float[Tensor, "shapes elements"]
    """What the decoder gives besides."""

    def __call__(self, shape: int, points: Float[Tensor, "n 3"]) -> Float[Tensor, " n"]:
        """Return the field of one shape.

        Args:
            shape: Number of the shape.
            points: In the network's frame.
        """
        found = torch.zeros(len(points), dtype=points.dtype, device=points.device)
        for first in range(0, len(points), _POINTS):
            piece = slice(first, first + _POINTS)
            self._add(found[piece], shape, points[piece])
        return found

    def _add(self, found: Tensor, shape: int, points: Float[Tensor, "n 3"]) -> None:
        """Add the field of one shape at points, element by element."""
        x, y, z = points.unbind(-1)
        one = torch.ones_like(x)
        terms = torch.stack((x * x, y * y, z * z, x * y, x * z, y * z, x, y, z, one))
        exponent = self.polynomial[shape].t() @ terms
        element, place = (exponent < 0).nonzero(as_tuple=True)
        counts = torch.bincount(element, minlength=len(exponent)).tolist()
        # the exponent was moved so that it is 0 where an element becomes negligible
        blob = (-0.5 * exponent[element, place]).exp_().mul_(-NEGLIGIBLE)
        homogeneous = terms[6:].t().contiguous().index_select(0, place)
        detail = torch.zeros_like(blob)
        start = 0
        for index, count in enumerate(counts):
            if count:
                here = slice(start, start + count)
                first = homogeneous[here] @ self.enter[shape, index]
                weight, other = self.leave[shape, index]
                middle = torch.addmm(
                    self.shift[shape, index], first.relu(), self.middle[shape, index]
                ).relu_()
                torch.addmv(first @ weight, middle, other, out=detail[here])
                detail[here] += 1 + self.added[shape, index]
                start += count
        found.index_add_(0, place, detail.mul_(blob))


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
    polynomial = torch.stack(
        (square[..., 0, 0], square[..., 1, 1], square[..., 2, 2],
         2 * square[..., 0, 1], 2 * square[..., 0, 2], 2 * square[..., 1, 2],
         linear[..., 0], linear[..., 1], linear[..., 2],
         moved.square().sum(-1) - limit), 1,
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
    enter = torch.cat(
        ((local * g1[..., None]).transpose(-1, -2), (shift * g1 + b1)[..., None, :]), -2
    )
    weight = g3 * out
    leave = torch.stack((weight, weight @ decoder.outer.weight), -2)
    added = (weight * decoder.outer.bias + b3 * out).sum(-1) + decoder.leave.bias
    return FastField(
        polynomial=polynomial.contiguous(),
        enter=enter.contiguous(),
        middle=(decoder.inner.weight.t() * g2[..., None, :]).contiguous(),
        shift=b2 + g2 * decoder.inner.bias,
        leave=leave,
        added=added,
    )
