"""Panorama pictures: from a file of any common kind to RGB floats, or a clear refusal."""

import math
import os
import struct
import warnings
import zlib
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from PIL import Image, ImageOps, UnidentifiedImageError
from torch import Tensor
from torch.nn import functional

from ._checks import ASPECT_TOLERANCE
from ._errors import PanoramaError
from ._records import Panorama

FORMATS = ("JPEG", "PNG", "TIFF", "WEBP", "BMP")
"""File formats that are read, by Pillow's names; no others are tried."""

MIN_WIDTH, MIN_HEIGHT = 64, 32
MAX_PIXELS = 150_000_000
"""16384 x 8192 fits; the decoded picture takes 3 bytes a pixel, and 12 where it is not reduced."""

_EXIF_ORIENTATION = 0x0112
# what Pillow's decoders raise on damaged files
_DAMAGE = (OSError, SyntaxError, ValueError, EOFError, IndexError, KeyError, TypeError,
           struct.error, zlib.error, OverflowError, MemoryError)  # fmt: skip


def read_panorama(
    path: str | os.PathLike[str], *, camera_height: float = 1.6, columns: int | None = None
) -> tuple[Float[Tensor, "3 height width"], Panorama]:
    """Return the picture as RGB floats in [0, 1], and what is known about it.

    Convention:
        - 8- and 16-bit, greyscale, palette, black and white, CMYK and YCbCr pictures become RGB;
          16-bit greyscale keeps its precision, 16-bit colour is read with 8 bits. Colour profiles
          are not applied
        - transparent pixels are composited over black: they are pixels that nobody saw
        - the EXIF orientation is applied, and then the picture must be 2:1 within 1 %
        - the first picture of a file with several is read
        - ``Panorama.file`` is the bare file name: a scene file is expected next to the photo; its
          size is that of the file

    Args:
        path: of the picture.
        camera_height: metres above the floor.
        columns: as many are enough: of a picture with at least twice as many, each pixel is the
            mean of two by two, three by three ... before it takes 12 bytes; None keeps all.

    Raises:
        PanoramaError: The file is missing, damaged, truncated or not of a known format, or the
            picture is not 2:1, below 64 x 32, or above 150 million pixels.
        ValueError: The camera height or the columns are not positive.
    """
    if not 0 < camera_height < math.inf:
        raise ValueError(f"camera_height: expected metres above 0, found {camera_height}")
    if columns is not None and columns < 1:
        raise ValueError(f"columns: expected at least 1, found {columns}")
    file = os.fspath(path)
    with warnings.catch_warnings():
        # Pillow warns about large pictures and odd metadata; here both are errors or harmless
        warnings.simplefilter("ignore")
        try:
            with Image.open(path, formats=FORMATS) as picture:
                width, height = _upright_size(picture)
                _check_size((width, height), file)
                image = _rgb(picture, file, _reduction(picture, columns))
        except PanoramaError:
            raise
        except (FileNotFoundError, IsADirectoryError, PermissionError) as error:
            reason = f"{(error.strerror or 'cannot be opened').lower()}; expected a picture file"
            raise PanoramaError(file, reason) from None
        except Image.DecompressionBombError:
            raise PanoramaError(file, _too_large("more than 178 million")) from None
        except UnidentifiedImageError:
            known = ", ".join(FORMATS)
            reason = f"not a picture of a known format, or damaged; expected one of {known}"
            raise PanoramaError(file, reason) from None
        except _DAMAGE as error:
            raise PanoramaError(file, f"the picture is damaged or truncated: {error}") from error
    return image, Panorama(width, height, camera_height, Path(file).name)


def _upright_size(picture: Image.Image) -> tuple[int, int]:
    """Return width and height after the EXIF orientation, before any pixel is decoded."""
    width, height = picture.size
    turned = picture.getexif().get(_EXIF_ORIENTATION) in (5, 6, 7, 8)
    return (height, width) if turned else (width, height)


def _reduction(picture: Image.Image, columns: int | None) -> int:
    """Return how many pixels along each axis become one, after what a JPEG can leave out."""
    if columns is None:
        return 1
    factor = max(_upright_size(picture)[0] // columns, 1)
    if factor > 1:
        width, height = picture.size
        # decodes a half, a quarter or an eighth of the pixels along each axis; JPEG only
        picture.draft(None, (width // factor, height // factor))
    return max(_upright_size(picture)[0] // columns, 1)


def _check_size(size: tuple[int, int], file: str) -> None:
    width, height = size
    found = f"{width} x {height} pixels"
    if width * height > MAX_PIXELS:
        raise PanoramaError(file, _too_large(f"{width * height / 1e6:.0f} million"))
    if abs(width - 2 * height) > ASPECT_TOLERANCE * width and width > 1:
        expected = "a full equirectangular panorama, twice as wide as high"
        raise PanoramaError(file, f"found {found}, expected {expected}")
    if width < MIN_WIDTH or height < MIN_HEIGHT:
        raise PanoramaError(file, f"found {found}, expected at least {MIN_WIDTH} x {MIN_HEIGHT}")


def _too_large(found: str) -> str:
    return f"found {found} pixels, expected at most {MAX_PIXELS // 1_000_000} million"


def _rgb(picture: Image.Image, file: str, factor: int) -> Float[Tensor, "3 height width"]:
    picture = ImageOps.exif_transpose(picture)
    if picture.mode.startswith("I") or picture.mode == "F":
        return _grey(picture, file, factor)
    if picture.has_transparency_data:
        seen = picture.convert("RGBA")
        picture = Image.alpha_composite(Image.new("RGBA", seen.size, (0, 0, 0, 255)), seen)
    picture = picture.convert("RGB")
    if factor > 1:
        picture = picture.reduce(factor)
    # bytes are reordered before they become four times as large
    pixels = torch.as_tensor(np.array(picture)).permute(2, 0, 1).contiguous()
    return pixels.float().div_(255)


def _grey(picture: Image.Image, file: str, factor: int) -> Float[Tensor, "3 height width"]:
    """Return greyscale of more than 8 bits; wide integers hold 16-bit values in practice."""
    values = torch.as_tensor(np.array(picture).astype(np.float32))
    largest = 1.0 if picture.mode == "F" else 65535.0
    low, high = float(values.min()), float(values.max())
    if not (low >= 0 and high <= largest):
        reason = f"found values from {low:g} to {high:g}, expected 0 to {largest:g}"
        raise PanoramaError(file, reason)
    if factor > 1:
        values = functional.avg_pool2d(values[None], factor, ceil_mode=True)[0]
    return (values / largest).repeat(3, 1, 1)
