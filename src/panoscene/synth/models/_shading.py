"""Normals of vertices: smooth over gentle edges, sharp over steep ones."""

import numpy as np
from jaxtyping import Float, Int

from ._pieces import Number, Piece


def shaded(
    piece: Piece, crease_deg: Number = 50.0
) -> tuple[
    Float[np.ndarray, "vertices 3"],
    Float[np.ndarray, "vertices 3"],
    Float[np.ndarray, "vertices 2"],
    Int[np.ndarray, "faces 3"],
]:
    """Return vertices, unit normals, uv and faces; vertices are split along sharp edges.

    The normal at a corner of a face is the mean, by area, of the faces that meet there and turn
    away from it by less than the crease angle.
    """
    a, b, c = (piece.vertices[piece.faces[:, k]] for k in range(3))
    area_normal = np.cross(b - a, c - a)
    length = np.linalg.norm(area_normal, axis=1, keepdims=True)
    normal = area_normal / np.maximum(length, 1e-15)
    keys = np.round(piece.vertices / 1e-6).astype(np.int64)
    place = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1)
    corner = piece.faces.reshape(-1)
    face = np.repeat(np.arange(len(piece.faces)), 3)
    order = np.argsort(place[corner], kind="stable")
    group = place[corner][order]
    start = np.searchsorted(group, group, side="left")
    count = np.searchsorted(group, group, side="right") - start
    mine = np.repeat(np.arange(len(group)), count)
    offset = np.arange(len(mine)) - np.repeat(np.cumsum(count) - count, count)
    other = start[mine] + offset
    face_mine, face_other = face[order][mine], face[order][other]
    near = np.einsum("ij,ij->i", normal[face_mine], normal[face_other]) > np.cos(
        np.radians(crease_deg)
    )
    total = np.stack(
        [np.bincount(mine[near], area_normal[face_other[near], k], len(group)) for k in range(3)], 1
    )
    total /= np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-15)
    result = np.zeros_like(total)
    result[order] = total
    rows = np.column_stack([corner, np.round(result * 2000).astype(np.int64)])
    _, first, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    chosen = corner[first]
    faces = inverse.reshape(-1, 3)
    return piece.vertices[chosen], result[first], piece.uv[chosen], faces
