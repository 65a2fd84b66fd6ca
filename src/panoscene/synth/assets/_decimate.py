"""Fewer triangles with the same parts, materials and texture coordinates."""

from typing import Any

import numpy as np
from jaxtyping import Float64, Int64
from scipy.spatial import KDTree

from ._errors import AssetError
from ._soup import Triangles, weld

MAX_FACES = 20_000
_FAR = 3.0
"""Barycentric coordinates beyond this are not trusted to carry a texture on."""
_WAYS = ({"agg": 3.0, "preserve_border": True}, {"agg": 3.0, "preserve_border": False})
"""First without touching rims, so that panes and panels stay whole; then anywhere."""


def decimated(triangles: Triangles, max_faces: int = MAX_FACES) -> Triangles:
    """Return at most ``max_faces`` triangles by quadric edge collapse.

    Every triangle that is left is one of the old ones with moved corners (Garland and Heckbert
    1997), so it keeps its label; its texture is carried on from the old corners to the new ones.
    Normals are left to be made anew. What resists is simplified by clustering its corners.

    Raises:
        AssetError: The optional package ``fast-simplification`` is missing.
    """
    if len(triangles.label) <= max_faces:
        return triangles
    found = triangles
    for way in _WAYS:
        found = _collapsed(triangles, max_faces, way)
        if len(found.label) <= max_faces:
            return found
    return _clustered(found, max_faces)


def _collapsed(triangles: Triangles, max_faces: int, way: dict[str, Any]) -> Triangles:
    """Return triangles after edge collapses; more than wanted where the mesh resists."""
    try:
        import fast_simplification  # noqa: PLC0415 - optional
    except ImportError as error:
        hint = "large models need fast-simplification: pip install 'panoscene[synth]'"
        raise AssetError("fast-simplification", hint) from error
    corners = weld(triangles.positions)
    points = np.zeros((int(corners.max()) + 1, 3))
    points[corners.ravel()] = triangles.positions.reshape(-1, 3)
    faces = corners.astype(np.int32)
    simplified = fast_simplification.simplify(
        points, faces, target_count=max_faces, return_collapses=True, **way
    )
    moved, left, collapses = simplified[0], simplified[1], simplified[-1]
    target = np.asarray(fast_simplification.replay_simplification(points, faces, collapses)[2])
    new = target[corners]
    a, b, c = new.T
    rows = np.flatnonzero((a != b) & (b != c) & (a != c))
    positions = np.asarray(moved, np.float64)[np.asarray(left)]
    if not _same_faces(new[rows], np.asarray(left, np.int64)):
        middles = KDTree(triangles.positions.mean(axis=1))
        rows = np.asarray(middles.query(positions.mean(axis=1))[1])
    return _with_corners(triangles.take(rows), positions)


def _same_faces(new: Int64[np.ndarray, "n 3"], left: Int64[np.ndarray, "m 3"]) -> bool:
    """Return whether two lists of faces are the same but for the numbers of their corners."""
    if new.shape != left.shape:
        return False
    pairs = np.unique(np.stack([new.ravel(), left.ravel()], axis=1), axis=0)
    return len(pairs) == len(np.unique(new)) == len(np.unique(left))


def _clustered(triangles: Triangles, max_faces: int) -> Triangles:
    """Return triangles whose corners are drawn together in cells just wide enough."""
    corners = weld(triangles.positions)
    points = triangles.positions.reshape(-1, 3)
    cell = 2.0**-12 * float(np.ptp(points, axis=0).max())
    while True:
        cells = np.floor((points - points.min(axis=0)) / cell).astype(np.int64)
        key = (cells[:, 0] << 42) | (cells[:, 1] << 21) | cells[:, 2]
        _, group = np.unique(key, return_inverse=True)
        ordered = np.sort(group.reshape(corners.shape), axis=1)
        rows = np.flatnonzero((np.diff(ordered, axis=1) > 0).all(axis=1))
        _, first = np.unique(ordered[rows], axis=0, return_index=True)
        if len(first) <= max_faces:
            break
        cell *= 1.15
    size = np.maximum(np.bincount(group), 1)
    middle = np.stack([np.bincount(group, points[:, k]) / size for k in range(3)], axis=1)
    kept = np.sort(rows[first])
    positions = middle[group.reshape(corners.shape)[kept]]
    return _with_corners(triangles.take(kept), positions)


def _with_corners(kept: Triangles, positions: Float64[np.ndarray, "n 3 3"]) -> Triangles:
    """Return triangles with new corners, without those that lost their area."""
    area = np.linalg.norm(
        np.cross(positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0]), axis=1
    )
    uv = _carried_uv(kept, positions)
    moved = Triangles(positions, uv, np.zeros_like(kept.normals), kept.label)
    return moved.take(area > 1e-12)


def _carried_uv(
    old: Triangles, positions: Float64[np.ndarray, "n 3 3"]
) -> Float64[np.ndarray, "n 3 2"]:
    """Return texture coordinates at moved corners, by the affine map of the old triangle."""
    origin = old.positions[:, 0]
    u, v = old.positions[:, 1] - origin, old.positions[:, 2] - origin
    uu, uv, vv = (np.einsum("nx,nx->n", p, q) for p, q in ((u, u), (u, v), (v, v)))
    span = np.maximum(uu * vv - uv * uv, 1e-300)
    away = positions - origin[:, None]
    du, dv = np.einsum("ncx,nx->nc", away, u), np.einsum("ncx,nx->nc", away, v)
    s = (vv[:, None] * du - uv[:, None] * dv) / span[:, None]
    t = (uu[:, None] * dv - uv[:, None] * du) / span[:, None]
    weights = np.stack([1 - s - t, s, t], axis=-1)
    carried = np.einsum("nck,nkx->ncx", weights, old.uv)
    trusted = (np.abs(weights) < 1 + _FAR).all(axis=-1, keepdims=True)
    return np.where(trusted, carried, old.uv)
