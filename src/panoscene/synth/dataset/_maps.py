"""The picture files of a panorama: what their pixels mean, written and read."""

import io
import warnings
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Int32, UInt8, UInt16
from PIL import Image

from ._errors import DatasetError

DISTANCE, INSTANCE, SEMANTIC = "distance.png", "instance.png", "semantic.png"
NORMAL, ALBEDO = "normal.png", "albedo.jpg"
SCENE, LABELS, GLB = "scene.json", "labels.json", "scene.glb"
MILLIMETRES = 1000.0
_MAX_PIXELS = 64_000_000
_ZLIB = 4


def millimetres(
    distance: Float32[np.ndarray, "height width"],
) -> UInt16[np.ndarray, "height width"]:
    """Return distances as whole millimetres; 0 is nothing, and 65535 is 65.535 m or more.

    Examples:
        >>> millimetres(np.array([[0.0, 1.2344, 99.0]], np.float32)).tolist()
        [[0, 1234, 65535]]
    """
    return np.clip(np.rint(distance * MILLIMETRES), 0, 65535).astype(np.uint16)


def png_bytes(array: np.ndarray) -> bytes:
    """Return an 8-bit or 16-bit map, or an RGB picture, as PNG."""
    stream = io.BytesIO()
    Image.fromarray(array).save(stream, "PNG", compress_level=_ZLIB)
    return stream.getvalue()


def jpeg_bytes(rgb: UInt8[np.ndarray, "height width 3"], quality: int) -> bytes:
    """Return a picture as JPEG without colour subsampling at high qualities."""
    stream = io.BytesIO()
    Image.fromarray(rgb).save(stream, "JPEG", quality=quality, subsampling=0 if quality > 90 else 2)
    return stream.getvalue()


def normal_picture(
    normal: Float32[np.ndarray, "height width 3"],
) -> UInt8[np.ndarray, "height width 3"]:
    """Return normals in the photo's frame as colours: -1 is 1, 0 is 128, 1 is 255; nothing is 0."""
    known = np.abs(normal).sum(axis=-1, keepdims=True) > 0
    return np.where(known, np.rint(normal * 127.0 + 128.0), 0).astype(np.uint8)


def read_map(path: Path, bits: int) -> Int32[np.ndarray, "height width"]:
    """Return the values of a map of one channel.

    Raises:
        DatasetError: The file is missing, damaged, or not a map of so many bits.
    """
    values = _pixels(path)
    kinds = {8: ("uint8",), 16: ("uint16", "int32")}[bits]
    if values.ndim != 2 or values.dtype.name not in kinds:
        found = f"{values.ndim - 1 or 'one'} channel axes of {values.dtype.name}"
        raise DatasetError(path, f"found {found}, expected one channel of {bits} bits")
    return values.astype(np.int32)


def read_rgb(path: Path) -> UInt8[np.ndarray, "height width 3"]:
    """Return a picture.

    Raises:
        DatasetError: The file is missing, damaged, or has no three channels.
    """
    values = _pixels(path)
    if values.ndim != 3 or values.shape[2] != 3 or values.dtype != np.uint8:
        raise DatasetError(path, f"found an array of shape {values.shape}, expected 8-bit RGB")
    return values


def _pixels(path: Path) -> np.ndarray:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(path, formats=("PNG", "JPEG")) as picture:
                size = picture.size
                values = np.array(picture) if size[0] * size[1] <= _MAX_PIXELS else None
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise DatasetError(path, f"expected a picture, found: {error}") from None
    if values is None:
        found = f"{size[0]} x {size[1]} pixels"
        raise DatasetError(path, f"found {found}, expected at most {_MAX_PIXELS}")
    return values
