"""The energy terms, one function each: non-negative errors of boxes, before weights.

Every function is differentiable in the boxes. Hard pieces are stop-gradients: whether two boxes
collide, on which side of the walls a corner lies, which corner bounds a projection, and which
bin of a relative yaw is the most probable. Batch axes are the scenes.

Source: DeepPanoContext, Sec. 3.3; the letters in brackets are the paper's.
"""

from typing import Literal

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry import (
    OrientedBoxes,
    box_corners,
    box_footprint,
    separation_margins,
    signed_distance_to_polygon,
    wrap_angle,
)

BEHIND = 2.36
"""Radians: a box with a corner farther than this to the side has no rectangle to compare."""


def _pair_margins(a: OrientedBoxes, b: OrientedBoxes) -> Float[Tensor, "*batch n m 6"]:
    first = OrientedBoxes(a.centre[..., :, None, :], a.size[..., :, None, :], a.yaw[..., :, None])
    other = OrientedBoxes(b.centre[..., None, :, :], b.size[..., None, :, :], b.yaw[..., None, :])
    return separation_margins(first, other)


def object_collision(
    boxes: OrientedBoxes,
    *,
    clearance: float = 0.0,
    axis_weight: float = 1.0,
    kind: Literal["sum", "depth"] = "sum",
) -> Float[Tensor, "*batch n n"]:
    """Return the overlap of every ordered pair in metres, 0 when apart [oc, Eq. of e^oc].

    Args:
        boxes: world frame, batch shape "*batch n". The diagonal of the result is 0.
        clearance: boxes nearer than this already collide, in metres.
        axis_weight: of each of the six axes; 1/2 counts those of parallel boxes once.
        kind: sum over the separating axes (paper), or the smallest overlap: the distance that
            the pair must really move apart.
    """
    margin = _pair_margins(boxes, boxes) + clearance
    least = margin.amin(-1)
    colliding = (least > 0) & ~torch.eye(boxes.yaw.shape[-1], dtype=torch.bool, device=least.device)
    overlap = least if kind == "depth" else margin.sum(-1) * axis_weight
    return torch.where(colliding, overlap, 0.0)


def wall_collision(
    boxes: OrientedBoxes, polygon: Float[Tensor, "*batch m 2"], *, clearance: float = 0.0
) -> Float[Tensor, "*batch n 4"]:
    """Return how far each footprint corner is outside the floor polygon, in metres [wc].

    The paper sums eight corners; the upper four lie over the lower four, so the energy counts
    each of these twice. Corners nearer to a wall than half the clearance count too.
    """
    corner = box_footprint(boxes)
    distance = signed_distance_to_polygon(corner.flatten(-3, -2), polygon)
    return torch.relu(distance.unflatten(-1, corner.shape[-3:-1]) + clearance / 2)


def floor_collision(
    boxes: OrientedBoxes,
    floor_height: Float[Tensor, "*batch"],
    *,
    upper: bool = False,
    clearance: float = 0.0,
) -> Float[Tensor, "*batch n"]:
    """Return how far the lower surface is below the floor, in metres [fc].

    ``upper`` asks for the upper surface instead; the release averages over both. Surfaces nearer
    to the floor than half the clearance count too.
    """
    side = boxes.size[..., 2] / 2 * (1 if upper else -1)
    return torch.relu(floor_height[..., None] - boxes.centre[..., 2] - side + clearance / 2)


def ceiling_collision(
    boxes: OrientedBoxes,
    ceiling_height: Float[Tensor, "*batch"],
    *,
    lower: bool = False,
    clearance: float = 0.0,
) -> Float[Tensor, "*batch n"]:
    """Return how far the upper surface is above the ceiling, in metres [cc].

    ``lower`` asks for the lower surface instead; the release averages over both. Surfaces nearer
    to the ceiling than half the clearance count too.
    """
    side = boxes.size[..., 2] / 2 * (-1 if lower else 1)
    return torch.relu(boxes.centre[..., 2] + side - ceiling_height[..., None] + clearance / 2)


def touching(
    boxes: OrientedBoxes,
    others: OrientedBoxes,
    *,
    axis_weight: float = 1.0,
    clearance: float = 0.0,
) -> Float[Tensor, "*batch n m"]:
    """Return the gap summed over the axes without overlap, in metres [oa].

    ``others`` are the objects themselves (then the diagonal is 0) or the wall cuboids. A gap of
    up to the clearance is contact.
    """
    gap = torch.relu(-_pair_margins(boxes, others) - clearance).sum(-1)
    return gap * axis_weight


