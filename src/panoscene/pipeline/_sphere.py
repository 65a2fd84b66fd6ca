"""Whether a picture shows the whole sphere, or was filled up to twice its height."""

import math
from dataclasses import dataclass

import torch
from jaxtyping import Float, Int64
from torch import Tensor

LEAST_BAND = math.radians(8.0)
"""Radians that a band at a pole must be high to count: cameras often hide their own foot."""
LEAST_SIDE = math.radians(3.0)
"""Radians that columns without a picture must span together to count."""
STRETCHED = 0.13
"""Spread of colours along the row at a pole, which is one point, from which it cannot be one."""
_PLAIN = 2.5 / 255
"""Spread of colours in columns that show nothing."""
_MOST, _LEAST = 16.0 / 255, 0.3 / 255
"""Larger and smaller changes from row to row count as these."""
_SHARPER = 2.5
"""How much more rows change behind the straight edge of a band than in it."""
_STRAIGHT = 0.7
"""Share of the columns in which that is so at the same row."""
_EDGE, _NEAR = 8, 16
"""Rows in which an edge may be blurred, and rows before and behind it that are compared."""
_RUN = 16
"""Columns that are averaged before colours at a pole are compared."""


@dataclass(frozen=True, slots=True)
class SphereGaps:
    """What a picture lacks of the sphere around the camera, in radians."""

    top: float
    """Height of the plain or blurred band at the upper pole."""
    bottom: float
    """Height of that at the lower pole."""
    sides: float
    """Width of all columns of one colour together."""
    spread: float
    """Standard deviation of colours around a pole, the larger of both: 0 on a whole sphere."""

    @property
    def whole(self) -> bool:
        """Whether nothing noteworthy is missing."""
        return not self.where and self.spread < STRETCHED

    @property
    def where(self) -> str:
        """What is plain or blurred, in words; empty when that is nothing noteworthy."""
        parts = [
            (self.top, LEAST_BAND, "at the top"),
            (self.bottom, LEAST_BAND, "at the bottom"),
            (self.sides, LEAST_SIDE, "from side to side"),
        ]
        missing = [
            f"{math.degrees(a):.0f} degrees {name}" for a, least, name in parts if a >= least
        ]
        return " and ".join(missing) + " are plain or blurred" if missing else ""


def sphere_gaps(image: Float[Tensor, "3 height width"]) -> SphereGaps:
    """Return what an equirectangular picture lacks of the whole sphere.

    Bands count that reach a pole, change little from row to row, and end in a straight edge along
    nearly all columns: a white ceiling ends where its walls are. The rows at the poles show one
    point each; if their colours vary, a part of the sphere was stretched to twice its height.

    Args:
        image: as it was taken, RGB in [0, 1].

    Source: ours.
    """
    height, width = image.shape[-2:]
    rows, columns = math.pi / height, 2 * math.pi / width
    sides = image.std(dim=1).amax(dim=0) < _PLAIN
    image = image[:, :, ~sides]
    if image.shape[-1] == 0:
        return SphereGaps(0.0, 0.0, 2 * math.pi, 0.0)
    return SphereGaps(
        _band(image) * rows,
        _band(image.flip(1)) * rows,
        int(sides.sum()) * columns,
        max(_spread(image[:, 0]), _spread(image[:, -1])),
    )


def _spread(row: Float[Tensor, "3 width"]) -> float:
    """Return how colours along a row vary, but for noise and single pixels."""
    if row.shape[-1] < 2 * _RUN:
        return 0.0
    smooth = torch.nn.functional.avg_pool1d(row, _RUN)
    return float(smooth.std(dim=-1).amax())


def _band(image: Float[Tensor, "3 height width"]) -> int:
    """Return the rows of the plain or blurred band at the top of a picture; 0 without one."""
    if image.shape[1] < 4 * (_EDGE + _NEAR):
        return 0
    change = (image[:, 1:] - image[:, :-1]).abs().amax(dim=0).clamp(max=_MOST)
    total = torch.cat((torch.zeros_like(change[:1]), change.cumsum(dim=0)))
    row = torch.arange(_EDGE + _NEAR, len(change) // 2 - _NEAR)

    def mean(first: Int64[Tensor, " rows"], last: Int64[Tensor, " rows"]) -> Tensor:
        return (total[last] - total[first]) / (last - first)[:, None]

    # the edge itself, which compression spreads over some rows, belongs to neither side
    inside = mean(torch.zeros_like(row), row - _EDGE)
    before = mean(row - _EDGE - _NEAR, row - _EDGE)
    behind = mean(row, row + _NEAR)
    sharper = behind > _SHARPER * torch.maximum(inside, before).clamp(min=_LEAST)
    share = sharper.float().mean(dim=1)
    best = row[share > max(_STRAIGHT, 0.95 * float(share.max()))]
    return int(best[-1]) if len(best) else 0
