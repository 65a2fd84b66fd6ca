"""Separating axes of upright boxes: how deep two boxes overlap, how far they are apart.

Two upright boxes are disjoint exactly when one of six directions separates them: the right,
front and up of either box. All functions broadcast over the batch axes of the two arguments, so
that every pair of ``boxes`` is ``f(boxes[:, None], boxes[None, :])``.
"""

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene.geometry._boxes import box_footprint
from panoscene.geometry._oriented_boxes import OrientedBoxes

SMALLEST_SHRUNK_SIZE = 0.01
"""A tolerance never shrinks an extent below this many metres."""


def separation_margins(a: OrientedBoxes, b: OrientedBoxes) -> Float[Tensor, "*batch 6"]:
    """Return by how much the two boxes' projections overlap on each axis, in metres.

    A margin is the sum of the two half widths minus the distance of the centres along the axis.
    Positive, it is the overlap; negative, it is minus the gap. Its absolute value is the d_x of
    the paper (Sec. 3.3), min(abs(a_max - b_min), abs(a_min - b_max)), without computing corners.

    Convention:
        - order: x of a, y of a, x of b, y of b, z of a, z of b (the last two are equal)

    Examples:
        >>> box = OrientedBoxes(torch.zeros(3), torch.full((3,), 2.0), torch.tensor(0.0))
        >>> moved = OrientedBoxes(torch.tensor([1.5, 0.0, 0.0]), box.size, box.yaw)
        >>> separation_margins(box, moved).tolist()
        [0.5, 2.0, 0.5, 2.0, 2.0, 2.0]
    """
    x_a, y_a, z_a = (a.size / 2).unbind(dim=-1)
    x_b, y_b, z_b = (b.size / 2).unbind(dim=-1)
    x, y, z = (b.centre - a.centre).unbind(dim=-1)
    cos_a, sin_a = torch.cos(a.yaw), torch.sin(a.yaw)
    cos_b, sin_b = torch.cos(b.yaw), torch.sin(b.yaw)
    # of the relative yaw, from each box's own: pairs are many, boxes few
    cos = (cos_a * cos_b + sin_a * sin_b).abs()
    sin = (cos_a * sin_b - sin_a * cos_b).abs()
    up = z_a + z_b - z.abs()
    margins = [
        x_a + x_b * cos + y_b * sin - (x * cos_a + y * sin_a).abs(),
        y_a + x_b * sin + y_b * cos - (y * cos_a - x * sin_a).abs(),
        x_b + x_a * cos + y_a * sin - (x * cos_b + y * sin_b).abs(),
        y_b + x_a * sin + y_a * cos - (y * cos_b - x * sin_b).abs(),
        up,
        up,
    ]
    return torch.stack(margins, dim=-1)


def separation_weights(a: OrientedBoxes, b: OrientedBoxes) -> Float[Tensor, "*batch 6"]:
    """Return weights that make equal axes count once, in the order of ``separation_margins``.

    The paper's sum has the vertical axis twice, and every horizontal axis twice when the boxes are
    parallel or at a right angle. With these weights the vertical axis counts once, and so does
    every horizontal direction: (1 + sin^2(2 t)) / 2 for boxes turned by t against each other, that
    is one half of each duplicate at 0 and 90 degrees and one at 45 degrees, where all four
    directions differ. The weight is smooth in t, so nothing jumps as boxes become parallel.

    Examples:
        >>> box = OrientedBoxes(torch.zeros(3), torch.ones(3), torch.tensor(0.3))
        >>> separation_weights(box, box).tolist()
        [0.5, 0.5, 0.5, 0.5, 0.5, 0.5]
    """
    horizontal = (1 + torch.sin(2 * (b.yaw - a.yaw)).square()) / 2
    vertical = torch.full_like(horizontal, 0.5)
    return torch.stack([horizontal] * 4 + [vertical] * 2, dim=-1)


def boxes_collide(
    a: OrientedBoxes, b: OrientedBoxes, tolerance: float = 0.0
) -> Bool[Tensor, "*batch"]:
    """Return whether two boxes overlap; boxes that only touch do not.

    Convention:
        - the tolerance in metres is taken off every extent of both boxes first (half on each side,
          never below 1 cm), so two boxes must overlap by more than it. A negative one grows the
          boxes: they collide when less than that apart

    Examples:
        >>> box = OrientedBoxes(torch.zeros(3), torch.ones(3), torch.tensor(0.0))
        >>> moved = OrientedBoxes(torch.tensor([0.95, 0.0, 0.0]), box.size, box.yaw)
        >>> bool(boxes_collide(box, moved)), bool(boxes_collide(box, moved, tolerance=0.1))
        (True, False)
    """
    return (separation_margins(_shrunk(a, tolerance), _shrunk(b, tolerance)) > 0).all(dim=-1)


