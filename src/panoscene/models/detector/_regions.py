"""Features of boxes, read from the level of the pyramid that suits their size.

The reading is that of Mask R-CNN (He et al., 2017, Section 3, RoIAlign) with four samples in each
cell. It is written as one weighted sum over the pixels of all levels.
"""

from collections.abc import Sequence

import torch
import torch.nn.functional as F
from jaxtyping import Float, Int
from torch import Tensor

_SAMPLES = 2
_FINEST = 4
_LEVELS = 4


def read_regions(
    pyramid: Sequence[Tensor],
    boxes: Sequence[Float[Tensor, "_ 4"]],
    cells: int,
    period: float | None,
    canonical_size: float,
) -> Float[Tensor, "n channels {cells} {cells}"]:
    """Return the features of boxes, each from the level that suits its size.

    Args:
        pyramid: Strides 4, 8, 16 and 32; a fifth level is not read.
        boxes: Of each picture.
        cells: Rows and columns that a box is cut into.
        period: Of the cylinder: boxes go on at the left edge.
        canonical_size: Boxes of this size (root of the area) are read from stride 16.
    """
    levels = pyramid[:_LEVELS]
    flat = torch.cat(list(boxes))
    area = (flat[:, 2] - flat[:, 0]) * (flat[:, 3] - flat[:, 1])
    place = (2 + (area.clamp_min(1e-6).sqrt() / canonical_size + 1e-6).log2()).floor()
    place = place.clamp(0, _LEVELS - 1).long()
    size = place.new_tensor([level.shape[-2:] for level in levels])[place]
    start = _starts(levels, place, boxes)
    inside = flat / (_FINEST * 2.0**place)[:, None]
    top, bottom, weight_v = _samples(inside[:, 1], inside[:, 3], size[:, 0], cells, wraps=False)
    left, right, weight_u = _samples(
        inside[:, 0], inside[:, 2], size[:, 1], cells, wraps=period is not None
    )
    v, u = torch.stack((top, bottom), -1).flatten(2), torch.stack((left, right), -1).flatten(2)
    rows = start[:, None, None] + v * size[:, 1, None, None]
    # regions, cells down, cells across, samples and their neighbours down and across
    pixel = rows[:, :, None, :, None] + u[:, None, :, None, :]
    weight = weight_v[:, :, None, :, None] * weight_u[:, None, :, None, :]
    table = torch.cat([level.permute(0, 2, 3, 1).flatten(0, 2) for level in levels])
    read = F.embedding_bag(
        pixel.flatten(3).flatten(0, 2),
        table,
        per_sample_weights=weight.flatten(3).flatten(0, 2).to(table),
        mode="sum",
    )
    return read.unflatten(0, (len(flat), cells, cells)).permute(0, 3, 1, 2)


def _starts(
    levels: Sequence[Tensor], place: Int[Tensor, " n"], boxes: Sequence[Tensor]
) -> Int[Tensor, " n"]:
    """Return the first pixel of each region's picture on its level, in a table of all pixels."""
    pixels = place.new_tensor([level.shape[-2] * level.shape[-1] for level in levels])
    before = (pixels * levels[0].shape[0]).cumsum(0) - pixels * levels[0].shape[0]
    counts = place.new_tensor([len(one) for one in boxes])
    picture = torch.arange(len(boxes), device=place.device).repeat_interleave(counts)
    return before[place] + picture * pixels[place]


def _samples(
    low: Float[Tensor, " n"],
    high: Float[Tensor, " n"],
    size: Int[Tensor, " n"],
    cells: int,
    *,
    wraps: bool,
) -> tuple[Int[Tensor, "n {cells} 2"], Int[Tensor, "n {cells} 2"], Float[Tensor, "n {cells} 4"]]:
    """Return two neighbours of each sample along an axis, and their shares in the cell's mean."""
    offset = (torch.arange(cells * _SAMPLES, device=low.device) + 0.5) / (cells * _SAMPLES)
    place = low[:, None] + (high - low).clamp_min(1)[:, None] * offset
    if wraps:
        before = place.floor()
        share = place - before
        first = before.long() % size[:, None]
        second = (first + 1) % size[:, None]
    else:
        last = (size - 1)[:, None]
        place = place.clamp_min(0).minimum(last.to(place))
        first = place.long()
        share = place - first
        second = (first + 1).minimum(last)
    shares = torch.stack((1 - share, share), -1) / _SAMPLES
    first, second = (index.unflatten(1, (cells, _SAMPLES)) for index in (first, second))
    return first, second, shares.unflatten(1, (cells, _SAMPLES)).flatten(2)
