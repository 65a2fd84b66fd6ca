"""Perspective crops: the pinhole view of a BFoV, and its way back into the panorama."""

import math

import torch
from jaxtyping import Bool, Float, Shaped
from torch import Tensor

from panoscene.geometry._interpolate import clamped, interpolate
from panoscene.geometry._resample import panorama_directions, sample_panorama
from panoscene.geometry._sphere import camera_from_turned, pixel_from_direction

MAX_FOV = math.radians(150)
"""The widest field of view of a perspective crop in radians, unless the caller says otherwise."""

_WIDEST_FOV = 3.12
_MIN_FOV = 1e-4
_MIN_FORWARD = 1e-6


def perspective_crop(
    image: Shaped[Tensor, "*#batch channels height width"],
    bfov: Float[Tensor, "*#batch 4"],
    size: tuple[int, int],
    *,
    mode: str = "bilinear",
    max_fov: float = MAX_FOV,
) -> Shaped[Tensor, "*#batch channels rows columns"]:
    """Return pinhole views of the BFoVs, each stretched to the same size.

    Leading axes broadcast: the crops of n BFoVs of one panorama come from an image of shape
    (channels, height, width) and BFoVs of shape (n, 4). The panorama is not copied, and pixels
    that no crop needs are not read. Differentiable in the image and, but for "nearest", in the
    BFoVs. There is no low-pass filter: shrink a large panorama before tiny crops.

    Args:
        image: Panorama; any type (labels, masks) for "nearest", floating point for the others.
        bfov: (lon, lat, width, height) in radians.
        size: Rows and columns of every crop.
        mode: "bilinear", "nearest" or "bicubic".
        max_fov: Fields of view above it are cut down to it, as a pinhole image grows without
            bound towards pi.

    Convention:
        - the crop's axes span width and height of the BFoV exactly: focal lengths differ
        - no roll: the crop's middle column lies in the vertical plane through its centre
        - source: DeepPanoContext, Sec. 3.1; the clamp is ours

    Raises:
        ValueError: If ``size``, ``max_fov`` or ``mode`` is out of range.

    Examples:
        >>> image = torch.arange(8.0).reshape(1, 1, 8).expand(1, 4, 8)
        >>> ahead_and_right = torch.tensor([[0.0, 0.0, 0.5, 0.5], [torch.pi / 2, 0.0, 0.5, 0.5]])
        >>> perspective_crop(image, ahead_and_right, (1, 1)).flatten()
        tensor([3.5000, 5.5000])
    """
    direction = perspective_directions(bfov, size, max_fov=max_fov)
    return sample_panorama(image, pixel_from_direction(direction, *image.shape[-2:]), mode)


def perspective_directions(
    bfov: Float[Tensor, "*batch 4"], size: tuple[int, int], *, max_fov: float = MAX_FOV
) -> Float[Tensor, "*batch rows columns 3"]:
    """Return the unit viewing directions, in camera axes, of a perspective crop's pixel centres.

    Args:
        bfov: (lon, lat, width, height) in radians.
        size: Rows and columns of the crop.
        max_fov: Fields of view above it are cut down to it.

    Raises:
        ValueError: If ``size`` or ``max_fov`` is out of range.

    Examples:
        >>> perspective_directions(torch.tensor([0.0, 0.0, 1.0, 1.0]), (3, 3))[1, 1]
        tensor([0., 1., 0.])
    """
    rows, columns = _checked_size(size)
    reach = _reach(bfov, max_fov)
    u = torch.arange(columns, dtype=bfov.dtype, device=bfov.device) + 0.5
    v = torch.arange(rows, dtype=bfov.dtype, device=bfov.device) + 0.5
    x = (reach[..., 0, None] * (2 * u / columns - 1))[..., None, :, None]
    z = (reach[..., 1, None] * (1 - 2 * v / rows))[..., :, None, None]
    right, forward, up = camera_from_turned(bfov[..., :2])[..., None, None, :, :].unbind(-1)
    return (x * right + z * up + forward) / (1 + x * x + z * z).sqrt()


