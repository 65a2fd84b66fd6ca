"""The shape network: a picture of an object to a code, a code to a field."""

import math

import torch
from jaxtyping import Float, Int64
from torch import Tensor, nn
from torch.nn import functional as F

from panoscene.models._backbone import build_backbone
from panoscene.scene import CATEGORIES

from ._config import HINTS, ISO_LEVEL, ShapeConfig
from ._decoder import LocalDecoder
from ._elements import Elements, elements_from_code, local_points

SHARPNESS = 100.0
"""Of the step from inside to outside."""
_SLOPE = 0.2
_PLACES = 4
_PLACE_WIDTH = 16


class Encoder(nn.Module):
    """The picture of an object and its category to a shape code (LIEN).

    Args:
        config: Sizes.
        imagenet: Whether the backbone starts from ImageNet weights.
    """

    def __init__(self, config: ShapeConfig, *, imagenet: bool = False) -> None:
        super().__init__()
        self.backbone = build_backbone(config.backbone, levels=config.levels, imagenet=imagenet)
        channels = list(self.backbone.channels)
        self.places = nn.Conv2d(channels[-2], _PLACE_WIDTH, 1) if len(channels) > 1 else None
        found = channels[-1] + (_PLACE_WIDTH * _PLACES**2 if self.places is not None else 0)
        self.features = nn.Linear(found, config.features)
        known = config.features + len(CATEGORIES) + (HINTS if config.hints else 0)
        last = nn.Linear(config.hidden, config.code)
        self.code = nn.Sequential(
            nn.Linear(known, config.hidden),
            nn.LeakyReLU(_SLOPE),
            nn.Linear(config.hidden, config.hidden),
            nn.LeakyReLU(_SLOPE),
            last,
        )
        self.hints = config.hints
        if config.spread:
            _spread_elements(last, config)

    def forward(
        self,
        crop: Float[Tensor, "batch 3 rows columns"],
        category: Int64[Tensor, " batch"],
        hints: Float[Tensor, "batch 8"],
    ) -> Float[Tensor, "batch code"]:
        """Return shape codes.

        Args:
            crop: RGB in [0, 1].
            category: Index into ``CATEGORIES``.
            hints: What ``view_hints`` returns; the paper's edition does not look at them.
        """
        return self.code_of(self.seen(crop), category, hints)

    def seen(self, crop: Float[Tensor, "batch 3 rows columns"]) -> Float[Tensor, "batch seen"]:
        """Return what the backbone sees: means of the last map, then 4 x 4 places of the other."""
        maps = self.backbone(crop)
        parts = [maps[-1].mean((-2, -1))]
        if self.places is not None:
            parts.append(F.adaptive_avg_pool2d(maps[-2], _PLACES).flatten(1))
        return torch.cat(parts, 1)

    def code_of(
        self,
        seen: Float[Tensor, "batch seen"],
        category: Int64[Tensor, " batch"],
        hints: Float[Tensor, "batch 8"],
    ) -> Float[Tensor, "batch code"]:
        """Return shape codes from what the backbone sees; see ``forward``."""
        parts = [seen]
        if self.places is not None:
            last = self.backbone.channels[-1]
            means, kept = seen[:, :last], seen[:, last:]
            kept = self.places(kept.reshape(len(seen), -1, _PLACES, _PLACES))
            parts = [means, F.leaky_relu(kept, _SLOPE).flatten(1)]
        features = self.features(torch.cat(parts, 1))
        if self.hints:
            features = F.leaky_relu(features, _SLOPE)
        known = [features, F.one_hot(category, len(CATEGORIES)).to(features.dtype)]
        return self.code(torch.cat(known + ([hints] if self.hints else []), 1))


