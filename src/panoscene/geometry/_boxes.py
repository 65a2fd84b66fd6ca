"""Upright boxes: corners, frames, containment and how they look from a camera."""

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene.geometry._oriented_boxes import OrientedBoxes


def box_corners(boxes: OrientedBoxes) -> Float[Tensor, "*batch 8 3"]:
    """Return the eight corners of each box in metres, world frame.

    Convention:
        - bit 0 of the corner's index is x, bit 1 is y, bit 2 is z of the box's own axes, low first

        ::

                6--------7       z (up)
               /|       /|       |  y (front)
              4--------5 |       | /
              | 2------|-3       |/___ x (right)
              |/       |/
              0--------1

    Examples:
        >>> box = OrientedBoxes(torch.zeros(3), torch.tensor([2.0, 4.0, 6.0]), torch.tensor(0.0))
        >>> box_corners(box)[[0, 1, 2, 4]].tolist()
        [[-1.0, -2.0, -3.0], [1.0, -2.0, -3.0], [-1.0, 2.0, -3.0], [-1.0, -2.0, 3.0]]
    """
    index = torch.arange(8, device=boxes.centre.device)
    bits = torch.stack([index & 1, (index >> 1) & 1, (index >> 2) & 1], dim=-1)
    local = (bits.to(boxes.size.dtype) - 0.5) * boxes.size.unsqueeze(-2)
    return _turned(local, boxes.yaw.unsqueeze(-1)) + boxes.centre.unsqueeze(-2)


def box_footprint(boxes: OrientedBoxes) -> Float[Tensor, "*batch 4 2"]:
    """Return the rectangle each box covers on the floor, in metres, world frame.

    Convention:
        - counter-clockwise from above, starting at the corner that is left and behind

    Examples:
        >>> box = OrientedBoxes(torch.zeros(3), torch.tensor([2.0, 4.0, 6.0]), torch.tensor(0.0))
        >>> box_footprint(box).tolist()
        [[-1.0, -2.0], [1.0, -2.0], [1.0, 2.0], [-1.0, 2.0]]
    """
    return box_corners(boxes)[..., [0, 1, 3, 2], :2]


def boxes_from_corners(corners: Float[Tensor, "*batch 8 3"]) -> OrientedBoxes:
    """Return the upright boxes that have these corners: the inverse of ``box_corners``.

    Corners that are not exactly those of an upright box give the box with their mean centre,
    mean edge lengths and mean yaw.

    Examples:
        >>> box = OrientedBoxes(torch.zeros(3), torch.ones(3), torch.tensor(0.5))
        >>> round(float(boxes_from_corners(box_corners(box)).yaw), 6)
        0.5
    """
    x_edge = (corners[..., 1::2, :] - corners[..., 0::2, :]).mean(dim=-2)
    y_edge = (corners[..., [2, 3, 6, 7], :] - corners[..., [0, 1, 4, 5], :]).mean(dim=-2)
    z_edge = (corners[..., 4:, :] - corners[..., :4, :]).mean(dim=-2)
    # both horizontal edges vote for the yaw, so a box without width still has one
    right_x = x_edge[..., 0] + y_edge[..., 1]
    right_y = x_edge[..., 1] - y_edge[..., 0]
    squared = torch.stack([x_edge, y_edge, z_edge], dim=-2).square().sum(dim=-1)
    extended = squared > 0  # the square root has no slope at zero
    size = torch.where(extended, torch.where(extended, squared, 1.0).sqrt(), 0.0)
    return OrientedBoxes(corners.mean(dim=-2), size, torch.atan2(right_y, right_x))


def world_from_object(boxes: OrientedBoxes) -> Float[Tensor, "*batch 4 4"]:
    """Return the rigid transforms that take box coordinates to the world, in metres.

    Convention:
        - ``p_world = world_from_object @ p_object`` for homogeneous columns (x, y, z, 1)
        - box coordinates are not scaled by the size: a corner is at ``size / 2``

    Examples:
        >>> box = OrientedBoxes(torch.tensor([1.0, 2.0, 3.0]), torch.ones(3), torch.tensor(0.0))
        >>> (world_from_object(box) @ torch.tensor([0.0, 0.5, 0.0, 1.0])).tolist()
        [1.0, 2.5, 3.0, 1.0]
    """
    return _rigid(boxes.yaw, boxes.centre)


def object_from_world(boxes: OrientedBoxes) -> Float[Tensor, "*batch 4 4"]:
    """Return the rigid transforms that take world coordinates to each box's own axes, in metres.

    Convention:
        - ``p_object = object_from_world @ p_world``: the inverse of ``world_from_object``

    Examples:
        >>> box = OrientedBoxes(torch.tensor([1.0, 2.0, 3.0]), torch.ones(3), torch.tensor(0.0))
        >>> (object_from_world(box) @ torch.tensor([1.0, 2.5, 3.0, 1.0])).tolist()
        [0.0, 0.5, 0.0, 1.0]
    """
    return _rigid(-boxes.yaw, -_turned(boxes.centre, -boxes.yaw))


def box_contains(
    boxes: OrientedBoxes, points: Float[Tensor, "*batch points 3"]
) -> Bool[Tensor, "*batch points"]:
    """Return whether points of the world lie in each box; the surface belongs to the box.

    Examples:
        >>> box = OrientedBoxes(torch.zeros(3), torch.ones(3), torch.tensor(0.0))
        >>> box_contains(box, torch.tensor([[0.5, 0.0, 0.0], [0.6, 0.0, 0.0]])).tolist()
        [True, False]
    """
    local = _turned(points - boxes.centre.unsqueeze(-2), -boxes.yaw.unsqueeze(-1))
    return (local.abs() <= boxes.size.unsqueeze(-2) / 2).all(dim=-1)


def box_volume(boxes: OrientedBoxes) -> Float[Tensor, "*batch"]:
    """Return the volume of each box in cubic metres.

    Examples:
        >>> size = torch.tensor([2.0, 3.0, 4.0])
        >>> float(box_volume(OrientedBoxes(torch.zeros(3), size, torch.tensor(0.0))))
        24.0
    """
    return boxes.size[..., 0] * boxes.size[..., 1] * boxes.size[..., 2]


def _turned(
    points: Float[Tensor, "*points 3"], yaw: Float[Tensor, "*yaws"]
) -> Float[Tensor, "*points 3"]:
    """Return points turned about +z by a yaw that broadcasts over them."""
    cos, sin = torch.cos(yaw), torch.sin(yaw)
    x, y, z = points.unbind(dim=-1)
    return torch.stack([cos * x - sin * y, sin * x + cos * y, z], dim=-1)


def _rigid(
    yaw: Float[Tensor, "*batch"], offset: Float[Tensor, "*batch 3"]
) -> Float[Tensor, "*batch 4 4"]:
    """Return homogeneous matrices that turn about +z and then move by the offset."""
    cos, sin = torch.cos(yaw), torch.sin(yaw)
    zero, one = torch.zeros_like(yaw), torch.ones_like(yaw)
    x, y, z = offset.unbind(dim=-1)
    rows = [cos, -sin, zero, x, sin, cos, zero, y, zero, zero, one, z, zero, zero, zero, one]
    return torch.stack(rows, dim=-1).reshape(*yaw.shape, 4, 4)
