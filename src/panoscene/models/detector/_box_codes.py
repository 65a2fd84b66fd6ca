"""Boxes as networks say them: how far from another box, and how much larger."""

import math
from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

_MOST_GROWTH = math.log(1000 / 16)


@dataclass(frozen=True, slots=True)
class BoxCoder:
    """Boxes to codes and back.

    Source: Girshick et al., 2014, Appendix C; the factors are those of Ren et al., 2015.
    """

    shift: float = 1.0
    """Factor of the centre's distance, in sides of the reference."""
    growth: float = 1.0
    """Factor of the logarithm of the sides' ratio."""

    def encode(
        self, boxes: Float[Tensor, "n 4"], reference: Float[Tensor, "n 4"]
    ) -> Float[Tensor, "n 4"]:
        """Return the codes of boxes, each by its reference."""
        centre, side = _centre_and_side(boxes)
        start, scale = _centre_and_side(reference)
        shift = self.shift * (centre - start) / scale
        return torch.cat((shift, self.growth * (side / scale).log()), -1)

    def decode(
        self, codes: Float[Tensor, "n 4"], reference: Float[Tensor, "n 4"]
    ) -> Float[Tensor, "n 4"]:
        """Return the boxes that codes say; none grows more than 62.5 times.

        Examples:
            >>> reference = torch.tensor([[0.0, 0.0, 4.0, 2.0]])
            >>> BoxCoder().decode(torch.tensor([[1.0, 0.0, 0.0, 0.0]]), reference)
            tensor([[4., 0., 8., 2.]])
        """
        start, scale = _centre_and_side(reference)
        centre = codes[:, :2] / self.shift * scale + start
        half = (codes[:, 2:] / self.growth).clamp_max(_MOST_GROWTH).exp() * scale / 2
        return torch.cat((centre - half, centre + half), -1)


def _centre_and_side(
    boxes: Float[Tensor, "n 4"],
) -> tuple[Float[Tensor, "n 2"], Float[Tensor, "n 2"]]:
    side = boxes[:, 2:] - boxes[:, :2]
    return boxes[:, :2] + side / 2, side
