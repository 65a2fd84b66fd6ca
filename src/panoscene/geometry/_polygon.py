"""Floor polygons: signed distance, area, and how much of a box lies inside the room.

Batches of rooms are padded by repeating the last corner; the zero-length edges that this makes
are harmless everywhere in this file.
"""

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene.geometry._oriented_boxes import OrientedBoxes


def signed_distance_to_polygon(
    points: Float[Tensor, "*batch points 2"], polygon: Float[Tensor, "*batch corners 2"]
) -> Float[Tensor, "*batch points"]:
    """Return the distance to the nearest wall in metres, negative inside the polygon.

    The gradient is a unit vector away from the room's inside, also for points that lie exactly on
    a wall, and is zero only exactly on a corner. It flows to the polygon too, any number of times.

    Convention:
        - a simple polygon, counter-clockwise (clockwise works too); convex or not
        - padding by repeated corners changes nothing

    Source: the point-to-polygon distance of the energy E^c (paper, supplement, wall collision).

    Examples:
        >>> room = torch.tensor([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]])
        >>> signed_distance_to_polygon(torch.tensor([[1.0, 2.5], [7.0, 7.0]]), room)
        tensor([-0.5000,  5.0000])
    """
    with torch.no_grad():
        nearest, inside = _nearest_wall(points, polygon)
        orientation = torch.where(polygon_area(polygon) < 0, -1.0, 1.0).to(points.dtype)
    following = polygon.roll(-1, dims=-2)
    index = nearest[..., None].expand(*nearest.shape, 2)
    start = polygon.gather(-2, index)
    along = following.gather(-2, index) - start
    offset = points - start
    squared = (along * along).sum(-1)
    real = squared > 0
    squared = torch.where(real, squared, 1.0)
    fraction = (offset * along).sum(-1) / squared
    # where the nearest point lies within a wall, the signed distance to its line is smooth
    on_wall = real & (fraction >= 0) & (fraction <= 1)
    cross = along[..., 0] * offset[..., 1] - along[..., 1] * offset[..., 0]
    from_line = -orientation[..., None] * cross / squared.sqrt()
    # elsewhere it is the distance to one of the two corners
    offset = offset - fraction.clamp(0, 1).detach()[..., None] * along
    squared = (offset * offset).sum(-1)
    apart = squared > 0
    from_corner = torch.where(apart, squared, 1.0).sqrt() * apart
    return torch.where(on_wall, from_line, torch.where(inside, -from_corner, from_corner))


def _nearest_wall(
    points: Float[Tensor, "*batch points 2"], polygon: Float[Tensor, "*batch corners 2"]
) -> tuple[Tensor, Tensor]:
    """Return the index of the nearest wall of each point, and whether the point is inside."""
    # walls before points: the long axis last, where arithmetic is fastest
    following = polygon.roll(-1, dims=-2)
    start_x, start_y = polygon[..., 0, None], polygon[..., 1, None]
    end_y = following[..., 1, None]
    along_x, along_y = following[..., 0, None] - start_x, end_y - start_y
    squared = along_x * along_x + along_y * along_y
    scale = torch.where(squared > 0, 1 / squared, 0.0)
    x, y = points[..., None, :, 0].contiguous(), points[..., None, :, 1].contiguous()
    x_offset, y_offset = x - start_x, y - start_y
    fraction = (x_offset * (along_x * scale)).addcmul_(y_offset, along_y * scale).clamp_(0, 1)
    # winding number: a wall counts when it passes the point's height to the right of the point;
    # the half-open comparison counts a corner level with the point once
    left = along_x * y_offset > along_y * x_offset
    starts_below, ends_below = start_y <= y, end_y <= y
    passes = (starts_below != ends_below) & (left == starts_below)
    winding = (passes * torch.where(end_y > start_y, 1.0, -1.0)).sum(-2)
    x_foot = x_offset.addcmul_(fraction, along_x, value=-1)
    y_foot = y_offset.addcmul_(fraction, along_y, value=-1)
    distance = (x_foot * x_foot).addcmul_(y_foot, y_foot)
    # the first of the nearest walls; amin twice is several times faster than argmin
    count = polygon.shape[-2]
    number = torch.arange(count, device=polygon.device, dtype=polygon.dtype)[:, None]
    nearest = torch.where(distance == distance.amin(-2, keepdim=True), number, float(count - 1))
    return nearest.amin(-2).long(), winding != 0


def polygon_contains(
    points: Float[Tensor, "*batch points 2"], polygon: Float[Tensor, "*batch corners 2"]
) -> Bool[Tensor, "*batch points"]:
    """Return whether each point lies inside the polygon, by its winding number.

    Points exactly on the outline may count either way.

    Examples:
        >>> room = torch.tensor([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]])
        >>> polygon_contains(torch.tensor([[1.0, 1.0], [5.0, 1.0]]), room)
        tensor([ True, False])
    """
    return _nearest_wall(points, polygon)[1]


