"""HorizonNet's signals of a room: where walls meet ceiling and floor, and where corners are.

HorizonNet counts latitude downwards and the released weights do so too; the importer that reads
them changes the sign. Here latitude is positive up, as everywhere.
"""

import math

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry._layout import corner_visible, wall_distance

CORNER_DECAY = 0.96
"""Corner signal one pixel away from a corner (HorizonNet's training target)."""


def column_lon(
    width: int, *, dtype: torch.dtype = torch.float32, device: torch.device | None = None
) -> Float[Tensor, " width"]:
    """Return the longitude in radians of the centre of each column of a panorama.

    Examples:
        >>> column_lon(4)
        tensor([-2.3562, -0.7854,  0.7854,  2.3562])
    """
    column = torch.arange(width, dtype=dtype, device=device)
    return ((column + 0.5) / width - 0.5) * (2 * math.pi)


def boundary_from_layout(
    polygon: Float[Tensor, "*batch corners 2"],
    floor_height: float | Float[Tensor, "*batch"],
    ceiling_height: float | Float[Tensor, "*batch"],
    camera_height: float | Float[Tensor, "*batch"],
    width: int = 1024,
) -> tuple[Float[Tensor, "*batch width"], Float[Tensor, "*batch width"]]:
    """Return the latitudes at which each column sees the wall meet the ceiling and the floor.

    Exact for the nearest wall at the centre of each column; differentiable. In a column without
    any wall (camera outside the room) both are on the horizon.

    Convention:
        - radians, positive up: the ceiling's are positive, the floor's negative
        - the camera stands at world (0, 0, camera_height)
        - occluded walls do not appear

    Source: HorizonNet's boundary target.

    Examples:
        >>> room = torch.tensor([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])
        >>> ceiling_lat, floor_lat = boundary_from_layout(room, 0.0, 2.6, 1.6, width=4)
        >>> floor_lat
        tensor([-0.5148, -0.5148, -0.5148, -0.5148])
    """
    lon = column_lon(width, dtype=polygon.dtype, device=polygon.device)
    distance = wall_distance(polygon, lon.expand(*polygon.shape[:-2], width))
    camera = torch.as_tensor(camera_height).to(polygon)[..., None]
    above = torch.as_tensor(ceiling_height).to(polygon)[..., None] - camera
    below = torch.as_tensor(floor_height).to(polygon)[..., None] - camera
    # through the inverse distance, whose gradient stays finite on the horizon
    nearness = 1 / distance
    return torch.atan(above * nearness), torch.atan(below * nearness)


def corner_signal_from_layout(
    polygon: Float[Tensor, "*batch corners 2"], width: int = 1024
) -> Float[Tensor, "*batch width"]:
    """Return 0.96 to the power of each column's distance in pixels to the nearest visible corner.

    The distance is from the centre of the column, around the seam. Zero when no corner is seen.

    Convention:
        - the camera stands at world (0, 0)
        - corners hidden behind a wall are left out

    Source: HorizonNet's corner target.

    Examples:
        >>> room = torch.tensor([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])
        >>> corner_signal_from_layout(room, width=8)
        tensor([0.9798, 0.9798, 0.9798, 0.9798, 0.9798, 0.9798, 0.9798, 0.9798])
    """
    lon = torch.atan2(polygon[..., 0], polygon[..., 1])
    u = (lon / (2 * math.pi) + 0.5) * width
    centre = torch.arange(width, dtype=polygon.dtype, device=polygon.device) + 0.5
    apart = (u[..., None] - centre).abs()
    apart = torch.minimum(apart, width - apart)
    apart = torch.where(corner_visible(polygon)[..., None], apart, torch.inf)
    return CORNER_DECAY ** apart.amin(-2)