def collision_error(
    a: OrientedBoxes, b: OrientedBoxes, *, tolerance: float = 0.0, duplicate_axes: bool = True
) -> Float[Tensor, "*batch"]:
    """Return the sum of the overlaps over all axes in metres if the boxes collide, else zero.

    The paper's e^oc (Sec. 3.3). It jumps when the boxes start to collide; a smooth measure of the
    same thing is ``penetration_depth``.

    Convention:
        - ``tolerance`` as in ``boxes_collide``
        - ``duplicate_axes`` true is the paper's sum over six axes, false weighs them by
          ``separation_weights``

    Examples:
        >>> big = OrientedBoxes(torch.zeros(3), torch.full((3,), 2.0), torch.tensor(0.0))
        >>> small = OrientedBoxes(torch.zeros(3), torch.ones(3), torch.tensor(0.0))
        >>> float(collision_error(big, small))
        9.0
        >>> float(collision_error(big, small, duplicate_axes=False))
        4.5
    """
    a, b = _shrunk(a, tolerance), _shrunk(b, tolerance)
    margins = separation_margins(a, b)
    overlap = margins if duplicate_axes else margins * separation_weights(a, b)
    collide = (margins > 0).all(dim=-1)
    return torch.where(collide, overlap.sum(dim=-1), 0.0)


def touch_error(
    a: OrientedBoxes, b: OrientedBoxes, *, tolerance: float = 0.0, duplicate_axes: bool = True
) -> Float[Tensor, "*batch"]:
    """Return the sum of the gaps over the axes without overlap in metres; zero on collision.

    The paper's e^oa (Sec. 3.3); continuous, and zero exactly where the boxes touch or overlap.

    Convention:
        - as in ``collision_error``

    Examples:
        >>> big = OrientedBoxes(torch.zeros(3), torch.full((3,), 2.0), torch.tensor(0.0))
        >>> small = OrientedBoxes(torch.tensor([4.0, 0.0, 0.0]), torch.ones(3), torch.tensor(0.0))
        >>> float(touch_error(big, small))
        5.0
        >>> float(touch_error(big, small, duplicate_axes=False))
        2.5
    """
    a, b = _shrunk(a, tolerance), _shrunk(b, tolerance)
    # colliding boxes have no axis with a gap, so the sum is zero without asking
    gaps = torch.relu(-separation_margins(a, b))
    return (gaps if duplicate_axes else gaps * separation_weights(a, b)).sum(dim=-1)


def penetration_depth(
    a: OrientedBoxes, b: OrientedBoxes, tolerance: float = 0.0
) -> Float[Tensor, "*batch"]:
    """Return how many metres one box must move for the two to separate; zero if they do not meet.

    The smallest margin: the length of the shortest translation that ends the overlap.

    Convention:
        - ``tolerance`` as in ``boxes_collide``

    Examples:
        >>> box = OrientedBoxes(torch.zeros(3), torch.ones(3), torch.tensor(0.0))
        >>> moved = OrientedBoxes(torch.tensor([0.75, 0.5, 0.0]), box.size, box.yaw)
        >>> float(penetration_depth(box, moved))
        0.25
    """
    margins = separation_margins(_shrunk(a, tolerance), _shrunk(b, tolerance))
    return torch.relu(margins.amin(dim=-1))


def gap(a: OrientedBoxes, b: OrientedBoxes) -> Float[Tensor, "*batch"]:
    """Return the Euclidean distance between two boxes in metres; zero if they touch or overlap.

    Examples:
        >>> box = OrientedBoxes(torch.zeros(3), torch.ones(3), torch.tensor(0.0))
        >>> moved = OrientedBoxes(torch.tensor([4.0, 5.0, 0.0]), box.size, box.yaw)
        >>> float(gap(box, moved))
        5.0
    """
    margins = separation_margins(a, b)
    squared = torch.minimum(_squared_corner_distance(a, b), _squared_corner_distance(b, a))
    apart = (margins[..., :4] <= 0).any(dim=-1)
    squared = torch.where(apart, squared, 0.0) + torch.relu(-margins[..., 4]).square()
    positive = squared > 0  # the square root has no slope at zero
    return torch.where(positive, torch.where(positive, squared, 1.0).sqrt(), 0.0)


def _squared_corner_distance(a: OrientedBoxes, b: OrientedBoxes) -> Float[Tensor, "*batch"]:
    """Return the squared floor-plane distance from the nearest corner of a to the rectangle b."""
    x, y = (box_footprint(a) - b.centre[..., None, :2]).unbind(dim=-1)
    cos, sin = torch.cos(b.yaw).unsqueeze(-1), torch.sin(b.yaw).unsqueeze(-1)
    half = b.size.unsqueeze(-2) / 2
    outside_x = torch.relu((x * cos + y * sin).abs() - half[..., 0])
    outside_y = torch.relu((y * cos - x * sin).abs() - half[..., 1])
    return (outside_x.square() + outside_y.square()).amin(dim=-1)


def _shrunk(boxes: OrientedBoxes, tolerance: float) -> OrientedBoxes:
    """Return the boxes with the tolerance taken off every extent, but never thinner than 1 cm.

    An extent that is already below 1 cm is kept, so a tolerance of zero changes nothing.
    """
    if tolerance == 0:
        return boxes
    floor = boxes.size.clamp(max=SMALLEST_SHRUNK_SIZE)
    return OrientedBoxes(boxes.centre, torch.maximum(boxes.size - tolerance, floor), boxes.yaw)
