"""Overlap of BFoVs on the sphere: exact intersection area, IoU, non-maximum suppression, union."""

import math

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from panoscene.geometry._bfov import bfov_area, bfov_candidates, bfov_contains, smallest_bfov
from panoscene.geometry._bfov_arcs import arcs_intersection_area, border_arcs
from panoscene.geometry._sphere import camera_from_turned, direction_from_lonlat
from panoscene.geometry._suppression import suppress

_PAIRS_AT_ONCE = 4096  # keeps the working memory below about 50 MB
# regions are shrunk by these fractions first, so that no two borders coincide: everything below
# is exact arithmetic on circles, and coincident circles are its only ambiguity
_SHRINK_A, _SHRINK_B = 3e-7, 1e-6
_BORDER_POINTS = 65  # on each edge of a region, for unions


def bfov_intersection_area(
    a: Float[Tensor, "n 4"], b: Float[Tensor, "m 4"]
) -> Float[Tensor, "n m"]:
    """Return the solid angle in steradians shared by every BFoV of a with every BFoV of b.

    The border of the intersection is cut into circle arcs, and the solid angle is the sum of a
    closed form over them, in float64. There is no sampling: the error is about 2e-6 of the
    smaller region, from the tiny shrinking that keeps borders from coinciding. Any width up to
    2 pi and any height up to pi is right, across the seam and over the poles.

    Convention:
        - exactly 0 for disjoint regions, exactly the area for identical ones
        - no gradient: this is for metrics and suppression

    Raises:
        ValueError: If a BFoV is not finite or its width or height is negative, or more than
            2 pi or pi.

    Examples:
        >>> a = torch.tensor([[3.1, 0.0, 0.4, 0.2]])
        >>> b = torch.tensor([[-3.1, 0.0, 0.4, 0.2], [0.0, 0.0, 0.4, 0.2]])
        >>> [round(x, 4) for x in bfov_intersection_area(a, b)[0].tolist()]
        [0.0633, 0.0]
    """
    _check_bfov(a, "a")
    _check_bfov(b, "b")
    first, second = _near_pairs(a, b).nonzero().unbind(-1)
    shared = torch.zeros(a.shape[0], b.shape[0], dtype=a.dtype, device=a.device)
    shared[first, second] = _pair_areas(a, b, first, second).to(a.dtype)
    return shared


def bfov_iou(a: Float[Tensor, "n 4"], b: Float[Tensor, "m 4"]) -> Float[Tensor, "n m"]:
    """Return intersection over union, by solid angle, of every BFoV of a with every one of b.

    Convention:
        - in [0, 1]; exactly 1 for identical BFoVs (even without area) and 0 for disjoint ones
        - no gradient; see bfov_intersection_area for the accuracy

    Raises:
        ValueError: If a BFoV is not finite or its width or height is negative, or more than
            2 pi or pi.

    Examples:
        >>> a = torch.tensor([[3.1, 0.0, 0.4, 0.2]])
        >>> b = torch.tensor([[3.1, 0.0, 0.4, 0.2], [-3.1, 0.0, 0.4, 0.2]])
        >>> [round(x, 4) for x in bfov_iou(a, b)[0].tolist()]
        [1.0, 0.6557]
    """
    shared = bfov_intersection_area(a, b)
    either = bfov_area(a.detach())[:, None] + bfov_area(b.detach())[None, :] - shared
    same = (a[:, None, :] == b[None, :, :]).all(-1)
    iou = (shared / either.clamp_min(torch.finfo(either.dtype).tiny)).clamp(0.0, 1.0)
    return torch.where(same, 1.0, iou)


