"""One floor polygon at a time, through shapely: why it is not valid, Manhattan or not, overlap."""

import math

import shapely
import torch
from jaxtyping import Float
from shapely.validation import explain_validity
from torch import Tensor

from panoscene.geometry._polygon import polygon_area

COINCIDENT = 1e-6
"""Corners nearer than this (metres) count as the same corner."""


def polygon_problem(polygon: Float[Tensor, "corners 2"]) -> str | None:
    """Return in plain words why this is not a valid floor polygon, or None when it is one.

    Valid: at least three finite corners, no two alike, no wall crosses or touches another,
    counter-clockwise from above.

    Examples:
        >>> polygon_problem(torch.tensor([[0.0, 0.0], [4.0, 3.0], [4.0, 0.0], [0.0, 3.0]]))
        'walls cross or touch: Self-intersection[2 1.5]'
    """
    corners = polygon.detach().to("cpu", torch.float64)
    if len(corners) < 3:
        return f"it has {len(corners)} corners, at least 3 are needed"
    for index, corner in enumerate(corners):
        if not bool(torch.all(torch.isfinite(corner))):
            return f"corner {index} is not finite: {_written(corner)}"
    apart = torch.cdist(corners, corners, compute_mode="donot_use_mm_for_euclid_dist")
    alike = torch.nonzero(apart.fill_diagonal_(math.inf) < COINCIDENT)
    if len(alike):
        first, second = int(alike[0, 0]), int(alike[0, 1])
        return f"corners {first} and {second} are the same point: {_written(corners[first])}"
    return _crossing_problem(corners)


def _crossing_problem(corners: Float[Tensor, "corners 2"]) -> str | None:
    shape = _shape(corners)
    extent = float((corners.amax(0) - corners.amin(0)).amax())
    if float(shape.convex_hull.area) <= COINCIDENT * extent:
        return "its area is zero: all corners lie on one line"
    if not shape.is_valid:
        return f"walls cross or touch: {explain_validity(shape)}"
    if float(polygon_area(corners)) < 0:
        return "its corners run clockwise, counter-clockwise from above is needed"
    return None


def _written(corner: Float[Tensor, "2"]) -> str:
    return f"({float(corner[0]):g}, {float(corner[1]):g})"


def polygon_turn(polygon: Float[Tensor, "corners 2"]) -> float:
    """Return the smallest turn that lays most of the wall along the axes, in radians.

    Counter-clockwise, within pi / 4. Minus the turn is the direction of the walls, up to quarter
    turns: the length-weighted mean of the walls' own directions.

    Convention:
        - padding by repeated corners changes nothing
        - 0 for a polygon whose walls have no common direction, such as a regular pentagon, up to
          rounding

    Examples:
        >>> room = torch.tensor([[2.0, 0.0], [4.0, 2.0], [2.0, 4.0], [0.0, 2.0]])
        >>> round(abs(polygon_turn(room)), 4)  # by an eighth of a full turn, either way
        0.7854
    """
    corner = polygon.detach().double()
    along = corner.roll(-1, dims=0) - corner
    length = torch.hypot(along[:, 0], along[:, 1])
    direction = torch.atan2(along[:, 1], along[:, 0])
    # four times the angle is the same for all four directions of a Manhattan room
    across = torch.sum(length * torch.sin(4 * direction))
    return float(-torch.atan2(across, torch.sum(length * torch.cos(4 * direction))) / 4)


def is_manhattan(polygon: Float[Tensor, "corners 2"], tolerance: float = 0.01) -> bool:
    """Return whether all walls are parallel or perpendicular to each other.

    The room may be turned: the axes are the length-weighted mean of the walls' own directions,
    and ``tolerance`` is the largest angle in radians that a wall may differ from them.

    Examples:
        >>> is_manhattan(torch.tensor([[2.0, 0.0], [4.0, 2.0], [2.0, 4.0], [0.0, 2.0]]))
        True
    """
    along = polygon.detach().roll(-1, dims=0) - polygon.detach()
    length = torch.hypot(along[:, 0], along[:, 1])
    direction = torch.atan2(along[:, 1], along[:, 0])
    turn = 4 * (direction + polygon_turn(polygon))
    deviation = torch.atan2(torch.sin(turn), torch.cos(turn)).abs() / 4
    return bool(torch.all((deviation <= tolerance) | (length < COINCIDENT)))


def polygon_intersection_area(
    polygon: Float[Tensor, "corners 2"], other: Float[Tensor, "other_corners 2"]
) -> float:
    """Return the area in square metres that two polygons share.

    Raises:
        ValueError: if a polygon has fewer than three corners, is not finite, or crosses itself.

    Examples:
        >>> square = torch.tensor([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
        >>> polygon_intersection_area(square, square + 1)
        1.0
    """
    shared = _valid_shape(polygon, "polygon").intersection(_valid_shape(other, "other"))
    return float(shared.area)


def polygon_iou(
    polygon: Float[Tensor, "corners 2"], other: Float[Tensor, "other_corners 2"]
) -> float:
    """Return intersection over union of two polygons, in [0, 1].

    Raises:
        ValueError: if a polygon has fewer than three corners, is not finite, or crosses itself.

    Examples:
        >>> square = torch.tensor([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
        >>> round(polygon_iou(square, square + 1), 4)
        0.1429
    """
    first, second = _valid_shape(polygon, "polygon"), _valid_shape(other, "other")
    shared = float(first.intersection(second).area)
    union = float(first.area) + float(second.area) - shared
    return min(shared / union, 1.0) if union > 0 else 0.0


def _shape(polygon: Float[Tensor, "corners 2"]) -> shapely.Polygon:
    return shapely.Polygon(polygon.detach().to("cpu", torch.float64).numpy())


def _valid_shape(polygon: Float[Tensor, "corners 2"], name: str) -> shapely.Polygon:
    if len(polygon) < 3:
        raise ValueError(f"{name}: expected at least 3 corners, found {len(polygon)}")
    if not bool(polygon.isfinite().all()):
        raise ValueError(f"{name}: expected finite corners, found NaN or infinity")
    shape = _shape(polygon)
    if not shape.is_valid:
        raise ValueError(f"{name}: expected a simple polygon, found {explain_validity(shape)}")
    return shape
