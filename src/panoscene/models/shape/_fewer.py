"""Fewer triangles where a surface is flat: meshes that programs and people can work with."""

from threading import Lock

import fast_simplification
import numpy as np
import torch
from jaxtyping import Float, Int, Int64

from panoscene.scene import Mesh

FACES_PER_CELL = 32
"""Triangles that a mesh may have for each cell along an axis: 2,048 at resolution 64."""
_BOLDNESS = 7.0
"""Of the library, from 0 to 10: the lower, the longer it takes, and the more triangles are left."""
_MOST_TOUCHING = 200
"""Edges with more than two triangles that are mended."""
_ONE_AT_A_TIME = Lock()
"""The library keeps the mesh that it works on in one place."""

Faces = Int64[np.ndarray, "_ 3"]
Points = Float[np.ndarray, "_ 3"]


def fewer_faces(mesh: Mesh, most: int) -> Mesh:
    """Return a closed mesh with about that many triangles, in the same bounds.

    Edges are collapsed where that changes the surface least (quadric error metrics: Garland and
    Heckbert 1997). Where that makes two sheets touch in an edge, the edge gets a middle for each,
    so that the surface stays closed, with two triangles at every edge.

    Args:
        mesh: closed.
        most: triangles. A mesh that has no more is returned as it is.
    """
    if len(mesh.faces) <= most:
        return mesh
    points = mesh.vertices.double().numpy(force=True)
    found = simplified(points, mesh.faces.long().numpy(force=True), most)
    if found is None:
        return mesh
    points, faces = (torch.from_numpy(part) for part in found)
    return Mesh(points.to(mesh.vertices), faces.to(mesh.faces))


def simplified(points: Points, faces: Faces, most: int) -> tuple[Points, Faces] | None:
    """Return points and triangles of such a mesh, None if they cannot be closed.

    Args:
        points: Corners.
        faces: At each edge as many on one side as on the other.
        most: triangles.
    """
    some, few = points, faces
    if len(faces) > most:
        with _ONE_AT_A_TIME:
            some, few, *_ = fast_simplification.simplify(
                points, faces.astype(np.int32), target_count=most, agg=_BOLDNESS
            )
    found, left = _parted(fitted(np.asarray(some, np.float64), points), unfolded(few))
    return (found, left) if len(left) and is_closed(left) else None


def is_closed(faces: Int64[np.ndarray, "faces 3"]) -> bool:
    """Return whether each edge has one triangle on either side, turned the same way round.

    Examples:
        >>> tetrahedron = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
        >>> is_closed(tetrahedron), is_closed(tetrahedron[:3])
        (True, False)
    """
    start, end = _edges(faces)
    count = int(faces.max(initial=-1)) + 1
    there, back = np.sort(start * count + end), np.sort(end * count + start)
    return bool((there[1:] != there[:-1]).all() and (there == back).all() and (start != end).all())


def _edges(faces: Faces) -> tuple[Int64[np.ndarray, " edges"], Int64[np.ndarray, " edges"]]:
    """Return where the edges of all triangles start and end, three for each."""
    one, two, three = np.ascontiguousarray(faces.T)
    return np.concatenate([one, two, three]), np.concatenate([two, three, one])


def unfolded(faces: Int[np.ndarray, "n 3"]) -> Int64[np.ndarray, "m 3"]:
    """Return triangles without pairs that lie on each other, back to back."""
    faces = faces.astype(np.int64)
    one, two, three = np.ascontiguousarray(faces.T)
    low = np.minimum(np.minimum(one, two), three)
    high = np.maximum(np.maximum(one, two), three)
    middle = one + two + three - low - high
    count = int(faces.max(initial=0)) + 1
    key = (low * count + middle) * count + high
    order = np.sort(key)
    twice = np.unique(order[1:][order[1:] == order[:-1]])
    if len(twice) == 0:
        return faces
    group = np.searchsorted(twice, key).clip(max=len(twice) - 1)
    alone = twice[group] != key
    single = faces.take(np.flatnonzero(alone), axis=0)
    faces, group = faces[~alone], group[~alone]
    up = (faces < np.roll(faces, -1, axis=1)).sum(axis=1) == 2
    more = np.bincount(group, np.where(up, 1, -1)).astype(np.int64)
    kept = np.flatnonzero(np.where(up, more[group] > 0, more[group] < 0))
    kept = kept[np.argsort(group[kept], kind="stable")]
    group = group[kept]
    number = np.arange(len(kept)) - np.searchsorted(group, group)
    return np.concatenate([single, faces[kept[number < np.abs(more[group])]]])


def _parted(points: Points, faces: Faces) -> tuple[Points, Faces]:
    """Return a surface in which no edge has more than two triangles: each pair gets its middle."""
    for _ in range(_MOST_TOUCHING):
        start, end = _edges(faces)
        key = np.minimum(start, end) * len(points) + np.maximum(start, end)
        edges, size = np.unique(key, return_counts=True)
        touching = edges[size > 2]
        if len(touching) == 0:
            break
        one, two = divmod(int(touching[0]), len(points))
        there = np.flatnonzero((start == one) & (end == two)) % len(faces)
        back = np.flatnonzero((start == two) & (end == one)) % len(faces)
        if len(there) != len(back):
            break
        middle = np.tile(len(points) + np.arange(len(there)), 2)[:, None]
        owner = np.concatenate([there, back])
        halves = [np.where(faces[owner] == corner, middle, faces[owner]) for corner in (one, two)]
        faces = np.concatenate([np.delete(faces, owner, axis=0), *halves])
        centre = (points[one] + points[two]) / 2
        points = np.concatenate([points, np.tile(centre, (len(there), 1))])
    return points, faces


def fitted(points: Points, like: Float[np.ndarray, "others 3"]) -> Points:
    """Return points moved and scaled along each axis to the bounds of others."""
    # axis by axis: rows of three are slow
    found = np.zeros(points.shape)
    for axis in range(3):
        wanted, along = np.ascontiguousarray(like[:, axis]), np.ascontiguousarray(points[:, axis])
        low, high, first, last = wanted.min(), wanted.max(), along.min(), along.max()
        share = (along - first) / max(last - first, 1e-12)
        found[:, axis] = (low + share * (high - low)).clip(low, high)
    return found
