"""Mask R-CNN for panoramas."""

from pathlib import Path

import torch
from jaxtyping import Float
from torch import Tensor, nn

from ._boxes import Frame
from ._config import DetectorConfig
from ._heads import RegionHeads
from ._pointwise import make_pointwise
from ._proposals import ProposalNetwork
from ._pyramid import Pyramid
from ._targets import DetectorTargets, RegionPredictions


class DetectorNetwork(nn.Module):
    """Torchvision's Mask R-CNN parts; boxes and features may go around the cylinder.

    Attributes:
        config: What it was built from.
    """

    def __init__(self, config: DetectorConfig, imagenet: bool | Path = False) -> None:
        super().__init__()
        self.config = config
        self.backbone = Pyramid(config, imagenet)
        self.rpn = ProposalNetwork(config)
        self.roi_heads = RegionHeads(config)

    def forward(
        self,
        image: Float[Tensor, "batch 3 rows columns"],
        targets: list[DetectorTargets] | None = None,
    ) -> dict[str, Tensor] | list[RegionPredictions]:
        """Return the losses of a batch when there are targets, else what is in the pictures.

        Args:
            image: RGB in [0, 1], the rows that the config asks for; see ``network_picture``.
            targets: Of each picture.
        """
        height, width = image.shape[-2:]
        period = float(width) if self.config.seam == "circular" else None
        frame = Frame(height, width, period)
        pyramid = self.backbone(image.contiguous(memory_format=torch.channels_last))
        proposals, losses = self.rpn(pyramid, frame, targets)
        if targets is None:
            return self.roi_heads.detect(pyramid, proposals, frame)
        return losses | self.roi_heads.losses(pyramid, proposals, targets, period)


def build_detector(config: DetectorConfig, *, imagenet: bool | Path = False) -> DetectorNetwork:
    """Return a detector, untrained but for the start weights of its backbone.

    Args:
        config: ``CONFIGS[edition]``, or one's own.
        imagenet: Whether the backbone starts with weights trained on ImageNet; a path is a file
            of them.

    Raises:
        CheckpointError: The start weights are missing or do not fit.
    """
    network = DetectorNetwork(config, imagenet)
    make_pointwise(network)
    return network.to(memory_format=torch.channels_last)
