"""Panoramas resampled on the sphere: at any pixels, and turned by any rotation."""

import torch
from jaxtyping import Float, Shaped
from torch import Tensor

from panoscene.geometry._interpolate import interpolate, over_the_poles
from panoscene.geometry._sphere import (
    direction_from_lonlat,
    lonlat_from_pixel,
    pixel_from_direction,
)


def sample_panorama(
    image: Shaped[Tensor, "*#batch channels height width"],
    uv: Float[Tensor, "*#batch rows columns 2"],
    mode: str = "bilinear",
) -> Shaped[Tensor, "*#batch channels rows columns"]:
    """Return the panorama's values at continuous pixels, without seams.

    Differentiable in the image and, but for "nearest", in the pixels. Leading axes broadcast:
    one panorama may be sampled by many grids without being copied.

    Args:
        image: Panorama; any type (labels, masks) for "nearest", floating point for the others.
        uv: Continuous pixels (u, v); anything outside the image is a place on the sphere too.
        mode: "bilinear", "nearest" or "bicubic" (which may overshoot the range of the image).

    Convention:
        - the centre of pixel (row i, column j) is (j + 0.5, i + 0.5)
        - circular in u with the period ``width`` exactly: no column is there twice
        - beyond the top or bottom row comes that row again, half a turn away: over the pole

    Raises:
        ValueError: If the mode is unknown, or would mix integers, or the image is empty.

    Examples:
        >>> image = torch.tensor([[[0.0, 1.0, 2.0, 3.0], [4.0, 5.0, 6.0, 7.0]]])
        >>> sample_panorama(image, torch.tensor([[[1.5, 0.5], [4.0, 0.5], [0.5, 0.0]]]))
        tensor([[[1.0000, 1.5000, 1.0000]]])
    """
    height, width = image.shape[-2:]
    period = torch.tensor((width, 2 * height), dtype=uv.dtype, device=uv.device)
    uv = uv - (uv.detach() / period).floor() * period
    return interpolate(image, uv, mode, over_the_poles(height, width, image.device))


def rotate_panorama(
    image: Shaped[Tensor, "*#batch channels height width"],
    new_from_old: Float[Tensor, "*#batch 3 3"],
    mode: str = "bilinear",
) -> Shaped[Tensor, "*#batch channels height width"]:
    """Return the panorama a camera turned in its place would have taken.

    What the old camera sees along d, the new one sees along ``new_from_old @ d``. Differentiable
    in the image and the rotation. Pixels are located in double precision where the device has it,
    so a turn about the vertical by k whole columns is a roll of the image by k columns.

    Args:
        image: Panorama; any type (labels, masks) for "nearest", floating point for the others.
        new_from_old: Rotation matrices in camera axes: +x right, +y ahead, +z up.
        mode: "bilinear", "nearest" or "bicubic".

    Convention:
        - ``camera_from_turned((lon, 0))`` moves the picture to the right by lon

    Raises:
        ValueError: If a matrix is not a rotation, or the mode does not suit the image.

    Examples:
        >>> image = torch.arange(8.0).reshape(1, 2, 4)
        >>> clockwise = torch.tensor([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        >>> rotate_panorama(image, clockwise).round()
        tensor([[[3., 0., 1., 2.],
                 [7., 4., 5., 6.]]])
    """
    _check_rotation(new_from_old)
    height, width = image.shape[-2:]
    fine: Tensor = new_from_old
    if new_from_old.device.type != "mps":
        fine = new_from_old.double()
    new = panorama_directions(height, width, like=fine)
    # the transpose of a rotation is its inverse, and a row vector times it applies it
    old = new.flatten(0, 1) @ fine
    old = old.view(*old.shape[:-2], height, width, 3)
    uv = pixel_from_direction(old, height, width)
    return sample_panorama(image, uv, mode)


def panorama_directions(
    height: int, width: int, like: Float[Tensor, "..."]
) -> Float[Tensor, "{height} {width} 3"]:
    """Return the unit viewing directions of all pixel centres of a panorama.

    Args:
        height: Rows of the panorama.
        width: Columns of the panorama.
        like: A tensor whose type and device the result takes.

    Raises:
        ValueError: If the panorama has no rows or no columns.

    Examples:
        >>> panorama_directions(2, 4, like=torch.zeros(())).shape
        torch.Size([2, 4, 3])
    """
    u = torch.arange(width, dtype=like.dtype, device=like.device) + 0.5
    v = torch.arange(height, dtype=like.dtype, device=like.device) + 0.5
    lon = lonlat_from_pixel(torch.stack((u, torch.zeros_like(u)), dim=-1), height, width)[:, 0]
    lat = lonlat_from_pixel(torch.stack((torch.zeros_like(v), v), dim=-1), height, width)[:, 1]
    lonlat = (lon.expand(height, width), lat[:, None].expand(height, width))
    return direction_from_lonlat(torch.stack(lonlat, dim=-1))


def _check_rotation(new_from_old: Tensor) -> None:
    matrix = new_from_old.detach()
    identity = torch.eye(3, dtype=matrix.dtype, device=matrix.device)
    wrong = (matrix @ matrix.mT - identity).abs().amax(dim=(-2, -1))
    wrong = torch.maximum(wrong, (matrix.det() - 1).abs())
    if not bool((wrong < 1e-3).all()):
        raise ValueError(
            "new_from_old: found a matrix that is no rotation"
            f" (off by {float(wrong.max()):.3g}), expected orthonormal rows and determinant 1"
        )
