"""Triangles that meet without a crease, as one facet."""

import numpy as np
from jaxtyping import Float, Int32, Int64

from panoscene.geometry import connected_components, edge_neighbours
from panoscene.views._rays import Soup

_CREASE = np.radians(35.0)
"""Neighbouring triangles at a larger angle are separated by a line."""


def facets(soup: Soup) -> Int32[np.ndarray, " faces"]:
    """Return a number for each triangle: those that meet without a crease share it.

    Triangles are neighbours when they are the only two at an edge. One without an area has no
    neighbours.
    """
    count = len(soup.faces)
    one, two = edge_neighbours(soup.faces)
    flat = _cosine(soup.normal, one, two) > np.cos(_CREASE)
    return connected_components(count, one[flat], two[flat]).astype(np.int32)


def _cosine(
    normal: Float[np.ndarray, "faces 3"],
    one: Int64[np.ndarray, " pairs"],
    two: Int64[np.ndarray, " pairs"],
) -> Float[np.ndarray, " pairs"]:
    return (normal[one] * normal[two]).sum(axis=1)
