"""What geometry alone says about the distance and the yaw of an object in a BFoV."""

import math

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry import (
    camera_from_turned,
    direction_from_lonlat,
    lonlat_from_direction,
    wall_distance,
    wall_normals,
    wrap_angle,
)
from panoscene.scene import Layout

GUESSES = 8
"""How many guesses of the distance ``pose_clues`` starts with."""
CLUES = 31
"""Numbers that ``pose_clues`` gives for each object."""
CLUE_METRES = 4.0
"""Unit of distances among the clues."""
_FARTHEST = 12.0
_STEEPEST = math.pi / 2 - 1e-3
_LOWEST = 1e-3
_ASIDE = 0.01
_FAR = 1e3


def pose_clues(
    bfov: Float[Tensor, "n 4"],
    mean_size: Float[Tensor, "n 3"],
    camera_height: float,
    layout: Layout | None = None,
) -> Float[Tensor, "n 31"]:
    """Return numbers from which the distance of an object can nearly be read off.

    First come ``GUESSES`` guesses of the distance to its centre: standing where the lower edge of
    the BFoV meets the floor; lying where its centre does; where the mean size is as high, or as
    wide, as the BFoV; standing, in the direction of the BFoV's centre; and at the room's surface
    behind the centre, the lower and the upper edge. Without a layout the last three are the first
    one again. The others are the height and extents of the BFoV, the mean size, and which way the
    walls behind it and nearest to it face.

    Args:
        bfov: (lon, lat, width, height) in radians.
        mean_size: Mean size of each object's category in metres.
        camera_height: Metres above the floor.
        layout: The room; without it its numbers are 0.

    Convention:
        - distances are in units of 4 m, at most 12 m
        - turning the world about the vertical changes nothing
        - source: ours; the paper's network sees the crop and the category only

    Examples:
        >>> down = torch.tensor([[1.0, -0.5236, 0.2, 0.2]])
        >>> clues = pose_clues(down, torch.ones(1, 3), camera_height=1.6)
        >>> round(float(clues[0, 1]) * CLUE_METRES, 2)
        3.2
    """
    lat, width, height = bfov[:, 1], bfov[:, 2], bfov[:, 3]
    lonlat = _edge_lonlat(bfov)
    as_high = mean_size[:, 2] / 2 / _tangent(height)
    as_wide = mean_size[:, :2].mean(dim=-1) / 2 / _tangent(width)
    across, meets = _across_floor(lat - height / 2, camera_height)
    deep = across + mean_size[:, 1] / 2
    drop = camera_height - mean_size[:, 2] / 2
    standing = torch.where(meets, torch.hypot(deep, drop), as_high)
    lying = _over_sine(-lat, camera_height)
    floating = _over_sine(-lat, drop.clamp(min=0.1))
    stands_at = torch.where(meets, (lat + torch.atan2(drop, deep)) / height.clamp(min=_LOWEST), 0.0)
    guess = [standing, lying, as_high, as_wide, floating]
    room, facing = _room_clues(bfov, lonlat, camera_height, layout, standing)
    guesses = torch.cat([torch.stack(guess, dim=-1), room], dim=-1).clamp(0.0, _FARTHEST)
    numbers = [
        lat, lat.sin(), width, height, width.clamp(min=_LOWEST).log(),
        height.clamp(min=_LOWEST).log(), meets.to(lat), stands_at.clamp(-1, 1),
        deep.clamp(max=_FARTHEST) / CLUE_METRES, *mean_size.clamp(min=_LOWEST).log().unbind(-1),
    ]  # fmt: skip
    return torch.cat([guesses / CLUE_METRES, torch.stack(numbers, dim=-1), facing], dim=-1)


