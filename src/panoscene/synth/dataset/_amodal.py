"""How much of an object there would be to see if nothing stood in front of it."""

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from jaxtyping import Bool, Float32, Float64, Int32, Int64

_MARGIN = 0.01
"""Radians around the cone that holds the object."""
_RAYS = 8000
_LEVEL = 1e-6
"""Differences of height that are rounding."""
_NOWHERE = 1e6
"""Metres; rays that meet nothing come back with more."""


def whole_solid_angle(
    vertices: Float64[np.ndarray, "vertices 3"],
    faces: Int32[np.ndarray, "faces 3"],
    directions: Float32[np.ndarray, "n 3"],
    weight: Float64[np.ndarray, " n"],
    seen: Bool[np.ndarray, " n"],
) -> float:
    """Return the solid angle in steradians of a mesh, alone in the world.

    Where it may be hidden at most 8,000 rays are cast, evenly over the pixels in question.

    Args:
        vertices: Relative to the camera, in the frame of the directions.
        faces: Seen from both sides.
        directions: Of the pixels, of unit length, row by row from the top.
        weight: Solid angles of the pixels.
        seen: Where it is known to be visible; these count without a ray.
    """
    total = float(weight[seen].sum())
    candidates = _may_meet(vertices, directions, ~seen)
    if len(candidates) == 0:
        return total
    count = len(candidates)
    candidates = candidates[:: -(-count // _RAYS)]
    world = EmbreeScene()
    TriangleMesh(world, np.ascontiguousarray(vertices, np.float32), faces)
    rays = np.ascontiguousarray(directions[candidates])
    hit = world.run(np.zeros_like(rays), rays) >= 0
    return total + float(weight[candidates[hit]].sum()) * count / len(candidates)


def points_seen_alone(
    vertices: Float64[np.ndarray, "vertices 3"],
    faces: Int32[np.ndarray, "faces 3"],
    directions: Float32[np.ndarray, "n 3"],
) -> Float64[np.ndarray, "hits 3"]:
    """Return where the rays of pixels meet a mesh that is alone in the world.

    Args:
        vertices: Relative to the camera, in the frame of the directions.
        faces: Seen from both sides.
        directions: Of the pixels, of unit length, row by row from the top.

    Raises:
        ValueError: The directions rise somewhere, as those of a tilted photo in the world frame.
    """
    if (np.diff(directions[:, 2]) > _LEVEL).any():
        raise ValueError("directions: found some that rise, expected rows from the top")
    candidates = _may_meet(vertices, directions, np.ones(len(directions), np.bool_))
    rays = np.ascontiguousarray(directions[candidates])
    if len(rays) == 0:
        return np.zeros((0, 3))
    world = EmbreeScene()
    TriangleMesh(world, np.ascontiguousarray(vertices, np.float32), faces)
    distance = world.run(np.zeros_like(rays), rays, query="DISTANCE").astype(np.float64)
    hit = distance < _NOWHERE
    return rays[hit].astype(np.float64) * distance[hit, None]


def _may_meet(
    vertices: Float64[np.ndarray, "vertices 3"],
    directions: Float32[np.ndarray, "n 3"],
    wanted: Bool[np.ndarray, " n"],
) -> Int64[np.ndarray, " some"]:
    """Return the wanted rays from the origin that may meet a mesh of these vertices."""
    length = np.linalg.norm(vertices, axis=1)
    towards = vertices / np.maximum(length, 1e-9)[:, None]
    axis = towards.mean(axis=0)
    axis /= max(float(np.linalg.norm(axis)), 1e-9)
    narrowest = float((towards @ axis).min())
    if narrowest > 0.05:  # a cone of less than 87 degrees holds all vertices, and so all faces
        reach = min(float(np.arccos(min(narrowest, 1.0))) + _MARGIN, np.pi)
        first, last = _level_with(axis, reach, directions[:, 2])
        near = directions[first:last] @ axis.astype(np.float32) >= np.cos(reach)
        candidates = np.flatnonzero(near & wanted[first:last]) + first
    else:
        candidates = np.flatnonzero(wanted)
    return candidates[_meets_bounds(vertices, directions[candidates])]


def _level_with(
    axis: Float64[np.ndarray, " 3"], reach: float, height: Float32[np.ndarray, " n"]
) -> tuple[int, int]:
    """Return the first and one past the last direction that is as high as some of a cone.

    Args:
        axis: Of the cone, of unit length.
        reach: Half the opening of the cone in radians.
        height: Of the directions, falling.
    """
    middle = np.arccos(np.clip(axis[2], -1.0, 1.0))
    high, low = np.cos(max(middle - reach, 0.0)), np.cos(min(middle + reach, np.pi))
    # two searches in what rises
    first, last = np.searchsorted(-height, (-high - _LEVEL, -low + _LEVEL))
    return int(first), int(last)


def _meets_bounds(
    vertices: Float64[np.ndarray, "vertices 3"], directions: Float32[np.ndarray, "n 3"]
) -> Bool[np.ndarray, " n"]:
    """Return whether rays from the origin meet the box of the vertices, along the axes."""
    low = (vertices.min(axis=0) - 1e-3).astype(np.float32)
    high = (vertices.max(axis=0) + 1e-3).astype(np.float32)
    tiny = np.float32(1e-9)
    slope = np.float32(1) / np.where(np.abs(directions) < tiny, tiny, directions)
    one, two = low * slope, high * slope
    enter, leave = np.minimum(one, two).max(axis=1), np.maximum(one, two).min(axis=1)
    return (enter <= leave) & (leave >= 0)
