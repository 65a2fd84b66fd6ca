"""Convolutions on the cylinder: the left edge of a panorama goes on at the right edge."""

from typing import TypeVar

import torch
import torch.nn.functional as F
from torch import Tensor, nn

Module = TypeVar("Module", bound=nn.Module)


class CircularConv2d(nn.Conv2d):
    """A convolution whose padding wraps around horizontally and is zero vertically.

    Padding is what the convolution it replaces has, or what keeps ``ceil(size / stride)`` for
    TensorFlow's "same". Parameters and their names are those of ``nn.Conv2d``.
    """

    same: bool = False

    def forward(self, input: Tensor) -> Tensor:
        """Return the convolution of a batch of pictures or features."""
        wrapped, rows = pad_circular(input, self, same=self.same)
        return F.conv2d(
            wrapped, self.weight, self.bias, self.stride, (rows, 0), self.dilation, self.groups
        )


class CircularMaxPool2d(nn.MaxPool2d):
    """A maximum over windows that go on across the seam."""

    def forward(self, input: Tensor) -> Tensor:
        """Return the maxima of a batch of features."""
        rows, columns = _pair(self.padding)
        wrapped = wrap_columns(input, columns, columns)
        return F.max_pool2d(
            wrapped, self.kernel_size, self.stride, (rows, 0), self.dilation, self.ceil_mode
        )


def make_circular(module: Module) -> Module:
    """Return the module with every padded convolution and pooling wrapped around horizontally.

    It is changed in place; weights stay what and where they are. Rolling the input by a multiple
    of the total stride then rolls the output. The width must be a multiple of that stride.

    Raises:
        ValueError: A convolution pads by reflection or replication.

    Examples:
        >>> import torch
        >>> layer = make_circular(torch.nn.Conv2d(1, 1, 3, padding=1))
        >>> image = torch.arange(32.0).reshape(1, 1, 4, 8)
        >>> bool(torch.equal(layer(image.roll(3, -1)), layer(image).roll(3, -1)))
        True
    """
    if isinstance(module, nn.Conv2d):
        _convert_convolution(module)
    elif isinstance(module, nn.MaxPool2d) and _pair(module.padding)[1]:
        module.__class__ = CircularMaxPool2d
    for child in module.children():
        make_circular(child)
    return module


def pad_circular(input: Tensor, layer: nn.Conv2d, *, same: bool) -> tuple[Tensor, int]:
    """Return the input padded for a convolution, and the rows that are still to be padded."""
    if same:
        top, bottom = same_padding(input.shape[-2], layer, 0)
        left, right = same_padding(input.shape[-1], layer, 1)
        if top != bottom:
            input = F.pad(input, (0, 0, top, bottom))
            top = 0
    else:
        top, left = (int(amount) for amount in _numbers(layer))
        right = left
    return wrap_columns(input, left, right), top


def same_padding(size: int, layer: nn.Conv2d, axis: int) -> tuple[int, int]:
    """Return what TensorFlow's "same" adds before and behind, to keep ``ceil(size / stride)``.

    Args:
        size: Of the input along the axis.
        layer: The convolution.
        axis: 0 for rows, 1 for columns.

    Examples:
        >>> same_padding(224, nn.Conv2d(1, 1, 3, stride=2), 0)
        (0, 1)
    """
    stride, kernel, dilation = layer.stride[axis], layer.kernel_size[axis], layer.dilation[axis]
    total = max((-(-size // stride) - 1) * stride + (kernel - 1) * dilation + 1 - size, 0)
    return total // 2, total - total // 2


def wrap_columns(input: Tensor, left: int, right: int) -> Tensor:
    """Return the input with columns of its other side at each side (the last axis).

    Twice as fast as ``F.pad``, which gives up the memory format (channels last).

    Examples:
        >>> import torch
        >>> wrap_columns(torch.tensor([1, 2, 3]), 1, 2)
        tensor([3, 1, 2, 3, 1, 2])
    """
    if not (left or right):
        return input
    width = input.shape[-1]
    return torch.cat((input[..., width - left :], input, input[..., :right]), dim=-1)


def _convert_convolution(layer: nn.Conv2d) -> None:
    if type(layer).__name__ == "Conv2dSame":  # ours or timm's, for networks from TensorFlow
        same = True
    elif type(layer) is nn.Conv2d:
        same = False
    else:
        return
    if layer.padding_mode != "zeros":
        raise ValueError(f"module: found padding {layer.padding_mode!r}, expected 'zeros'")
    if max(layer.kernel_size) == 1 or not (same or _numbers(layer)[1]):
        return
    layer.__class__ = CircularConv2d
    layer.same = same  # ty: ignore[invalid-assignment]


def _numbers(layer: nn.Conv2d) -> tuple[int, int]:
    if layer.padding == "valid":
        return 0, 0
    if layer.padding == "same":  # PyTorch's own: stride 1
        rows, columns = (
            d * (k - 1) // 2 for d, k in zip(layer.dilation, layer.kernel_size, strict=True)
        )
        return rows, columns
    return _pair(layer.padding)  # ty: ignore[invalid-argument-type]


def _pair(amount: int | tuple[int, ...]) -> tuple[int, int]:
    return (amount[0], amount[1]) if isinstance(amount, tuple) else (amount, amount)
