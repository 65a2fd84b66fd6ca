"""Boxes (left, top, right, bottom) in pixels, on a picture or on a cylinder.

With a period, places that differ by it are the same; a box is at most one period wide.
"""

from typing import NamedTuple

import torch
from jaxtyping import Float, Int
from torch import Tensor


class Frame(NamedTuple):
    """The picture that boxes are on."""

    height: int
    width: int
    period: float | None
    """Of the cylinder; None where the picture has a left and a right edge."""


def box_overlaps(
    a: Float[Tensor, "n 4"], b: Float[Tensor, "m 4"], period: float | None
) -> tuple[Float[Tensor, "n m"], Float[Tensor, "n m"]]:
    """Return the areas shared by all pairs of boxes, and their intersections over unions.

    Boxes wider than half a period may meet on both sides; the larger meeting counts.
    """
    centre_a, centre_b = (a[:, 0] + a[:, 2]) / 2, (b[:, 0] + b[:, 2]) / 2
    width_a, width_b = a[:, 2] - a[:, 0], b[:, 2] - b[:, 0]
    apart = centre_a[:, None] - centre_b
    if period is not None:
        apart = apart - (apart / period).round_().mul_(period)
    across = (width_a[:, None] + width_b).div_(2).sub_(apart.abs_())
    across = across.minimum(width_a[:, None]).minimum(width_b).clamp_min_(0)
    along = torch.minimum(a[:, 3:4], b[:, 3]) - torch.maximum(a[:, 1:2], b[:, 1])
    shared = across.mul_(along.clamp_min_(0))
    area_a, area_b = width_a * (a[:, 3] - a[:, 1]), width_b * (b[:, 3] - b[:, 1])
    either = (area_a[:, None] + area_b).sub_(shared)
    return shared, shared / either.clamp_min_(1e-6)


def nearest_turn(
    boxes: Float[Tensor, "n 4"], reference: Float[Tensor, "n 4"], period: float | None
) -> Float[Tensor, "n 4"]:
    """Return boxes moved by whole periods to be nearest to the boxes beside them."""
    if period is None:
        return boxes
    apart = (reference[:, 0] + reference[:, 2] - boxes[:, 0] - boxes[:, 2]) / 2
    shift = (apart / period).round() * period
    return boxes + shift[:, None] * boxes.new_tensor([1.0, 0.0, 1.0, 0.0])


def within_picture(boxes: Float[Tensor, "n 4"], frame: Frame) -> Float[Tensor, "n 4"]:
    """Return boxes cut at the edges of the picture; on a cylinder, with their left edge on it.

    There they are cut at top and bottom, and to one period around their centre.
    """
    height, width, period = frame
    left, top, right, bottom = boxes.unbind(-1)
    top, bottom = top.clamp(0, height), bottom.clamp(0, height)
    if period is None:
        return torch.stack((left.clamp(0, width), top, right.clamp(0, width), bottom), -1)
    half = (right - left).clamp(0, period) / 2
    start = (left + right) / 2 - half
    start = start - (start / period).floor() * period
    return torch.stack((start, top, start + 2 * half, bottom), -1)


def suppress(
    boxes: Float[Tensor, "n 4"],
    score: Float[Tensor, " n"],
    group: Int[Tensor, " n"] | None,
    threshold: float,
    period: float | None,
) -> Int[Tensor, " kept"]:
    """Return the boxes kept by greedy non-maximum suppression, best first.

    Args:
        boxes: On the picture or cylinder.
        score: Larger is better.
        group: Boxes of different groups do not compete.
        threshold: Largest intersection over union of two that are kept.
        period: Of the cylinder.
    """
    order = score.argsort(descending=True, stable=True)
    boxes = boxes[order]
    rival = (box_overlaps(boxes, boxes, period)[1] > threshold).triu_(1)
    if group is not None:
        rival &= group[order, None] == group[order]
    rival = rival.float()
    kept = torch.ones_like(score, dtype=torch.bool)
    while True:  # the one fixed point is greedy suppression; each pass settles at least one box
        again = (kept.float() @ rival) == 0
        if torch.equal(again, kept):
            return order[kept]
        kept = again
