"""From HorizonNet's signals to a room: the inverse that always returns a room.

Three candidates are built and rendered back: a Manhattan room, a star-shaped polygon of general
walls, and a cuboid. The simplest one that explains the boundary about as well as the best wins.
The idea of corner peaks, walls across one of two axes and inserted hidden walls is HorizonNet's;
the fit (optimal segmentation instead of votes) and the choice are ours.
"""

import math
from dataclasses import dataclass
from typing import Literal

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry._boundary import boundary_from_layout
from panoscene.geometry._boundary_columns import MIN_DISTANCE, Columns, columns_from_signals
from panoscene.geometry._polygon import signed_distance_to_polygon
from panoscene.geometry._polygon_validity import polygon_problem
from panoscene.geometry._wall_chain import chain_corners, general_chain, manhattan_chain
from panoscene.geometry._wall_segmentation import manhattan_axes

Method = Literal["manhattan", "general", "cuboid", "fallback"]

NOT_MUCH_WORSE = (1.25, math.radians(0.15))
"""A simpler candidate may have this times the best reprojection error, plus this (radians)."""
CLEARANCE = 0.05
"""Metres between the camera and the nearest wall that a room must leave."""
SLACKS = (0.03, 0.12, 0.5)
"""Angles in radians by which a corner may leave the ray between its walls before they are taken
to hide something: all are tried."""
CUBOID_ROUNDS = 5


@dataclass(frozen=True, slots=True)
class RecoveredLayout:
    """A room recovered from boundary signals."""

    polygon: Float[Tensor, "corners 2"]
    """World x, y of the corners in metres, counter-clockwise; simple, with the camera inside."""
    ceiling_height: float
    """World z of the ceiling in metres; the floor is at 0."""
    method: Method
    """How the polygon was obtained. ``cuboid``: neither a Manhattan nor a general polygon
    explained the boundary better than four walls; ``fallback``: nothing did, a square."""
    reprojection_error: float
    """Mean absolute difference of latitude in radians between the room and the signals."""


def layout_from_boundary(
    ceiling_lat: Float[Tensor, " width"],
    floor_lat: Float[Tensor, " width"],
    corner_probability: Float[Tensor, " width"],
    camera_height: float,
    *,
    manhattan: bool = True,
    max_distance: float = 20.0,
) -> RecoveredLayout:
    """Return the room that explains a panorama's boundary and corner signals.

    Any finite signals give a valid room: a simple polygon around the camera. The panorama need
    not be aligned with the walls. Not differentiable.

    Convention:
        - latitudes in radians, positive up; columns as ``boundary_from_layout`` has them
        - ``corner_probability`` is a probability: pass HorizonNet's logits through a sigmoid
        - a boundary at the horizon, infinitely far, counts as ``max_distance`` metres

    Args:
        ceiling_lat: Where each column sees the wall meet the ceiling.
        floor_lat: Where each column sees the wall meet the floor.
        corner_probability: Evidence of a corner in each column; zeros are fine.
        camera_height: Metres from the floor to the camera.
        manhattan: Prefer a room of perpendicular walls; it wins only if its reprojection error
            is not much worse than that of general walls, and needs not many more walls.
        max_distance: Largest distance of a wall in metres.

    Raises:
        ValueError: if a signal is not finite, the lengths differ or are below 16, or
            ``camera_height`` or ``max_distance`` is not a positive number (max_distance > 1).

    Examples:
        >>> room = torch.tensor([[-2.0, -1.0], [3.0, -1.0], [3.0, 2.0], [-2.0, 2.0]])
        >>> ceiling_lat, floor_lat = boundary_from_layout(room, 0.0, 2.5, 1.6)
        >>> found = layout_from_boundary(ceiling_lat, floor_lat, torch.zeros(1024), 1.6)
        >>> found.method, len(found.polygon), round(found.ceiling_height, 3)
        ('manhattan', 4, 2.5)
    """
    _check_signals(ceiling_lat, floor_lat, corner_probability, camera_height, max_distance)
    columns = columns_from_signals(
        ceiling_lat, floor_lat, corner_probability, camera_height, max_distance
    )
    general = general_chain(columns)
    axes = manhattan_axes([wall.run for wall in general])
    # from the simplest to the last resort
    candidates: dict[Method, list[Tensor]] = {}
    if manhattan:
        chain = manhattan_chain(columns, general, axes)
        polygons = [chain_corners(chain, columns, slack, axes) for slack in SLACKS]
        # each visible wall may hide one more; many more than that is an oblique wall in steps
        most = 2 * len(general) + 2
        candidates["manhattan"] = [polygon for polygon in polygons if len(polygon) <= most]
    candidates["general"] = [chain_corners(general, columns, slack) for slack in SLACKS]
    candidates["cuboid"] = [_cuboid(columns, axes)]
    method, polygon, error = _best(candidates, columns)
    return RecoveredLayout(
        polygon.to(floor_lat), camera_height + columns.above_camera, method, error
    )


