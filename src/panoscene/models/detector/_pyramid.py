"""The backbone and its feature pyramid, on the picture or on the cylinder."""

from collections.abc import Sequence
from pathlib import Path

import torch.nn.functional as F
from jaxtyping import Float
from torch import Tensor, nn

from panoscene.models._backbone import build_backbone
from panoscene.models._circular import make_circular
from panoscene.models._folding import fold_norms

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
