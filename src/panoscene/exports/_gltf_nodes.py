"""The nodes of a glTF scene: where each of them stands, and as which box."""

import math
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from panoscene.exports._gltf_schema import GltfFile, NodeModel

UPRIGHT_TOLERANCE = 1e-3
"""Sines and cosines may be wrong by so much: editors store angles in float32."""


def placed_nodes(
    source: GltfFile,
) -> Iterator[tuple[int, NodeModel, Float[np.ndarray, "4 4"]]]:
    """Yield index, node and world matrix of all nodes of the scene, in glTF axes.

    Raises:
        SceneFormatError: An index that is not there, a node with two parents or below itself, a
            transform that cannot be used.
    """
    gltf = source.gltf
    top = source.item(gltf.scenes, gltf.scene, "$.scene")
    seen: set[int] = set()
    waiting = [(index, np.eye(4), f"$.scenes[{gltf.scene}].nodes") for index in top.nodes[::-1]]
    while waiting:
        index, parent, field = waiting.pop()
        node = source.item(gltf.nodes, index, field)
        if index in seen:
            expected = "a tree: every node below one other only"
            raise source.refusal(field, f"node {index} again", expected)
        seen.add(index)
        with np.errstate(all="ignore"):
            matrix = parent @ node_matrix(source, node, f"$.nodes[{index}]")
        if not np.isfinite(matrix).all():
            expected = "a transform of ordinary size"
            raise source.refusal(f"$.nodes[{index}]", "an overflow", expected)
        yield index, node, matrix
        below = f"$.nodes[{index}].children"
        waiting += [(child, matrix, below) for child in node.children[::-1]]


def node_matrix(source: GltfFile, node: NodeModel, field: str) -> Float[np.ndarray, "4 4"]:
    """Return the transform from a node to its parent.

    Raises:
        SceneFormatError: A rotation of length zero, or a matrix with a perspective.
    """
    if node.matrix is not None:
        matrix = np.array(node.matrix).reshape(4, 4).T
        if not np.array_equal(matrix[3], [0.0, 0.0, 0.0, 1.0]):
            expected = "0, 0, 0, 1, as the columns end"
            raise source.refusal(f"{field}.matrix", "other numbers in its last row", expected)
        return matrix
    quaternion = np.array(node.rotation)
    length = float(np.linalg.norm(quaternion))
    if length < 1e-6:
        expected = "a quaternion of length 1"
        raise source.refusal(f"{field}.rotation", "zeros", expected)
    x, y, z, w = quaternion / length
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, :3] *= np.array(node.scale)
    matrix[:3, 3] = node.translation
    return matrix


def box_placement(
    source: GltfFile, matrix: Float[np.ndarray, "4 4"], field: str
) -> tuple[list[float], list[float], float]:
    """Return world centre, scale (right, front, up) and yaw of an upright box's node.

    Raises:
        SceneFormatError: The node is tilted, skewed, mirrored, or has no extent.
    """
    right, up, back = matrix[:3, :3].T
    scale = [float(np.linalg.norm(axis)) for axis in (right, back, up)]
    if min(scale) < 1e-9 or max(scale) > 1e9:
        sizes = ", ".join(f"{factor:.3g}" for factor in scale)
        raise source.refusal(f"{field}.scale", sizes, "numbers above 0")
    right, back, up = right / scale[0], back / scale[1], up / scale[2]
    problem: tuple[str, str] | None = None
    if up[1] < 0 or math.hypot(up[0], up[2]) > UPRIGHT_TOLERANCE:
        degrees = math.degrees(math.acos(min(max(float(up[1]), -1.0), 1.0)))
        problem = f"tilted by {degrees:.1f} degrees", "a turn about the vertical only"
    elif max(abs(float(right @ up)), abs(float(right @ back)), abs(float(up @ back))) > 1e-2:
        problem = "a skew", "translation, a turn about the vertical, and scale along its own axes"
    elif float(np.linalg.det(np.stack([right, up, back]))) < 0:
        problem = "a mirror image", "no negative scale"
    if problem is not None:
        raise source.refusal(field, *problem)
    x, z, y = (float(number) for number in matrix[:3, 3])
    return [x, -y, z], scale, math.atan2(-float(right[2]), float(right[0]))
