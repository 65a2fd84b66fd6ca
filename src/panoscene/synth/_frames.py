"""Places in the frames of furniture."""

import numpy as np
from jaxtyping import Float


def place_of(
    centre: Float[np.ndarray, " 3"], yaw: float, right: float, front: float
) -> Float[np.ndarray, " 2"]:
    """Return the point that lies so far to a piece's right and front of its centre.

    Examples:
        >>> place_of(np.array([1.0, 2.0, 0.5]), np.pi / 2, 0.0, 3.0).round(6).tolist()
        [-2.0, 2.0]
    """
    cos, sin = np.cos(yaw), np.sin(yaw)
    return centre[:2] + np.array([cos * right - sin * front, sin * right + cos * front])
