"""The pose network: crops of a scene's objects to size, yaw, distance and offset."""

from dataclasses import dataclass
from pathlib import Path

import torch
from jaxtyping import Bool, Float, Int64
from torch import Tensor, nn
from torch.nn import functional

from panoscene.geometry import DISTANCE_BIN_WIDTH, DISTANCE_BINS, YAW_BINS, BoxCode
from panoscene.models._backbone import build_backbone
from panoscene.scene import CATEGORIES, MEAN_SIZE

from ._attention import RelationalAttention
from ._clues import CLUE_METRES, CLUES, GUESSES
from ._config import PoseConfig

_SLOPE = 0.2
_DEVIATION = 0.01
_SHARPNESS = 4.0


@dataclass(frozen=True, slots=True)
class PoseOutput:
    """What the network says of each object; see ``BoxCode`` for the numbers."""

    delta: Float[Tensor, "*batch 2"]
    distance_logit: Float[Tensor, "*batch 6"]
    distance_residual: Float[Tensor, "*batch 6"]
    """In each bin."""
    yaw_logit: Float[Tensor, "*batch 6"]
    yaw_residual: Float[Tensor, "*batch 6"]
    """In each bin."""
    size_residual: Float[Tensor, "*batch 3"]

    def code(self) -> BoxCode:
        """Return the code in the likeliest bins."""
        distance, yaw = self.distance_logit.argmax(dim=-1), self.yaw_logit.argmax(dim=-1)
        return BoxCode(
            delta=self.delta,
            distance_bin=distance,
            distance_residual=_pick(self.distance_residual, distance),
            yaw_bin=yaw,
            yaw_residual=_pick(self.yaw_residual, yaw),
            size_residual=self.size_residual,
        )


