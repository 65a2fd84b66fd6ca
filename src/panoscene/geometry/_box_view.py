"""How boxes look from a camera: the BFoV of their projection."""

import math

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene.geometry._bfov import bfov_area, bfov_from_directions
from panoscene.geometry._boxes import (
    box_contains,
    box_corners,
    object_from_world,
    world_from_object,
)
from panoscene.geometry._oriented_boxes import OrientedBoxes
from panoscene.geometry._sphere import camera_from_turned, lonlat_from_direction

# corners that differ in one bit of their index share an edge
_EDGE_STARTS = [0, 2, 4, 6, 0, 1, 4, 5, 0, 1, 2, 3]
_EDGE_ENDS = [1, 3, 5, 7, 2, 3, 6, 7, 4, 5, 6, 7]
_FRACTIONS = (0.0, 0.25, 0.5, 0.75, 1.0)
_PARALLEL = 1e-12


def bfov_from_boxes(
    boxes: OrientedBoxes, camera_height: float | Float[Tensor, "..."]
) -> Float[Tensor, "*batch 4"]:
    """Return the BFoV (lon, lat, width, height) in radians of each whole box, seen from the camera.

    The centre is the one ``bfov_from_directions`` finds for points on the edges, or the direction
    of the box's nearest point where that gives less area: from there the whole box is in front, so
    no BFoV exceeds a hemisphere. The extents are then exact for the centre, without sampling. The
    outline of a box consists of edges. Along an edge lon' is monotone, so its extremes are corners,
    and lat' peaks at most once between them, at a point with a closed form. If the turned camera's
    up or down ray meets the box, or an edge passes straight behind it, that centre sees the box
    all the way round.

    Args:
        boxes: Boxes in the world frame.
        camera_height: Height of the camera above the floor in metres, one or one per box.

    Convention:
        - the camera is at (0, 0, camera_height); for another place, move the boxes first
        - a box that contains the camera, or touches it, covers the full sphere: (0, 0, 2 pi, pi)
        - nothing hides anything: walls and other boxes are not considered

    Examples:
        >>> size = torch.full((3,), 2.0)
        >>> box = OrientedBoxes(torch.tensor([0.0, 3.0, 1.6]), size, torch.tensor(0.0))
        >>> [round(x, 4) for x in bfov_from_boxes(box, camera_height=1.6).tolist()]
        [0.0, 0.0, 0.9273, 0.9273]
    """
    x, y, z = boxes.centre.unbind(dim=-1)
    seen = OrientedBoxes(torch.stack([x, y, z - camera_height], dim=-1), boxes.size, boxes.yaw)
    around = box_contains(seen, torch.zeros_like(boxes.centre).unsqueeze(-2))
    # boxes around the camera are replaced by a point ahead, where every step is defined
    ahead = boxes.centre.new_tensor([0.0, 1.0, 0.0])
    corners = torch.where(around.unsqueeze(-1), ahead, box_corners(seen))
    fractions = corners.new_tensor(_FRACTIONS).unsqueeze(-1)
    starts, ends = corners[..., _EDGE_STARTS, None, :], corners[..., _EDGE_ENDS, None, :]
    samples = (starts + fractions * (ends - starts)).flatten(-3, -2)
    fitted = bfov_from_directions(samples)[..., :2]
    nearest = lonlat_from_direction(torch.where(around, ahead, _nearest_point(seen)))
    first = torch.cat([fitted, _exact_extents(seen, corners, fitted)], dim=-1)
    second = torch.cat([nearest, _exact_extents(seen, corners, nearest)], dim=-1)
    # the small factor lets rounding never decide between equal areas
    better = (bfov_area(second) < 0.999 * bfov_area(first)).unsqueeze(-1)
    whole_sphere = corners.new_tensor([0.0, 0.0, 2 * math.pi, math.pi])
    return torch.where(around, whole_sphere, torch.where(better, second, first))


def _nearest_point(boxes: OrientedBoxes) -> Float[Tensor, "*batch 3"]:
    """Return the point of each box that is nearest to the origin."""
    origin = object_from_world(boxes)[..., :3, 3]
    half = boxes.size / 2
    local = torch.maximum(torch.minimum(origin, half), -half)
    world = world_from_object(boxes)
    return (world[..., :3, :3] @ local.unsqueeze(-1)).squeeze(-1) + world[..., :3, 3]


def _exact_extents(
    boxes: OrientedBoxes, corners: Float[Tensor, "*batch 8 3"], centre: Float[Tensor, "*batch 2"]
) -> Float[Tensor, "*batch 2"]:
    """Return width and height of the smallest BFoV with this centre around each whole box.

    The boxes and corners are relative to the camera.
    """
    camera_axes = camera_from_turned(centre)
    turned = corners @ camera_axes
    starts, ends = turned[..., _EDGE_STARTS, :], turned[..., _EDGE_ENDS, :]
    extremes = torch.cat([turned, _highest_on_edges(starts, ends)], dim=-2)
    reach = lonlat_from_direction(extremes).abs().amax(dim=-2)
    up = camera_axes[..., 2]
    pole = _ray_meets(boxes, up) | _ray_meets(boxes, -up)
    behind = pole | _pass_behind(starts, ends).any(dim=-1)
    width = torch.where(behind, 2 * math.pi, 2 * reach[..., 0])
    height = torch.where(pole, math.pi, 2 * reach[..., 1])
    return torch.stack([width, height], dim=-1)


def _highest_on_edges(
    starts: Float[Tensor, "*batch 3"], ends: Float[Tensor, "*batch 3"]
) -> Float[Tensor, "*batch 3"]:
    """Return the point of each edge where lat' has its extreme, or the nearer end of the edge.

    The derivative of z / |p| along p = start + t (end - start) vanishes at one t only.
    """
    step = ends - starts
    rise, level = step[..., 2], starts[..., 2]
    along = (starts * step).sum(dim=-1)
    above = level * along - rise * starts.square().sum(dim=-1)
    below = rise * along - level * step.square().sum(dim=-1)
    bends = below != 0
    t = torch.where(bends, above / torch.where(bends, below, 1.0), 0.0).clamp(0, 1)
    return starts + t.unsqueeze(-1) * step


def _pass_behind(
    starts: Float[Tensor, "*batch 3"], ends: Float[Tensor, "*batch 3"]
) -> Bool[Tensor, "*batch"]:
    """Return whether edges of the turned camera cross lon' = pi."""
    x_start, x_end = starts[..., 0], ends[..., 0]
    side = (starts[..., 1] * x_end - ends[..., 1] * x_start) * (x_end - x_start).sign()
    return (x_start * x_end <= 0) & (side < 0)


def _ray_meets(
    boxes: OrientedBoxes, direction: Float[Tensor, "*batch 3"]
) -> Bool[Tensor, "*batch"]:
    """Return whether the ray from the origin in a direction meets each box."""
    object_axes = object_from_world(boxes)
    start = object_axes[..., :3, 3]
    ray = (object_axes[..., :3, :3] @ direction.unsqueeze(-1)).squeeze(-1)
    ray = torch.where(ray.abs() < _PARALLEL, _PARALLEL, ray)
    near, far = (-boxes.size / 2 - start) / ray, (boxes.size / 2 - start) / ray
    enter = torch.minimum(near, far).amax(dim=-1)
    leave = torch.maximum(near, far).amin(dim=-1)
    return (enter <= leave) & (leave >= 0)
