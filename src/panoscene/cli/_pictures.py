"""Panoramas to cube faces, pinhole views and turned panoramas."""

import math
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import torch
from jaxtyping import Float
from PIL import Image
from torch import Tensor

from panoscene.cli._errors import InputError
from panoscene.cli._files import write_bytes
from panoscene.cli._folders import check_folder
from panoscene.cli._kinds import PICTURES, check_kind
from panoscene.geometry import (
    CUBE_FACES,
    MAX_FOV,
    camera_from_turned,
    cube_from_panorama,
    perspective_crop,
    rotate_panorama,
)
from panoscene.scene import read_panorama

MAX_SIZE = 8192
"""Pixels along one side of a face or a view."""


@dataclass(frozen=True, slots=True)
class PanoramaOptions:
    """What to make of a panorama; None for options that were not given."""

    cube: bool | None
    view: str | None
    yaw_deg: float | None
    size: int | None


def convert_panorama(file: Path, output: Path, options: PanoramaOptions) -> str:
    """Write what was asked for and say what it is.

    Raises:
        InputError: Not exactly one thing was asked for, or with a value that makes no sense.
        PanoramaError: The file is not a panorama.
    """
    wanted = [x for x in (options.cube, options.view, options.yaw_deg) if x is not None]
    if len(wanted) != 1:
        found = "several" if wanted else "none"
        raise InputError(
            f"{file}: found {found} of --cube, --view and --yaw-deg with a panorama, expected one"
        )
    size = _checked_size(options)
    if check_kind(output, ["folder" if options.cube else "picture"]) == "folder":
        check_folder(output)
    bfov = None if options.view is None else _bfov(options.view)
    camera_from_new = _turn(options.yaw_deg or 0.0)
    image, _ = read_panorama(file)
    if options.cube:
        return _write_cube(image, output, size or max(image.shape[-1] // 4, 1))
    if bfov is None:
        picture = rotate_panorama(image, camera_from_new.mT)
    else:
        side = size or _native_size(image.shape[-1], float(bfov[2]))
        picture = perspective_crop(image, bfov, (side, side))
    write_bytes(output, _encoded(picture, output.suffix))
    height, width = picture.shape[-2:]
    return f"wrote {output}: {width} x {height} pixels"


def _checked_size(options: PanoramaOptions) -> int | None:
    size = options.size
    if size is not None and (options.yaw_deg is not None or not 1 <= size <= MAX_SIZE):
        expected = f"1 to {MAX_SIZE} pixels, with --cube or --view"
        raise InputError(f"--size: found {size}, expected {expected}")
    return size


def _turn(yaw_deg: float) -> Float[Tensor, "3 3"]:
    """Return the rotation from the axes of the turned camera to those of the photo's."""
    if not math.isfinite(yaw_deg):
        raise InputError(f"--yaw-deg: found {yaw_deg}, expected a finite number of degrees")
    # yaw is counter-clockwise from above, lon is clockwise
    return camera_from_turned(torch.tensor([-math.radians(math.remainder(yaw_deg, 360)), 0.0]))


def _bfov(view: str) -> Float[Tensor, "4"]:
    largest = math.degrees(MAX_FOV)
    expected = (
        "LON,LAT,FOV in degrees such as 90,-10,60, "
        f"with LAT from -90 to 90 and FOV from 1 to {largest:g}"
    )
    try:
        lon, lat, fov = (float(number) for number in view.split(","))
    except ValueError:
        raise InputError(f"--view: found {view!r}, expected {expected}") from None
    if not (math.isfinite(lon) and -90 <= lat <= 90 and 1 <= fov <= largest):
        raise InputError(f"--view: found {view!r}, expected {expected}")
    degrees = (math.remainder(lon, 360), lat, fov, fov)
    return torch.tensor([math.radians(number) for number in degrees])


def _native_size(width: int, fov: float) -> int:
    """Return the pixels of a view that is as sharp in its centre as the panorama."""
    pixels = 2 * math.tan(fov / 2) * width / (2 * math.pi)
    return min(max(round(pixels), 1), MAX_SIZE)


def _write_cube(image: Float[Tensor, "3 height width"], folder: Path, size: int) -> str:
    # everything is computed and encoded before the first file is written
    faces = [_encoded(face, ".png") for face in cube_from_panorama(image, size)]
    names = [f"{face}.png" for face in CUBE_FACES]
    for name, data in zip(names, faces, strict=True):
        write_bytes(folder / name, data)
    return f"wrote {folder}: {', '.join(names)} of {size} x {size} pixels"


def _encoded(picture: Float[Tensor, "3 rows columns"], suffix: str) -> bytes:
    pixels = (picture.clamp(0, 1) * 255).round().to(torch.uint8).permute(1, 2, 0)
    stream = BytesIO()
    kind = PICTURES[suffix.lower()]
    options = {"quality": 95, "subsampling": 0} if kind == "JPEG" else {}
    Image.fromarray(pixels.contiguous().numpy()).save(stream, kind, **options)
    return stream.getvalue()
