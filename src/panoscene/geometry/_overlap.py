"""Exact intersection of upright boxes: area on the floor, volume and IoU."""

import torch
from jaxtyping import Float, Int
from torch import Tensor

from panoscene.geometry._boxes import box_volume
from panoscene.geometry._oriented_boxes import OrientedBoxes
from panoscene.geometry._separation import separation_margins
from panoscene.geometry._suppression import suppress

SHORTEST_EDGE = 1e-12
"""An edge that advances less than this many metres along an axis counts as perpendicular to it."""


def rectangle_intersection_area(a: OrientedBoxes, b: OrientedBoxes) -> Float[Tensor, "*batch"]:
    """Return the area in square metres that the footprints of two boxes share.

    Exact for any position and turn, differentiable with finite gradients everywhere, and free of
    sorting and of tolerances. In the axes of a, the part of b inside a has at every x the length
    clamp(y_top) - clamp(y_bottom), where y_top and y_bottom are the two edges of b above that x
    and clamp limits y to the extent of a. The area is therefore minus the sum, over the edges of b
    walked counter-clockwise, of the integral of clamp(y) dx between the limits of a, and each of
    these has a closed form that is continuous in everything.

    Convention:
        - broadcasts over the batch axes: all pairs are ``f(boxes[:, None], boxes[None, :])``

    Examples:
        >>> box = OrientedBoxes(torch.zeros(3), torch.full((3,), 2.0), torch.tensor(0.0))
        >>> moved = OrientedBoxes(torch.tensor([1.5, 1.0, 9.0]), box.size, box.yaw)
        >>> float(rectangle_intersection_area(box, moved))
        0.5
    """
    half_x, half_y = (a.size[..., :2] / 2).unbind(dim=-1)
    total = torch.zeros((), dtype=a.size.dtype, device=a.size.device)
    corners = _footprint_in(a, b)
    for start, end in zip(corners, [*corners[1:], corners[0]], strict=True):
        total = total - _clamped_integral(start, end, half_x, half_y)
    # a rounding error must not make disjoint boxes share something, nor more than either has
    apart = (separation_margins(a, b)[..., :4] <= 0).any(dim=-1)
    smaller = torch.minimum(a.size[..., 0] * a.size[..., 1], b.size[..., 0] * b.size[..., 1])
    return torch.where(apart, 0.0, torch.minimum(torch.relu(total), smaller))


def paired_intersection_volume(a: OrientedBoxes, b: OrientedBoxes) -> Float[Tensor, "*batch"]:
    """Return the volume in cubic metres that box a and box b of each pair share.

    Convention:
        - broadcasts over the batch axes; see ``box_intersection_volume`` for all pairs of two lists

    Examples:
        >>> box = OrientedBoxes(torch.zeros(3), torch.full((3,), 2.0), torch.tensor(0.0))
        >>> moved = OrientedBoxes(torch.tensor([1.5, 1.0, 1.0]), box.size, box.yaw)
        >>> float(paired_intersection_volume(box, moved))
        0.5
    """
    reach = (a.size[..., 2] + b.size[..., 2]) / 2 - (a.centre[..., 2] - b.centre[..., 2]).abs()
    height = torch.minimum(reach, torch.minimum(a.size[..., 2], b.size[..., 2]))
    return rectangle_intersection_area(a, b) * torch.relu(height)


def paired_box_iou(a: OrientedBoxes, b: OrientedBoxes) -> Float[Tensor, "*batch"]:
    """Return the exact 3D intersection over union of box a and box b of each pair.

    Two boxes without volume have IoU zero.

    Convention:
        - broadcasts over the batch axes; see ``box_iou`` for all pairs of two lists

    Examples:
        >>> box = OrientedBoxes(torch.zeros(3), torch.full((3,), 2.0), torch.tensor(0.0))
        >>> moved = OrientedBoxes(torch.tensor([0.0, 0.0, 1.0]), box.size, box.yaw)
        >>> round(float(paired_box_iou(box, moved)), 6)
        0.333333
    """
    shared = paired_intersection_volume(a, b)
    union = box_volume(a) + box_volume(b) - shared
    return torch.where(union > 0, shared / torch.where(union > 0, union, 1.0), 0.0)


def box_intersection_volume(a: OrientedBoxes, b: OrientedBoxes) -> Float[Tensor, "n m"]:
    """Return the volume in cubic metres that each of n boxes shares with each of m boxes.

    Examples:
        >>> boxes = OrientedBoxes(torch.zeros(2, 3), torch.full((2, 3), 2.0), torch.zeros(2))
        >>> box_intersection_volume(boxes, boxes[:1]).tolist()
        [[8.0], [8.0]]
    """
    return paired_intersection_volume(a[:, None], b[None, :])


