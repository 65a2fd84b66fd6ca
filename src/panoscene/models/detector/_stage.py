"""The detector as a stage: a panorama in, detections out."""

from pathlib import Path

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene._editions import Edition
from panoscene.models._weights import load_network, weights_file
from panoscene.scene import Detections

from ._config import CONFIGS, DetectorConfig
from ._merge import merge_detections
from ._network import DetectorNetwork, build_detector
from ._paste import paste_masks
from ._targets import RegionPredictions
from ._window import network_picture

STAGE = "detector"
"""Name of this stage in files with weights."""
_LEAST_PIXELS = 4


class DetectorStage:
    """Finds the objects in upright panoramas.

    Attributes:
        network: The detector.
        score_threshold: Detections below are left out.
        mask_height: Rows of the masks; None for those of the image.
    """

    def __init__(
        self,
        network: DetectorNetwork,
        *,
        score_threshold: float = 0.3,
        mask_height: int | None = None,
    ) -> None:
        self.network = network.eval()
        self.score_threshold = score_threshold
        self.mask_height = mask_height

    @torch.inference_mode()
    def __call__(self, image: Float[Tensor, "3 height width"]) -> Detections:
        """Return what is seen in an upright panorama, best first.

        Args:
            image: RGB in [0, 1], twice as wide as high.

        Raises:
            ValueError: The image is not twice as wide as high.
        """
        device = next(self.network.parameters()).device
        picture = network_picture(image[None].to(device), self.network.config)
        (found,) = self.network(picture)
        height = self.mask_height or image.shape[-2]
        return detections_of(found, self.network.config, height, self.score_threshold)


def detections_of(
    found: RegionPredictions,
    config: DetectorConfig,
    height: int,
    score_threshold: float = 0.0,
) -> Detections:
    """Return what a network found in its picture as detections on the sphere.

    Args:
        found: In one picture.
        config: Of the network.
        height: Rows of the panorama that the masks are drawn on.
        score_threshold: Detections below are left out.
    """
    sure = found.score >= score_threshold
    found = RegionPredictions(
        found.boxes[sure], found.category[sure], found.score[sure], found.mask[sure]
    )
    masks = paste_masks(found.mask, found.boxes, config, height)
    empty = masks.flatten(1).sum(1) < _LEAST_PIXELS
    if empty.any():
        masks[empty] = _boxes_as_masks(found, empty, config, height)
    return merge_detections(found, masks, config)


def load_detector_stage(
    edition: Edition = "compact",
    weights: Path | None = None,
    device: str = "cpu",
    *,
    score_threshold: float = 0.3,
    mask_height: int | None = None,
) -> DetectorStage:
    """Return a detector with trained weights.

    Args:
        edition: ``compact`` or ``paper``.
        weights: A file of the edition; by default the compact one that comes with this package.
        device: Where it runs.
        score_threshold: Detections below are left out.
        mask_height: Rows of the masks; None for those of the image.

    Raises:
        CheckpointError: The file is missing or for another network.
    """
    path = weights_file(STAGE, edition, weights)
    network = load_network(path, build_detector, CONFIGS[edition], stage=STAGE, edition=edition)
    return DetectorStage(
        network.to(device), score_threshold=score_threshold, mask_height=mask_height
    )


def _boxes_as_masks(
    found: RegionPredictions, chosen: Bool[Tensor, " n"], config: DetectorConfig, height: int
) -> Bool[Tensor, "k height width"]:
    """Return boxes as masks, at least two pixels wide and high."""
    boxes = found.boxes[chosen]
    centre = (boxes[:, :2] + boxes[:, 2:]) / 2
    pixel = config.width / (2 * height)
    half = ((boxes[:, 2:] - boxes[:, :2]) / 2).clamp_min(1.2 * pixel)
    full = torch.ones_like(found.mask[chosen])
    return paste_masks(full, torch.cat((centre - half, centre + half), -1), config, height)
