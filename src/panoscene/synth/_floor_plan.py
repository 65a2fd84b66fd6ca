"""Manhattan floor plans: a rectangle from which corners and chimney breasts are cut."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

CORNER_SHARE = {4: 0.60, 6: 0.22, 8: 0.10, 10: 0.08}
"""How often a room has so many corners when the caller leaves the number open."""

_ALONG = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])
"""Direction of the rectangle's sides, counter-clockwise; their inward normals are the next row."""


@dataclass(frozen=True, slots=True)
class FloorPlan:
    """A room seen from above in its own axis-aligned frame (metres)."""

    extent: Float[np.ndarray, " 2"]
    """The room lies in [0, extent x] x [0, extent y]."""
    polygon: Float[np.ndarray, "corners 2"]
    """Corners, counter-clockwise; every side is parallel to an axis."""
    notch_low: Float[np.ndarray, "notches 2"]
    """Lower corners of the rectangles inside the extent that are not part of the room."""
    notch_high: Float[np.ndarray, "notches 2"]

    @property
    def wall_length(self) -> Float[np.ndarray, " corners"]:
        """Length of each wall in metres."""
        return np.abs(np.roll(self.polygon, -1, axis=0) - self.polygon).sum(axis=1)

    @property
    def wall_yaw(self) -> Float[np.ndarray, " corners"]:
        """Yaw of an object that stands with its back to each wall, in radians."""
        along = np.roll(self.polygon, -1, axis=0) - self.polygon
        return np.arctan2(along[:, 1], along[:, 0])

    def clearance(self, points: Float[np.ndarray, "k 2"]) -> Float[np.ndarray, " k"]:
        """Return the distance of points in the extent to the nearest wall; 0 inside notches."""
        to_sides = np.minimum(points, self.extent - points).min(axis=1)
        outside = np.maximum(
            self.notch_low - points[:, None], points[:, None] - self.notch_high
        ).clip(min=0.0)
        return np.minimum(to_sides, np.linalg.norm(outside, axis=2).min(axis=1, initial=np.inf))


def sample_corner_count(rng: np.random.Generator) -> int:
    """Return 4, 6, 8 or 10 with the shares of ``CORNER_SHARE``."""
    return int(rng.choice(list(CORNER_SHARE), p=list(CORNER_SHARE.values())))


def sample_floor_plan(rng: np.random.Generator, area: float, corners: int) -> FloorPlan:
    """Return a random Manhattan room.

    Every corner cut off adds two corners to the polygon, every chimney breast (a block standing
    out from the middle of a side) four. Cuts take 18 to 38 % of a side, so that the room stays in
    one piece and every passage is at least 24 % of a side wide.

    Args:
        rng: source of randomness.
        area: square metres of the uncut rectangle.
        corners: 4, 6, 8, 10 or 12.

    Raises:
        ValueError: if the number of corners is another one.
    """
    if corners not in (4, 6, 8, 10, 12):
        raise ValueError(f"corners must be 4, 6, 8, 10 or 12, found {corners}")
    aspect = rng.uniform(0.62, 1.0)
    extent = np.sqrt(area * np.array([1.0 / aspect, aspect]))
    if rng.random() < 0.5:
        extent = extent[::-1].copy()
    cuts = (corners - 4) // 2
    chimney = int(rng.integers(4)) if cuts >= 2 and rng.random() < 0.35 else None
    cut_corners = set(rng.permutation(4)[: cuts - (2 if chimney is not None else 0)].tolist())

    rectangle = np.array([[0.0, 0.0], [extent[0], 0.0], extent, [0.0, extent[1]]])
    polygon: list[np.ndarray] = []
    notches: list[np.ndarray] = []
    for corner, point in enumerate(rectangle):
        arriving, leaving = _ALONG[corner - 1], _ALONG[corner]
        side, across = float(np.abs(leaving) @ extent), float(np.abs(arriving) @ extent)
        if corner in cut_corners:
            back = point - rng.uniform(0.18, 0.38) * across * arriving
            ahead = point + rng.uniform(0.18, 0.38) * side * leaving
            polygon += [back, back + ahead - point, ahead]
            notches.append(np.stack([point, back + ahead - point]))
        else:
            polygon.append(point)
        if corner == chimney:
            start = point + rng.uniform(0.40, 0.45) * side * leaving
            stop = point + rng.uniform(0.55, 0.60) * side * leaving
            depth = rng.uniform(0.08, 0.18) * across * _ALONG[(corner + 1) % 4]
            polygon += [start, start + depth, stop + depth, stop]
            notches.append(np.stack([start, stop + depth]))
    pairs = np.array(notches).reshape(-1, 2, 2)
    return FloorPlan(extent, np.array(polygon), pairs.min(axis=1), pairs.max(axis=1))


def sample_camera(rng: np.random.Generator, plan: FloorPlan) -> Float[np.ndarray, " 2"]:
    """Return a place for the camera in the plan's frame, well away from the walls.

    It is the roomiest of three random places that have 0.7 m of clearance, or the roomiest of all
    tried ones in a very small room.
    """
    points = rng.uniform(0.0, 1.0, (64, 2)) * plan.extent
    clearance = plan.clearance(points)
    roomy = np.flatnonzero(clearance >= 0.7)[:3]
    if roomy.size == 0:
        return points[clearance.argmax()]
    return points[roomy[clearance[roomy].argmax()]]
