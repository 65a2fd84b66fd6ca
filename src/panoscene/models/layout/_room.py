"""From the network's signals to the record of a room, with what is sure about it and what not."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry import polygon_iou, polygon_problem, signed_distance_to_polygon
from panoscene.models.layout._columns import RoomColumns, room_columns
from panoscene.models.layout._manhattan import Fit, manhattan_fits
from panoscene.models.layout._raw import drawn_polygon
from panoscene.models.layout._walls import FAR_AWAY, seen_walls
from panoscene.scene import Layout

LEAST_OVERLAP = 0.8
"""IoU with the drawn polygon below which a regular room does not fit."""
CLEARANCE = 0.05
"""Camera heights that a room leaves around the camera."""
SURE = math.radians(2.0)
"""Latitude error at which the score of a wall has fallen to 1 / e."""
AS_GOOD = 30.0
"""Cost by which another room may be worse and still be plausible."""
ALIKE = 0.85
"""IoU of two rooms from which they count as one reading."""
TORN = math.log(1.4)
"""Logarithm of the ratio of the distances that floor and ceiling tell where they contradict."""
TORN_COLUMNS = 1 / 72
"""Part of the panorama in which they must (5 degrees)."""


@dataclass(frozen=True, slots=True)
class RoomReading:
    """A room read from signals."""

    layout: Layout
    """With ``raw_polygon`` and ``wall_score``."""
    ambiguous: bool
    """Whether another room explains the panorama about as well."""
    regular: bool
    """Whether the floor polygon is a Manhattan room; else it is the raw polygon."""


def room_from_signals(
    boundary: Float[Tensor, "2 columns"],
    corner: Float[Tensor, " columns"],
    camera_height: float = 1.6,
) -> RoomReading:
    """Return the room that boundary and corner signals describe.

    The raw polygon is what the boundaries draw. The floor polygon is the Manhattan room that
    explains them best; where none comes near the raw polygon, it is the raw polygon itself. Any
    finite signals give a valid room.

    Args:
        boundary: Latitudes in radians, positive up, of ceiling and floor; the number of columns
            is a multiple of 256.
        corner: Probability of a corner in each column.
        camera_height: Metres; the room's size is proportional to it.

    Raises:
        ValueError: A signal is not finite, lengths differ, or the height is not positive.

    Examples:
        >>> from panoscene.geometry import boundary_from_layout, corner_signal_from_layout
        >>> room = torch.tensor([[-2.0, -1.0], [3.0, -1.0], [3.0, 2.0], [-2.0, 2.0]])
        >>> boundary = torch.stack(boundary_from_layout(room, 0.0, 2.5, 1.6))
        >>> found = room_from_signals(boundary, corner_signal_from_layout(room), 1.6)
        >>> len(found.layout.floor_polygon), round(found.layout.ceiling_height, 2)
        (4, 2.5)
    """
    if not 0 < camera_height < math.inf:
        raise ValueError(f"camera_height: expected a positive number, found {camera_height}")
    if boundary.shape != (2, len(corner)) or not len(corner) or len(corner) % 256:
        raise ValueError(
            "boundary, corner: expected 2 rows and 1 row of a multiple of 256 columns, found "
            f"{tuple(boundary.shape)} and {tuple(corner.shape)}"
        )
    columns = room_columns(boundary, corner)
    raw = drawn_polygon(columns.points(columns.distance))
    fits = manhattan_fits(columns)
    regular = regular_polygon(fits, raw)
    polygon = raw if regular is None else regular
    layout = Layout(
        floor_polygon=(polygon * camera_height).float(),
        ceiling_height=camera_height * (1 + columns.above),
        wall_score=wall_scores(polygon, columns),
        raw_polygon=(raw * camera_height).float(),
    )
    return RoomReading(layout, _ambiguous(fits, columns), regular is not None)


def polygon_of(fit: Fit) -> Float[Tensor, "corners 2"] | None:
    """Return the floor polygon of a fit, counter-clockwise, or None when it is no room."""
    polygon = torch.from_numpy(fit.walls.corners()[::-1].copy())
    if polygon_problem(polygon) is not None:
        return None
    inside = signed_distance_to_polygon(torch.zeros(1, 2, dtype=polygon.dtype), polygon)
    return polygon if float(inside[0]) <= -CLEARANCE else None


def regular_polygon(
    fits: Sequence[Fit], raw: Float[Tensor, "corners 2"]
) -> Float[Tensor, "regular_corners 2"] | None:
    """Return the first room that is valid and comes near the drawn polygon, or None."""
    for fit in fits:
        polygon = polygon_of(fit)
        if polygon is not None and polygon_iou(polygon, raw) >= LEAST_OVERLAP:
            return polygon
    return None


def wall_scores(
    polygon: Float[Tensor, "corners 2"], columns: RoomColumns
) -> Float[Tensor, " corners"]:
    """Return how sure each wall is, in [0, 1]: how well the columns that see it agree with it.

    1 where both boundaries run exactly along the wall, 1 / e where they are 2 degrees away, 0
    for a wall that no column sees.
    """
    # corner k + 1 ends wall k
    corners = np.roll(polygon.numpy(), -1, axis=0)[None]
    distance, wall = seen_walls(corners, columns.ray.numpy())
    floor = np.abs(np.arctan(-1 / distance[0]) - columns.floor.numpy())
    ceiling = np.abs(np.arctan(columns.above / distance[0]) - columns.ceiling.numpy())
    agreement = np.where(distance[0] < FAR_AWAY, np.exp(-(floor + ceiling) / (2 * SURE)), 0.0)
    total = np.bincount(wall[0], agreement, minlength=len(polygon))
    seen = np.bincount(wall[0], minlength=len(polygon))
    return torch.from_numpy(total / np.maximum(seen, 1)).float()


def _ambiguous(fits: Sequence[Fit], columns: RoomColumns) -> bool:
    """Return whether there are two readings: of the floor and the ceiling, or two rooms."""
    if _torn(columns):
        return True
    rooms = [polygon_of(fit) for fit in fits if fit.cost <= fits[0].cost + AS_GOOD]
    first = rooms[0] if rooms else None
    return first is not None and any(
        other is not None and polygon_iou(first, other) < ALIKE for other in rooms[1:]
    )


def _torn(columns: RoomColumns) -> bool:
    """Return whether floor and ceiling contradict each other in a run of columns.

    So they do at an open doorway: the ceiling stops at the wall above it, the floor goes on.
    """
    apart = torch.log(columns.from_floor / columns.from_ceiling).abs() > TORN
    around = torch.cat((apart, apart)).tolist()
    longest = run = 0
    for one in around:
        run = run + 1 if one else 0
        longest = max(longest, run)
    return longest >= TORN_COLUMNS * len(apart)