def bfov_nms(
    bfov: Float[Tensor, "n 4"],
    score: Float[Tensor, " n"],
    category: Int[Tensor, " n"] | None = None,
    *,
    iou_threshold: float,
) -> Int[Tensor, " kept"]:
    """Return the indices kept by greedy non-maximum suppression, by descending score.

    A BFoV falls when a kept one of higher score, and of the same category when categories are
    given, overlaps it by more than the threshold. Equal scores keep their order.

    Args:
        bfov: (lon, lat, width, height) in radians.
        score: Confidence of each BFoV.
        category: Class of each BFoV; without it all of them compete.
        iou_threshold: Largest IoU on the sphere that two kept BFoVs may have, in [0, 1].

    Raises:
        ValueError: If the threshold is outside [0, 1], a score is not finite, or a BFoV is bad.

    Examples:
        >>> bfov = torch.tensor([[3.1, 0.0, 0.4, 0.2], [-3.1, 0.0, 0.4, 0.2], [0.0, 0.0, 0.4, 0.2]])
        >>> bfov_nms(bfov, torch.tensor([0.5, 0.9, 0.7]), iou_threshold=0.4).tolist()
        [1, 2]
    """
    return suppress(bfov_iou(bfov, bfov), score, category, iou_threshold)


def bfov_union(
    bfov: Float[Tensor, "*batch regions 4"],
    valid: Bool[Tensor, "*batch regions"] | None = None,
) -> Float[Tensor, "*batch 4"]:
    """Return a small BFoV that contains all regions of each batch entry.

    The fit is that of bfov_from_directions, to dense points on the borders. Regions stick out of
    the result by less than 1e-4 rad up to the size of a large object, and by 0.03 rad at most
    beyond a hemisphere. The largest region is returned unchanged when it contains the others. Two
    halves of an object cut at the seam become one BFoV around both.

    Args:
        bfov: (lon, lat, width, height) in radians.
        valid: Which regions count; all of them by default.

    Raises:
        ValueError: If a batch entry has no valid region, or a valid one is not finite or too large.

    Examples:
        >>> halves = torch.tensor([[3.0416, 0.0, 0.2, 0.3], [-3.0416, 0.0, 0.2, 0.3]])
        >>> [round(x, 3) for x in bfov_union(halves).tolist()]
        [-3.142, 0.0, 0.4, 0.3]
    """
    if valid is None:
        valid = torch.ones(bfov.shape[:-1], dtype=torch.bool, device=bfov.device)
    missing = ~valid.any(-1)
    if missing.any():
        index = tuple(int(i) for i in missing.nonzero()[0])
        raise ValueError(f"bfov: found no valid region in entry {index}, expected one in each")
    _check_bfov(bfov[valid], "bfov")
    bfov = torch.where(valid[..., None], bfov, 0.0)
    directions = _region_directions(bfov)
    of_region = valid[..., None].expand(directions.shape[:-1])
    candidates = bfov_candidates(directions.flatten(-3, -2), of_region.flatten(-2))
    fit = smallest_bfov(_grown_over_regions(candidates, bfov, valid))
    biggest = torch.where(valid, bfov_area(bfov), -1.0).argmax(-1)[..., None, None]
    largest = bfov.gather(-2, biggest.expand(*bfov.shape[:-2], 1, 4))
    inside = bfov_contains(
        largest.unsqueeze(-2).expand(*directions.shape[:-1], 4), directions, 1e-6
    )
    whole = (inside | ~of_region).flatten(-2).all(-1)
    return torch.where(whole[..., None], largest.squeeze(-2), fit)


def _check_bfov(bfov: Float[Tensor, "n 4"], name: str) -> None:
    size = bfov[:, 2:]
    most = bfov.new_tensor([2 * math.pi, math.pi]) * (1 + 1e-5)
    bad = ~(bfov.isfinite().all(-1) & ((size >= 0) & (size <= most)).all(-1))
    if bad.any():
        index = int(bad.int().argmax())
        found = [float(x) for x in bfov[index]]
        raise ValueError(
            f"{name}: found {found} at index {index}, expected finite (lon, lat, width, height) "
            "with 0 <= width <= 2 pi and 0 <= height <= pi"
        )


