"""The backbone and its feature pyramid, on the picture or on the cylinder."""

from collections.abc import Sequence
from pathlib import Path

import torch.nn.functional as F
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn.utils.fusion import fuse_conv_bn_weights

from panoscene.models._backbone import Backbone, build_backbone
from panoscene.models._circular import make_circular

from ._config import DetectorConfig


class TopDown(nn.Module):
    """Feature maps of one width: each is told what the coarser ones see.

    Parts have torchvision's names. Source: Lin et al., Feature Pyramid Networks, 2017, Figure 3.
    """

    def __init__(self, given: Sequence[int], channels: int) -> None:
        super().__init__()
        # torchvision has each convolution in a block of its own
        self.inner_blocks = nn.ModuleList(nn.Sequential(nn.Conv2d(c, channels, 1)) for c in given)
        self.layer_blocks = nn.ModuleList(
            nn.Sequential(nn.Conv2d(channels, channels, 3, padding=1)) for _ in given
        )
        for layer in self.modules():
            if isinstance(layer, nn.Conv2d) and layer.bias is not None:
                nn.init.kaiming_uniform_(layer.weight, a=1)
                nn.init.zeros_(layer.bias)

    def forward(self, maps: Sequence[Tensor]) -> list[Tensor]:
        """Return feature maps (batch, channels, rows, columns), finest first."""
        inner = [block(level) for block, level in zip(self.inner_blocks, maps, strict=True)]
        for k in range(len(inner) - 2, -1, -1):
            inner[k] = inner[k] + F.interpolate(inner[k + 1], size=inner[k].shape[-2:])
        return [block(level) for block, level in zip(self.layer_blocks, inner, strict=True)]


class Pyramid(nn.Module):
    """Feature maps of one width at strides 4, 8, 16, 32, and 64 where the config asks for it."""

    def __init__(self, config: DetectorConfig, imagenet: bool | Path) -> None:
        super().__init__()
        circular = config.seam == "circular"
        self.body = build_backbone(config.backbone, circular=circular, imagenet=imagenet)
        if config.fold_norms:
            fold_norms(self.body)
        for name in config.frozen:
            self.body.network.get_submodule(name).requires_grad_(False)
        self.fpn = TopDown(self.body.channels, config.channels)
        if circular:
            make_circular(self.fpn)
        self.extra_level = config.extra_level

    def forward(self, image: Float[Tensor, "batch 3 height width"]) -> list[Tensor]:
        """Return feature maps (batch, channels, rows, columns), finest first."""
        pyramid = self.fpn(self.body(image))
        if self.extra_level:
            pyramid.append(pyramid[-1][:, :, ::2, ::2])
        return pyramid

    def train(self, mode: bool = True) -> "Pyramid":
        """Set training mode, but keep the normalisations' statistics: batches are too small."""
        super().train(mode)
        for module in self.body.modules():
            if isinstance(module, nn.BatchNorm2d):
                module.eval()
                module.requires_grad_(False)
        return self


def fold_norms(backbone: Backbone) -> None:
    """Make each batch normalisation part of the convolution whose output it takes, in place.

    The function computed in inference mode stays the same; the normalisations are gone.

    Raises:
        ValueError: A normalisation does not take the output of a convolution without bias.
    """
    pairs = _convolutions_before_norms(backbone)
    for name, norm in list(backbone.named_modules()):
        if not isinstance(norm, nn.BatchNorm2d):
            continue
        conv = pairs.get(name)
        mean, variance = norm.running_mean, norm.running_var
        if conv is None or conv.bias is not None or mean is None or variance is None:
            raise ValueError(f"backbone: {name} does not follow a convolution without bias")
        conv.weight, conv.bias = fuse_conv_bn_weights(
            conv.weight, None, mean, variance, norm.eps, norm.weight, norm.bias
        )
        conv.bias.requires_grad_(True)
        backbone.set_submodule(name, getattr(norm, "act", nn.Identity()))


def _convolutions_before_norms(backbone: Backbone) -> dict[str, nn.Conv2d]:
    """Return the convolution before each normalisation: all backbones list them so."""
    pairs: dict[str, nn.Conv2d] = {}
    last: nn.Conv2d | None = None
    for name, module in backbone.named_modules():
        if isinstance(module, nn.Conv2d):
            last = module
        elif isinstance(module, nn.BatchNorm2d):
            if last is not None and last.out_channels == module.num_features:
                pairs[name] = last
            last = None
    return pairs
