"""The paper's parametrisation of a box: what a network reads off the panorama and predicts."""

import math
from dataclasses import dataclass

import torch
from jaxtyping import Float, Int64
from torch import Tensor

from panoscene.geometry._angles import wrap_angle
from panoscene.geometry._oriented_boxes import OrientedBoxes
from panoscene.geometry._sphere import direction_from_lonlat, lonlat_from_direction

DISTANCE_BINS = 6
"""Number of distance bins; they cover 0 to 12 m and the last one everything beyond."""
DISTANCE_BIN_WIDTH = 2.0
"""Metres in a distance bin."""
YAW_BINS = 6
"""Number of bins of the view-relative yaw, from -pi to pi."""
YAW_BIN_WIDTH = 2 * math.pi / YAW_BINS
"""Radians in a yaw bin."""


@dataclass(frozen=True, slots=True)
class BoxCode:
    """Boxes relative to their BFoV, their category's mean size and their line of sight.

    Source: the paper's box estimation network, as in Total3D. Scores are not part of the code.
    """

    delta: Float[Tensor, "*batch 2"]
    """BFoV centre minus the direction of the box centre, (lon, lat), over the BFoV's extents."""
    distance_bin: Int64[Tensor, "*batch"]
    """Bin of the distance from the camera to the box centre, 0 to DISTANCE_BINS - 1."""
    distance_residual: Float[Tensor, "*batch"]
    """Distance minus the bin's centre, in bin widths: -0.5 to 0.5, more beyond 12 m."""
    yaw_bin: Int64[Tensor, "*batch"]
    """Bin of the view-relative yaw, 0 to YAW_BINS - 1."""
    yaw_residual: Float[Tensor, "*batch"]
    """View-relative yaw minus the bin's centre, in bin widths: -0.5 to 0.5."""
    size_residual: Float[Tensor, "*batch 3"]
    """Size over mean size minus one."""


def view_relative_yaw(
    yaw: Float[Tensor, "*batch"], lon: Float[Tensor, "*batch"]
) -> Float[Tensor, "*batch"]:
    """Return the yaw relative to the line of sight, in radians, in [-pi, pi).

    Convention:
        - clockwise from above, from the line of sight (camera to box centre) to the box's front:
          0 faces away from the camera, -pi faces it; -lon - yaw, wrapped
        - ``lon`` is the longitude of the box centre, not of the BFoV centre

    Examples:
        >>> lon = torch.tensor([0.5, 0.5])
        >>> view_relative_yaw(torch.tensor([-0.5, 0.0]), lon).tolist()
        [0.0, -0.5]
    """
    return wrap_angle(-lon - yaw)


def yaw_from_view_relative(
    view_yaw: Float[Tensor, "*batch"], lon: Float[Tensor, "*batch"]
) -> Float[Tensor, "*batch"]:
    """Return the world yaw in [-pi, pi): the inverse of ``view_relative_yaw``.

    Examples:
        >>> yaw_from_view_relative(torch.tensor(0.0), torch.tensor(0.5)).item()
        -0.5
    """
    return wrap_angle(-lon - view_yaw)


def box_centre_from_view(
    lonlat: Float[Tensor, "*batch 2"],
    distance: Float[Tensor, "*batch"],
    camera_height: float | Float[Tensor, "..."],
) -> Float[Tensor, "*batch 3"]:
    """Return the world position in metres of points seen in a direction, at a distance.

    Args:
        lonlat: Longitude and latitude of the direction in radians.
        distance: Length of the ray from the camera in metres.
        camera_height: Height of the camera above the floor in metres, one or one per point.

    Convention:
        - the camera is at (0, 0, camera_height)

    Examples:
        >>> box_centre_from_view(torch.tensor([0.0, 0.0]), torch.tensor(2.0), 1.5).tolist()
        [0.0, 2.0, 1.5]
    """
    x, y, z = (direction_from_lonlat(lonlat) * distance.unsqueeze(-1)).unbind(dim=-1)
    return torch.stack([x, y, z + camera_height], dim=-1)


