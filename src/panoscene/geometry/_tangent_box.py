"""Boxes on the plane that touches the sphere at a viewing direction (gnomonic projection)."""

import math

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene.geometry._angles import wrap_angle
from panoscene.geometry._sphere import (
    camera_from_turned,
    lonlat_from_direction,
)

MAX_TANGENT_FOV = math.radians(150)
"""Largest field of view in radians that a tangent plane shows: tan grows without bound at pi."""

_REACH = math.tan(MAX_TANGENT_FOV / 2)
_EDGE_STEPS = 65  # odd: the middle of an edge of the box, where it reaches highest, is among them


def tangent_points(
    directions: Float[Tensor, "*batch points 3"], lonlat: Float[Tensor, "*batch 2"]
) -> tuple[Float[Tensor, "*batch points 2"], Bool[Tensor, "*batch points"]]:
    """Return points on the plane tangent to the unit sphere at lonlat, and which are shown.

    Args:
        directions: Viewing directions of any length, in camera axes.
        lonlat: Where the plane touches the sphere, in radians.

    Convention:
        - x to the right and y up, in units of the plane's distance: (tan lon', tan lat' / cos lon')
          in the turned camera
        - a direction is shown within MAX_TANGENT_FOV / 2 of the point of contact; the others get
          (0, 0) and False

    Examples:
        >>> points, shown = tangent_points(
        ...     torch.tensor([[1.0, 2.0, 0.5], [0.0, -1.0, 0.0]]), torch.tensor([0.0, 0.0])
        ... )
        >>> points
        tensor([[0.5000, 0.2500],
                [0.0000, 0.0000]])
        >>> shown
        tensor([ True, False])
    """
    turned = directions @ camera_from_turned(lonlat)
    across = turned[..., 0::2]
    forward = turned[..., 1]
    shown = (forward > 0) & (across.square().sum(-1) <= (_REACH * forward).square())
    depth = torch.where(shown, forward, 1.0)[..., None]
    return torch.where(shown[..., None], across / depth, 0.0), shown


def tangent_box_from_directions(
    directions: Float[Tensor, "*batch points 3"],
    lonlat: Float[Tensor, "*batch 2"],
    valid: Bool[Tensor, "*batch points"] | None = None,
) -> Float[Tensor, "*batch 4"]:
    """Return the box (left, bottom, right, top) around directions on the plane tangent at lonlat.

    Args:
        directions: Viewing directions of any length, in camera axes.
        lonlat: Where the plane touches the sphere, in radians.
        valid: Which points count; all of them by default.

    Convention:
        - x to the right and y up, in units of the plane's distance
        - every side is within tan(MAX_TANGENT_FOV / 2) of the point of contact; a direction behind
          the plane pushes the sides towards which it lies to that limit

    Raises:
        ValueError: If a batch entry has no valid point.

    Examples:
        >>> corners = torch.tensor([[-0.1, 1.0, 0.0], [0.2, 1.0, 0.3]])
        >>> tangent_box_from_directions(corners, torch.tensor([0.0, 0.0]))
        tensor([-0.1000,  0.0000,  0.2000,  0.3000])
    """
    if valid is None:
        valid = torch.ones(directions.shape[:-1], dtype=torch.bool, device=directions.device)
    missing = ~valid.any(-1)
    if missing.any():
        index = tuple(int(i) for i in missing.nonzero()[0])
        raise ValueError(f"directions: found no valid point in entry {index}, expected one in each")
    turned = directions @ camera_from_turned(lonlat)
    across = turned[..., 0::2]
    forward = turned[..., 1:2]
    # beyond the limit only the sign counts: that also keeps the division away from zero
    shown = across.abs() < _REACH * forward
    point = torch.where(shown, across / torch.where(shown, forward, 1.0), across.sign() * _REACH)
    kept = valid[..., None]
    low = torch.where(kept, point, math.inf).amin(-2)
    high = torch.where(kept, point, -math.inf).amax(-2)
    return torch.cat((low, high), dim=-1)


def tangent_box_from_bfov(bfov: Float[Tensor, "*batch 4"]) -> Float[Tensor, "*batch 4"]:
    """Return the box (left, bottom, right, top) of each BFoV on the plane tangent at its centre.

    Convention:
        - (-x, -y, x, y) with x = tan(width / 2) and y = tan(height / 2), in units of the plane's
          distance: the frame of a perspective crop with those two fields of view
        - width and height are cut to MAX_TANGENT_FOV first
        - the sides agree with the BFoV everywhere, bottom and top on the centre column only: there
          a BFoV's border curves outwards to y / cos lon'

    Examples:
        >>> tangent_box_from_bfov(torch.tensor([1.0, 0.5, torch.pi / 2, torch.pi]))
        tensor([-1.0000, -3.7321,  1.0000,  3.7321])
    """
    half = (bfov[..., 2:].clamp_max(MAX_TANGENT_FOV) / 2).tan()
    return torch.cat((-half, half), dim=-1)


def bfov_from_tangent_box(
    box: Float[Tensor, "*batch 4"], lonlat: Float[Tensor, "*batch 2"]
) -> Float[Tensor, "*batch 4"]:
    """Return the BFoV that contains a box (left, bottom, right, top) on the plane at lonlat.

    It is centred on the angular middle of the box and is the smallest there, so this inverts
    tangent_box_from_bfov below MAX_TANGENT_FOV, and lifts boxes found in a perspective crop.

    Convention:
        - x to the right and y up, in units of the plane's distance from the camera

    Raises:
        ValueError: If a box is not finite, or its left exceeds its right, or its bottom its top.

    Examples:
        >>> box = torch.tensor([-1.0, -0.5, 1.0, 0.5])
        >>> bfov_from_tangent_box(box, torch.tensor([3.0, 0.2]))
        tensor([3.0000, 0.2000, 1.5708, 0.9273])
    """
    low, high = box[..., :2], box[..., 2:]
    bad = ~(box.isfinite() & torch.cat((low <= high, low <= high), -1)).all(-1)
    if bad.any():
        found = [float(x) for x in box[bad][0]]
        raise ValueError(f"box: found {found}, expected finite left <= right and bottom <= top")
    middle = ((low.atan() + high.atan()) / 2).tan()
    camera = camera_from_turned(lonlat)
    centre = lonlat_from_direction(_lifted(middle.unsqueeze(-2), camera)).squeeze(-2)
    # at the exact middle keep lonlat itself: straight up and down, lon says how it is turned
    centred = (middle == 0).all(-1, keepdim=True)
    centre = torch.where(
        centred, torch.cat((wrap_angle(lonlat[..., :1]), lonlat[..., 1:]), -1), centre
    )
    step = torch.linspace(0, 1, _EDGE_STEPS, dtype=box.dtype, device=box.device)
    side, end = torch.cat((step, step)), torch.cat((torch.zeros_like(step), torch.ones_like(step)))
    along = torch.stack((torch.cat((side, end)), torch.cat((end, side))), dim=-1)
    border = low.unsqueeze(-2) + (high - low).unsqueeze(-2) * along
    seen = lonlat_from_direction(_lifted(border, camera) @ camera_from_turned(centre))
    return torch.cat((centre, 2 * seen.abs().amax(-2)), dim=-1)


def _lifted(
    points: Float[Tensor, "*batch points 2"], camera: Float[Tensor, "*batch 3 3"]
) -> Float[Tensor, "*batch points 3"]:
    """Return the camera directions of points on the plane in front of a turned camera."""
    turned = torch.stack((points[..., 0], torch.ones_like(points[..., 0]), points[..., 1]), -1)
    return turned @ camera.transpose(-1, -2)
