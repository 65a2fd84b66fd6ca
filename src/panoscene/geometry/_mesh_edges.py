"""Which triangles of a mesh meet at an edge."""

import numpy as np
from jaxtyping import Bool, Int, Int64


def edge_neighbours(
    faces: Int[np.ndarray, "faces 3"],
) -> tuple[Int64[np.ndarray, " pairs"], Int64[np.ndarray, " pairs"]]:
    """Return the two triangles of each edge that has exactly two, as indices of faces.

    Examples:
        >>> one, two = edge_neighbours(np.array([[0, 1, 2], [2, 1, 3]]))
        >>> one.tolist(), two.tolist()
        ([0], [1])
    """
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
