"""Walls of padded rooms: as boxes, and as the camera sees them."""

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene.geometry import (
    OrientedBoxes,
    box_footprint,
    lonlat_from_direction,
    signed_distance_to_polygon,
    wall_boxes,
)

from ._estimates import Estimates

_NEAREST = 0.05


def closed_polygon(
    polygon: Float[Tensor, "scenes m 2"], valid: Bool[Tensor, "scenes m"]
) -> Float[Tensor, "scenes m 2"]:
    """Return floor polygons padded by their first corner, so that the last wall keeps its place.

    Examples:
        >>> corners = torch.tensor([[[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [-1.0, 0.0]]])
        >>> real = torch.tensor([[True, True, True, False]])
        >>> closed_polygon(corners, real)[0, 3].tolist()
        [1.0, 0.0]
    """
    return torch.where(valid[..., None], polygon, polygon[:, :1])


def walls_of(
    estimates: Estimates,
) -> tuple[OrientedBoxes, Float[Tensor, "scenes m 4"]]:
    """Return the walls as cuboids, batch shape (scenes, m), and their BFoVs.

    The BFoV looks at the middle of the wall's face; it is as wide as the angle between the wall's
    ends (never more than a half turn) and as high as the wall is at its middle. Padding gets
    finite numbers.
    """
    polygon = closed_polygon(estimates.polygon, estimates.wall_valid)
    boxes = wall_boxes(polygon, 0.0, estimates.ceiling)
    following = polygon.roll(-1, dims=1)
    middle = (polygon + following) / 2
    eye = estimates.camera_height[:, None]
    across = torch.linalg.vector_norm(middle, dim=-1).clamp(min=_NEAREST)
    rise = torch.atan2(estimates.ceiling[:, None] - eye, across)
    fall = torch.atan2(eye, across)
    cross = polygon[..., 0] * following[..., 1] - polygon[..., 1] * following[..., 0]
    width = torch.atan2(cross.abs(), (polygon * following).sum(-1))
    ray = torch.cat([middle, boxes.centre[..., 2:] - eye[..., None]], dim=-1)
    bfov = torch.cat([lonlat_from_direction(ray), torch.stack([width, rise + fall], -1)], dim=-1)
    return boxes, bfov


def room_distances(boxes: OrientedBoxes, estimates: Estimates) -> Float[Tensor, "scenes n 8"]:
    """Return how far the corners of boxes are outside the room, in metres, negative inside.

    Upright boxes have eight such numbers of their own: of the four corners of the footprint to the
    walls, of bottom and top to the floor, of bottom and top to the ceiling. All are 0 in scenes
    without walls.

    Args:
        boxes: Batch shape (scenes, n).
        estimates: Of the same scenes.
    """
    low = boxes.centre[..., 2] - boxes.size[..., 2] / 2
    high = low + boxes.size[..., 2]
    ceiling = estimates.ceiling[:, None]
    level = torch.stack([-low, -high, low - ceiling, high - ceiling], dim=-1)
    aside = level.new_zeros(*level.shape[:2], 4)
    if estimates.polygon.shape[1] and level.shape[1]:
        polygon = closed_polygon(estimates.polygon, estimates.wall_valid)
        corner = box_footprint(boxes).flatten(1, 2)
        aside = signed_distance_to_polygon(corner, polygon).unflatten(1, (-1, 4))
    known = estimates.wall_valid.any(dim=1)[:, None, None]
    return torch.where(known, torch.cat([aside, level], dim=-1), 0.0)