def pixel_in_perspective(
    direction: Float[Tensor, "*#batch 3"],
    bfov: Float[Tensor, "*#batch 4"],
    size: tuple[int, int],
    *,
    max_fov: float = MAX_FOV,
) -> tuple[Float[Tensor, "*#batch 2"], Bool[Tensor, "*#batch"]]:
    """Return where directions of any length fall in a perspective crop, and whether inside it.

    Args:
        direction: Viewing directions in camera axes.
        bfov: (lon, lat, width, height) in radians.
        size: Rows and columns of the crop.
        max_fov: Fields of view above it are cut down to it.

    Returns:
        Continuous pixels (u, v) of the crop, and True for those in front of the camera and
        within the crop's borders. Directions behind the camera get finite pixels of no meaning.

    Raises:
        ValueError: If ``size`` or ``max_fov`` is out of range.

    Examples:
        >>> bfov = torch.tensor([0.0, 0.0, torch.pi / 2, torch.pi / 2])
        >>> pixel_in_perspective(torch.tensor([1.0, 1.0, 0.0]), bfov, (64, 64))
        (tensor([64., 32.]), tensor(True))
    """
    rows, columns = _checked_size(size)
    reach = _reach(bfov, max_fov)
    right, forward, up = camera_from_turned(bfov[..., :2]).unbind(-1)
    ahead = (direction * forward).sum(-1)
    length = direction.detach().square().sum(-1).sqrt()
    in_front = ahead > _MIN_FORWARD * length
    depth = torch.where(in_front, ahead, torch.ones_like(ahead))
    x = (direction * right).sum(-1) / (depth * reach[..., 0])
    z = (direction * up).sum(-1) / (depth * reach[..., 1])
    uv = torch.stack(((x + 1) * (columns / 2), (1 - z) * (rows / 2)), dim=-1)
    return uv, in_front & (x.abs() <= 1) & (z.abs() <= 1)


def panorama_from_perspective(
    crop: Shaped[Tensor, "*#batch channels rows columns"],
    bfov: Float[Tensor, "*#batch 4"],
    height: int,
    width: int,
    *,
    mode: str = "bilinear",
    max_fov: float = MAX_FOV,
) -> tuple[
    Shaped[Tensor, "*#batch channels {height} {width}"], Bool[Tensor, "*#batch {height} {width}"]
]:
    """Return each crop painted back into an empty panorama, and the mask of pixels it covers.

    Args:
        crop: Perspective views of the BFoVs.
        bfov: (lon, lat, width, height) in radians.
        height: Rows of the panorama.
        width: Columns of the panorama.
        mode: "bilinear", "nearest" or "bicubic".
        max_fov: The value the crops were made with.

    Returns:
        Panoramas that are zero outside the crop, and True for pixels whose centre the crop sees.
        Average several crops as ``panorama.sum(0) / covered.sum(0)``.

    Raises:
        ValueError: If the panorama is empty, or ``max_fov`` or ``mode`` is out of range.

    Examples:
        >>> ahead = torch.tensor([0.0, 0.0, torch.pi / 2, torch.pi / 2])
        >>> panorama, covered = panorama_from_perspective(torch.ones(3, 32, 32), ahead, 64, 128)
        >>> panorama.shape, int(covered[32].sum())
        (torch.Size([3, 64, 128]), 32)
    """
    rows, columns = crop.shape[-2:]
    direction = panorama_directions(height, width, like=bfov)
    uv, covered = pixel_in_perspective(
        direction, bfov[..., None, None, :], (rows, columns), max_fov=max_fov
    )
    uv = torch.where(covered[..., None], uv, torch.zeros_like(uv))
    painted = interpolate(crop, uv, mode, clamped(rows, columns, crop.device))
    return torch.where(covered[..., None, :, :], painted, torch.zeros_like(painted)), covered


def _reach(bfov: Tensor, max_fov: float) -> Tensor:
    """Return half the crop's width and height on the plane at distance one."""
    if not _MIN_FOV < max_fov <= _WIDEST_FOV:
        raise ValueError(
            f"max_fov: found {max_fov}, expected above 0 and at most {_WIDEST_FOV} radians"
        )
    return (bfov[..., 2:].clamp(_MIN_FOV, max_fov) / 2).tan()


def _checked_size(size: tuple[int, int]) -> tuple[int, int]:
    if min(size) < 1:
        raise ValueError(f"size: found {size[0]} x {size[1]}, expected at least 1 x 1 pixels")
    return size