def encode_boxes(
    boxes: OrientedBoxes,
    bfov: Float[Tensor, "*batch 4"],
    mean_size: Float[Tensor, "*batch 3"],
    camera_height: float | Float[Tensor, "..."],
) -> BoxCode:
    """Return the code of boxes, given the BFoV they were detected in and their mean size.

    ``decode_box_code`` with the same arguments gives the boxes back, except that the yaw comes
    back wrapped to [-pi, pi).

    Args:
        boxes: Boxes in the world frame.
        bfov: (lon, lat, width, height) of each box's detection in radians.
        mean_size: Mean size of each box's category in metres.
        camera_height: Height of the camera above the floor in metres, one or one per box.

    Convention:
        - the difference of longitudes is wrapped, so the seam is nowhere special
        - bins are nearest centres: 1, 3, ... 11 m and -150, -90, ... 150 degrees

    Raises:
        ValueError: If a box is centred on the camera, a BFoV has no extent or a mean size is not
            positive.

    Examples:
        >>> box = OrientedBoxes(
        ...     torch.tensor([0.0, 3.0, 1.6]), torch.ones(3), torch.tensor(-0.3))
        >>> bfov = torch.tensor([0.1, 0.0, 0.4, 0.4])
        >>> code = encode_boxes(box, bfov, torch.ones(3), camera_height=1.6)
        >>> int(code.distance_bin), float(code.distance_residual), int(code.yaw_bin)
        (1, 0.0, 3)
        >>> code.delta.tolist()
        [0.25, 0.0]
    """
    _check_positive("mean_size", mean_size)
    _check_positive("width and height of bfov", bfov[..., 2:])
    x, y, z = boxes.centre.unbind(dim=-1)
    ray = torch.stack([x, y, z - camera_height], dim=-1)
    distance = ray.square().sum(dim=-1).sqrt()
    _check_positive("distance of the box centre from the camera", distance)
    lonlat = lonlat_from_direction(ray)
    offset = bfov[..., :2] - lonlat
    offset = torch.stack([wrap_angle(offset[..., 0]), offset[..., 1]], dim=-1)
    view_yaw = view_relative_yaw(boxes.yaw, lonlat[..., 0])
    distance_bin, distance_residual = _split(distance, 0.0, DISTANCE_BIN_WIDTH, DISTANCE_BINS)
    yaw_bin, yaw_residual = _split(view_yaw, -math.pi, YAW_BIN_WIDTH, YAW_BINS)
    return BoxCode(
        delta=offset / bfov[..., 2:],
        distance_bin=distance_bin,
        distance_residual=distance_residual,
        yaw_bin=yaw_bin,
        yaw_residual=yaw_residual,
        size_residual=boxes.size / mean_size - 1,
    )


def decode_box_code(
    code: BoxCode,
    bfov: Float[Tensor, "*batch 4"],
    mean_size: Float[Tensor, "*batch 3"],
    camera_height: float | Float[Tensor, "..."],
) -> OrientedBoxes:
    """Return the boxes of a code: the exact inverse of ``encode_boxes``.

    Differentiable in delta and in all residuals.

    Args:
        code: As predicted, or from ``encode_boxes``.
        bfov: (lon, lat, width, height) of each box's detection in radians.
        mean_size: Mean size of each box's category in metres.
        camera_height: Height of the camera above the floor in metres, one or one per box.

    Raises:
        ValueError: If a bin does not exist.

    Examples:
        >>> box = OrientedBoxes(torch.tensor([0.0, 3.0, 1.0]), torch.ones(3), torch.tensor(-0.3))
        >>> bfov = torch.tensor([0.1, 0.0, 0.4, 0.4])
        >>> code = encode_boxes(box, bfov, torch.ones(3), camera_height=1.6)
        >>> decoded = decode_box_code(code, bfov, torch.ones(3), camera_height=1.6)
        >>> torch.allclose(decoded.centre, box.centre, atol=1e-6)
        True
    """
    _check_bins("distance_bin", code.distance_bin, DISTANCE_BINS)
    _check_bins("yaw_bin", code.yaw_bin, YAW_BINS)
    distance = (code.distance_bin + 0.5 + code.distance_residual) * DISTANCE_BIN_WIDTH
    view_yaw = (code.yaw_bin + 0.5 + code.yaw_residual) * YAW_BIN_WIDTH - math.pi
    lonlat = bfov[..., :2] - code.delta * bfov[..., 2:]
    return OrientedBoxes(
        centre=box_centre_from_view(lonlat, distance, camera_height),
        size=(code.size_residual + 1) * mean_size,
        yaw=yaw_from_view_relative(view_yaw, lonlat[..., 0]),
    )


def _split(
    value: Float[Tensor, "*batch"], start: float, width: float, bins: int
) -> tuple[Int64[Tensor, "*batch"], Float[Tensor, "*batch"]]:
    """Return the bin with the nearest centre and the rest in bin widths."""
    position = (value - start) / width
    index = position.detach().floor().clamp(0, bins - 1).long()
    return index, position - index - 0.5


def _check_positive(name: str, value: Float[Tensor, "..."]) -> None:
    if not bool((value > 0).all()):
        raise ValueError(f"{name}: found {float(value.min())}, expected only positive numbers")


def _check_bins(name: str, index: Int64[Tensor, "..."], bins: int) -> None:
    if bool(((index < 0) | (index >= bins)).any()):
        found = f"{int(index.min())} to {int(index.max())}"
        raise ValueError(f"{name}: found {found}, expected 0 to {bins - 1}")
