"""Models at their places, as triangles of the home's frame and as solids."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64, Int64, UInt8
from scipy.spatial import ConvexHull, QhullError

from panoscene.synth.assets import CadModel
from panoscene.synth.homes import Placed

from ._shapes import CollisionShape


def turned(yaw: float) -> Float64[np.ndarray, "3 3"]:
    """Return the rotation about +z that takes the object frame to the home's."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, slots=True)
class Solid:
    """A model at its place."""

    triangles: Float64[np.ndarray, "faces 3 3"]
    """In the frame of the home, metres."""
    shape: CollisionShape
    position: Float64[np.ndarray, " 3"]
    """Of the origin of the object frame."""
    yaw: float
    scale: Float64[np.ndarray, " 3"]
    extent: Float64[np.ndarray, "2 3"]
    """Bounds in the object frame after scaling."""
    bounds: Float64[np.ndarray, "2 3"]
    """Bounds in the frame of the home."""
    outline: Float64[np.ndarray, "corners 2"]
    """Corners of the convex outline of the plan, in the frame of the home."""

    @property
    def low(self) -> float:
        """Height of the lower edge."""
        return float(self.bounds[0, 2])

    @property
    def volume(self) -> float:
        """Of the bounding box, in cubic metres."""
        return float(np.prod(np.maximum(self.extent[1] - self.extent[0], 0.002)))

    def shifted(self, offset: Float64[np.ndarray, " 3"]) -> "Solid":
        """Return the same model elsewhere."""
        if not offset.any():
            return self
        return replace(
            self,
            triangles=self.triangles + offset,
            position=self.position + offset,
            bounds=self.bounds + offset,
            outline=self.outline + offset[:2],
        )

    def states(self, points: Float64[np.ndarray, "n 3"]) -> UInt8[np.ndarray, " n"]:
        """Return whether points of the home are free, near the surface or inside (0, 1, 2)."""
        local = (points - self.position) @ turned(self.yaw) / self.scale
        return self.shape.states(local)

    def span(self, direction: Float64[np.ndarray, " 3"]) -> tuple[float, float]:
        """Return the least and greatest coordinate of the oriented box along a direction."""
        local = direction @ turned(self.yaw)
        middle = float(self.position @ direction + self.extent.mean(axis=0) @ local)
        half = float(np.abs(local) @ (self.extent[1] - self.extent[0]) / 2)
        return middle - half, middle + half


def solid(model: CadModel, placed: Placed, shape: CollisionShape) -> Solid:
    """Return a model at its place.

    Args:
        model: The model that is meant.
        placed: Where it is, and its scale.
        shape: Its collision shape.
    """
    scale = np.array(placed.scale, np.float64)
    position = np.array(placed.position, np.float64)
    vertices = model.vertices.astype(np.float64) * scale
    extent = np.stack([vertices.min(axis=0), vertices.max(axis=0)])
    world = vertices @ turned(placed.yaw).T + position
    triangles = world[model.faces]
    bounds = np.stack([world.min(axis=0), world.max(axis=0)])
    outline = world[_outline(vertices[:, :2]), :2]
    return Solid(triangles, shape, position, placed.yaw, scale, extent, bounds, outline)


def _outline(plan: Float64[np.ndarray, "n 2"]) -> Int64[np.ndarray, " corners"]:
    """Return which points are corners of the convex outline, counter-clockwise from above."""
    try:
        return ConvexHull(plan).vertices.astype(np.int64)
    except QhullError:  # all on a line
        far = np.argmax(np.linalg.norm(plan - plan[0], axis=1))
        return np.array([np.argmax(np.linalg.norm(plan - plan[far], axis=1)), far], np.int64)
