"""The layout stage: an upright panorama in, a room out."""

from dataclasses import dataclass
from pathlib import Path

import torch
import torch.nn.functional as F
from jaxtyping import Float
from torch import Tensor

from panoscene._editions import Edition
from panoscene.models._weights import load_network, weights_file
from panoscene.models.layout._config import CONFIGS
from panoscene.models.layout._network import LayoutNetwork, build_layout
from panoscene.models.layout._room import room_from_signals
from panoscene.scene import Layout

STAGE = "layout"
"""Name of this stage in files with weights."""
PUBLISHED_COLUMNS = 4
"""Columns of a step in HorizonNet. Where a step gives more, they are off in a pattern that repeats
from step to step, and the boundary is smoothed over one step."""


@dataclass(frozen=True, slots=True)
class LayoutPrediction:
    """The room of a panorama and the signals it was read from."""

    layout: Layout
    """With ``raw_polygon`` and ``wall_score``."""
    ambiguous: bool
    """Whether another room explains the panorama about as well, as at an open doorway."""
    boundary: Float[Tensor, "2 1024"]
    """Latitude in radians, positive up, of the ceiling boundary and of the floor boundary."""
    corner: Float[Tensor, " 1024"]
    """Probability of a corner in each column."""


class LayoutStage:
    """Reads the room from an upright panorama.

    Attributes:
        network: The network, in evaluation mode.
        camera_height: Metres from the floor to the camera, where a call does not say.
    """

    def __init__(self, network: LayoutNetwork, *, camera_height: float = 1.6) -> None:
        self.network = network.eval()
        self.camera_height = camera_height

    @torch.inference_mode()
    def __call__(
        self, image: Float[Tensor, "3 height width"], *, camera_height: float | None = None
    ) -> LayoutPrediction:
        """Return the room that a panorama shows.

        Args:
            image: Upright, RGB in [0, 1], of any size.
            camera_height: Metres; the room's size is proportional to it.

        Raises:
            ValueError: The camera height is not positive, or the image has no pixels.
        """
        height = self.camera_height if camera_height is None else camera_height
        boundary, corner = self.signals(image[None])
        reading = room_from_signals(boundary[0], corner[0], height)
        return LayoutPrediction(reading.layout, reading.ambiguous, boundary[0], corner[0])

    @torch.inference_mode()
    def signals(
        self, images: Float[Tensor, "batch 3 height width"]
    ) -> tuple[Float[Tensor, "batch 2 1024"], Float[Tensor, "batch 1024"]]:
        """Return boundaries (radians, positive up) and corner probabilities of panoramas."""
        config = self.network.config
        weight = self.network.head.weight
        images = images.to(weight.device, weight.dtype)
        images = resized_panorama(images, (config.image_height, config.image_width))
        if images.device.type == "cpu":
            images = images.contiguous(memory_format=torch.channels_last)
        found = self.network(images)
        boundary = found.boundary.float().cpu()
        if self.network.columns > PUBLISHED_COLUMNS:
            boundary = _smoothed(boundary, self.network.columns // 2)
        return boundary, torch.sigmoid(found.corner.float()).cpu()


def _smoothed(
    rows: Float[Tensor, "batch rows columns"], reach: int
) -> Float[Tensor, "batch rows columns"]:
    """Return means over neighbouring columns, around the seam."""
    around = torch.cat((rows[..., -reach:], rows, rows[..., :reach]), dim=-1)
    return F.avg_pool1d(around, 2 * reach + 1, stride=1)


def resized_panorama(
    images: Float[Tensor, "batch 3 height width"], size: tuple[int, int]
) -> Float[Tensor, "batch 3 rows columns"]:
    """Return panoramas at another size; each pixel is a mean of what it covers."""
    if tuple(images.shape[-2:]) == size:
        return images
    rows, columns = images.shape[-2:]
    if rows % size[0] == 0 and columns % size[1] == 0:
        return F.avg_pool2d(images, (rows // size[0], columns // size[1]))
    smaller = rows > size[0]
    return F.interpolate(images, size=size, mode="bilinear", align_corners=False, antialias=smaller)


def load_layout_stage(
    edition: Edition = "compact", weights: Path | None = None, device: str = "cpu"
) -> LayoutStage:
    """Return the layout stage with its weights.

    Args:
        edition: Which network.
        weights: Its weights; None takes those that come with this package.
        device: Of PyTorch.

    Raises:
        CheckpointError: There are no such weights, or they are for another network.
    """
    path = weights_file(STAGE, edition, weights)
    network = load_network(path, build_layout, CONFIGS[edition], stage=STAGE, edition=edition)
    network.to(device)
    if device == "cpu":
        network.to(memory_format=torch.channels_last)
    return LayoutStage(network)
