"""EfficientNet-Lite0, the backbone of the compact networks, without the seconds that timm imports.

Parts, names and shapes are those of timm's tf_efficientnet_lite0, so that its weights fit.
Source: Tan and Le, EfficientNet, 2019, and the Lite variant that its authors published.
"""

import math
from typing import NamedTuple

import torch.nn.functional as F
from torch import Tensor, nn

from ._circular import same_padding

_STEM = 32
_EPSILON = 1e-3


class _Stage(NamedTuple):
    repeats: int
    kernel: int
    stride: int
    expansion: int
    channels: int


_STAGES = (
    _Stage(1, 3, 1, 1, 16),
    _Stage(2, 3, 2, 6, 24),
    _Stage(2, 5, 2, 6, 40),
    _Stage(3, 3, 2, 6, 80),
    _Stage(3, 5, 1, 6, 112),
    _Stage(4, 5, 2, 6, 192),
    _Stage(1, 3, 1, 6, 320),
)
"""Table 1 of the source, without the head; Lite leaves the ends as they are."""
_LEVELS = (0, 1, 2, 4, 6)
"""The last stage of each stride."""


class Conv2dSame(nn.Conv2d):
    """A convolution padded as TensorFlow pads: more at the right and at the bottom."""

    def forward(self, input: Tensor) -> Tensor:
        """Return the convolution of a batch of pictures or features."""
        top, bottom = same_padding(input.shape[-2], self, 0)
        left, right = same_padding(input.shape[-1], self, 1)
        padded = F.pad(input, (left, right, top, bottom))
        return F.conv2d(padded, self.weight, self.bias, self.stride, 0, self.dilation, self.groups)


class BatchNormAct2d(nn.BatchNorm2d):
    """A batch normalisation with what follows it."""

    def __init__(self, channels: int, *, activated: bool = True) -> None:
        super().__init__(channels, eps=_EPSILON)
        self.act = nn.ReLU6(inplace=True) if activated else nn.Identity()

    def forward(self, input: Tensor) -> Tensor:
        """Return normalised features."""
        return self.act(super().forward(input))


class _Separable(nn.Module):
    """A depthwise convolution and a projection."""

    def __init__(self, given: int, made: int, kernel: int, stride: int) -> None:
        super().__init__()
        self.conv_dw = _convolution(given, given, kernel, stride, groups=given)
        self.bn1 = BatchNormAct2d(given)
        self.conv_pw = _convolution(given, made)
        self.bn2 = BatchNormAct2d(made, activated=False)

    def forward(self, x: Tensor) -> Tensor:
        return self.bn2(self.conv_pw(self.bn1(self.conv_dw(x))))


class _Inverted(nn.Module):
    """An expansion, a depthwise convolution and a projection, past which the input runs."""

    def __init__(self, given: int, made: int, kernel: int, stride: int, expansion: int) -> None:
        super().__init__()
        inner = given * expansion
        self.conv_pw = _convolution(given, inner)
        self.bn1 = BatchNormAct2d(inner)
        self.conv_dw = _convolution(inner, inner, kernel, stride, groups=inner)
        self.bn2 = BatchNormAct2d(inner)
        self.conv_pwl = _convolution(inner, made)
        self.bn3 = BatchNormAct2d(made, activated=False)
        self.passes = stride == 1 and given == made

    def forward(self, x: Tensor) -> Tensor:
        made = self.bn2(self.conv_dw(self.bn1(self.conv_pw(x))))
        made = self.bn3(self.conv_pwl(made))
        return made + x if self.passes else made


class LiteNetwork(nn.Module):
    """The network up to the last feature map that is asked for.

    Attributes:
        channels: Of each feature map, finest first.
    """

    def __init__(self, levels: tuple[int, ...]) -> None:
        super().__init__()
        self.conv_stem = _convolution(3, _STEM, 3, 2)
        self.bn1 = BatchNormAct2d(_STEM)
        self._kept = tuple(_LEVELS[level] for level in levels)
        stages, given = [], _STEM
        for stage in _STAGES[: self._kept[-1] + 1]:
            stages.append(_blocks(given, stage))
            given = stage.channels
        self.blocks = nn.Sequential(*stages)
        self.channels = tuple(_STAGES[stage].channels for stage in self._kept)

    def forward(self, x: Tensor) -> list[Tensor]:
        """Return the feature maps (batch, channels, rows, columns), finest first."""
        x = self.bn1(self.conv_stem(x))
        maps = []
        for number, stage in enumerate(self.blocks):
            x = stage(x)
            if number in self._kept:
                maps.append(x)
        return maps


def _blocks(given: int, stage: _Stage) -> nn.Sequential:
    blocks: list[nn.Module] = []
    for number in range(stage.repeats):
        stride = stage.stride if number == 0 else 1
        if stage.expansion == 1:
            blocks.append(_Separable(given, stage.channels, stage.kernel, stride))
        else:
            blocks.append(_Inverted(given, stage.channels, stage.kernel, stride, stage.expansion))
        given = stage.channels
    return nn.Sequential(*blocks)


def _convolution(
    given: int, made: int, kernel: int = 1, stride: int = 1, *, groups: int = 1
) -> nn.Conv2d:
    """Return a convolution that keeps ceil(size / stride), with the source's start weights."""
    if stride == 1:
        padding = kernel // 2
        layer = nn.Conv2d(given, made, kernel, padding=padding, groups=groups, bias=False)
    else:
        layer = Conv2dSame(given, made, kernel, stride, groups=groups, bias=False)
    nn.init.normal_(layer.weight, std=math.sqrt(2 * groups / (kernel**2 * made)))
    return layer
