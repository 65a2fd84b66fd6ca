"""What the shape network is trained for."""

from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional as F

from ._elements import Elements
from ._network import ShapeNetwork, outside_probability

_BOX = 0.7
_INSIDE = 1.1


@dataclass(frozen=True, slots=True)
class ShapeTargets:
    """Points of each object, in the network's frame, and the coarse grid around it."""

    uniform: Float[Tensor, "batch uniform 3"]
    uniform_outside: Float[Tensor, "batch uniform"]
    """1 outside, 0 inside."""
    near: Float[Tensor, "batch near 3"]
    near_outside: Float[Tensor, "batch near"]
    grid: Float[Tensor, "batch nodes nodes nodes"]
    """Signed distances at nodes from -0.7 to 0.7, x first; unit: the longest side."""
    stretch: Float[Tensor, "batch 3"]
    """Takes the network's frame to that of the grid, axis by axis."""


@dataclass(frozen=True, slots=True)
class ShapeWeights:
    """Weights of the loss terms; these are the paper's."""

    uniform: float = 1.0
    near: float = 0.1
    in_box: float = 10.0
    inside: float = 0.2


def shape_losses(
    network: ShapeNetwork,
    code: Float[Tensor, "batch code"],
    targets: ShapeTargets,
    weights: ShapeWeights | None = None,
) -> dict[str, Tensor]:
    """Return the weighted loss terms of shape codes.

    Squared errors of being outside at uniform points and at points near the surface, and two terms
    that keep the centres of elements in the box and within a voxel of the inside.

    Args:
        network: Whose codes they are.
        code: Of the objects.
        targets: Likewise.
        weights: Of the terms; by default the paper's.

    Source: paper, Sec. 3.1 (LDIF); terms and weights of the authors' release.
    """
    weights = ShapeWeights() if weights is None else weights
    elements = network.elements(code)
    count = targets.uniform.shape[1]
    points = torch.cat((targets.uniform, targets.near), 1)
    outside = outside_probability(network.field(elements, points))
    return {
        "uniform": weights.uniform * F.mse_loss(outside[:, :count], targets.uniform_outside),
        "near": weights.near * F.mse_loss(outside[:, count:], targets.near_outside),
        "in_box": weights.in_box * (elements.centre.abs() - _BOX).relu().square().mean(),
        "inside": weights.inside * _inside_loss(elements, targets),
    }


def _inside_loss(elements: Elements, targets: ShapeTargets) -> Tensor:
    """Return how far centres are outside the shape; less than a voxel counts as nothing."""
    places = elements.centre * targets.stretch[:, None] / _BOX
    # grid_sample takes (z, y, x) volumes and (x, y, z) places
    volume = targets.grid.permute(0, 3, 2, 1)[:, None]
    found = F.grid_sample(volume, places[:, :, None, None], align_corners=True)[:, 0, :, 0, 0]
    spacing = 2 * _BOX / targets.grid.shape[-1]
    outside = torch.where(found > spacing / _INSIDE, found, torch.zeros_like(found))
    return (outside + 1e-4).square().mean() + 1e-5
