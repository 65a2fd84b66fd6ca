"""Interpolation by direct look-up: the one sampler behind panoramas, crops and cube maps.

``torch.nn.functional.grid_sample`` knows neither a circular border nor one that continues over
the poles, and cannot look up integers. Padding for it would copy the whole panorama; here the
neighbours of a sample are found in tables as long as the image's sides, so a crop of a large
panorama reads only the pixels it needs.
"""

import math
from dataclasses import dataclass

import torch
from jaxtyping import Float, Int, Shaped
from torch import Tensor

MODES = ("bilinear", "nearest", "bicubic")

MARGIN = 2
"""Rows and columns beyond each border that interpolation may ask for."""


@dataclass(frozen=True, slots=True)
class Border:
    """What lies at each row and column of an image, ``MARGIN`` more on either side included."""

    row_start: Int[Tensor, " rows"]
    """Index in the flattened image of the first pixel of the row."""
    row_shift: Int[Tensor, " rows"]
    """Columns by which the row is turned: entries of ``column`` to skip."""
    column: Int[Tensor, " columns"]
    """Column of the image; longer than its width by the largest shift."""


def interpolate(
    image: Shaped[Tensor, "*#batch channels height width"],
    uv: Float[Tensor, "*#batch rows columns 2"],
    mode: str,
    border: Border,
) -> Shaped[Tensor, "*#batch channels rows columns"]:
    """Return the image at continuous pixels, batches broadcast against each other.

    Args:
        image: Any type for "nearest", floating point for the others.
        uv: Continuous pixels (u, v); the centre of pixel (row i, column j) is (j + 0.5, i + 0.5).
            They lie within the tables; those that do not are moved to the nearest that does.
        mode: One of "bilinear", "nearest" and "bicubic" (Keys 1981 with a = -1/2).
        border: What lies around the image.

    Raises:
        ValueError: If the mode is unknown or would mix integers.
    """
    _check_mode(image, mode)
    height, width = image.shape[-2:]
    images = image.shape[:-3]
    # all images side by side: one gradient buffer, and no copy of an image that many crops share
    values = image.movedim(-3, 0).flatten(1)
    first = (torch.arange(math.prod(images), device=image.device) * (height * width)).view(images)
    corner = (uv.detach() - (0.0 if mode == "nearest" else 0.5)).floor()
    column, row = corner.long().unbind(-1)
    # counted from the first entry of the tables for the tap before the corner
    row = row.add_(MARGIN - 1).clamp_(0, len(border.row_start) - 4)
    column = column.add_(MARGIN - 1).clamp_(0, width)

    def look_up(start: Tensor, turned: Tensor, tap: int) -> Tensor:
        index = _entries(border.column, tap, turned) + start
        found = values.gather(1, index.flatten().expand(values.shape[0], -1))
        return found.view(values.shape[0], *index.shape)

    if mode == "nearest":
        start = _entries(border.row_start, 0, row) + first[..., None, None]
        turned = _entries(border.row_shift, 0, row).add_(column)
        return look_up(start, turned, 0).movedim(0, -3).contiguous()
    fraction = (uv - 0.5 - corner).to(image.dtype)
    weights = _linear_weights if mode == "bilinear" else _cubic_weights
    across, down = weights(fraction[..., 0]), weights(fraction[..., 1])
    total = torch.zeros((), dtype=image.dtype, device=image.device)
    for i, weight_down in down.items():
        start = _entries(border.row_start, i, row) + first[..., None, None]
        turned = _entries(border.row_shift, i, row).add_(column)
        for j, weight_across in across.items():
            found = look_up(start, turned, j)
            total = torch.addcmul(total, weight_down * weight_across, found)
    return total.movedim(0, -3).contiguous()


def over_the_poles(height: int, width: int, device: torch.device) -> Border:
    """Return the border of a panorama, whose rows run from pole to pole and up the other side.

    Columns have the period ``width`` and rows the period ``2 * height``: those past the bottom
    are the same rows in reverse, half a turn away (rounded down where ``width`` is odd).
    """
    _check_sides(height, width)
    row = torch.arange(-MARGIN, 2 * height + MARGIN, device=device) % (2 * height)
    beyond = row >= height
    row = torch.where(beyond, 2 * height - 1 - row, row)
    column = torch.arange(-MARGIN, width + width // 2 + MARGIN, device=device) % width
    return Border(row * width, beyond * (width // 2), column)


def clamped(height: int, width: int, device: torch.device) -> Border:
    """Return the border of an ordinary image, which repeats its outermost pixels."""
    _check_sides(height, width)
    row = torch.arange(-MARGIN, height + MARGIN, device=device).clamp(0, height - 1)
    column = torch.arange(-MARGIN, width + MARGIN, device=device).clamp(0, width - 1)
    return Border(row * width, torch.zeros_like(row), column)


def _entries(table: Tensor, tap: int, index: Tensor) -> Tensor:
    return table[1 + tap :].index_select(0, index.flatten()).view(index.shape)


def _linear_weights(fraction: Tensor) -> dict[int, Tensor]:
    return {0: 1 - fraction, 1: fraction}


def _cubic_weights(fraction: Tensor) -> dict[int, Tensor]:
    f, rest = fraction, 1 - fraction
    return {
        -1: -0.5 * f * rest * rest,
        0: 1 + f * f * (1.5 * f - 2.5),
        1: 1 + rest * rest * (1.5 * rest - 2.5),
        2: -0.5 * f * f * rest,
    }


def _check_mode(image: Tensor, mode: str) -> None:
    if mode not in MODES:
        raise ValueError(f"mode: found {mode!r}, expected one of {', '.join(MODES)}")
    if mode != "nearest" and not image.is_floating_point():
        raise ValueError(
            f"image: found {image.dtype} for mode {mode!r}, expected floating point"
            " (labels are looked up with mode 'nearest')"
        )


def _check_sides(height: int, width: int) -> None:
    if height < 1 or width < 1:
        raise ValueError(f"image: found {height} x {width} pixels, expected at least 1 x 1")
