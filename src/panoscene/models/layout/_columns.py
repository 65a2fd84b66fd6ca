"""What boundaries say column by column: how far the wall is, how high the ceiling, how sure."""

import math
from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry import column_lon

NEAREST, FARTHEST = 0.25, 25.0
"""Metres from the camera within which walls are taken to be, for a camera 1.6 m high."""
HEIGHT_RANGE = (0.1, 6.0)
"""Ceiling above the camera, as multiples of the camera's height."""
USUAL_HEIGHT = 0.6
"""The same where no column tells."""
HORIZON = 0.02
"""Latitude in radians that boundaries are kept away from the horizon."""


@dataclass(frozen=True, slots=True)
class RoomColumns:
    """The columns of a panorama, in float64 on the CPU, for a camera at height 1.

    Everything is in camera heights: a room is known but for its size.
    """

    ceiling: Float[Tensor, " columns"]
    """Latitude of the ceiling boundary, positive."""
    floor: Float[Tensor, " columns"]
    """Latitude of the floor boundary, negative."""
    corner: Float[Tensor, " columns"]
    """Probability of a corner."""
    ray: Float[Tensor, "columns 2"]
    """Unit vector on the floor."""
    above: float
    """Ceiling above the camera."""
    distance: Float[Tensor, " columns"]
    """To the wall, from both boundaries."""
    from_floor: Float[Tensor, " columns"]
    """To the wall, from the floor boundary alone."""
    from_ceiling: Float[Tensor, " columns"]
    """To the wall, from the ceiling boundary alone."""

    def points(self, distance: Float[Tensor, " columns"]) -> Float[Tensor, "columns 2"]:
        """Return the points at some distance, counter-clockwise from above."""
        return (self.ray * distance[:, None]).flip(0)


def room_columns(
    boundary: Float[Tensor, "2 columns"], corner: Float[Tensor, " columns"]
) -> RoomColumns:
    """Return what the signals of one panorama say; see ``RoomColumns``.

    The height of the ceiling is a median over columns, weighted by how well each tells it. Both
    boundaries then give a distance, and the mean of the inverse distances, weighted by precision,
    is the wall's.

    Args:
        boundary: Latitude in radians, positive up, of ceiling and floor.
        corner: Probabilities of corners.

    Raises:
        ValueError: A value is not finite.
    """
    if not bool(boundary.isfinite().all() and corner.isfinite().all()):
        raise ValueError("boundary, corner: expected finite values, found NaN or infinity")
    ceiling, floor = boundary.detach().to("cpu", torch.float64).unbind()
    limit = math.pi / 2 - HORIZON
    ceiling, floor = ceiling.clamp(HORIZON, limit), floor.clamp(-limit, -HORIZON)
    rise, fall = torch.tan(ceiling), torch.tan(-floor)
    above = ceiling_above(rise, fall)
    # change of latitude with inverse distance: how precisely each boundary tells it
    floor_weight = 1 / (1 + fall**2) ** 2
    ceiling_weight = above**2 / (1 + rise**2) ** 2
    nearness = (floor_weight * fall + ceiling_weight * rise / above) / (
        floor_weight + ceiling_weight
    )
    low, high = 1.6 / FARTHEST, 1.6 / NEAREST
    lon = column_lon(len(floor), dtype=torch.float64)
    return RoomColumns(
        ceiling=ceiling,
        floor=floor,
        corner=corner.detach().to("cpu", torch.float64),
        ray=torch.stack((torch.sin(lon), torch.cos(lon)), dim=-1),
        above=above,
        distance=1 / nearness.clamp(low, high),
        from_floor=1 / fall.clamp(low, high),
        from_ceiling=1 / (rise / above).clamp(low, high),
    )


def ceiling_above(rise: Float[Tensor, " columns"], fall: Float[Tensor, " columns"]) -> float:
    """Return the ceiling's height above the camera, in camera heights: a weighted median.

    Args:
        rise: Tangent of the latitude of the ceiling boundary.
        fall: Tangent of the latitude of the floor boundary, as a positive number.

    Examples:
        >>> rise, fall = torch.tensor([0.3, 0.6, 2.0]), torch.tensor([0.5, 1.0, 0.5])
        >>> round(ceiling_above(rise, fall), 6)
        0.6
    """
    # relative error of a tangent for the same error of latitude, of both added
    error = ((1 + rise**2) / rise) ** 2 + ((1 + fall**2) / fall) ** 2
    ratio = weighted_median((rise / fall).double(), 1 / error.double())
    if not math.isfinite(ratio):
        return USUAL_HEIGHT
    return min(max(ratio, HEIGHT_RANGE[0]), HEIGHT_RANGE[1])


def weighted_median(values: Float[Tensor, " n"], weights: Float[Tensor, " n"]) -> float:
    """Return the value that half of the weight lies below; not a number without weight.

    Examples:
        >>> weighted_median(torch.tensor([1.0, 2.0, 9.0]), torch.tensor([1.0, 1.0, 1.5]))
        2.0
    """
    order = values.argsort()
    total = weights[order].cumsum(0)
    if not len(values) or float(total[-1]) <= 0:
        return math.nan
    return float(values[order][int((total < total[-1] / 2).count_nonzero())])
