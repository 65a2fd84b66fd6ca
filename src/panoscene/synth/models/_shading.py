"""Normals of vertices: smooth over gentle edges, sharp over steep ones."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int, Int64, UInt64

from ._pieces import Number, Piece


class Surface(NamedTuple):
    """Triangles with all that a renderer wants to know of their corners."""

    vertices: Float[np.ndarray, "vertices 3"]
    normals: Float[np.ndarray, "vertices 3"]
    uv: Float[np.ndarray, "vertices 2"]
    faces: Int[np.ndarray, "faces 3"]


def _hashed(columns: Int64[np.ndarray, "rows columns"]) -> UInt64[np.ndarray, " rows"]:
    """Return one number for every row; equal rows share it, others do not in practice."""
    mixed = np.zeros(len(columns), np.uint64)
    for column in columns.astype(np.uint64).T:
        mixed = (mixed ^ column) * np.uint64(0x9E3779B97F4A7C15)
        mixed ^= mixed >> np.uint64(32)
    return mixed


def shaded(pieces: Sequence[Piece], creases_deg: Sequence[Number]) -> Surface:
    """Return the pieces as one surface whose vertices are split along sharp edges.

    The normal at a corner of a face is the mean, by area, of the faces of the same piece that meet
    there and turn away from it by less than the piece's crease angle. Corners that belong together
    have exactly the same position.
    """
    sizes = np.array([len(p.vertices) for p in pieces])
    offset = np.cumsum(sizes) - sizes
    vertices = np.concatenate([p.vertices for p in pieces])
    uv = np.concatenate([p.uv for p in pieces])
    faces = np.concatenate([p.faces + n for p, n in zip(pieces, offset, strict=True)])
    limit = np.cos(np.radians(np.asarray(creases_deg, float)))
    limit = np.repeat(limit, [len(p.faces) for p in pieces])
    keys = np.round(vertices / 1e-6).astype(np.int64)
    keys = np.column_stack([keys, np.repeat(np.arange(len(pieces)), sizes)])
    _, first, place = np.unique(_hashed(keys), return_index=True, return_inverse=True)
    vertices = vertices[first][place.reshape(-1)]
    normals = _corner_normals(vertices, faces, place.reshape(-1), limit)
    corner = faces.reshape(-1)
    rows = np.column_stack([np.round(normals * 500).astype(np.int64), corner])
    _, first, inverse = np.unique(_hashed(rows), return_index=True, return_inverse=True)
    chosen = corner[first]
    return Surface(vertices[chosen], normals[first], uv[chosen], inverse.reshape(-1, 3))


def _corner_normals(
    vertices: Float[np.ndarray, "vertices 3"],
    faces: Int[np.ndarray, "faces 3"],
    place: Int[np.ndarray, " vertices"],
    limit: Float[np.ndarray, " faces"],
) -> Float[np.ndarray, "corners 3"]:
    """Return the unit normal of every corner of every face."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area_normal = np.cross(b - a, c - a)
    normal = area_normal / np.maximum(np.linalg.norm(area_normal, axis=1, keepdims=True), 1e-15)
    face = np.repeat(np.arange(len(faces)), 3)
    order = np.argsort(place[faces.reshape(-1)], kind="stable")
    group = place[faces.reshape(-1)][order]
    start = np.searchsorted(group, group, side="left")
    count = np.searchsorted(group, group, side="right") - start
    mine = np.repeat(np.arange(len(group)), count)
    other = start[mine] + np.arange(len(mine)) - np.repeat(np.cumsum(count) - count, count)
    face_mine, face_other = face[order][mine], face[order][other]
    near = np.einsum("ij,ij->i", normal[face_mine], normal[face_other]) > limit[face_mine]
    mine, face_other = mine[near], face_other[near]
    total = [np.bincount(mine, area_normal[face_other, k], len(group)) for k in range(3)]
    summed = np.stack(total, axis=1)
    summed = summed / np.maximum(np.linalg.norm(summed, axis=1, keepdims=True), 1e-15)
    result = np.zeros_like(summed)
    result[order] = summed
    return result