def _check_signals(
    ceiling_lat: Tensor,
    floor_lat: Tensor,
    corner_probability: Tensor,
    camera_height: float,
    max_distance: float,
) -> None:
    signals = {
        "ceiling_lat": ceiling_lat,
        "floor_lat": floor_lat,
        "corner_probability": corner_probability,
    }
    for name, signal in signals.items():
        if signal.ndim != 1 or len(signal) != len(floor_lat) or len(signal) < 16:
            raise ValueError(
                f"{name}: expected one value for each of at least 16 columns, "
                f"found shape {tuple(signal.shape)} beside {len(floor_lat)} columns of floor_lat"
            )
        if not bool(torch.all(torch.isfinite(signal))):
            raise ValueError(f"{name}: expected finite values, found NaN or infinity")
    if not 0 < camera_height < math.inf:
        raise ValueError(f"camera_height: expected a positive number, found {camera_height}")
    if not 1 < max_distance < math.inf:
        raise ValueError(f"max_distance: expected more than 1 metre, found {max_distance}")


def _best(candidates: dict[Method, list[Tensor]], columns: Columns) -> tuple[Method, Tensor, float]:
    """Return the first candidate whose reprojection error is not much worse than the least."""
    rooms: list[tuple[Method, Tensor, float]] = []
    for method, polygons in candidates.items():
        for index, polygon in enumerate(polygons):
            known = any(torch.equal(polygon, other) for other in polygons[:index])
            if not known and _is_room(polygon):
                rooms.append((method, polygon, reprojection_error(polygon, columns)))
    if not rooms:
        square = _square(columns)
        return "fallback", square, reprojection_error(square, columns)
    factor, slack = NOT_MUCH_WORSE
    enough = min(error for _, _, error in rooms) * factor + slack
    method = next(method for method, _, error in rooms if error <= enough)
    return min((room for room in rooms if room[0] == method), key=lambda room: room[2])


def _is_room(polygon: Float[Tensor, "corners 2"]) -> bool:
    if polygon_problem(polygon) is not None:
        return False
    distance = signed_distance_to_polygon(torch.zeros_like(polygon[:1]), polygon)
    return float(distance[0]) <= -CLEARANCE


def reprojection_error(polygon: Float[Tensor, "corners 2"], columns: Columns) -> float:
    """Return the mean absolute difference of latitude in radians between a room and the signals."""
    ceiling_lat, floor_lat = boundary_from_layout(
        polygon, -columns.camera_height, columns.above_camera, 0.0, len(columns.nearness)
    )
    difference = (ceiling_lat - columns.ceiling_lat).abs() + (floor_lat - columns.floor_lat).abs()
    return float(difference.mean()) / 2


def _cuboid(columns: Columns, axes: Float[Tensor, "2 2"]) -> Float[Tensor, "4 2"]:
    """Return the four-walled room that fits best: assign columns to walls, take medians, repeat."""
    normals = torch.cat((axes, -axes))
    facing = columns.ray @ normals.T
    # the nearness of a wall that each column implies, if it is this wall that the column sees
    implied = columns.nearness[:, None] / facing.clamp(min=1e-3)
    nearness = columns.nearness.median().repeat(4)
    for _ in range(CUBOID_ROUNDS):
        wall = (facing * nearness).argmax(1)
        for index in range(4):
            mine = implied[wall == index, index]
            if len(mine):
                nearness[index] = mine.median()
        nearness = nearness.clamp(1 / columns.max_distance, 1 / MIN_DISTANCE)
    right, front, left, back = (1 / nearness).unbind()
    return torch.stack(
        (
            -left * axes[0] - back * axes[1],
            right * axes[0] - back * axes[1],
            right * axes[0] + front * axes[1],
            -left * axes[0] + front * axes[1],
        )
    )


def _square(columns: Columns) -> Float[Tensor, "4 2"]:
    half = 1 / columns.nearness.median()
    return half * half.new_tensor([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
