"""Panorama pictures: from a file of any common kind to RGB floats, or a clear refusal."""

import math
import os
from pathlib import Path

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn import functional

from panoscene._photo import Photo, read_photo

from ._records import Panorama


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
    photo = read_photo(path, columns)
    file = Path(os.fspath(path)).name
    return _floats(photo), Panorama(photo.width, photo.height, camera_height, file)


def _floats(photo: Photo) -> Float[Tensor, "3 height width"]:
    pixels = torch.as_tensor(photo.pixels)
    if pixels.ndim == 3:
        # bytes are reordered before they become four times as large
        return pixels.permute(2, 0, 1).contiguous().float().div_(photo.largest)
    if photo.reduction > 1:
        pixels = functional.avg_pool2d(pixels[None], photo.reduction, ceil_mode=True)[0]
    return (pixels / photo.largest).repeat(3, 1, 1)
