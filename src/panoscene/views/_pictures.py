"""Pictures as pixels: photos and renders at the size they are drawn, and a room without a photo."""

import numpy as np
import torch
from jaxtyping import Float, UInt8
from PIL import Image
from torch import Tensor

from panoscene.geometry import wall_distance
from panoscene.scene import Layout
from panoscene.style import FLOOR
from panoscene.views._model import rgb

_CEILING, _WALL = "#dfe3e8", "#c9ced6"
"""Of a room that nobody photographed: pale, so that lines and labels stand out."""


def fitted_pixels(
    image: Float[Tensor, "3 height width"], width: int, height: int
) -> UInt8[np.ndarray, "{height} {width} 3"]:
    """Return a picture of colours in [0, 1] as bytes at another size.

    Raises:
        ValueError: the picture has no pixels.
    """
    if min(image.shape[1:]) < 1:
        raise ValueError(f"image: expected at least one pixel, found {tuple(image.shape)}")
    values = image.detach().to("cpu", torch.float32).nan_to_num(0.0).clamp(0.0, 1.0)
    pixels = (values * 255.0).round().to(torch.uint8).permute(1, 2, 0).contiguous()
    picture = Image.fromarray(pixels.numpy())
    if picture.size == (width, height):
        return np.array(picture)
    shrinks = width < picture.width
    method = Image.Resampling.BOX if shrinks else Image.Resampling.BICUBIC
    return np.array(picture.resize((width, height), method))


def plain_room(
    layout: Layout, camera_height: float, width: int, height: int
) -> UInt8[np.ndarray, "{height} {width} 3"]:
    """Return the panorama of an unlit room: floor, walls and ceiling, each of one pale colour."""
    lon = 2 * np.pi * ((np.arange(width) + 0.5) / width - 0.5)
    lat = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
    polygon = layout.floor_polygon.detach().to("cpu", torch.float64)
    distance = wall_distance(polygon, torch.as_tensor(lon)).numpy()
    low = np.arctan2(layout.floor_height - camera_height, distance)
    high = np.arctan2(layout.ceiling_height - camera_height, distance)
    surface = 1 + (lat[:, None] > high).astype(int) - (lat[:, None] < low)
    colours = [[round(255 * part) for part in rgb(name)] for name in (FLOOR, _WALL, _CEILING)]
    return np.array(colours, dtype=np.uint8)[surface]
