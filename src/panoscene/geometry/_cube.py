"""Cube maps: six square perspective views that cover the sphere."""

import math

import torch
from jaxtyping import Float, Shaped
from torch import Tensor

from panoscene.geometry._interpolate import MARGIN, Border, clamped, interpolate
from panoscene.geometry._perspective import perspective_crop, perspective_directions
from panoscene.geometry._resample import panorama_directions
from panoscene.geometry._sphere import camera_from_turned

CUBE_FACES: tuple[str, ...] = ("front", "right", "back", "left", "up", "down")
"""Order of the faces of a cube map."""

_FACE_LONLAT = (
    (0.0, 0.0),
    (math.pi / 2, 0.0),
    (-math.pi, 0.0),
    (-math.pi / 2, 0.0),
    (0.0, math.pi / 2),
    (0.0, -math.pi / 2),
)


def cube_from_panorama(
    image: Shaped[Tensor, "*batch channels height width"], size: int, mode: str = "bilinear"
) -> Shaped[Tensor, "*batch 6 channels {size} {size}"]:
    """Return the cube map of a panorama.

    Args:
        image: Panorama; any type (labels, masks) for "nearest", floating point for the others.
        size: Rows and columns of each face.
        mode: "bilinear", "nearest" or "bicubic".

    Convention:
        - faces in the order of ``CUBE_FACES``, all seen from the inside and none mirrored
        - front looks along +y, right along +x; these and back, left have the zenith at the top
        - up and down continue front: its top row meets the bottom row of up, its bottom row the
          top row of down

    Raises:
        ValueError: If ``size`` is not positive, or the mode does not suit the image.

    Examples:
        >>> cube_from_panorama(torch.zeros(3, 64, 128), 32).shape
        torch.Size([6, 3, 32, 32])
    """
    dtype = image.dtype if image.is_floating_point() else torch.get_default_dtype()
    return perspective_crop(
        image[..., None, :, :, :], _face_bfov(1.0, dtype, image.device), (size, size), mode=mode
    )


def panorama_from_cube(
    faces: Shaped[Tensor, "*batch 6 channels size size"],
    height: int,
    width: int,
    mode: str = "bilinear",
) -> Shaped[Tensor, "*batch channels {height} {width}"]:
    """Return the panorama of a cube map as ``cube_from_panorama`` makes it.

    Every face first gets a border of one pixel from its neighbours, so that no edge shows.

    Args:
        faces: Six faces in the order of ``CUBE_FACES``.
        height: Rows of the panorama.
        width: Columns of the panorama.
        mode: "bilinear", "nearest" or "bicubic".

    Raises:
        ValueError: If the panorama is empty, or the mode does not suit the faces.

    Examples:
        >>> panorama_from_cube(torch.ones(6, 3, 32, 32), 64, 128).shape
        torch.Size([3, 64, 128])
    """
    dtype = faces.dtype if faces.is_floating_point() else torch.get_default_dtype()
    size = faces.shape[-1]
    bfov = _face_bfov(1 + 2 / size, dtype, faces.device)
    around = perspective_directions(bfov, (size + 2, size + 2))
    neighbours = _look_up(faces, around.flatten(0, 1), mode, border=0)
    bordered = neighbours.view(*neighbours.shape[:-2], 6, size + 2, size + 2)
    bordered = bordered.movedim(-3, -4).clone()
    bordered[..., 1:-1, 1:-1] = faces
    return _look_up(bordered, panorama_directions(height, width, like=bfov), mode, border=1)


def _look_up(
    faces: Shaped[Tensor, "*batch 6 channels size size"],
    direction: Float[Tensor, "rows columns 3"],
    mode: str,
    *,
    border: int,
) -> Shaped[Tensor, "*batch channels rows columns"]:
    """Return the faces' values along directions, where ``border`` pixels surround each face."""
    size = faces.shape[-1]
    bfov = _face_bfov(1.0, direction.dtype, direction.device)
    right, forward, up = camera_from_turned(bfov[:, :2]).unbind(-1)
    ahead, face = (direction @ forward.mT).max(dim=-1)
    x = (direction * right[face]).sum(-1) / ahead
    z = (direction * up[face]).sum(-1) / ahead
    half = size / 2 - border
    v = size / 2 - z * half + face * (size + 2 * MARGIN)
    uv = torch.stack((size / 2 + x * half, v), dim=-1)
    tall = faces.movedim(-4, -3).flatten(-3, -2)
    return interpolate(tall, uv, mode, _clamped_in_face(size, faces.device))


def _clamped_in_face(size: int, device: torch.device) -> Border:
    """Return the border of six faces stacked into one tall image, each with its own margin."""
    one = clamped(size, size, device)
    face = torch.arange(6, device=device)[:, None]
    row_start = (face * (size * size) + one.row_start).flatten()
    return Border(row_start, torch.zeros_like(row_start), one.column)


def _face_bfov(reach: float, dtype: torch.dtype, device: torch.device) -> Float[Tensor, "6 4"]:
    """Return the BFoVs of the faces, extended from the plane's [-1, 1] to [-reach, reach]."""
    lonlat = torch.tensor(_FACE_LONLAT, dtype=dtype, device=device)
    return torch.cat((lonlat, torch.full_like(lonlat, 2 * math.atan(reach))), dim=-1)
