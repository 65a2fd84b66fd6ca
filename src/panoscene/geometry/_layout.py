"""Rooms as walls: cuboids, normals, what the camera sees of them, and layout overlap."""

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene.geometry._angles import wrap_angle
from panoscene.geometry._oriented_boxes import OrientedBoxes
from panoscene.geometry._polygon import polygon_area
from panoscene.geometry._polygon_validity import polygon_intersection_area

GRAZING = 1e-6
"""A wall blocks a corner only when it is nearer by more than this part of the distance."""


def _wall_directions(
    polygon: Float[Tensor, "*batch corners 2"],
) -> tuple[Float[Tensor, "*batch corners 2"], Float[Tensor, "*batch corners"]]:
    """Return the unit vector along each wall and its length; +x for walls without length."""
    along = polygon.roll(-1, dims=-2) - polygon
    squared = (along * along).sum(-1)
    real = squared > 0
    length = torch.where(real, squared, 1.0).sqrt()
    unit = torch.where(real[..., None], along / length[..., None], along.new_tensor([1.0, 0.0]))
    return unit, length * real


def wall_normals(polygon: Float[Tensor, "*batch corners 2"]) -> Float[Tensor, "*batch corners 2"]:
    """Return the unit vector of each wall that points into the room.

    Convention:
        - counter-clockwise corners; wall i runs from corner i to corner i + 1
        - a wall without length (padding) has the normal (0, 1)

    Examples:
        >>> wall_normals(torch.tensor([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]))[1] + 0
        tensor([-1.,  0.])
    """
    along, _ = _wall_directions(polygon)
    return torch.stack((-along[..., 1], along[..., 0]), dim=-1)


def wall_boxes(
    polygon: Float[Tensor, "*batch corners 2"],
    floor_height: float | Float[Tensor, "*batch"],
    ceiling_height: float | Float[Tensor, "*batch"],
    thickness: float = 0.2,
) -> OrientedBoxes:
    """Return each wall as a cuboid of size (length, thickness, height), batch (*batch, corners).

    The front face (+y) lies on the wall's segment and looks into the room; the thickness goes
    outwards. A wall without length (padding) becomes a box of zero width.

    Source: paper, Sec. 3.3, walls as nodes of the relation graph.

    Examples:
        >>> room = torch.tensor([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])
        >>> wall_boxes(room, 0.0, 2.5).centre[1]
        tensor([2.1000, 0.0000, 1.2500])
    """
    along, length = _wall_directions(polygon)
    outwards = torch.stack((along[..., 1], -along[..., 0]), dim=-1)
    middle = (polygon + polygon.roll(-1, dims=-2)) / 2 + outwards * (thickness / 2)
    floor = torch.as_tensor(floor_height).to(polygon)[..., None]
    ceiling = torch.as_tensor(ceiling_height).to(polygon)[..., None]
    z = ((floor + ceiling) / 2).expand_as(length)
    size = torch.stack(
        (length, torch.full_like(length, thickness), (ceiling - floor).expand_as(length)), dim=-1
    )
    # the wall's own right is its direction, so the yaw is the angle of the direction from +x
    yaw = torch.atan2(along[..., 1], along[..., 0])
    return OrientedBoxes(torch.cat((middle, z[..., None]), dim=-1), size, wrap_angle(yaw))