def box_iou(a: OrientedBoxes, b: OrientedBoxes) -> Float[Tensor, "n m"]:
    """Return the exact 3D intersection over union of each of n boxes with each of m boxes.

    Examples:
        >>> boxes = OrientedBoxes(torch.zeros(2, 3), torch.full((2, 3), 2.0), torch.zeros(2))
        >>> box_iou(boxes, boxes[:1]).tolist()
        [[1.0], [1.0]]
    """
    return paired_box_iou(a[:, None], b[None, :])


def box_nms(
    boxes: OrientedBoxes,
    score: Float[Tensor, " n"],
    category: Int[Tensor, " n"] | None = None,
    *,
    iou_threshold: float,
) -> Int[Tensor, " kept"]:
    """Return the indices kept by greedy non-maximum suppression in 3D, by descending score.

    A box falls when a kept one of higher score, and of the same category when categories are
    given, overlaps it by more than the threshold. Equal scores keep their order.

    Args:
        boxes: n of them.
        score: Confidence of each box.
        category: Class of each box; without it all of them compete.
        iou_threshold: Largest 3D IoU that two kept boxes may have, in [0, 1].

    Raises:
        ValueError: If the threshold is outside [0, 1] or a score is not finite.

    Examples:
        >>> centre = torch.tensor([[0.0, 0.0, 1.0], [0.1, 0.0, 1.0], [3.0, 0.0, 1.0]])
        >>> boxes = OrientedBoxes(centre, torch.ones(3, 3), torch.zeros(3))
        >>> box_nms(boxes, torch.tensor([0.5, 0.9, 0.7]), iou_threshold=0.3).tolist()
        [1, 2]
    """
    return suppress(box_iou(boxes, boxes), score, category, iou_threshold)


def _footprint_in(a: OrientedBoxes, b: OrientedBoxes) -> list[tuple[Tensor, Tensor]]:
    """Return x and y of the four corners of b, counter-clockwise, in the axes of a."""
    cos_a, sin_a = torch.cos(a.yaw), torch.sin(a.yaw)
    x, y = (b.centre[..., :2] - a.centre[..., :2]).unbind(dim=-1)
    x, y = x * cos_a + y * sin_a, y * cos_a - x * sin_a
    turn = b.yaw - a.yaw
    cos, sin = torch.cos(turn), torch.sin(turn)
    half_x, half_y = (b.size[..., :2] / 2).unbind(dim=-1)
    right_x, right_y = half_x * cos, half_x * sin
    front_x, front_y = -half_y * sin, half_y * cos
    return [
        (x + p * right_x + q * front_x, y + p * right_y + q * front_y)
        for p, q in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]


def _clamped_integral(
    start: tuple[Tensor, Tensor], end: tuple[Tensor, Tensor], half_x: Tensor, half_y: Tensor
) -> Tensor:
    """Return the integral of clamp(y) dx along an edge, over the x between -half_x and half_x."""
    (x_start, y_start), (x_end, y_end) = start, end
    run = x_end - x_start
    steep = run.abs() < SHORTEST_EDGE
    slope_run = torch.where(steep, 1.0, run)
    left, right = _clamp(x_start, half_x), _clamp(x_end, half_x)
    # where the edge enters and leaves, as fractions from its own two ends; nothing for steep edges
    entry = torch.where(steep, 0.0, ((left - x_start) / slope_run).clamp(0, 1))
    leave = torch.where(steep, 0.0, ((x_end - right) / slope_run).clamp(0, 1))
    rise = y_end - y_start
    return (right - left) * _mean_of_clamp(y_start + entry * rise, y_end - leave * rise, half_y)


def _mean_of_clamp(start: Tensor, end: Tensor, limit: Tensor) -> Tensor:
    """Return the mean of clamp(y) as y goes evenly from start to end.

    The mean of the two clamped ends, corrected for the share of the way that lies beyond a limit
    at either end. No two large numbers are subtracted, so thin and far rectangles stay exact.
    """
    first, last = _clamp(start, limit), _clamp(end, limit)
    before, after, change = (start - first).abs(), (end - last).abs(), first - last
    way = before + after + change.abs()
    moving = way > 0
    share = torch.where(moving, (before - after) / torch.where(moving, way, 1.0), 0.0)
    return (first + last + share * change) / 2


def _clamp(value: Tensor, limit: Tensor) -> Tensor:
    """Return the value limited to [-limit, limit]."""
    return torch.maximum(torch.minimum(value, limit), -limit)
