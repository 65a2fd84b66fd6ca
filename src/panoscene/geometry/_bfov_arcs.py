"""Exact intersection area of two BFoVs, from the circle arcs that bound them."""

import math
from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from panoscene.geometry._angles import wrap_angle
from panoscene.geometry._sphere import camera_from_turned, direction_from_lonlat


@dataclass(frozen=True, slots=True)
class BorderArcs:
    """The four edges (bottom, top, left, right) of regions, each an arc of a circle.

    A circle runs counter-clockwise, seen from outside the sphere, around its normal; its region
    is on the left, where normal . direction >= offset.
    """

    normal: Float[Tensor, "*batch 4 3"]
    """Unit axis of each circle, in camera axes."""
    offset: Float[Tensor, "*batch 4"]
    """Height of the circle's plane along its normal; zero for the sides, great circles."""
    middle: Float[Tensor, "*batch 4 3"]
    """Unit vector from the circle's axis to the middle of the arc."""
    half: Float[Tensor, "*batch 4"]
    """Half of the arc's angle around the axis, in radians."""
    centre: Float[Tensor, "*batch 3"]
    """Direction of the region's centre."""
    wide: Bool[Tensor, "*batch"]
    """Whether the region is wider than pi: then it is inside either side, not both."""

    def __getitem__(self, index: Int[Tensor, " pairs"]) -> "BorderArcs":
        """Return the arcs of the regions at index along the first axis."""
        return BorderArcs(
            self.normal[index],
            self.offset[index],
            self.middle[index],
            self.half[index],
            self.centre[index],
            self.wide[index],
        )


def border_arcs(bfov: Float[Tensor, "*batch 4"], shrink: float) -> BorderArcs:
    """Return the border of each BFoV in float64, after scaling its width and height by 1 - shrink.

    Examples:
        >>> border_arcs(torch.tensor([0.0, 0.0, 0.2, 0.4]), 0.0).half
        tensor([0.1000, 0.1000, 0.2000, 0.2000], dtype=torch.float64)
    """
    bfov = bfov.double()
    across = (bfov[..., 2] / 2).clamp_max(math.pi) * (1 - shrink)
    upward = (bfov[..., 3] / 2).clamp_max(math.pi / 2) * (1 - shrink)
    zero, one = torch.zeros_like(across), torch.ones_like(across)
    sin, cos = across.sin(), across.cos()
    normal = [(zero, zero, one), (zero, zero, -one), (cos, sin, zero), (-cos, sin, zero)]
    middle = [(zero, one, zero), (zero, one, zero), (-sin, cos, zero), (sin, cos, zero)]
    turned_from_camera = camera_from_turned(bfov[..., :2]).transpose(-1, -2)
    return BorderArcs(
        normal=torch.stack([torch.stack(n, -1) for n in normal], -2) @ turned_from_camera,
        offset=torch.stack((-upward.sin(), -upward.sin(), zero, zero), -1),
        middle=torch.stack([torch.stack(m, -1) for m in middle], -2) @ turned_from_camera,
        half=torch.stack((across, across, upward, upward), -1),
        centre=direction_from_lonlat(bfov[..., :2]),
        wide=across > math.pi / 2,
    )


def arcs_intersection_area(a: BorderArcs, b: BorderArcs) -> Float[Tensor, "*batch"]:
    """Return the solid angle shared by each region of a and the region of b at the same index.

    By Stokes' theorem: with q the centre of a, the form q . (p x dp) / (1 + q . p) integrated
    along a closed curve is the area on its left, as long as -q is not in it. The curve is the part
    of a's border inside b and the part of b's border inside a.

    Convention:
        - no two circles may coincide: the borders are shrunk by different fractions before
        - region a must not reach all the way round (then -q would be in it)
    """
    return _integral_inside(a, b, a.centre) + _integral_inside(b, a, a.centre)


def _integral_inside(
    arcs: BorderArcs, region: BorderArcs, pole: Float[Tensor, "*batch 3"]
) -> Float[Tensor, "*batch"]:
    """Return the integral of the area form around pole over the parts of arcs inside region."""
    onward = torch.cross(arcs.normal, arcs.middle, dim=-1)  # where an arc heads at its middle
    radius = (1 - arcs.offset.square()).clamp_min(0.0).sqrt()
    # at angle t an arc is level + ahead cos t + beside sin t above each plane of the region
    planes = region.normal.transpose(-1, -2)
    level = arcs.offset[..., None] * (arcs.normal @ planes) - region.offset[..., None, :]
    ahead = radius[..., None] * (arcs.middle @ planes)
    beside = radius[..., None] * (onward @ planes)
    swing = torch.hypot(ahead, beside).clamp_min(1e-300)
    crossing = (-level / swing).clamp(-1.0, 1.0).acos()
    phase = torch.atan2(beside, ahead)
    cuts = wrap_angle(torch.cat((phase - crossing, phase + crossing), -1))
    half = arcs.half[..., None]
    cuts = torch.cat((-half, cuts.minimum(half).maximum(-half), half), -1).sort(-1).values
    between = ((cuts[..., 1:] + cuts[..., :-1]) / 2)[..., None]
    height = level[..., None, :] + ahead[..., None, :] * between.cos()
    above = (height + beside[..., None, :] * between.sin()) >= 0
    wide = region.wide[..., None, None]
    sides = torch.where(wide, above[..., 2:].any(-1), above[..., 2:].all(-1))
    parts = _area_form(arcs, onward, radius, pole, cuts).diff(dim=-1)
    return torch.where(above[..., :2].all(-1) & sides, parts, 0.0).sum((-2, -1))


def _area_form(
    arcs: BorderArcs,
    onward: Float[Tensor, "*batch 4 3"],
    radius: Float[Tensor, "*batch 4"],
    pole: Float[Tensor, "*batch 3"],
    angle: Float[Tensor, "*batch 4 cuts"],
) -> Float[Tensor, "*batch 4 cuts"]:
    """Return the antiderivative, at each angle along its circle, of the area form around pole.

    With d the offset, r the radius, and c the cosine between pole and normal, the form is
    -d + (c + d) / (1 + c d + r sqrt(1 - c^2) cos(t - t0)), whose integral is an arctangent.
    """
    towards = pole[..., :, None]
    cosine = (arcs.normal @ towards).squeeze(-1)
    ahead, beside = (arcs.middle @ towards).squeeze(-1), (onward @ towards).squeeze(-1)
    lift = (arcs.offset + cosine)[..., None]
    most = (1 + arcs.offset * cosine + radius * torch.hypot(ahead, beside))[..., None]
    turn = angle - torch.atan2(beside, ahead)[..., None]
    rounds = (turn / (2 * math.pi)).round()
    rest = turn / 2 - math.pi * rounds
    arc = torch.atan2(lift * rest.sin(), most * rest.cos()) + math.pi * lift.sign() * rounds
    return 2 * arc - arcs.offset[..., None] * angle
