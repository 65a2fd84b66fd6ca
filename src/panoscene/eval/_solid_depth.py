"""How deep two solids are in each other, from exact distances of points to triangles."""

import itertools
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import KDTree

from panoscene.eval._solids import Solid

_CANDIDATES = 3
"""Points from which the search for the deepest one starts."""
_STEPS = 16
_SMALLEST_STEP = 1e-4
"""Metres below which a step is not worth taking."""
_SAMPLES = 2000
"""Points that stand for a surface while starting points are chosen."""
_AT_ONCE = 50_000
"""Pairs of points and triangles that are worked on together."""
_DIRECTIONS = np.array(
    [
        np.array(step) / np.linalg.norm(step)
        for step in itertools.product((-1.0, 0.0, 1.0), repeat=3)
        if np.abs(step).sum() in (1.0, 3.0)
    ]
)
"""The 6 axes and the 8 diagonals between them."""


@dataclass(frozen=True, slots=True)
class Faces:
    """Triangles with what their distances to points need, computed once."""

    normal: Float[np.ndarray, "faces 3"]
    """Unit vectors; zero for faces without area."""
    level: Float[np.ndarray, " faces"]
    """Where along its normal a face lies."""
    along: Float[np.ndarray, "faces 3 3"]
    """Unit vectors along the edges."""
    start: Float[np.ndarray, "faces 3"]
    """Where along itself an edge starts."""
    length: Float[np.ndarray, "faces 3"]
    inward: Float[np.ndarray, "faces 3 3"]
    """Unit vectors in the plane of the face, into it from each edge."""
    rim: Float[np.ndarray, "faces 3"]
    """Where along its inward vector an edge lies."""
    centre: Float[np.ndarray, "faces 3"]
    radius: Float[np.ndarray, " faces"]
    """Of a ball around ``centre`` that holds the face."""

    def __getitem__(self, index: Bool[np.ndarray, " faces"]) -> "Faces":
        """Return some of the faces."""
        return Faces(*(getattr(self, name)[index] for name in Faces.__slots__))


def faces_from_triangles(triangles: Float[np.ndarray, "faces 3 3"]) -> Faces:
    """Return triangles, given by their corners in metres, ready for distances."""
    edge = np.roll(triangles, -1, axis=1) - triangles
    length = np.linalg.norm(edge, axis=-1)
    along = edge / np.where(length > 0, length, 1.0)[..., None]
    normal = np.cross(edge[:, 0], edge[:, 1])
    area = np.linalg.norm(normal, axis=-1, keepdims=True)
    normal = normal / np.where(area > 0, area, 1.0)
    inward = np.cross(normal[:, None], along)
    centre = triangles.mean(axis=1)
    return Faces(
        normal=normal,
        level=(normal * triangles[:, 0]).sum(-1),
        along=along,
        start=(along * triangles).sum(-1),
        length=length,
        inward=inward,
        rim=(inward * triangles).sum(-1),
        centre=centre,
        radius=np.linalg.norm(triangles - centre[:, None], axis=-1).max(axis=-1),
    )


def distance_to_faces(
    points: Float[np.ndarray, "points 3"], faces: Faces
) -> Float[np.ndarray, " points"]:
    """Return the exact distance of each point to the nearest of the faces, in metres."""
    chunk = max(1, _AT_ONCE // max(1, len(faces.level)))
    parts = [
        _pair_distances(points[first : first + chunk], faces).min(axis=1)
        for first in range(0, len(points), chunk)
    ]
    return np.concatenate([np.zeros(0), *parts])


def common_depth(first: Solid, other: Solid, points: Float[np.ndarray, "points 3"]) -> float:
    """Return how deep two solids are in each other, in metres; 0 when no point is given.

    The largest sum, over points inside both, of the point's depths below the two surfaces. The
    balls of these two radii around the point lie inside the solids, so one solid must move by at
    least this much, in whatever direction, before the two are apart. For boxes with parallel
    faces it is that distance (``penetration_depth``); for other shapes it is a lower bound.

    Args:
        first: one solid.
        other: the other.
        points: inside both solids, metres; the search starts from the best of them.
    """
    if len(points) == 0:
        return 0.0
    surfaces = [_spread_points(solid.triangles) for solid in (first, other)]
    rough = np.sum([KDTree(surface).query(points)[0] for surface in surfaces], axis=0)
    best = np.argsort(-rough, kind="stable")[:_CANDIDATES]
    solids = [faces_from_triangles(solid.triangles) for solid in (first, other)]
    return max(_deepest_nearby(point, solids) for point in points[best])


def _deepest_nearby(point: Float[np.ndarray, " 3"], solids: list[Faces]) -> float:
    """Return the largest sum of depths that a walk from the point finds."""
    depths = np.array([distance_to_faces(point[None], faces)[0] for faces in solids])
    step = depths.min() / 2
    for _ in range(_STEPS):
        # within the smaller ball, all points are inside both solids
        step = min(step, 0.9 * depths.min())
        if step < _SMALLEST_STEP:
            break
        around = point + step * _DIRECTIONS
        found = np.array(
            [
                distance_to_faces(around, _reachable(faces, point, depth + 2 * step))
                for faces, depth in zip(solids, depths, strict=True)
            ]
        )
        best = int(found.sum(axis=0).argmax())
        if found[:, best].sum() > depths.sum():
            point, depths = around[best], found[:, best]
        else:
            step /= 2
    return float(depths.sum())


def _reachable(faces: Faces, point: Float[np.ndarray, " 3"], reach: float) -> Faces:
    """Return the faces that may be within reach of the point; the nearest is among them."""
    nearest = np.linalg.norm(faces.centre - point, axis=1) - faces.radius
    return faces[nearest <= max(reach, float(nearest.min()))]


def _spread_points(triangles: Float[np.ndarray, "faces 3 3"]) -> Float[np.ndarray, "samples 3"]:
    """Return points spread evenly over the triangles, without chance."""
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(cross, axis=1).cumsum()
    index = np.arange(_SAMPLES)
    face = np.searchsorted(area, (index + 0.5) / _SAMPLES * area[-1]).clip(0, len(area) - 1)
    # the additive sequence of the plastic number covers the unit square evenly
    u, v = (index * 0.7548776662466927) % 1, (index * 0.5698402909980532) % 1
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    weight = np.stack([1 - u - v, u, v], axis=1)
    return (triangles[face] * weight[..., None]).sum(axis=1)


def _pair_distances(
    points: Float[np.ndarray, "points 3"], faces: Faces
) -> Float[np.ndarray, "points faces"]:
    height = points @ faces.normal.T - faces.level
    beside = np.full(height.shape, np.inf)
    inside = np.broadcast_to((faces.normal != 0).any(axis=1), height.shape)
    for edge in range(3):
        depth = points @ faces.inward[:, edge].T - faces.rim[:, edge]
        place = points @ faces.along[:, edge].T - faces.start[:, edge]
        past = place - place.clip(0, faces.length[:, edge])
        beside = np.minimum(beside, depth * depth + past * past)
        inside = inside & (depth >= 0)
    return np.sqrt(height * height + np.where(inside, 0.0, beside))
