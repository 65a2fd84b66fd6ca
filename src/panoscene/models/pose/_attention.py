"""What the objects of a scene say about each other: attention with geometric weights."""

import math

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from panoscene.geometry import wrap_angle

_SMALLEST = 1e-6
_WAVES = 8
_SLOWEST = 10000.0
PAIR_CHANNELS = 4 * 2 * _WAVES
"""Numbers that describe a pair of BFoVs."""


class RelationalAttention(nn.Module):
    """Adds to each object's feature what it takes from all objects of its scene.

    Every group weighs the objects by a learned function of the pair of BFoVs and by a scaled
    product of query and key; it carries its own slice of the features, without a projection. One
    number scales and one shifts the result, which is added to the features.

    Source: the paper's ODN, after Total3D and Hu et al., Relation Networks for Object Detection.
    """

    def __init__(self, features: int, groups: int, key_channels: int) -> None:
        super().__init__()
        if features % groups:
            raise ValueError(f"features: found {features}, expected a multiple of {groups} groups")
        self.groups = groups
        self.key_channels = key_channels
        self.geometry = nn.Linear(PAIR_CHANNELS, groups)
        self.key = nn.Linear(features, groups * key_channels)
        self.query = nn.Linear(features, groups * key_channels)
        self.scale = nn.Parameter(torch.ones(1))
        self.shift = nn.Parameter(torch.zeros(1))

    def forward(
        self,
        feature: Float[Tensor, "scenes n features"],
        bfov: Float[Tensor, "scenes n 4"],
        valid: Bool[Tensor, "scenes n"],
    ) -> Float[Tensor, "scenes n features"]:
        """Return the features with what the scene's valid objects add to them."""
        pair = pair_embedding(bfov)
        geometric = self.geometry(pair).clamp(min=_SMALLEST).log()
        key, query = (
            layer(feature).unflatten(-1, (self.groups, self.key_channels))
            for layer in (self.key, self.query)
        )
        alike = torch.einsum("stgc,sugc->stug", query, key) / math.sqrt(self.key_channels)
        # a scene of padding only attends to padding: no row may be empty
        source = valid | ~valid.any(dim=-1, keepdim=True)
        logits = (geometric + alike).masked_fill(~source[:, None, :, None], -torch.inf)
        weight = logits.softmax(dim=2)
        value = feature.unflatten(-1, (self.groups, -1))
        related = torch.einsum("stug,sugc->stgc", weight, value).flatten(-2)
        return feature + self.scale * related + self.shift


def pair_embedding(bfov: Float[Tensor, "*batch n 4"]) -> Float[Tensor, "*batch n n 64"]:
    """Return how BFoVs lie to each other, [target, source], as sines and cosines.

    Four numbers per pair: the offsets of the target in widths and heights of the source, and the
    logarithms of the ratios of widths and heights. Differences of longitudes are wrapped, so the
    seam is nowhere special (the authors' release takes pixels and ignores the seam).

    Examples:
        >>> pair_embedding(torch.tensor([[0.0, 0.0, 1.0, 1.0], [0.5, 0.0, 1.0, 1.0]])).shape
        torch.Size([2, 2, 64])
    """
    target, source = bfov[..., :, None, :], bfov[..., None, :, :]
    width, height = source[..., 2].clamp(min=_SMALLEST), source[..., 3].clamp(min=_SMALLEST)
    number = torch.stack(
        [
            wrap_angle(target[..., 0] - source[..., 0]) / width,
            (target[..., 1] - source[..., 1]) / height,
            (target[..., 2].clamp(min=_SMALLEST) / width).log(),
            (target[..., 3].clamp(min=_SMALLEST) / height).log(),
        ],
        dim=-1,
    )
    step = torch.arange(_WAVES, dtype=bfov.dtype, device=bfov.device) / _WAVES
    angle = number.unsqueeze(-1) * _SLOWEST**-step
    return torch.stack([angle.sin(), angle.cos()], dim=-1).flatten(-3)
