"""Loose triangles, and how they become a mesh with vertices, outward faces and normals."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int32, Int64
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

WELD = 1e-5
"""Corners nearer than about this, in metres, are one vertex."""
_CREASE = np.cos(np.deg2rad(40.0))
_ASTRAY = np.cos(np.deg2rad(30.0))
"""Normals of a file further from their face are not believed: they shade flat panels as bowls."""


@dataclass(frozen=True, slots=True)
class Triangles:
    """Loose triangles with everything their corners carry."""

    positions: Float64[np.ndarray, "triangles 3 3"]
    uv: Float64[np.ndarray, "triangles 3 2"]
    normals: Float64[np.ndarray, "triangles 3 3"]
    """Zero where the source gives none."""
    label: Int64[np.ndarray, " triangles"]
    """Number of the part and material they belong to."""

    def take(self, rows: Bool[np.ndarray, " n"] | Int64[np.ndarray, " n"]) -> "Triangles":
        """Return some of the triangles."""
        return Triangles(self.positions[rows], self.uv[rows], self.normals[rows], self.label[rows])


@dataclass(frozen=True, slots=True)
class IndexedMesh:
    """What a renderer takes: vertices with one normal and uv each."""

    vertices: Float32[np.ndarray, "vertices 3"]
    normals: Float32[np.ndarray, "vertices 3"]
    uv: Float32[np.ndarray, "vertices 2"]
    faces: Int32[np.ndarray, "faces 3"]


def weld(positions: Float64[np.ndarray, "*shape 3"]) -> Int64[np.ndarray, "*shape"]:
    """Return a number for each corner, the same for corners at the same place."""
    flat = positions.reshape(-1, 3)
    cells = np.round((flat - flat.min(axis=0)) / max(WELD, np.ptp(flat) * 2.0**-20))
    steps = cells.astype(np.int64)
    key = (steps[:, 0] << 42) | (steps[:, 1] << 21) | steps[:, 2]
    return np.unique(key, return_inverse=True)[1].reshape(positions.shape[:-1])


def cleaned(triangles: Triangles, prefer: Bool[np.ndarray, " labels"] | None = None) -> Triangles:
    """Return the triangles without those that have no area, and one of each coincident set.

    Args:
        triangles: To look at.
        prefer: Labels that win over others on the same place, such as textured materials.
    """
    corners = weld(triangles.positions)
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area = np.linalg.norm(_face_vectors(triangles.positions), axis=1)
    rows = np.flatnonzero((a != b) & (b != c) & (a != c) & (area > 1e-12))
    ordered = np.sort(corners[rows], axis=1)
    if prefer is not None:
        first = np.argsort(~prefer[triangles.label[rows]], kind="stable")
        rows, ordered = rows[first], ordered[first]
    _, unique = np.unique(ordered, axis=0, return_index=True)
    return triangles.take(np.sort(rows[unique]))


def _face_vectors(positions: Float64[np.ndarray, "n 3 3"]) -> Float64[np.ndarray, "n 3"]:
    return np.cross(positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0])


@dataclass(frozen=True, slots=True)
class _Edges:
    """Pairs of neighbouring faces: the edges that exactly two faces share."""

    faces: Int64[np.ndarray, "pairs 2"]
    corner: Int64[np.ndarray, "pairs 2"]
    """Corner of each face at which its half of the edge starts."""
    opposed: Bool[np.ndarray, " pairs"]
    """The two faces run along the edge in opposite directions, as on an oriented surface."""
    open_faces: Int64[np.ndarray, " faces"]
    """Faces with an edge that not exactly two faces share."""


def _edges(corners: Int64[np.ndarray, "faces 3"]) -> _Edges:
    start = corners.ravel()
    end = np.roll(corners, -1, axis=1).ravel()
    key = np.minimum(start, end) * (start.max(initial=0) + 1) + np.maximum(start, end)
    _, group, count = np.unique(key, return_inverse=True, return_counts=True)
    order = np.argsort(group, kind="stable")
    pairs = order[count[group[order]] == 2].reshape(-1, 2)
    return _Edges(
        faces=pairs // 3,
        corner=pairs % 3,
        opposed=start[pairs[:, 0]] == end[pairs[:, 1]],
        open_faces=np.flatnonzero((count[group] != 2).reshape(-1, 3).any(axis=1)),
    )


def _components(pairs: Int64[np.ndarray, "pairs 2"], count: int) -> Int64[np.ndarray, " count"]:
    ones = np.ones(len(pairs), np.int8)
    graph = coo_matrix((ones, (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def oriented(triangles: Triangles) -> Triangles:
    """Return the triangles turned so that winding and normals agree and closed shells look out.

    First a triangle that is wound against the normals of its corners is turned; then shells
    without any hole whose volume is negative are turned as a whole, normals included.
    """
    positions, uv = triangles.positions.copy(), triangles.uv.copy()
    normals = triangles.normals.copy()
    mean = normals.sum(axis=1)
    against = np.einsum("nx,nx->n", _face_vectors(positions), mean) < 0
    for values in (positions, uv, normals):
        values[against] = values[against][:, [0, 2, 1]]
    edges = _edges(weld(positions))
    shell = _components(edges.faces, len(positions))
    broken = np.zeros(int(shell.max(initial=0)) + 1, bool)
    broken[shell[edges.open_faces]] = True
    broken[shell[edges.faces[~edges.opposed, 0]]] = True
    centred = positions - positions.mean(axis=(0, 1))
    volume = np.bincount(shell, np.linalg.det(centred), minlength=len(broken))
    inside_out = (~broken & (volume < 0))[shell]
    for values in (positions, uv, normals):
        values[inside_out] = values[inside_out][:, [0, 2, 1]]
    normals[inside_out] *= -1
    return Triangles(positions, uv, normals, triangles.label)


def smooth_normals(positions: Float64[np.ndarray, "n 3 3"]) -> Float64[np.ndarray, "n 3 3"]:
    """Return normals of the corners: smooth over edges bent by less than 40 degrees, else flat.

    Faces weigh by their area and their angle at the corner, so that large flat panels stay flat
    and their narrow bevels take up the bend.
    """
    vectors = _face_vectors(positions)
    unit = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)
    edges = _edges(weld(positions))
    first, second = edges.faces.T
    alike = np.einsum("nx,nx->n", unit[first], unit[second]) > _CREASE
    keep = alike & edges.opposed
    start, other = (edges.faces * 3 + edges.corner)[keep], (edges.corner[keep] + 1) % 3
    end = edges.faces[keep] * 3 + other
    pairs = np.concatenate([np.c_[start[:, 0], end[:, 1]], np.c_[end[:, 0], start[:, 1]]])
    group = _components(pairs, positions.shape[0] * 3)
    to_next = np.roll(positions, -1, axis=1) - positions
    to_last = np.roll(positions, 1, axis=1) - positions
    cross = np.linalg.norm(np.cross(to_next, to_last), axis=2)
    angle = np.arctan2(cross, np.einsum("ncx,ncx->nc", to_next, to_last))
    weighted = (vectors[:, None] * angle[..., None]).reshape(-1, 3)
    sums = np.stack([np.bincount(group, weighted[:, k]) for k in range(3)], axis=1)
    found = sums[group].reshape(positions.shape)
    length = np.linalg.norm(found, axis=2, keepdims=True)
    return np.where(length > 1e-20, found / np.maximum(length, 1e-300), unit[:, None])


def indexed(triangles: Triangles) -> IndexedMesh:
    """Return the triangles with shared vertices; missing or odd normals are made from the faces."""
    length = np.linalg.norm(triangles.normals, axis=2, keepdims=True)
    unit = triangles.normals / np.maximum(length, 1e-300)
    flat = _face_vectors(triangles.positions)[:, None]
    along = (unit * flat).sum(axis=2, keepdims=True)
    given = (length > 1e-6) & (along > _ASTRAY * np.linalg.norm(flat, axis=2, keepdims=True))
    given = np.broadcast_to(given.all(axis=1, keepdims=True), given.shape)
    made = unit if given.all() else smooth_normals(triangles.positions)
    normals = np.where(given, unit, made)
    place = weld(triangles.positions)
    facets = np.round(normals * 500).astype(np.int64).reshape(-1, 3)
    texels = np.round(triangles.uv * 20000).astype(np.int64).reshape(-1, 2)
    rows = np.concatenate([place.reshape(-1, 1), facets, texels], axis=1)
    _, first, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return IndexedMesh(
        vertices=triangles.positions.reshape(-1, 3)[first].astype(np.float32),
        normals=normals.reshape(-1, 3)[first].astype(np.float32),
        uv=triangles.uv.reshape(-1, 2)[first].astype(np.float32),
        faces=inverse.reshape(-1, 3).astype(np.int32),
    )
