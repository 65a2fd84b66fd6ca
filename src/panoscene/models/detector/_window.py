"""The part of a panorama that the detector looks at, at its own size."""

import torch
import torch.nn.functional as F
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry import panorama_directions

from ._config import DetectorConfig


def network_picture(
    image: Float[Tensor, "batch 3 height width"], config: DetectorConfig
) -> Float[Tensor, "batch 3 rows columns"]:
    """Return panoramas as the network sees them: scaled, rows near the poles cut off.

    Where the config extends panoramas, their left half is there again at the right.

    Args:
        image: Upright panoramas, RGB in [0, 1].
        config: Of the network.

    Raises:
        ValueError: The image is not twice as wide as high.
    """
    height, width = image.shape[-2:]
    if width != 2 * height:
        raise ValueError(
            f"image: found {width} x {height} pixels, expected a panorama twice as wide as high"
        )
    if width != config.width:
        size = (config.width // 2, config.width)
        image = F.interpolate(image, size, mode="bilinear", antialias=True, align_corners=False)
        image = image.clamp(0.0, 1.0)
    return extended(image[..., config.first_row : config.first_row + config.rows, :], config)


def window_directions(config: DetectorConfig) -> Float[Tensor, "rows columns 3"]:
    """Return the viewing directions of the network's pixels, before any extension."""
    whole = panorama_directions(config.width // 2, config.width, like=torch.zeros(()))
    return whole[config.first_row : config.first_row + config.rows]


def extended(image: Tensor, config: DetectorConfig) -> Tensor:
    """Return pictures with their left half appended, where the config says so."""
    if config.seam != "extend":
        return image
    return torch.cat((image, image[..., : config.width // 2]), -1)