def wall_distance(
    polygon: Float[Tensor, "*batch corners 2"],
    lon: Float[Tensor, "*batch rays"],
    camera_xy: tuple[float, float] = (0.0, 0.0),
) -> Float[Tensor, "*batch rays"]:
    """Return the horizontal distance in metres from the camera to the first wall along each lon.

    Differentiable. No ray slips between two walls at their corner.

    Convention:
        - lon runs clockwise from +y: the ray points along (sin lon, cos lon)
        - from outside the room, the first wall from outside; infinity where no wall is met

    Examples:
        >>> room = torch.tensor([[-2.0, -1.0], [2.0, -1.0], [2.0, 3.0], [-2.0, 3.0]])
        >>> wall_distance(room, torch.tensor([0.0, torch.pi / 2]))
        tensor([3., 2.])
    """
    start = polygon - polygon.new_tensor(camera_xy)
    start_x, start_y = start[..., 0, None], start[..., 1, None]
    x, y = torch.sin(lon)[..., None, :], torch.cos(lon)[..., None, :]
    # the side of the ray on which each corner lies, the same number for both of its walls
    side = x * start_y - y * start_x
    end_side = side.roll(-1, dims=-2)
    end_x, end_y = start_x.roll(-1, dims=-2), start_y.roll(-1, dims=-2)
    met = (side <= 0) != (end_side <= 0)
    twice_area = start_x * end_y - start_y * end_x
    distance = twice_area / torch.where(met, end_side - side, 1.0)
    return torch.where(met & (distance > 0), distance, torch.inf).amin(-2)


def corner_visible(
    polygon: Float[Tensor, "*batch corners 2"], camera_xy: tuple[float, float] = (0.0, 0.0)
) -> Bool[Tensor, "*batch corners"]:
    """Return whether the camera sees each corner: no wall crosses the line of sight to it.

    Convention:
        - walls that start or end at the corner do not hide it
        - a line of sight that exactly grazes another corner may count either way
        - padding by repeated corners changes nothing
        - from outside the room, the corners that are seen from outside

    Examples:
        >>> room = torch.tensor([[-1, -1], [3, -1], [3, 1], [1, 1], [1, 3], [-1, 3]]).float()
        >>> corner_visible(room, (2.5, 0.0))
        tensor([ True,  True,  True,  True, False, False])
    """
    corner = polygon - polygon.new_tensor(camera_xy)
    x, y = corner[..., None, :, 0], corner[..., None, :, 1]
    start_x, start_y = corner[..., 0, None], corner[..., 1, None]
    end_x, end_y = start_x.roll(-1, dims=-2), start_y.roll(-1, dims=-2)
    side, end_side = x * start_y - y * start_x, x * end_y - y * end_x
    met = (side <= 0) != (end_side <= 0)
    # 1 at the corner itself
    fraction = (start_x * end_y - start_y * end_x) / torch.where(met, end_side - side, 1.0)
    own = ((start_x == x) & (start_y == y)) | ((end_x == x) & (end_y == y))
    blocked = met & ~own & (fraction > 0) & (fraction < 1 - GRAZING)
    return ~blocked.any(-2)


def layout_iou_3d(
    polygon: Float[Tensor, "corners 2"],
    floor_ceiling: tuple[float, float],
    other: Float[Tensor, "other_corners 2"],
    other_floor_ceiling: tuple[float, float],
) -> float:
    """Return intersection over union of the volumes of two rooms, in [0, 1].

    The 2D layout IoU is ``polygon_iou``. With a common floor this is the published measure:
    shared floor area times the smaller height, over the union.

    Args:
        polygon: Floor polygon of the first room.
        floor_ceiling: Its world z of floor and ceiling in metres.
        other: Floor polygon of the second room.
        other_floor_ceiling: Its world z of floor and ceiling in metres.

    Raises:
        ValueError: if a polygon has fewer than three corners, is not finite, or crosses itself;
            if a ceiling is not above its floor.

    Examples:
        >>> room = torch.tensor([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]])
        >>> layout_iou_3d(room, (0.0, 2.0), room, (0.0, 2.5))
        0.8
    """
    volume = 0.0
    for name, corners, (floor, ceiling) in (
        ("floor_ceiling", polygon, floor_ceiling),
        ("other_floor_ceiling", other, other_floor_ceiling),
    ):
        if not ceiling > floor:
            raise ValueError(f"{name}: expected a ceiling above the floor, found {floor, ceiling}")
        volume += abs(float(polygon_area(corners.double()))) * (ceiling - floor)
    top = min(floor_ceiling[1], other_floor_ceiling[1])
    bottom = max(floor_ceiling[0], other_floor_ceiling[0])
    shared = polygon_intersection_area(polygon, other) * max(top - bottom, 0.0)
    return min(shared / (volume - shared), 1.0)
