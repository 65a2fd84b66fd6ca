"""The report's panorama as a data address."""

import base64
import io
from pathlib import Path

import numpy as np
from jaxtyping import Float
from PIL import Image
from torch import Tensor

from panoscene.scene import read_panorama
from panoscene.style import PAPER, WALL

WIDEST = 2048
"""Pixels; larger photos are made smaller."""
QUALITY = 85


def photo_address(image: Float[Tensor, "3 height width"] | Path | None) -> str:
    """Return a panorama as the data address of a JPEG, at most 2048 pixels wide.

    Args:
        image: RGB in [0, 1], or a file that ``read_panorama`` reads; a plain sky and ground in
            grey for None.

    Raises:
        ValueError: the picture is not twice as wide as high within 1 %.
        PanoramaError: the file cannot be read as a panorama.
    """
    if isinstance(image, Path):
        image, _ = read_panorama(image)
    picture = _horizon() if image is None else _picture(image)
    if picture.width > WIDEST:
        picture = picture.resize((WIDEST, WIDEST // 2), Image.Resampling.LANCZOS)
    stream = io.BytesIO()
    picture.save(stream, "JPEG", quality=QUALITY, optimize=True, progressive=True)
    return "data:image/jpeg;base64," + base64.b64encode(stream.getvalue()).decode()


def _picture(image: Float[Tensor, "3 height width"]) -> Image.Image:
    height, width = image.shape[1:]
    if min(height, width) < 1 or abs(width - 2 * height) > 0.01 * width:
        raise ValueError(f"image: found {width} x {height} pixels, expected 2:1, a full panorama")
    pixels = (image.detach().cpu().float().nan_to_num(0.0).clamp(0, 1) * 255).round().byte()
    return Image.fromarray(np.ascontiguousarray(pixels.permute(1, 2, 0).numpy()))


def _horizon() -> Image.Image:
    """Return a picture for rooms without one: darker towards floor and ceiling."""
    light, dark = (
        np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) for colour in (PAPER, WALL)
    )
    share = 0.38 + 0.4 * np.abs(np.linspace(-1, 1, 128))[:, None, None]
    rows = light + share * (dark - light)
    return Image.fromarray(np.broadcast_to(rows, (128, 256, 3)).round().astype(np.uint8))
