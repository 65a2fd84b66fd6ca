"""What a procedural texture is, and the draft its makers hand in."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, UInt8


@dataclass(frozen=True, slots=True)
class Texture:
    """A square picture of a surface with its fine shape. Arrays are read-only: they are shared."""

    colour: UInt8[np.ndarray, "height width 3"]
    """sRGB; row 0 is the upper edge."""
    roughness: UInt8[np.ndarray, "height width"]
    """0 is a mirror, 255 is chalk."""
    normal: UInt8[np.ndarray, "height width 3"]
    """Tangent space: red grows with u to the right, green with v up, blue out of the surface;
    128 is 0."""
    metres: float
    """Length of an edge of the picture in the real world."""


class Draft(NamedTuple):
    """A texture before it is quantised."""

    colour: Float[np.ndarray, "height width 3"]
    """sRGB in [0, 1]."""
    height: Float[np.ndarray, "height width"]
    """Metres above the mean surface."""
    roughness: Float[np.ndarray, "height width"]
    metres: float


def finish(draft: Draft, wraps: bool = True) -> Texture:
    """Return the texture of a draft; normals come from the height, across the edges if it wraps."""
    pixel = draft.metres / draft.height.shape[0]
    height = draft.height.astype(np.float32) / pixel
    if not wraps:
        height = np.pad(height, 1, mode="edge")
    right = 0.5 * (np.roll(height, -1, 1) - np.roll(height, 1, 1))
    up = 0.5 * (np.roll(height, 1, 0) - np.roll(height, -1, 0))
    if not wraps:
        right, up = right[1:-1, 1:-1], up[1:-1, 1:-1]
    scale = 127.0 / np.sqrt(1.0 + right * right + up * up)
    normal = np.stack([-right * scale, -up * scale, scale], axis=-1) + 128.0
    texture = Texture(
        (np.clip(draft.colour, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8),
        (np.clip(draft.roughness, 0.02, 1.0) * 255.0 + 0.5).astype(np.uint8),
        (np.clip(normal, 0.0, 255.0) + 0.5).astype(np.uint8),
        float(draft.metres),
    )
    for array in (texture.colour, texture.roughness, texture.normal):
        array.flags.writeable = False
    return texture
