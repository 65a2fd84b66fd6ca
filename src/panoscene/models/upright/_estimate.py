"""The rotation that makes a photo upright, and how sure it is."""

import math
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Float64
from torch import Tensor

from ._directions import Directions, find_directions, photo_axes
from ._edges import edge_points
from ._segments import find_segments

LEAST_CONFIDENCE = 0.3
"""Below it a photo is taken as it is."""

_SURPLUS = (20.0, 4.0)
"""Surplus of segments that gives an even chance, and the step that multiplies it by e."""
_ERROR = math.radians(0.8)
_CLEAR_LEAD = 0.1
"""Lead over another vertical, in parts of the score, from which on that one casts no doubt."""
_MOST_BLOCKS = 2.7
"""JPEG blocks above it hide the lines of the room: a quality of about 16."""
_ASPECT_TOLERANCE = 0.01
_LEAST_LEVEL_SHARE = 0.02

Rotation = tuple[tuple[float, float, float], tuple[float, float, float], tuple[float, float, float]]


@dataclass(frozen=True, slots=True)
class UprightEstimate:
    """How a photo has to be turned to stand upright."""

    upright_from_photo: Rotation
    """Rotation matrix for ``Panorama.upright_from_photo``: the photo's directions to the world's.
    The middle column of the upright photo is the one above and below the photo's middle."""
    tilt: float
    """Angle in radians between the photo's top and the room's vertical."""
    wall_yaw: float | None
    """Yaw of the walls in the world frame in [-pi/4, pi/4): they face it and the quarter turns
    from it. None where nothing tells."""
    confidence: float
    """In [0, 1]. Below ``LEAST_CONFIDENCE`` the rotation is the identity and the tilt 0."""
    segments: int
    """Straight segments that point up or along the walls."""

    @property
    def rotation(self) -> Float64[Tensor, "3 3"]:
        """``upright_from_photo`` as ``rotate_panorama`` takes it."""
        return torch.tensor(self.upright_from_photo, dtype=torch.float64)


def upright_rotation(image: Float[Tensor, "3 height width"]) -> UprightEstimate:
    """Return the rotation that makes a tilted panorama upright, from the lines of the room.

    Straight edges are found on six perspective views. Each lies in a plane through the camera, and
    the planes of parallel edges meet in one direction: their vanishing point. The vertical is the
    direction within 40 degrees of the photo's top where, together with two horizontal directions
    at right angles, most of them meet; least squares with outliers weighted down make it exact.
    Deterministic, on the CPU, whatever device the image is on.

    Args:
        image: Panorama of the full sphere, RGB in [0, 1], tilted by up to 40 degrees.

    Convention:
        - turn the photo with ``rotate_panorama(image, estimate.rotation)``
        - the yaw stays: the photo's middle is at lon 0 before and after
        - source: the alignment that DeepPanoContext's inputs need (Sec. 3.1); the method is ours

    Raises:
        ValueError: If the image is not twice as wide as high.

    Examples:
        >>> estimate = upright_rotation(torch.zeros(3, 64, 128))
        >>> estimate.upright_from_photo[0], estimate.confidence
        ((1.0, 0.0, 0.0), 0.0)
    """
    height, width = image.shape[-2:]
    if height < 1 or abs(width - 2 * height) > _ASPECT_TOLERANCE * width:
        raise ValueError(f"image: found {height} x {width} pixels, expected a width of 2 x height")
    points = edge_points(image)
    found = find_directions(find_segments(points))
    if found is None or points.blocks > _MOST_BLOCKS:
        return UprightEstimate(_rows(np.eye(3)), 0.0, None, 0.0, 0)
    confidence = _confidence(found)
    if confidence < LEAST_CONFIDENCE:
        return UprightEstimate(_rows(np.eye(3)), 0.0, None, confidence, found.count)
    up = found.axes[2]
    rotation = photo_axes(up)
    tilt = math.atan2(math.hypot(up[0], up[1]), up[2])
    walls = None
    if found.level_length > _LEAST_LEVEL_SHARE * (found.level_length + found.up_length):
        x, y, _ = rotation @ found.axes[0]
        walls = (math.atan2(-x, y) + math.pi / 4) % (math.pi / 2) - math.pi / 4
    return UprightEstimate(_rows(rotation), tilt, walls, confidence, found.count)


def _confidence(found: Directions) -> float:
    """Return a number in [0, 1]: segments beyond chance, a vertical held well, and no rival."""
    middle, step = _SURPLUS
    evidence = 1 / (1 + np.exp((middle - found.surplus) / step))
    alone = min(1.0, (1 - found.rival) / _CLEAR_LEAD)
    return float(evidence * alone * np.exp(-((found.error / _ERROR) ** 2)))


def _rows(matrix: Float64[np.ndarray, "3 3"]) -> Rotation:
    first, second, third = ((float(row[0]), float(row[1]), float(row[2])) for row in matrix)
    return first, second, third
