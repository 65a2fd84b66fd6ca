"""The panoramic camera: which way each pixel looks."""

import math

import numpy as np
from jaxtyping import Float64

from panoscene.synth.render._records import Camera


def home_from_camera(camera: Camera) -> Float64[np.ndarray, "3 3"]:
    """Return the rotation from the camera's frame to the home's frame.

    In the camera's frame +y is the image's centre, +x its right and +z its top, as in the world
    frame of scenes. A camera without pitch and roll is only turned about the vertical.

    Examples:
        >>> left = home_from_camera(Camera((0.0, 0.0, 1.6), yaw=np.pi / 2)) @ (0.0, 1.0, 0.0)
        >>> left.round(6).tolist()
        [-1.0, 0.0, 0.0]
    """
    turn = _rotation(2, camera.yaw)
    return turn @ _rotation(0, camera.pitch) @ _rotation(1, camera.roll)


def pixel_rays(camera: Camera) -> Float64[np.ndarray, "height width 3"]:
    """Return the unit directions through the pixel centres in the home's frame."""
    lon = 2 * np.pi * ((np.arange(camera.width) + 0.5) / camera.width - 0.5)
    lat = np.pi * (0.5 - (np.arange(camera.height) + 0.5) / camera.height)[:, None]
    across = np.broadcast_to(np.sin(lat), (camera.height, camera.width))
    local = np.stack([np.cos(lat) * np.sin(lon), np.cos(lat) * np.cos(lon), across], axis=-1)
    return local @ home_from_camera(camera).T


def _rotation(axis: int, angle: float) -> Float64[np.ndarray, "3 3"]:
    matrix = np.eye(3)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    matrix[i, i] = matrix[j, j] = math.cos(angle)
    matrix[i, j], matrix[j, i] = -math.sin(angle), math.sin(angle)
    return matrix
