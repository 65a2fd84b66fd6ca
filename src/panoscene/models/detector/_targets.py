"""What the detector learns from and what it gives, in pixels of its own picture."""

from dataclasses import dataclass

import torch
from jaxtyping import Float, Int
from torch import Tensor


@dataclass(frozen=True, slots=True)
class DetectorTargets:
    """The objects of one picture."""

    boxes: Float[Tensor, "n 4"]
    """Left, top, right, bottom; at the seam the right edge is beyond the picture's."""
    category: Int[Tensor, " n"]
    """Index into ``CATEGORIES``."""
    instance: Int[Tensor, " n"]
    """Value of each object in ``instances``."""
    instances: Int[Tensor, "rows columns"]
    """Which object is seen at each pixel; masks of all objects at once."""
    ignored: Float[Tensor, "k 4"]
    """Boxes of what may be found or not."""
    seed: int = 0
    """Of the choice of anchors and proposals that the losses look at."""


@dataclass(frozen=True, slots=True)
class RegionPredictions:
    """What the network found in one picture, best first."""

    boxes: Float[Tensor, "n 4"]
    """As in the targets."""
    category: Int[Tensor, " n"]
    score: Float[Tensor, " n"]
    mask: Float[Tensor, "n size size"]
    """Probability that a part of the box belongs to the object."""


def mask_targets(
    targets: DetectorTargets, boxes: Float[Tensor, "n 4"], match: Int[Tensor, " n"], size: int
) -> Float[Tensor, "n {size} {size}"]:
    """Return the share of each cell of boxes, cut in size x size, that their objects fill.

    Args:
        targets: Of the picture.
        boxes: Proposals.
        match: Index of the object of each.
        size: Cells in a row.
    """
    rows, columns = targets.instances.shape
    step = (torch.arange(2 * size, device=boxes.device) + 0.5) / (2 * size)
    u = boxes[:, :1] + step * (boxes[:, 2:3] - boxes[:, :1])
    v = boxes[:, 1:2] + step * (boxes[:, 3:] - boxes[:, 1:2])
    u = u.floor().long() % columns
    v = v.floor().long().clamp(0, rows - 1)
    seen = targets.instances[v[:, :, None], u[:, None, :]]
    filled = (seen == targets.instance[match][:, None, None]).float()
    return torch.nn.functional.avg_pool2d(filled[:, None], 2)[:, 0]
