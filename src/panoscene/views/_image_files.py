"""Pictures to files, whole or not at all."""

import io
import os
from pathlib import Path

import numpy as np
from jaxtyping import Float
from PIL import Image
from torch import Tensor

from panoscene.scene import write_atomically

_FORMATS = {".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG", ".webp": "WEBP"}
_OPTIONS = {"PNG": {"compress_level": 4}, "JPEG": {"quality": 92}, "WEBP": {"quality": 90}}


def write_image(image: Float[Tensor, "3 height width"], path: str | os.PathLike[str]) -> None:
    """Write a picture of RGB floats in [0, 1] as PNG, JPEG or WebP, whichever the name ends in.

    Numbers outside [0, 1] are clipped. The file appears complete or not at all.

    Raises:
        ValueError: the name ends in anything else, or the picture is empty or not finite.
    """
    file = Path(path)
    kind = _FORMATS.get(file.suffix.lower())
    if kind is None:
        raise ValueError(f"path: found {file.name!r}, expected a name in {', '.join(_FORMATS)}")
    buffer = io.BytesIO()
    picture_from_image(image).save(buffer, format=kind, **_OPTIONS[kind])
    write_atomically(file, buffer.getvalue())


def picture_from_image(image: Float[Tensor, "3 height width"]) -> Image.Image:
    """Return RGB floats in [0, 1] as a picture of 8 bits."""
    values = image.detach().permute(1, 2, 0).numpy(force=True)
    if values.size == 0 or not np.isfinite(values).all():
        raise ValueError("image: expected at least one pixel and finite numbers")
    return Image.fromarray((values.clip(0.0, 1.0) * 255.0 + 0.5).astype(np.uint8))
