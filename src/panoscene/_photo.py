"""Pictures of panoramas as pixels, or a clear refusal; it needs no library that loads slowly."""

import os
import struct
import warnings
import zlib
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, UInt8
from PIL import Image, ImageOps, UnidentifiedImageError

from panoscene._file_error import FileError

FORMATS = ("JPEG", "PNG", "TIFF", "WEBP", "BMP")
"""File formats that are read, by Pillow's names; no others are tried."""
ASPECT_TOLERANCE = 0.01
"""Relative deviation from 2:1 that a panorama may have."""
MIN_WIDTH, MIN_HEIGHT = 64, 32
MAX_PIXELS = 150_000_000
"""16384 x 8192 fits; the decoded picture takes 3 bytes a pixel, and 12 where it is not reduced."""

_EXIF_ORIENTATION = 0x0112
# what Pillow's decoders raise on damaged files
_DAMAGE = (OSError, SyntaxError, ValueError, EOFError, IndexError, KeyError, TypeError,
           struct.error, zlib.error, OverflowError, MemoryError)  # fmt: skip


class PanoramaError(FileError):
    """A picture cannot be used as an equirectangular panorama.

    Attributes:
        file: Name of the picture.
        reason: What was found and what was expected.
    """


@dataclass(frozen=True, slots=True)
class Photo:
    """A decoded picture."""

    width: int
    """Of the upright picture in the file."""
    height: int
    pixels: UInt8[np.ndarray, "rows columns 3"] | Float32[np.ndarray, "rows columns"]
    """Colours, or greyscale of more than 8 bits."""
    largest: float
    """What a pixel is at most."""
    reduction: int
    """As many rows and columns are still to become one."""


def read_photo(path: str | os.PathLike[str], columns: int | None = None) -> Photo:
    """Return a picture that can be a panorama.

    Args:
        path: of the picture.
        columns: as many are enough; None keeps all.

    Raises:
        PanoramaError: As ``panoscene.scene.read_panorama`` says.
    """
    file = os.fspath(path)
    with warnings.catch_warnings():
        # Pillow warns about large pictures and odd metadata; here both are errors or harmless
        warnings.simplefilter("ignore")
        try:
            with Image.open(path, formats=FORMATS) as picture:
                size = _upright_size(picture)
                _check_size(size, file)
                return _decoded(picture, size, file, _reduction(picture, columns))
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


def _decoded(picture: Image.Image, size: tuple[int, int], file: str, factor: int) -> Photo:
    picture = ImageOps.exif_transpose(picture)
    if picture.mode.startswith("I") or picture.mode == "F":
        return Photo(*size, *_grey(picture, file), factor)
    if picture.has_transparency_data:
        seen = picture.convert("RGBA")
        picture = Image.alpha_composite(Image.new("RGBA", seen.size, (0, 0, 0, 255)), seen)
    picture = picture.convert("RGB")
    if factor > 1:
        picture = picture.reduce(factor)
    return Photo(*size, np.array(picture), 255.0, 1)


def _grey(picture: Image.Image, file: str) -> tuple[Float32[np.ndarray, "rows columns"], float]:
    """Return greyscale of more than 8 bits; wide integers hold 16-bit values in practice."""
    values = np.array(picture).astype(np.float32)
    largest = 1.0 if picture.mode == "F" else 65535.0
    low, high = float(values.min()), float(values.max())
    if not (low >= 0 and high <= largest):
        reason = f"found values from {low:g} to {high:g}, expected 0 to {largest:g}"
        raise PanoramaError(file, reason)
    return values, largest
