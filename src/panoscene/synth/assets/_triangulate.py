"""Triangles from polygons of any shape: convex, concave, or slit to go round a hole."""

import numpy as np
from jaxtyping import Bool, Float64, Int64

_FLAT = 1e-12


def triangulate(
    positions: Float64[np.ndarray, "corners 3"], starts: Int64[np.ndarray, " polygons_and_one"]
) -> tuple[Int64[np.ndarray, "triangles 3"], Int64[np.ndarray, " triangles"]]:
    """Return the triangles as corner indices, and the polygon each was cut from.

    Convex polygons become fans, all of one length at a time; concave ones and those with slits
    are clipped ear by ear (Meisters 1975) in the plane of their area vector.

    Args:
        positions: Of all corners, polygon by polygon.
        starts: Polygon k has the corners ``starts[k]`` to ``starts[k + 1] - 1``.
    """
    lengths = np.diff(starts)
    triangles: list[np.ndarray] = []
    owners: list[np.ndarray] = []
    for length in np.unique(lengths[lengths >= 3]):
        polygons = np.flatnonzero(lengths == length)
        corners = starts[polygons][:, None] + np.arange(length)
        fan = np.ones(len(polygons), bool) if length == 3 else _is_convex(positions[corners])
        steps = np.arange(1, length - 1)
        first = np.broadcast_to(corners[fan, :1], (int(fan.sum()), length - 2))
        cut = np.stack([first, corners[fan][:, steps], corners[fan][:, steps + 1]], axis=-1)
        triangles.append(cut.reshape(-1, 3))
        owners.append(np.repeat(polygons[fan], length - 2))
        for polygon, row in zip(polygons[~fan], corners[~fan], strict=True):
            ears = clip_ears(flattened(positions[row]))
            triangles.append(row[ears])
            owners.append(np.full(len(ears), polygon))
    if not triangles:
        return np.zeros((0, 3), np.int64), np.zeros(0, np.int64)
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(triangles)[order].astype(np.int64), owner[order].astype(np.int64)


def _area_vectors(
    corners: Float64[np.ndarray, "polygons corners 3"],
) -> Float64[np.ndarray, "polygons 3"]:
    """Return normals of the polygons with the length of twice their area."""
    centred = corners - corners[:, :1]
    return np.cross(centred, np.roll(centred, -1, axis=1)).sum(axis=1)


def _is_convex(
    corners: Float64[np.ndarray, "polygons corners 3"],
) -> Bool[np.ndarray, " polygons"]:
    """Return which polygons turn the same way at every corner, and only once around."""
    normal = _area_vectors(corners)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    unit = normal / np.maximum(length, 1e-300)
    edges = np.roll(corners, -1, axis=1) - corners
    before = np.roll(edges, 1, axis=1)
    turn = np.einsum("pcx,px->pc", np.cross(before, edges), unit)
    along = np.einsum("pcx,pcx->pc", before, edges)
    tolerance = 1e-9 * length
    once = np.abs(np.arctan2(turn, along).sum(axis=1)) < 2.5 * np.pi
    back = ((np.abs(turn) <= tolerance) & (along < 0)).any(axis=1)
    return (turn >= -tolerance).all(axis=1) & once & ~back


def flattened(corners: Float64[np.ndarray, "corners 3"]) -> Float64[np.ndarray, "corners 2"]:
    """Return a polygon in the plane of its area vector, counter-clockwise."""
    normal = _area_vectors(corners[None])[0]
    length = np.linalg.norm(normal)
    unit = normal / length if length > 0 else np.array([0.0, 0.0, 1.0])
    side = np.eye(3)[int(np.argmin(np.abs(unit)))]
    right = np.cross(side, unit)
    right /= np.linalg.norm(right)
    return (corners - corners[0]) @ np.stack([right, np.cross(unit, right)], axis=1)


def clip_ears(polygon: Float64[np.ndarray, "corners 2"]) -> Int64[np.ndarray, "triangles 3"]:
    """Return n - 2 triangles of a counter-clockwise polygon of n corners.

    Corners that lie on each other, as along a slit to a hole, do not block an ear. A polygon that
    crosses itself has no triangulation; it gets one that at least uses every corner.

    Examples:
        >>> import numpy as np
        >>> clip_ears(np.array([[0.0, 0], [2, 0], [0.5, 0.5], [0, 2]])).tolist()
        [[0, 1, 2], [0, 2, 3]]
    """
    left = list(range(len(polygon)))
    triangles: list[tuple[int, int, int]] = []
    scale = float(np.ptp(polygon, axis=0).max()) ** 2
    while len(left) > 3:
        points = polygon[left]
        before, after = np.roll(points, 1, axis=0), np.roll(points, -1, axis=0)
        turn = _cross(points - before, after - points)
        k = _best_ear(points, before, after, turn, scale * _FLAT)
        triangles.append((left[k - 1], left[k], left[(k + 1) % len(left)]))
        del left[k]
    triangles.append((left[0], left[1], left[2]))
    return np.array(triangles, np.int64)


def _best_ear(
    points: Float64[np.ndarray, "corners 2"],
    before: Float64[np.ndarray, "corners 2"],
    after: Float64[np.ndarray, "corners 2"],
    turn: Float64[np.ndarray, " corners"],
    flat: float,
) -> int:
    """Return the corner to clip: an empty ear with the shortest cut, else the least bad one."""
    cut = np.linalg.norm(after - before, axis=1)
    order = np.argsort(np.where(turn > flat, cut, np.inf), kind="stable")
    reflex = points[turn <= flat]
    ears = order[: int((turn > flat).sum())]
    for rim in (-flat, flat):  # first nothing may touch the ear, then nothing may be inside it
        for k in ears:
            if not _blocks(before[k], points[k], after[k], reflex, rim).any():
                return int(k)
    collinear = np.flatnonzero(np.abs(turn) <= flat)
    return int(collinear[0]) if len(collinear) else int(np.argmax(turn))


def _blocks(
    a: Float64[np.ndarray, "2"],
    b: Float64[np.ndarray, "2"],
    c: Float64[np.ndarray, "2"],
    others: Float64[np.ndarray, "others 2"],
    rim: float,
) -> Bool[np.ndarray, " others"]:
    """Return which points lie in the triangle by more than ``rim``, but not on its corners."""
    inside = (
        (_cross(b - a, others - a) >= rim)
        & (_cross(c - b, others - b) >= rim)
        & (_cross(a - c, others - c) >= rim)
    )
    corner = np.zeros(len(others), bool)
    for point in (a, b, c):
        corner |= ((others - point) ** 2).sum(axis=1) <= abs(rim)
    return inside & ~corner


def _cross(
    a: Float64[np.ndarray, "*n 2"], b: Float64[np.ndarray, "*m 2"]
) -> Float64[np.ndarray, " k"]:
    return np.atleast_1d(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
