"""Masks of boxes laid onto the panorama."""

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from ._config import DetectorConfig

_AT_ONCE = 16  # masks; keeps the working memory below about 50 MB


def paste_masks(
    mask: Float[Tensor, "n size size"],
    boxes: Float[Tensor, "n 4"],
    config: DetectorConfig,
    height: int,
) -> Bool[Tensor, "n {height} columns"]:
    """Return which pixels of the panorama belong to each object.

    Cells are interpolated bilinearly and fade out at the edge of the box. Both axes are separate,
    so this is two matrix products for each mask. Columns beyond the panorama's edge go on at the
    other one.

    Args:
        mask: Probabilities in the cells of each box.
        boxes: In pixels of the network's picture, at most one turn wide.
        config: Of the network.
        height: Rows of the panorama; it has twice as many columns.
    """
    scale = 2 * height / config.width
    left, top, right, bottom = (boxes * scale).unbind(-1)
    top, bottom = top + config.first_row * scale, bottom + config.first_row * scale
    size = mask.shape[-1]
    row = torch.arange(height, device=mask.device) + 0.5
    column = torch.arange(2 * height, device=mask.device) + 0.5
    # a column beyond either edge of the box is taken where it is nearest to the box's centre
    centre = (left + right)[:, None] / 2
    column = centre + (column - centre + height) % (2 * height) - height
    down = _cell_weights(row.expand(len(mask), -1), top, bottom, size)
    across = _cell_weights(column, left, right, size)
    pasted = [
        (down[k : k + _AT_ONCE] @ mask[k : k + _AT_ONCE] @ across[k : k + _AT_ONCE].mT) > 0.5
        for k in range(0, len(mask), _AT_ONCE)
    ]
    return torch.cat(pasted) if pasted else mask.new_zeros(0, height, 2 * height).bool()


def _cell_weights(
    place: Float[Tensor, "n places"],
    low: Float[Tensor, " n"],
    high: Float[Tensor, " n"],
    size: int,
) -> Float[Tensor, "n places {size}"]:
    """Return how much each cell between two ends counts at each place."""
    cell = (place - low[:, None]) / (high - low).clamp_min(1e-3)[:, None] * size - 0.5
    apart = cell[..., None] - torch.arange(size, device=place.device)
    return (1.0 - apart.abs()).clamp_(0.0, 1.0)