def _room_clues(
    bfov: Float[Tensor, "n 4"],
    lonlat: Float[Tensor, "n 5 2"],
    camera_height: float,
    layout: Layout | None,
    standing: Float[Tensor, " n"],
) -> tuple[Float[Tensor, "n 3"], Float[Tensor, "n 11"]]:
    """Return distances to the room's surface, and how the walls lie to the line of sight."""
    count = len(bfov)
    if layout is None or not count:
        return standing.unsqueeze(-1).expand(count, 3), bfov.new_zeros(count, 11)
    polygon = layout.floor_polygon.to(bfov)
    lon, lat = lonlat.unbind(-1)
    wall = wall_distance(polygon, lon.flatten()).view_as(lon).clamp(max=_FAR)
    floor = _over_sine(-lat, camera_height - layout.floor_height)
    ceiling = _over_sine(lat, max(layout.ceiling_height - camera_height, 0.1))
    through = wall / lat.cos().clamp(min=_LOWEST)
    reach = torch.minimum(through, torch.minimum(floor, ceiling)).clamp(max=_FARTHEST)
    middle = bfov[:, 0]
    behind = wrap_angle(-middle - _yaw_behind(polygon, middle))
    away = torch.minimum(standing * bfov[:, 1].cos(), wall[:, 0])
    point = torch.stack([middle.sin(), middle.cos()], dim=-1) * away.unsqueeze(-1)
    gap, yaw = _nearest_wall(polygon, point)
    beside = wrap_angle(-middle - yaw)
    facing = [
        behind.sin(), behind.cos(), beside.sin(), beside.cos(), gap.clamp(max=4.0) / 4,
        wall[:, 0].clamp(max=_FARTHEST) / CLUE_METRES, *(reach[:, 3:] / CLUE_METRES).unbind(-1),
        (floor[:, 1] < through[:, 1]).to(gap), (ceiling[:, 2] < through[:, 2]).to(gap),
        torch.ones_like(gap),
    ]  # fmt: skip
    return reach[:, :3], torch.stack(facing, dim=-1)


def _yaw_behind(
    polygon: Float[Tensor, "corners 2"], lon: Float[Tensor, " n"]
) -> Float[Tensor, " n"]:
    """Return the yaw of an object that faces as the wall does which is met along each lon."""
    sides = torch.stack([lon - _ASIDE, lon + _ASIDE])
    away = wall_distance(polygon, sides.flatten()).view_as(sides).clamp(max=_FAR)
    x, y = away * sides.sin(), away * sides.cos()
    # clockwise along the wall the room is on the right: its normal is the step turned right
    step_x, step_y = x[1] - x[0], y[1] - y[0]
    return torch.atan2(-step_y, -step_x)


def _nearest_wall(
    polygon: Float[Tensor, "corners 2"], point: Float[Tensor, "n 2"]
) -> tuple[Float[Tensor, " n"], Float[Tensor, " n"]]:
    """Return the distance to the nearest wall, and the yaw of what faces as it does."""
    along = polygon.roll(-1, dims=0) - polygon
    offset = point[:, None] - polygon
    share = (offset * along).sum(-1) / along.square().sum(-1).clamp(min=1e-9)
    gap = torch.linalg.vector_norm(offset - share.clamp(0, 1).unsqueeze(-1) * along, dim=-1)
    nearest, index = gap.min(dim=-1)
    normal = wall_normals(polygon)[index]
    return nearest, torch.atan2(-normal[:, 0], normal[:, 1])


def _edge_lonlat(bfov: Float[Tensor, "n 4"]) -> Float[Tensor, "n 5 2"]:
    """Return where the BFoV's centre is and the middles of its edges: down, up, left, right."""
    width, height = (bfov[:, 2:] / 2).unbind(-1)
    zero = torch.zeros_like(width)
    lon = torch.stack([zero, zero, zero, -width, width], dim=-1)
    lat = torch.stack([zero, -height, height, zero, zero], dim=-1)
    turned = direction_from_lonlat(torch.stack([lon, lat], dim=-1))
    return lonlat_from_direction(turned @ camera_from_turned(bfov[:, :2]).mT)


def _across_floor(
    lat: Float[Tensor, " n"], camera_height: float
) -> tuple[Float[Tensor, " n"], Tensor]:
    """Return how far along the floor a ray meets it, and whether it does so within 12 m."""
    across = camera_height / (-lat).clamp(_LOWEST, _STEEPEST).tan()
    return across, (lat < -_LOWEST) & (across < _FARTHEST)


def _over_sine(lat: Tensor, rise: float | Tensor) -> Tensor:
    """Return the length of a ray that climbs by ``rise``; a kilometre where it never does."""
    sine = lat.sin()
    return torch.where(sine > _LOWEST, rise / sine.clamp(min=_LOWEST), _FAR)


def _tangent(extent: Tensor) -> Tensor:
    return (extent / 2).clamp(_LOWEST, _STEEPEST).tan()
