"""Areas of convex outlines on the sphere."""

import numpy as np
import shapely
from jaxtyping import Float64


def hull_area(directions: Float64[np.ndarray, "n 3"], axis: Float64[np.ndarray, "3"]) -> float:
    """Return the area in steradians of the convex hull of directions, in a flat map around an axis.

    The map is Lambert's equal-area projection: it keeps areas and covers the whole sphere, where
    a perspective camera ends at 90 degrees.

    Examples:
        >>> ring = np.linspace(0, 2 * np.pi, 400)
        >>> half = np.stack([np.cos(ring), 0 * ring, np.sin(ring)], axis=1)
        >>> round(hull_area(half, np.array([0.0, 1.0, 0.0])) / np.pi, 3)
        2.0
    """
    axis = axis / np.linalg.norm(axis)
    helper = np.eye(3)[np.abs(axis).argmin()]
    right = np.cross(axis, helper)
    right /= np.linalg.norm(right)
    up = np.cross(right, axis)
    along = directions @ axis
    stretch = np.sqrt(2.0 / np.maximum(1.0 + along, 1e-6))
    plane = np.stack([directions @ right, directions @ up], axis=1) * stretch[:, None]
    return float(shapely.MultiPoint(plane).convex_hull.area)