class PoseNetwork(nn.Module):
    """The paper's ODN: an encoder of crops, relational attention, and four heads.

    Attributes:
        config: What it was built from.
        mean_size: Metres, of each category: what sizes are relative to. It is stored with the
            weights, for they only fit the sizes that they were trained with.
    """

    mean_size: Float[Tensor, "57 3"]

    def __init__(self, config: PoseConfig, *, imagenet: bool | Path = False) -> None:
        super().__init__()
        self.config = config
        self.register_buffer("mean_size", MEAN_SIZE.clone())
        self.backbone = build_backbone(config.backbone, levels=(4,), imagenet=imagenet)
        side = -(-config.crop_px // self.backbone.strides[-1]) - config.pool + 1
        if side < 1:
            raise ValueError(
                f"pool: found {config.pool}, expected at most {side + config.pool - 1}, the side"
                " of the feature map"
            )
        flat = self.backbone.channels[-1] * side**2
        features = config.features or flat
        if features % config.groups:
            raise ValueError(
                f"groups: found {config.groups}, expected a divisor of {features} features"
            )
        told = len(CATEGORIES) + (CLUES if config.clues else 0)
        self.narrow = nn.Linear(flat, features) if config.features else None
        self.clue = nn.Linear(told, features) if config.clues else None
        self.attention = RelationalAttention(features, config.groups, config.key_channels)
        self.size = _head(features + told, config, 3)
        self.yaw = _head(features + told, config, 2 * YAW_BINS)
        self.distance = _head(features + told, config, 2 * DISTANCE_BINS)
        self.delta = _head(features + told, config, 2)
        self.guess = _head(features + told, config, GUESSES) if config.clues else None
        self.sharpness = nn.Parameter(torch.tensor(_SHARPNESS)) if config.clues else None

    def forward(
        self,
        crops: Float[Tensor, "crops 3 rows columns"],
        bfov: Float[Tensor, "scenes n 4"],
        category: Int64[Tensor, "scenes n"],
        valid: Bool[Tensor, "scenes n"],
        *,
        clues: Float[Tensor, "scenes n clues"] | None = None,
        pictured: Bool[Tensor, "scenes n"] | None = None,
    ) -> PoseOutput:
        """Return the output for every object of every scene; padding gets numbers of no meaning.

        Args:
            crops: RGB in [0, 1] of the pictured objects only, scene after scene.
            bfov: (lon, lat, width, height) in radians.
            category: Index into ``CATEGORIES``.
            valid: False for padding.
            clues: From ``pose_clues``; needed if the configuration says so.
            pictured: Which objects have a crop; all valid ones by default. The others are judged
                by what else is known of them.

        Raises:
            ValueError: There is not one crop for each pictured object, or there are no clues.
        """
        encoded = self.encoded(crops)
        return self.placed(encoded, bfov, category, valid, clues=clues, pictured=pictured)

    def placed(
        self,
        encoded: Float[Tensor, "crops features"],
        bfov: Float[Tensor, "scenes n 4"],
        category: Int64[Tensor, "scenes n"],
        valid: Bool[Tensor, "scenes n"],
        *,
        clues: Float[Tensor, "scenes n clues"] | None = None,
        pictured: Bool[Tensor, "scenes n"] | None = None,
    ) -> PoseOutput:
        """Return the output for crops that are encoded already; arguments are as in a call.

        Raises:
            ValueError: There is not one crop for each pictured object, or there are no clues.
        """
        shown = valid if pictured is None else pictured & valid
        if len(encoded) != int(shown.sum()):
            raise ValueError(
                f"crops: found {len(encoded)}, expected {int(shown.sum())}, one for each object"
            )
        feature = encoded.new_zeros(*valid.shape, encoded.shape[-1])
        feature[shown] = encoded
        told = functional.one_hot(category, len(CATEGORIES)).to(feature)
        if self.clue is not None:
            if clues is None:
                raise ValueError("clues: found none, expected pose_clues of every object")
            told = torch.cat([told, clues.to(feature)], dim=-1)
            feature = feature + functional.silu(self.clue(told))
        related = torch.cat([self.attention(feature, bfov, valid), told], dim=-1)
        yaw = self.yaw(related).unflatten(-1, (2, YAW_BINS))
        distance = self.distance(related).unflatten(-1, (2, DISTANCE_BINS))
        if clues is not None and self.guess is not None and self.sharpness is not None:
            guessed = _guessed(self.guess(related), clues.to(related), self.sharpness)
            distance = distance + guessed
        return PoseOutput(
            delta=self.delta(related),
            distance_logit=distance[..., 0, :],
            distance_residual=distance[..., 1, :],
            yaw_logit=yaw[..., 0, :],
            yaw_residual=yaw[..., 1, :],
            size_residual=self.size(related),
        )

    def encoded(
        self, crops: Float[Tensor, "crops 3 rows columns"]
    ) -> Float[Tensor, "crops features"]:
        """Return what the encoder makes of crops, RGB in [0, 1]."""
        if not len(crops):
            return crops.new_zeros(0, self.attention.key.in_features)
        pixels = crops.contiguous(memory_format=torch.channels_last)
        last = self.backbone(pixels)[-1]
        flat = functional.avg_pool2d(last, self.config.pool, stride=1).flatten(1)
        if self.narrow is None:
            return flat
        # without the norm large features push the activation to where it no longer learns
        return functional.silu(self.narrow(functional.layer_norm(flat, flat.shape[1:])))


def build_pose(config: PoseConfig, *, imagenet: bool | Path = False) -> PoseNetwork:
    """Return a pose network with new weights.

    Args:
        config: Such as ``CONFIGS["compact"]``.
        imagenet: Whether the encoder starts from weights trained on ImageNet; a path is a file.

    Raises:
        ValueError: The feature map is smaller than the pooling window, or groups do not fit.
        CheckpointError: The ImageNet weights are not there, or do not fit.
    """
    return PoseNetwork(config, imagenet=imagenet)


def _head(inputs: int, config: PoseConfig, outputs: int) -> nn.Sequential:
    first, last = nn.Linear(inputs, config.hidden), nn.Linear(config.hidden, outputs)
    for layer in (first, last):
        nn.init.normal_(layer.weight, std=_DEVIATION)
        nn.init.zeros_(layer.bias)
    return nn.Sequential(first, nn.LeakyReLU(_SLOPE), nn.Dropout(config.dropout), last)


def _guessed(
    choice: Float[Tensor, "*batch guesses"],
    clues: Float[Tensor, "*batch clues"],
    sharpness: Float[Tensor, ""],
) -> Float[Tensor, "*batch 2 bins"]:
    """Return logits and residuals of a mean of the guesses, which the network weighs."""
    guess = clues[..., :GUESSES] * (CLUE_METRES / DISTANCE_BIN_WIDTH)
    mean = (choice.softmax(dim=-1) * guess).sum(dim=-1, keepdim=True)
    bins = torch.arange(DISTANCE_BINS, device=mean.device, dtype=mean.dtype) + 0.5
    residual = mean - bins
    return torch.stack([-sharpness * residual.square(), residual], dim=-2)


def _pick(value: Tensor, index: Tensor) -> Tensor:
    return value.gather(-1, index.unsqueeze(-1)).squeeze(-1)