def _near_pairs(a: Float[Tensor, "n 4"], b: Float[Tensor, "m 4"]) -> Bool[Tensor, "n m"]:
    """Return which pairs have overlapping bounding caps: no others can intersect."""
    reach = [_cap_radius(x)[..., None] for x in (a, b)]
    centres = [direction_from_lonlat(x[:, :2]) for x in (a, b)]
    apart = (centres[0] @ centres[1].T).clamp(-1.0, 1.0).acos()
    return apart <= reach[0] + reach[1].T + 2e-3  # acos of float32 is this coarse near 0


def _cap_radius(bfov: Float[Tensor, "n 4"]) -> Float[Tensor, " n"]:
    """Return the angle from the centre to the farthest point of each region."""
    across = (bfov[:, 2] / 2).cos()
    # the corner, or the middle of a side once the region reaches behind the camera
    return torch.where(across > 0, across * (bfov[:, 3] / 2).cos(), across).clamp(-1.0, 1.0).acos()


@torch.no_grad()
def _pair_areas(
    a: Float[Tensor, "n 4"],
    b: Float[Tensor, "m 4"],
    first: Int[Tensor, " pairs"],
    second: Int[Tensor, " pairs"],
) -> Float[Tensor, " pairs"]:
    """Return the intersection areas of the pairs a[first], b[second], in float64."""
    arcs_a, arcs_b = border_arcs(a, _SHRINK_A), border_arcs(b, _SHRINK_B)
    areas = [
        arcs_intersection_area(arcs_a[i], arcs_b[j])
        for i, j in zip(
            torch.split(first, _PAIRS_AT_ONCE), torch.split(second, _PAIRS_AT_ONCE), strict=True
        )
    ]
    shared = torch.cat(areas)
    area_a, area_b = bfov_area(a.double())[first], bfov_area(b.double())[second]
    shared = torch.where((a[first] == b[second]).all(-1), area_a, shared)
    return shared.clamp_min(0.0).minimum(area_a).minimum(area_b)


def _region_directions(
    bfov: Float[Tensor, "*batch 4"],
) -> Float[Tensor, "*batch points 3"]:
    """Return directions on the border of each region and on a coarse grid inside."""
    edge = torch.linspace(-0.5, 0.5, _BORDER_POINTS, dtype=bfov.dtype, device=bfov.device)
    grid = torch.linspace(-0.375, 0.375, 7, dtype=bfov.dtype, device=bfov.device)
    end = torch.full_like(edge, 0.5)
    across = torch.cat((edge, edge, end, -end, grid.repeat(7)))
    upward = torch.cat((end, -end, edge, edge, grid.repeat_interleave(7)))
    steps = torch.stack((across, upward), dim=-1)
    turned = direction_from_lonlat(bfov[..., None, 2:] * steps)
    return turned @ camera_from_turned(bfov[..., :2]).transpose(-1, -2)


def _grown_over_regions(
    fits: Float[Tensor, "*batch fits 4"],
    bfov: Float[Tensor, "*batch regions 4"],
    valid: Bool[Tensor, "*batch regions"],
) -> Float[Tensor, "*batch fits 4"]:
    """Return the fits, made full height or width where a region holds their pole or their back.

    lon' and lat' peak on the border of a region, except where it contains a pole of the turned
    camera or crosses its back meridian (lon' = pi).
    """
    back = torch.linspace(-math.pi / 2, math.pi / 2, _BORDER_POINTS).to(fits)
    turned = direction_from_lonlat(torch.stack((torch.full_like(back, math.pi), back), -1))
    seen = turned @ camera_from_turned(fits[..., :2]).transpose(-1, -2)
    shape = (*fits.shape[:-1], bfov.shape[-2], _BORDER_POINTS)
    inside = bfov_contains(
        bfov[..., None, :, None, :].expand(*shape, 4), seen.unsqueeze(-3).expand(*shape, 3)
    )
    inside = (inside & valid[..., None, :, None]).any(-2)
    width = torch.where(inside[..., 1:-1].any(-1), 2 * math.pi, fits[..., 2])
    height = torch.where(inside[..., 0] | inside[..., -1], math.pi, fits[..., 3])
    return torch.stack((fits[..., 0], fits[..., 1], width, height), dim=-1)