def polygon_area(polygon: Float[Tensor, "*batch corners 2"]) -> Float[Tensor, "*batch"]:
    """Return the signed area in square metres, positive for counter-clockwise corners.

    Examples:
        >>> polygon_area(torch.tensor([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]]))
        tensor(12.)
    """
    # relative to the first corner, so that a room far from the origin loses no digits
    corner = polygon - polygon[..., :1, :]
    following = corner.roll(-1, dims=-2)
    return (corner[..., 0] * following[..., 1] - corner[..., 1] * following[..., 0]).sum(-1) / 2


def box_in_room_fraction(
    boxes: OrientedBoxes,
    polygon: Float[Tensor, "*batch corners 2"],
    floor_height: float | Float[Tensor, "*batch"],
    ceiling_height: float | Float[Tensor, "*batch"],
) -> Float[Tensor, "*batch n"]:
    """Return the part of each box's volume that lies inside the room, in [0, 1].

    Exact for any simple polygon, and differentiable. The boxes have batch shape (*batch, n): n
    boxes in each room. A box without volume gets 0.

    Convention:
        - the room is the floor polygon between world z = floor_height and z = ceiling_height
        - padding by repeated corners changes nothing

    Examples:
        >>> room = torch.tensor([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]])
        >>> box = OrientedBoxes(
        ...     torch.tensor([[4.0, 1.0, 0.5]]), torch.ones(1, 3), torch.zeros(1)
        ... )
        >>> box_in_room_fraction(box, room, 0.0, 2.5)
        tensor([0.5000])
    """
    floor = torch.as_tensor(floor_height).to(polygon)[..., None]
    ceiling = torch.as_tensor(ceiling_height).to(polygon)[..., None]
    half = boxes.size / 2
    centre = boxes.centre
    top = torch.minimum(centre[..., 2] + half[..., 2], ceiling)
    bottom = torch.maximum(centre[..., 2] - half[..., 2], floor)
    shared = footprint_area_in_polygon(boxes, polygon) * (top - bottom).clamp(min=0)
    volume = boxes.size.prod(-1)
    real = volume > 0
    return torch.where(real, shared / torch.where(real, volume, 1.0), 0.0).clamp(0, 1)


def footprint_area_in_polygon(
    boxes: OrientedBoxes, polygon: Float[Tensor, "*batch corners 2"]
) -> Float[Tensor, "*batch n"]:
    """Return the area in square metres of each box's footprint inside the polygon.

    Pull the polygon's outline into the footprint rectangle by clamping both coordinates. The
    clamped outline winds around each point of the rectangle exactly as often as the outline
    itself, so the area it encloses is the wanted one: the integral of -y dx along it. It is
    piecewise linear between the points where it enters or leaves the two strips.

    Examples:
        >>> room = torch.tensor([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]])
        >>> boxes = OrientedBoxes(
        ...     torch.tensor([[4.0, 3.0, 0.5]]), torch.ones(1, 3), torch.zeros(1)
        ... )
        >>> footprint_area_in_polygon(boxes, room)
        tensor([0.2500])
    """
    cos, sin = torch.cos(boxes.yaw)[..., None], torch.sin(boxes.yaw)[..., None]
    offset_x = polygon[..., None, :, 0] - boxes.centre[..., 0, None]
    offset_y = polygon[..., None, :, 1] - boxes.centre[..., 1, None]
    x, y = cos * offset_x + sin * offset_y, cos * offset_y - sin * offset_x
    half_x, half_y = boxes.size[..., 0, None] / 2, boxes.size[..., 1, None] / 2
    along_x, along_y = x.roll(-1, dims=-1) - x, y.roll(-1, dims=-1) - y
    enter, leave = _strip_crossings(x, along_x, half_x)
    enter, leave = enter.clamp(0, 1), leave.clamp(0, 1)
    first, second = _strip_crossings(y, along_y, half_y)
    first, second = first.clamp(enter, leave), second.clamp(enter, leave)

    x_inside = x.clamp(-half_x, half_x)
    xs = (
        x_inside,
        (x + first * along_x).clamp(-half_x, half_x),
        (x + second * along_x).clamp(-half_x, half_x),
        x_inside.roll(-1, dims=-1),
    )
    ys = [(y + s * along_y).clamp(-half_y, half_y) for s in (enter, first, second, leave)]
    area = sum(
        ((xs[k] - xs[k + 1]) * (ys[k] + ys[k + 1]) for k in range(3)), start=torch.zeros_like(x)
    )
    orientation = torch.where(polygon_area(polygon.detach()) < 0, -0.5, 0.5).to(x.dtype)
    return (area.sum(-1) * orientation[..., None]).clamp(min=0)


def _strip_crossings(
    start: Float[Tensor, "*batch corners"],
    along: Float[Tensor, "*batch corners"],
    half: Float[Tensor, "*batch one"],
) -> tuple[Tensor, Tensor]:
    """Return where along each edge it enters and leaves the strip |coordinate| <= half."""
    moving = along != 0
    along = torch.where(moving, along, 1.0)
    reach = half / along.abs()
    middle = -start / along
    # an edge along the strip crosses nothing: any place on it will do
    return torch.where(moving, middle - reach, 0.0), torch.where(moving, middle + reach, 1.0)
