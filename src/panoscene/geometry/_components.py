"""Connected components of a graph, without the half second that a library for graphs imports."""

import numpy as np
from jaxtyping import Int, Int64


def connected_components(
    count: int, one: Int[np.ndarray, " edges"], two: Int[np.ndarray, " edges"]
) -> Int64[np.ndarray, " nodes"]:
    """Return a number for each node: nodes that edges join share it, in the order of the first.

    Args:
        count: of the nodes.
        one: the node at one end of each edge, from 0.
        two: the node at its other end.

    Examples:
        >>> connected_components(5, np.array([4, 2]), np.array([1, 4])).tolist()
        [0, 1, 1, 2, 1]
    """
    root = np.arange(count)
    while len(one):
        first, second = root[one], root[two]
        apart = first != second
        one, two, first, second = one[apart], two[apart], first[apart], second[apart]
        # each root with lower ones beside it is put under the lowest
        np.minimum.at(root, np.maximum(first, second), np.minimum(first, second))
        while not np.array_equal(further := root[root], root):
            root = further
    # a root is the first node of its component
    return (np.cumsum(root == np.arange(count)) - 1)[root]
