"""Fewer triangles where a surface is flat: meshes that programs and people can work with."""

from threading import Lock

import fast_simplification
import numpy as np
import torch
from jaxtyping import Float, Int, Int64

from panoscene.scene import Mesh

FACES_PER_CELL = 32
"""Triangles that a mesh may have for each cell along an axis: 2,048 at resolution 64."""
_BOLDNESS = 5.0
"""Of the library, from 0 to 10: the lower, the longer it takes, and the more triangles are left."""
_CUBE = 0.7
"""Edge of the cubes in which points are gathered; 1 is that of squares as large as the triangles
that are left."""
_FLAT = 0.9
"""Share of the area of a surface that remains when it is seen from where most remains."""
_ATTEMPTS = 10
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
    before = mesh.vertices.double().numpy(force=True)
    faces = mesh.faces.long().numpy(force=True)
    some, few = _gathered(before, faces, most)
    if len(few) > most:
        with _ONE_AT_A_TIME:
            simplified = fast_simplification.simplify(
                some, few.astype(np.int32), target_count=most, agg=_BOLDNESS
            )
        some, few = simplified[0], simplified[1]
    points = _fitted(np.asarray(some, np.float64), before)
    points, left = _parted(points, _unfolded(few))
    if len(left) == 0 or not is_closed(left):
        return mesh
    return Mesh(torch.from_numpy(points).to(mesh.vertices), torch.from_numpy(left).to(mesh.faces))


def _gathered(points: Points, faces: Faces, most: int) -> tuple[Points, Faces]:
    """Return a surface with one point for each small cube in which it is all but flat.

    That is much quicker than to collapse edges, and leaves fewer of them to collapse. Points in
    cubes where the surface bends, or where gathering them makes sheets touch, stay as they are.
    """
    normal, area = _normals(points, faces)
    edge = _CUBE * float(np.sqrt(area.sum() / most))
    number = ((points - points.min(axis=0)) / edge).astype(np.int64)
    across = number.max(axis=0) + 1
    cube = (number[:, 0] * across[1] + number[:, 1]) * across[2] + number[:, 2]
    owner = cube[faces[:, 0]]
    count = int(across.prod())
    total = np.stack([np.bincount(owner, part, count) for part in normal])
    flat = np.sqrt((total**2).sum(axis=0)) > _FLAT * np.bincount(owner, area, count)
    place, few = np.arange(len(points)), faces
    for _ in range(_ATTEMPTS):
        place = np.where(flat[cube], cube, count + np.arange(len(points)))
        few = place.take(faces)
        kept = (few[:, 0] != few[:, 1]) & (few[:, 1] != few[:, 2]) & (few[:, 2] != few[:, 0])
        few = _unfolded(few[kept])
        touching = _in_touching_edges(few)
        touching = touching[touching < count]
        if len(touching) == 0:
            break
        flat[touching] = False
    size = np.bincount(place)
    mean = np.stack([np.bincount(place, part) for part in points.T], axis=1)
    used = np.zeros(len(size), bool)
    used[few] = True
    return mean[used] / size[used, None], (np.cumsum(used) - 1).take(few)


def _normals(
    points: Points, faces: Faces
) -> tuple[Float[np.ndarray, "3 faces"], Float[np.ndarray, " faces"]]:
    """Return normals, as long as twice the areas, and these lengths."""
    corners = np.ascontiguousarray(points.T).take(np.ascontiguousarray(faces.T), axis=1)
    (x, y, z), (u, v, w) = (corners[:, k] - corners[:, 0] for k in (1, 2))
    normal = np.stack((y * w - z * v, z * u - x * w, x * v - y * u))
    return normal, np.sqrt((normal**2).sum(axis=0))


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
    return faces.ravel(), np.roll(faces, -1, axis=1).ravel()


def _unfolded(faces: Int[np.ndarray, "n 3"]) -> Int64[np.ndarray, "m 3"]:
    """Return triangles without pairs that lie on each other, back to back."""
    faces = faces.astype(np.int64)
    low, middle, high = np.sort(faces, axis=1).T
    count = int(faces.max(initial=0)) + 1
    key = (low * count + middle) * count + high
    order = np.sort(key)
    twice = np.unique(order[1:][order[1:] == order[:-1]])
    if len(twice) == 0:
        return faces
    group = np.searchsorted(twice, key).clip(max=len(twice) - 1)
    alone = twice[group] != key
    single, faces, group = faces[alone], faces[~alone], group[~alone]
    up = (faces < np.roll(faces, -1, axis=1)).sum(axis=1) == 2
    more = np.bincount(group, np.where(up, 1, -1)).astype(np.int64)
    kept = np.flatnonzero(np.where(up, more[group] > 0, more[group] < 0))
    kept = kept[np.argsort(group[kept], kind="stable")]
    group = group[kept]
    number = np.arange(len(kept)) - np.searchsorted(group, group)
    return np.concatenate([single, faces[kept[number < np.abs(more[group])]]])


def _in_touching_edges(faces: Faces) -> Int64[np.ndarray, " points"]:
    """Return the points at edges with more than one triangle on a side, some of them twice."""
    start, end = _edges(faces)
    count = int(faces.max(initial=0)) + 1
    key = np.sort(start * count + end)
    return np.concatenate(np.divmod(key[1:][key[1:] == key[:-1]], count))


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
        there = np.flatnonzero((start == one) & (end == two)) // 3
        back = np.flatnonzero((start == two) & (end == one)) // 3
        if len(there) != len(back):
            break
        middle = np.tile(len(points) + np.arange(len(there)), 2)[:, None]
        owner = np.concatenate([there, back])
        halves = [np.where(faces[owner] == corner, middle, faces[owner]) for corner in (one, two)]
        faces = np.concatenate([np.delete(faces, owner, axis=0), *halves])
        centre = (points[one] + points[two]) / 2
        points = np.concatenate([points, np.tile(centre, (len(there), 1))])
    return points, faces


def _fitted(points: Points, like: Float[np.ndarray, "others 3"]) -> Points:
    """Return points moved and scaled along each axis to the bounds of others."""
    low, high = like.min(axis=0), like.max(axis=0)
    first, last = points.min(axis=0), points.max(axis=0)
    share = (points - first) / np.maximum(last - first, 1e-12)
    return (low + share * (high - low)).clip(low, high)