def relative_yaw(
    boxes: OrientedBoxes, others: OrientedBoxes, angle: Float[Tensor, "*batch n m"]
) -> Float[Tensor, "*batch n m"]:
    """Return the absolute error of the relative yaw in radians [rr].

    ``angle`` is the wanted wrap(yaw of the other - yaw of the box), in the world frame.
    """
    return wrap_angle(others.yaw[..., None, :] - boxes.yaw[..., :, None] - angle).abs()


def on_floor(
    boxes: OrientedBoxes, floor_height: Float[Tensor, "*batch"], *, clearance: float = 0.0
) -> Float[Tensor, "*batch n"]:
    """Return the gap between the floor and the lower surface in metres [fa].

    A gap of up to the clearance is contact.
    """
    gap = boxes.centre[..., 2] - boxes.size[..., 2] / 2 - floor_height[..., None]
    return torch.relu(gap - clearance)


def under_ceiling(
    boxes: OrientedBoxes, ceiling_height: Float[Tensor, "*batch"], *, clearance: float = 0.0
) -> Float[Tensor, "*batch n"]:
    """Return the gap between the ceiling and the upper surface in metres [ca].

    A gap of up to the clearance is contact.
    """
    gap = ceiling_height[..., None] - boxes.centre[..., 2] - boxes.size[..., 2] / 2
    return torch.relu(gap - clearance)


def farther_than(distance: Float[Tensor, "*batch n"]) -> Float[Tensor, "*batch n n"]:
    """Return by how much [subject, object] breaks "the subject is farther", in metres [rd].

    ``distance`` runs from the camera to the box centres.
    """
    return torch.relu(distance[..., None, :] - distance[..., :, None])


def observation(
    variables: Float[Tensor, "*batch"], start: Float[Tensor, "*batch"]
) -> Float[Tensor, "*batch"]:
    """Return the absolute difference from the estimate [delta, d, s, theta], same unit."""
    return (variables - start).abs()


def projected_rectangle(
    boxes: OrientedBoxes,
    bfov: Float[Tensor, "*batch n 4"],
    camera_height: Float[Tensor, "*batch"],
) -> Float[Tensor, "*batch n 4"]:
    """Return right, left, top, bottom of the projected corners, seen from the BFoV's centre.

    Radians of lon' and lat' in the camera turned to the centre of the BFoV, so that no box is
    cut by the seam (paper, supplement, "Dealing with panorama image").
    """
    corner = box_corners(boxes)
    zero = torch.zeros_like(camera_height)
    camera = torch.stack([zero, zero, camera_height], -1)[..., None, None, :]
    x, y, z = (corner - camera).unbind(-1)
    lon, lat = bfov[..., 0, None], bfov[..., 1, None]
    right = x * torch.cos(lon) - y * torch.sin(lon)
    ahead = x * torch.sin(lon) + y * torch.cos(lon)
    forward = ahead * torch.cos(lat) + z * torch.sin(lat)
    up = z * torch.cos(lat) - ahead * torch.sin(lat)
    level = torch.sqrt(right**2 + forward**2 + 1e-12)
    turned_lon, turned_lat = torch.atan2(right, forward), torch.atan2(up, level)
    return torch.stack(
        [turned_lon.amax(-1), turned_lon.amin(-1), turned_lat.amax(-1), turned_lat.amin(-1)], -1
    )


def reprojection(
    rectangle: Float[Tensor, "*batch 4"],
    bfov: Float[Tensor, "*batch 4"],
    *,
    kind: Literal["edges", "iou"] = "edges",
) -> Float[Tensor, "*batch edges"]:
    """Return the four edge errors in radians, or 1 - IoU of the two rectangles [bp].

    The paper calls the term the IoU of the boxes; as an energy it must be 1 - IoU. Boxes with a
    corner behind the turned camera have no rectangle and give 0.
    """
    half = bfov[..., 2:] / 2
    target = torch.stack([half[..., 0], -half[..., 0], half[..., 1], -half[..., 1]], -1)
    seen = (rectangle[..., :2].abs() < BEHIND).all(-1, keepdim=True)
    if kind == "edges":
        return torch.where(seen, (rectangle - target).abs(), 0.0)
    inner = torch.relu(
        torch.minimum(rectangle, target)[..., 0::2] - torch.maximum(rectangle, target)[..., 1::2]
    ).prod(-1)
    area = (rectangle[..., 0::2] - rectangle[..., 1::2]).prod(-1)
    whole = area + (target[..., 0::2] - target[..., 1::2]).prod(-1) - inner
    return torch.where(seen, (1 - inner / whole)[..., None], 0.0)