class ShapeNetwork(nn.Module):
    """LIEN and LDIF: a picture to a code, a code to a field that is below -0.07 inside.

    Args:
        config: Sizes.
        imagenet: Whether the backbone starts from ImageNet weights.

    Attributes:
        config: Sizes.
    """

    def __init__(self, config: ShapeConfig, *, imagenet: bool = False) -> None:
        super().__init__()
        self.config = config
        self.encoder = Encoder(config, imagenet=imagenet)
        self.decoder = LocalDecoder(config.latent, config.decoder)

    def forward(
        self,
        crop: Float[Tensor, "batch *picture"],
        category: Int64[Tensor, " batch"],
        hints: Float[Tensor, "batch 8"],
    ) -> Float[Tensor, "batch code"]:
        """Return shape codes; see ``Encoder``. A crop may be what ``Encoder.seen`` returns, too."""
        seen = crop if crop.dim() == 2 else self.encoder.seen(crop)
        return self.encoder.code_of(seen, category, hints)

    def elements(self, code: Float[Tensor, "batch code"]) -> Elements:
        """Return the elements of shape codes."""
        return elements_from_code(code, self.config)

    def field(
        self, elements: Elements, points: Float[Tensor, "batch points 3"]
    ) -> Float[Tensor, "batch points"]:
        """Return the field at points: sum of constant * Gaussian * (1 + decoder) over elements.

        Args:
            elements: Of the shapes.
            points: In the network's frame.
        """
        local = local_points(elements, points)
        modulation = self.decoder.modulation(elements.latent)
        shape = local.shape[:3]
        nearest = self.config.nearest
        if self.training and nearest is not None and nearest < shape[2]:
            chosen = local.detach().square().sum(-1).topk(nearest, dim=-1, largest=False).indices
            local = local.gather(2, chosen[..., None].expand(-1, -1, -1, 3))
            first = torch.arange(shape[0], device=chosen.device)[:, None, None] * shape[2]
            row = (chosen + first).flatten()
            modulation = modulation.flatten(0, 1).flatten(1).index_select(0, row)
            modulation = modulation.reshape(*chosen.shape, 6, -1)
            constant = elements.constant.flatten().index_select(0, row).reshape(chosen.shape)
        else:
            modulation = modulation[:, None].expand(-1, shape[1], -1, -1, -1)
            constant = elements.constant[:, None]
        blob = constant * (-0.5 * local.square().sum(-1)).exp()
        return (blob * (1 + self.decoder(local, modulation))).sum(-1)


def outside_probability(field: Float[Tensor, "*batch"]) -> Float[Tensor, "*batch"]:
    """Return the probability that points are outside, from the field there.

    Examples:
        >>> outside_probability(torch.tensor([-0.07, 0.0])).round(decimals=2)
        tensor([0.5000, 1.0000])
    """
    return (SHARPNESS * (field - ISO_LEVEL)).sigmoid()


def view_hints(
    bfov: Float[Tensor, "n 4"], size: Float[Tensor, "n 3"], view_yaw: Float[Tensor, " n"]
) -> Float[Tensor, "n 8"]:
    """Return what the compact encoder is told about an object besides its picture.

    The sine and cosine of its yaw relative to the line of sight, the logarithms of its size, those
    of the width and height of its BFoV, and the latitude of that.

    Args:
        bfov: What the picture shows.
        size: Of the box, in metres.
        view_yaw: What ``panoscene.geometry.view_relative_yaw`` returns.
    """
    return torch.cat(
        (
            torch.stack((view_yaw.sin(), view_yaw.cos()), 1),
            size.clamp(min=1e-3).log(),
            bfov[:, 2:].clamp(min=1e-3).log() + 1,
            bfov[:, 1:2],
        ),
        1,
    )


def build_shape(config: ShapeConfig, *, imagenet: bool = False) -> ShapeNetwork:
    """Return a shape network without trained weights.

    Args:
        config: Such as ``CONFIGS["compact"]``.
        imagenet: Whether the backbone starts from ImageNet weights.

    Raises:
        CheckpointError: The ImageNet weights are not there.
    """
    return ShapeNetwork(config, imagenet=imagenet)


def _spread_elements(layer: nn.Linear, config: ShapeConfig) -> None:
    """Let the elements start all over the box: an untrained network gives a smooth blob."""
    count = config.elements
    order = torch.arange(count, dtype=torch.float32) + 0.5
    # the generalised golden ratio fills the box evenly
    steps = torch.tensor([1.0 / 1.2207440846**k for k in (1, 2, 3)])
    centre = (order[:, None] * steps) % 1.0 - 0.5
    half = torch.arange(count) < config.symmetric
    centre[:, 0] = torch.where(half, centre[:, 0].abs(), centre[:, 0])
    start = torch.zeros(count, config.width)
    start[:, 0] = 0.1
    start[:, 1:4] = 2 * 0.85 * centre
    start[:, 4:7] = math.log(2.0)
    with torch.no_grad():
        layer.weight.mul_(0.3)
        layer.bias.copy_(start.flatten())
