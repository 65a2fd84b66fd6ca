"""Which meshes touch, beyond what their boxes say."""

import numpy as np
from jaxtyping import Float64, Int32
from scipy.spatial import KDTree

_REACH = 0.15
"""Metres around a box in which the other mesh is looked at."""
_POINTS = 1500
_VERTICES = 1500


def mesh_gap(
    first: tuple[Float64[np.ndarray, "v 3"], Int32[np.ndarray, "f 3"]],
    second: tuple[Float64[np.ndarray, "w 3"], Int32[np.ndarray, "g 3"]],
) -> float:
    """Return about how far apart in metres two meshes are, given as vertices and faces.

    It is the distance between the nearest of their points: vertices, and 1,500 points spread over
    the part of each mesh that is near the other. Meshes farther apart than 0.15 m along an axis
    give infinity.
    """
    near = [_near(mine, other) for mine, other in ((first, second), (second, first))]
    if not all(len(points) for points in near):
        return float("inf")
    few, many = sorted(near, key=len)
    distance, _ = KDTree(many).query(few)
    return float(distance.min())


def _near(
    mesh: tuple[np.ndarray, np.ndarray], other: tuple[np.ndarray, np.ndarray]
) -> Float64[np.ndarray, "n 3"]:
    """Return points of a mesh near the bounds of another one, always the same ones."""
    vertices, faces = mesh
    low, high = other[0].min(axis=0) - _REACH, other[0].max(axis=0) + _REACH
    corners = vertices[faces]
    meets = ((corners.min(axis=1) <= high) & (corners.max(axis=1) >= low)).all(axis=1)
    corners = corners[meets]
    if len(corners) == 0:
        return np.zeros((0, 3))
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    total = np.cumsum(np.linalg.norm(cross, axis=1))
    # evenly spread over the area; the golden ratio and its square root of two fill triangles well
    step = (np.arange(_POINTS) + 0.5) / _POINTS
    chosen = np.minimum(np.searchsorted(total, step * total[-1]), len(corners) - 1)
    a, b = (
        np.modf(np.arange(_POINTS) * 0.754877666)[0],
        np.modf(np.arange(_POINTS) * 0.569840291)[0],
    )
    fold = a + b > 1
    a, b = np.where(fold, 1 - a, a), np.where(fold, 1 - b, b)
    one, two, three = (corners[chosen, k] for k in range(3))
    # and vertices: edges and tips are where meshes meet
    tips = vertices[np.unique(faces[meets])]
    points = np.concatenate([
        one + a[:, None] * (two - one) + b[:, None] * (three - one),
        tips[:: -(-len(tips) // _VERTICES)],
    ])  # fmt: skip
    inside = ((points >= low) & (points <= high)).all(axis=1)
    return points[inside]
