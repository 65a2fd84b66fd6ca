"""HorizonNet: a panorama as a sequence of columns, read by a recurrent network.

Each level of the backbone is compressed in height only, resized to one width, and flattened to a
sequence that runs once around the room. A recurrent network in both directions turns it into the
latitudes of the ceiling and the floor boundary and the evidence of a corner in each column.

Source: HorizonNet (Sun et al., CVPR 2019), Sec. 3.2 and the authors' release.
"""

from typing import NamedTuple

import torch
import torch.nn.functional as F
from jaxtyping import Float
from torch import Tensor, nn

from panoscene.models._backbone import build_backbone
from panoscene.models._circular import wrap_columns
from panoscene.models.layout._config import COLUMNS, LayoutConfig

START = (-1.0, 0.478, -0.425)
"""First answers: corner logit, latitude of the ceiling and of the floor boundary (radians)."""


class LayoutSignals(NamedTuple):
    """What the network says about each column of a batch of panoramas."""

    boundary: Float[Tensor, "batch 2 1024"]
    """Latitude in radians, positive up, of the ceiling boundary and of the floor boundary."""
    corner: Float[Tensor, "batch 1024"]
    """Logit of a corner."""


class HeightCompression(nn.Module):
    """Halves the height of a feature map several times and lays its rows side by side."""

    def __init__(
        self,
        channels: int,
        widths: tuple[int, ...],
        *,
        squeeze: bool,
        rows: int,
        projection: int | None,
    ) -> None:
        super().__init__()
        self.squeeze = _normalised(nn.Conv2d(channels, widths[0], 1)) if squeeze else None
        inputs = (widths[0] if squeeze else channels, *widths[:-1])
        # the columns' neighbours are put beside them around the seam in forward
        self.halve = nn.ModuleList(
            _normalised(nn.Conv2d(before, after, 3, stride=(2, 1), padding=(1, 0)))
            for before, after in zip(inputs, widths, strict=True)
        )
        self.project = (
            None if projection is None else nn.Conv1d(widths[-1] * rows, projection, kernel_size=1)
        )
        self.channels = widths[-1] * rows if projection is None else projection

    def forward(
        self, features: Float[Tensor, "batch channels height width"], steps: int
    ) -> Float[Tensor, "batch out_channels {steps}"]:
        """Return the sequence of this level."""
        if self.squeeze is not None:
            features = self.squeeze(features)
        for halve in self.halve:
            features = halve(wrap_columns(features, 1, 1))
        sequence = features.flatten(1, 2)
        if self.project is not None:
            sequence = self.project(sequence)
        return _resized_around(sequence, steps)


class LayoutNetwork(nn.Module):
    """HorizonNet in either edition; see ``build_layout``.

    Attributes:
        config: The sizes that it was built with.
    """

    def __init__(self, config: LayoutConfig, *, imagenet: bool = False) -> None:
        super().__init__()
        self.config = config
        self.backbone = build_backbone(config.backbone, circular=True, imagenet=imagenet)
        levels = [
            HeightCompression(
                channels,
                widths,
                squeeze=config.squeeze,
                rows=config.rows(level),
                projection=config.projection,
            )
            for level, (channels, widths) in enumerate(
                zip(self.backbone.channels, config.compression, strict=True)
            )
        ]
        self.compress = nn.ModuleList(levels)
        cell = nn.LSTM if config.cell == "lstm" else nn.GRU
        self.recurrent = cell(
            sum(level.channels for level in levels),
            config.hidden,
            num_layers=config.layers,
            dropout=config.dropout if config.layers > 1 else 0.0,
            batch_first=True,
            bidirectional=True,
        )
        self.dropout = nn.Dropout(config.dropout)
        self.columns = COLUMNS // config.steps
        self.head = nn.Linear(2 * config.hidden, 3 * self.columns)
        with torch.no_grad():
            self.head.bias.copy_(torch.tensor(START).repeat_interleave(self.columns))
        self._freeze()

    def forward(self, image: Float[Tensor, "batch 3 height width"]) -> LayoutSignals:
        """Return the signals of upright panoramas, RGB in [0, 1], of the configured size.

        Raises:
            ValueError: The images have another size.
        """
        size = (self.config.image_height, self.config.image_width)
        if tuple(image.shape[-2:]) != size:
            raise ValueError(
                f"image: found {tuple(image.shape[-2:])} rows and columns, expected {size}"
            )
        levels = self.backbone(image)
        steps, wrap = self.config.steps, self.config.wrap
        sequence = torch.cat(
            [compress(level, steps) for compress, level in zip(self.compress, levels, strict=True)],
            dim=1,
        )
        if wrap:
            sequence = wrap_columns(sequence, wrap, wrap)
        states, _ = self.recurrent(sequence.mT)
        states = states[:, wrap : wrap + steps]
        answers = self.head(self.dropout(states)).unflatten(-1, (3, self.columns))
        corner, ceiling, floor = answers.transpose(1, 2).flatten(2).unbind(1)
        return LayoutSignals(torch.stack((ceiling, floor), dim=1), corner)

    def train(self, mode: bool = True) -> "LayoutNetwork":
        """Return self in training mode; frozen batch normalisation stays as it is."""
        super().train(mode)
        if self.config.frozen_stages:
            for module in self.backbone.modules():
                if isinstance(module, nn.BatchNorm2d):
                    module.eval()
        return self

    def _freeze(self) -> None:
        """Take the first stages of the backbone out of the training."""
        stages = self.config.frozen_stages
        if not stages:
            return
        frozen = ("conv_stem.", "bn1.", *(f"blocks.{stage}." for stage in range(stages - 1)))
        for name, parameter in self.backbone.network.named_parameters():
            if name.startswith(frozen):
                parameter.requires_grad_(False)


def build_layout(config: LayoutConfig, *, imagenet: bool = False) -> LayoutNetwork:
    """Return a new layout network.

    Args:
        config: Sizes, as in ``CONFIGS``.
        imagenet: Start the backbone from ImageNet weights.

    Raises:
        CheckpointError: The ImageNet weights are not to be found.
    """
    return LayoutNetwork(config, imagenet=imagenet)


def _normalised(convolution: nn.Conv2d) -> nn.Sequential:
    return nn.Sequential(convolution, nn.BatchNorm2d(convolution.out_channels), nn.ReLU(True))


def _resized_around(
    sequence: Float[Tensor, "batch channels width"], steps: int
) -> Float[Tensor, "batch channels {steps}"]:
    """Return the sequence interpolated to more steps; the ends are neighbours."""
    factor = steps // sequence.shape[-1]
    if factor * sequence.shape[-1] != steps:
        raise ValueError(f"steps: {steps} is no multiple of the {sequence.shape[-1]} columns found")
    if factor == 1:
        return sequence
    around = wrap_columns(sequence, 1, 1)
    wide = F.interpolate(around, scale_factor=factor, mode="linear", align_corners=False)
    return wide[..., factor:-factor]
