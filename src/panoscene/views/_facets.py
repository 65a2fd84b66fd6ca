"""Triangles that meet without a crease, as one facet."""

import numpy as np
from jaxtyping import Bool, Float, Int32, Int64
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from panoscene.views._rays import Soup

_CREASE = np.radians(35.0)
"""Neighbouring triangles at a larger angle are separated by a line."""


def facets(soup: Soup) -> Int32[np.ndarray, " faces"]:
    """Return a number for each triangle: those that meet without a crease share it.

    Triangles are neighbours when they are the only two at an edge. One without an area has no
    neighbours.
    """
    count = len(soup.faces)
    one, two = _neighbours(soup.faces)
    flat = _cosine(soup.normal, one, two) > np.cos(_CREASE)
    one, two = one[flat], two[flat]
    graph = coo_array((np.ones(len(one), bool), (one, two)), shape=(count, count))
    return connected_components(graph, directed=False)[1].astype(np.int32)


def _neighbours(
    faces: Int32[np.ndarray, "faces 3"],
) -> tuple[Int64[np.ndarray, " pairs"], Int64[np.ndarray, " pairs"]]:
    """Return the two triangles of each edge that has exactly two."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    # both ends of an edge in one number, which sorts fast
    edge = np.minimum(start, end).astype(np.int64) << 32 | np.maximum(start, end)
    order = np.argsort(edge, kind="stable")
    edge = edge[order]
    same: Bool[np.ndarray, " n"] = edge[1:] == edge[:-1]
    alone = np.ones(len(same), bool)
    alone[1:] &= ~same[:-1]
    alone[:-1] &= ~same[1:]
    first = np.flatnonzero(same & alone)
    return order[first] // 3, order[first + 1] // 3


def _cosine(
    normal: Float[np.ndarray, "faces 3"],
    one: Int64[np.ndarray, " pairs"],
    two: Int64[np.ndarray, " pairs"],
) -> Float[np.ndarray, " pairs"]:
    return (normal[one] * normal[two]).sum(axis=1)
