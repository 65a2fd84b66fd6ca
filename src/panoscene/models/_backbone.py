"""Networks that turn a panorama into feature maps; all stages start with one."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, get_args

import torch
from jaxtyping import Float
from torch import Tensor, nn

from ._circular import make_circular
from ._imagenet import imagenet_weights
from ._lite import LiteNetwork

BackboneName = Literal["resnet18", "resnet34", "resnet50", "tf_efficientnet_lite0"]
_HALF = (0.5, 0.5, 0.5)
"""Mean and deviation of the pictures that EfficientNet-Lite0 was trained with."""


class Backbone(nn.Module):
    """A network as timm has it, without its classifier: RGB in [0, 1] to feature maps.

    The mean and standard deviation that the network was trained with are applied inside.

    Attributes:
        channels: Of each feature map, finest first.
        strides: Pixels of the image per pixel of each feature map.
    """

    mean: Tensor
    deviation: Tensor

    def __init__(
        self,
        network: nn.Module,
        channels: Sequence[int],
        strides: Sequence[int],
        mean: Sequence[float],
        deviation: Sequence[float],
    ) -> None:
        super().__init__()
        self.network = network
        self.channels = tuple(channels)
        self.strides = tuple(strides)
        self.register_buffer("mean", torch.tensor(mean).reshape(-1, 1, 1), persistent=False)
        self.register_buffer(
            "deviation", torch.tensor(deviation).reshape(-1, 1, 1), persistent=False
        )

    def forward(self, image: Float[Tensor, "batch 3 height width"]) -> tuple[Tensor, ...]:
        """Return one feature map (batch, channels, rows, columns) per level, finest first."""
        return tuple(self.network((image - self.mean) / self.deviation))


def build_backbone(
    name: BackboneName,
    *,
    levels: tuple[int, ...] = (1, 2, 3, 4),
    circular: bool = False,
    imagenet: bool | Path = False,
) -> Backbone:
    """Return a network that gives feature maps at some levels; level k has stride 2^(k + 1).

    Args:
        name: Of the network, as timm calls it.
        levels: Which feature maps, finest first; 0 to 4. Layers behind the last are left out.
        circular: Whether padding wraps around horizontally, so that rolling the panorama by a
            multiple of the last stride rolls the feature maps.
        imagenet: Whether to start from weights trained on ImageNet; a path is a file of them.

    Raises:
        ValueError: There is no such network, or levels are out of order.
        CheckpointError: The ImageNet weights are not there, or do not fit.

    Examples:
        >>> backbone = build_backbone("tf_efficientnet_lite0", levels=(2, 4))
        >>> backbone.channels, backbone.strides
        ((40, 320), (8, 32))
    """
    if name not in get_args(BackboneName):
        expected = ", ".join(get_args(BackboneName))
        raise ValueError(f"name: found {name!r}, expected one of {expected}")
    if not levels or list(levels) != sorted(set(levels) & set(range(5))):
        raise ValueError(f"levels: found {levels}, expected rising numbers from 0 to 4")
    backbone = _lite(levels) if name == "tf_efficientnet_lite0" else _of_timm(name, levels)
    network = backbone.network
    if imagenet:
        file = imagenet if isinstance(imagenet, Path) else None
        wanted = network.state_dict()
        given = imagenet_weights(name, file)
        network.load_state_dict({key: given[key] for key in wanted if key in given}, strict=False)
    if circular:
        make_circular(network)
    return backbone


def _lite(levels: tuple[int, ...]) -> Backbone:
    network = LiteNetwork(levels)
    strides = [2 ** (level + 1) for level in levels]
    return Backbone(network, network.channels, strides, _HALF, _HALF)


def _of_timm(name: str, levels: tuple[int, ...]) -> Backbone:
    import timm  # noqa: PLC0415 (with torchvision and TorchDynamo it takes seconds)

    network = timm.create_model(name, pretrained=False, features_only=True, out_indices=levels)
    config = timm.get_pretrained_cfg(name)
    if config is None:
        raise ValueError(f"name: timm does not know how the pictures of {name} are normalised")
    info: Any = network.feature_info
    _cut(network, info.module_name()[-1])
    return Backbone(network, info.channels(), info.reduction(), config.mean, config.std)


def _cut(network: nn.Module, last: str) -> None:
    """Drop the blocks behind the last feature map, which timm keeps in some networks."""
    kind, _, number = last.partition(".")
    blocks = getattr(network, kind, None)
    if number and isinstance(blocks, nn.Sequential):
        setattr(network, kind, blocks[: int(number) + 1])
