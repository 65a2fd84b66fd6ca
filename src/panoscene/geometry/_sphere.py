"""Panorama pixels, longitude and latitude, viewing directions: the one convention, both ways."""

import math

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry._angles import wrap_angle


def lonlat_from_pixel(
    uv: Float[Tensor, "*batch 2"], height: int, width: int
) -> Float[Tensor, "*batch 2"]:
    """Return longitude and latitude in radians of continuous pixel coordinates.

    Args:
        uv: Columns and rows, measured from the top left corner of the image.
        height: Rows of the panorama.
        width: Columns of the panorama.

    Convention:
        - lon = 2 pi (u / width - 1/2), wrapped to [-pi, pi), positive to the right
        - lat = pi (1/2 - v / height), positive up
        - the centre of pixel (row i, column j) is (j + 0.5, i + 0.5)

    Raises:
        ValueError: If the panorama has no rows or no columns.

    Examples:
        >>> lonlat_from_pixel(torch.tensor([[512.0, 256.0], [0.0, 512.0]]), 512, 1024)
        tensor([[ 0.0000,  0.0000],
                [-3.1416, -1.5708]])
    """
    _check_shape(height, width)
    lon = wrap_angle((uv[..., 0] / width - 0.5) * (2 * math.pi))
    lat = (0.5 - uv[..., 1] / height) * math.pi
    return torch.stack((lon, lat), dim=-1)


def pixel_from_lonlat(
    lonlat: Float[Tensor, "*batch 2"], height: int, width: int
) -> Float[Tensor, "*batch 2"]:
    """Return continuous pixel coordinates (u, v) of longitude and latitude in radians.

    Args:
        lonlat: Any longitude: it is wrapped first.
        height: Rows of the panorama.
        width: Columns of the panorama.

    Convention:
        - u is in [0, width): the seam (lon = pi) is column 0, and the period is exactly width
        - v grows downwards from 0 at the zenith to height at the nadir

    Raises:
        ValueError: If the panorama has no rows or no columns.

    Examples:
        >>> pixel_from_lonlat(torch.tensor([torch.pi / 2, torch.pi / 4]), 512, 1024)
        tensor([768., 128.])
    """
    lon, lat = lonlat.unbind(-1)
    return _pixel(wrap_angle(lon), lat, height, width)


def direction_from_lonlat(lonlat: Float[Tensor, "*batch 2"]) -> Float[Tensor, "*batch 3"]:
    """Return the unit viewing direction of longitude and latitude in radians.

    Convention:
        - (cos lat sin lon, cos lat cos lon, sin lat) in camera axes: +x right, +y ahead, +z up

    Examples:
        >>> direction_from_lonlat(torch.tensor([0.0, 0.0]))
        tensor([0., 1., 0.])
    """
    lon, lat = lonlat.unbind(-1)
    across = lat.cos()
    return torch.stack((across * lon.sin(), across * lon.cos(), lat.sin()), dim=-1)


def lonlat_from_direction(direction: Float[Tensor, "*batch 3"]) -> Float[Tensor, "*batch 2"]:
    """Return longitude and latitude in radians of directions of any length.

    Convention:
        - lon in [-pi, pi), zero ahead (+y) and positive to the right (+x); lat positive up
        - straight up and down have no longitude: 0 is returned there, with a gradient of zero,
          and the zero vector is seen at (0, 0)

    Examples:
        >>> lonlat_from_direction(torch.tensor([2.0, 0.0, 0.0]))
        tensor([1.5708, 0.0000])
    """
    return torch.stack(_angles(direction), dim=-1)


def direction_from_pixel(
    uv: Float[Tensor, "*batch 2"], height: int, width: int
) -> Float[Tensor, "*batch 3"]:
    """Return the unit viewing direction of continuous pixel coordinates.

    Convention:
        - the centre column (u = width / 2) on the horizon (v = height / 2) looks along +y
        - the column at three quarters of the width looks along +x

    Raises:
        ValueError: If the panorama has no rows or no columns.

    Examples:
        >>> direction_from_pixel(torch.tensor([512.0, 256.0]), 512, 1024)
        tensor([0., 1., 0.])
    """
    return direction_from_lonlat(lonlat_from_pixel(uv, height, width))


def pixel_from_direction(
    direction: Float[Tensor, "*batch 3"], height: int, width: int
) -> Float[Tensor, "*batch 2"]:
    """Return continuous pixel coordinates (u, v) of directions of any length.

    Convention:
        - u in [0, width), v in [0, height]; straight up and down land on the centre column

    Raises:
        ValueError: If the panorama has no rows or no columns.

    Examples:
        >>> pixel_from_direction(torch.tensor([0.0, 3.0, 0.0]), 512, 1024)
        tensor([512., 256.])
    """
    return _pixel(*_angles(direction), height, width)


def camera_from_turned(lonlat: Float[Tensor, "*batch 2"]) -> Float[Tensor, "*batch 3 3"]:
    """Return the rotation that carries directions of the turned camera into the camera.

    The turned camera looks at ``lonlat``: the camera is turned by lon about the vertical, then
    pitched by lat, and never rolled. Columns are its right, forward and up in camera axes, so
    ``direction_camera = camera_from_turned @ direction_turned``.

    Convention:
        - lon turns clockwise seen from above, lat pitches up, both in radians
        - (0, 1, 0) in the turned camera is the direction of ``lonlat`` in the camera

    Examples:
        >>> looking_up = camera_from_turned(torch.tensor([0.0, torch.pi / 6]))
        >>> looking_up @ torch.tensor([0.0, 1.0, 0.0])
        tensor([0.0000, 0.8660, 0.5000])
    """
    lon, lat = lonlat.unbind(-1)
    sin_lon, cos_lon, sin_lat, cos_lat = lon.sin(), lon.cos(), lat.sin(), lat.cos()
    zero = torch.zeros_like(lon)
    right = torch.stack((cos_lon, -sin_lon, zero), dim=-1)
    forward = torch.stack((cos_lat * sin_lon, cos_lat * cos_lon, sin_lat), dim=-1)
    up = torch.stack((-sin_lat * sin_lon, -sin_lat * cos_lon, cos_lat), dim=-1)
    return torch.stack((right, forward, up), dim=-1)


def _angles(direction: Float[Tensor, "*batch 3"]) -> tuple[Tensor, Tensor]:
    """Return lon in [-pi, pi) and lat."""
    x, y, z = direction.unbind(-1)
    square = x * x + y * y
    # the gradient of the root is infinite at zero, so the root of zero is not taken
    aside = square > 0
    across = torch.where(aside, torch.where(aside, square, torch.ones_like(square)).sqrt(), 0.0)
    lon = torch.atan2(x + 0.0, y + 0.0)  # adding zero makes -0.0 positive: atan2(0, -0.0) is pi
    lon = torch.where(lon >= math.pi, lon - 2 * math.pi, lon)
    return lon, torch.atan2(z, across)


def _pixel(lon: Tensor, lat: Tensor, height: int, width: int) -> Float[Tensor, "*batch 2"]:
    """Return the pixel of a lon in [-pi, pi) and a lat."""
    _check_shape(height, width)
    u = (lon / (2 * math.pi) + 0.5) * width
    # the numbers next to the seam may have been rounded to its other side
    u = torch.where(u < 0, u + width, u)
    u = torch.where(u >= width, u - width, u)
    v = (0.5 - lat / math.pi) * height
    return torch.stack((u, v), dim=-1)


def _check_shape(height: int, width: int) -> None:
    if height < 1 or width < 1:
        raise ValueError(f"height and width: found {height} x {width}, expected at least 1 x 1")
