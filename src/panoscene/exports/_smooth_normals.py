"""Which meshes are drawn round, and the normals that make them look so."""

import math

import numpy as np
from jaxtyping import Float, Int

from panoscene.geometry import edge_neighbours

SHARP = math.radians(35)
"""Meshes are drawn smooth, unless more than a twentieth of their edges turn by more than this."""
_MOST_SHARP = 0.05


def smooth_normals(
    vertices: Float[np.ndarray, "vertices 3"], faces: Int[np.ndarray, "faces 3"]
) -> Float[np.ndarray, "vertices 3"] | None:
    """Return unit normals of the vertices of a round shape; None for an edgy one.

    The normal of a vertex is the mean of its triangles' normals, weighted with their angles there
    (Thuermer and Wuethrich, 1998). A shape with a vertex that has none counts as edgy.
    """
    corners = vertices[faces].astype(np.float64)
    normal = _unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    one, two = edge_neighbours(faces)
    turn = (normal[one] * normal[two]).sum(axis=1)
    if len(turn) == 0 or float((turn < math.cos(SHARP)).mean()) > _MOST_SHARP:
        return None
    weighted = (_angles(corners)[..., None] * normal[:, None]).reshape(-1, 3)
    corner = faces.ravel()
    summed = [np.bincount(corner, axis, minlength=len(vertices)) for axis in weighted.T]
    normals = _unit(np.stack(summed, axis=-1))
    return normals if bool((np.abs(np.linalg.norm(normals, axis=-1) - 1) < 1e-3).all()) else None


def _angles(corners: Float[np.ndarray, "faces 3 3"]) -> Float[np.ndarray, "faces 3"]:
    """Return the angle of each triangle at each of its corners."""
    ahead = _unit(np.roll(corners, -1, axis=1) - corners)
    back = -np.roll(ahead, 1, axis=1)
    return np.arccos((ahead * back).sum(axis=-1).clip(-1, 1))


def _unit(vectors: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n 3"]:
    """Return vectors of length 1; those without a length stay so."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
