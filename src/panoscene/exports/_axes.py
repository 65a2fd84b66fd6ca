"""The one place where axes change: the world is +z up, the files of other programs are +y up."""

import numpy as np
from jaxtyping import Float


def gltf_from_world(points: Float[np.ndarray, "*points 3"]) -> Float[np.ndarray, "*points 3"]:
    """Return points or directions of the world, +z up, in the axes of glTF, +y up.

    Examples:
        >>> gltf_from_world(np.array([1.0, 2.0, 3.0])).tolist()
        [1.0, 3.0, -2.0]
    """
    return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1)


def world_from_gltf(points: Float[np.ndarray, "*points 3"]) -> Float[np.ndarray, "*points 3"]:
    """Return points or directions in the axes of glTF, +y up, in those of the world, +z up.

    Examples:
        >>> world_from_gltf(np.array([1.0, 3.0, -2.0])).tolist()
        [1.0, 2.0, 3.0]
    """
    return np.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1)
