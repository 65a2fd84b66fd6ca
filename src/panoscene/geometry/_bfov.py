"""Bounding fields of view (BFoV): fits to directions, contours and masks, containment, area."""

import math

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene.geometry._angles import wrap_angle
from panoscene.geometry._sphere import (
    camera_from_turned,
    direction_from_lonlat,
    direction_from_pixel,
    lonlat_from_direction,
)

_RECENTRINGS = 3
_FINE_COLUMNS = 512  # coarser masks are sampled as if they had at least this many columns


def bfov_from_directions(
    directions: Float[Tensor, "*batch points 3"],
    valid: Bool[Tensor, "*batch points"] | None = None,
) -> Float[Tensor, "*batch 4"]:
    """Return a small BFoV (lon, lat, width, height) in radians that contains all directions.

    For a given centre the BFoV is the smallest symmetric one: twice the largest |lon'| and |lat'|
    in the turned camera. The paper takes the middle of the pixel bounding box as the centre. Here
    that middle (found on the circle, opposite the widest empty gap), the mean direction, the
    horizon below the middle and the nearer pole are tried too, each recentred a few times on the
    middle of the lon' and lat' it sees; the smallest area wins, if it is 1 % below that of the
    paper's centre. So there is no seam and no special case around the poles. It is a good local
    answer, not a proven minimum.

    Args:
        directions: Viewing directions of any length but zero, in camera axes.
        valid: Which points count; all of them by default.

    Convention:
        - lon in [-pi, pi), width at most 2 pi, height at most pi; one point has size zero
        - only the points are contained, not the surface between them
        - differentiable wherever the extreme points and the winning centre do not change

    Raises:
        ValueError: If a batch entry has no valid point, or a valid one is zero or not finite.

    Examples:
        >>> ahead = direction_from_lonlat(torch.tensor([[3.0, 0.0], [-3.0, 0.0]]))
        >>> [round(x, 4) for x in bfov_from_directions(ahead).tolist()]
        [-3.1416, 0.0, 0.2832, 0.0]
    """
    return smallest_bfov(bfov_candidates(directions, valid))


def bfov_from_contour(
    uv: Float[Tensor, "*batch points 2"],
    height: int,
    width: int,
    valid: Bool[Tensor, "*batch points"] | None = None,
) -> Float[Tensor, "*batch 4"]:
    """Return a small BFoV (lon, lat, width, height) in radians around contour points in pixels.

    Args:
        uv: Continuous pixel coordinates (u right, v down) of a dense contour: the points are
            contained, the lines between them are not looked at.
        height: Rows of the panorama.
        width: Columns of the panorama.
        valid: Which points count; all of them by default.

    Convention:
        - u may leave [0, width], as in contours traced on a tiled image; only its value modulo the
          width matters
        - OpenCV contours hold pixel indices: add 0.5 for the centres of those pixels

    Raises:
        ValueError: If a valid v is outside [0, height], a batch entry has no valid point, or a
            valid coordinate is not finite.

    Examples:
        >>> across_the_seam = torch.tensor([[1014.0, 256.0], [1034.0, 256.0]])
        >>> [round(x, 4) for x in bfov_from_contour(across_the_seam, 512, 1024).tolist()]
        [-3.1416, 0.0, 0.1227, 0.0]
    """
    v = uv[..., 1]
    outside = (v < 0) | (v > height)
    if valid is not None:
        outside = outside & valid
    if outside.any():
        raise ValueError(f"uv: found v = {v[outside][0].item():g}, expected 0 <= v <= {height}")
    return bfov_from_directions(direction_from_pixel(uv, height, width), valid)


def bfov_from_mask(mask: Bool[Tensor, "*batch height width"]) -> Float[Tensor, "*batch 4"]:
    """Return a small float32 BFoV (lon, lat, width, height) in radians around each mask.

    Whole pixels are contained, from corner to corner: a single pixel has about its own angular
    size. A column counts as filled from its topmost to its bottommost pixel, so holes cost
    nothing and the work per mask grows with the columns only. A mask may cross the seam, contain
    a pole or go all the way round; a mask of several parts gets one BFoV around all of them.

    Convention:
        - row 0 is at the zenith, column 0 begins at the seam (lon = -pi)

    Raises:
        ValueError: If a mask is empty (its index is named) or has no rows or columns.

    Examples:
        >>> mask = torch.zeros(512, 1024, dtype=torch.bool)
        >>> mask[240:272, :16] = mask[240:272, -16:] = True
        >>> [round(x, 4) for x in bfov_from_mask(mask).tolist()]
        [-3.1416, 0.0, 0.1963, 0.1963]
    """
    height, width = mask.shape[-2:]
    if height < 1 or width < 1:
        raise ValueError(f"mask: found {height} x {width} pixels, expected at least 1 x 1")
    top, bottom = _column_span(mask)
    empty = (bottom == 0).all(-1)
    if empty.any():
        index = tuple(int(i) for i in empty.nonzero()[0])
        raise ValueError(f"mask: found no pixel in mask {index}, expected at least one in each")
    # the left edge of a column (column 0 follows the last) sees the pixels on both its sides;
    # inside a column, and inside coarse pixels, further verticals see that column only
    repeat = max(1, _FINE_COLUMNS // width)
    fine_top = top.repeat_interleave(repeat, -1)
    fine_bottom = bottom.repeat_interleave(repeat, -1)
    high = torch.minimum(fine_top, fine_top.roll(1, -1))
    low = torch.maximum(fine_bottom, fine_bottom.roll(1, -1))
    lon = torch.arange(width * repeat, device=mask.device) * (2 * math.pi / (width * repeat))
    lon = (lon - math.pi).float().expand(high.shape)
    span = torch.stack((math.pi * (0.5 - low / height), math.pi * (0.5 - high / height)))
    occupied = low > 0
    directions, valid = _span_directions(lon, span, occupied, min(1e-3, math.pi / height / 4))
    candidates = bfov_candidates(directions, valid)
    return smallest_bfov(_grown_over_columns(candidates, lon, span, occupied))


def bfov_contains(
    bfov: Float[Tensor, "*batch 4"],
    direction: Float[Tensor, "*batch 3"],
    tolerance: float = 0.0,
) -> Bool[Tensor, "*batch"]:
    """Return whether each direction (of any length, in camera axes) lies in its BFoV.

    Args:
        bfov: (lon, lat, width, height) in radians.
        direction: Viewing directions.
        tolerance: How far outside, in radians on the sphere, still counts as inside.

    Convention:
        - the border belongs to the region: |lon'| <= width / 2 and |lat'| <= height / 2 in the
          turned camera

    Examples:
        >>> bfov = torch.tensor([3.1, 0.0, 0.4, 0.2])
        >>> behind = direction_from_lonlat(torch.tensor([[-3.1, 0.05], [-3.1, 0.15]]))
        >>> bfov_contains(bfov.expand(2, 4), behind)
        tensor([ True, False])
    """
    turned = direction.unsqueeze(-2) @ camera_from_turned(bfov[..., :2])
    lon, lat = lonlat_from_direction(turned.squeeze(-2)).unbind(-1)
    beside = (lon.abs() - bfov[..., 2] / 2) * lat.cos()
    above = lat.abs() - bfov[..., 3] / 2
    return (beside <= tolerance) & (above <= tolerance)


def bfov_area(bfov: Float[Tensor, "*batch 4"]) -> Float[Tensor, "*batch"]:
    """Return the exact solid angle of each BFoV in steradians, at most 4 pi.

    Convention:
        - width x 2 sin(height / 2), wherever the centre is

    Examples:
        >>> bfov_area(torch.tensor([0.0, 1.0, 2 * torch.pi, torch.pi])) / torch.pi
        tensor(4.)
    """
    return bfov[..., 2] * 2 * (bfov[..., 3] / 2).sin()


def bfov_candidates(
    directions: Float[Tensor, "*batch points 3"],
    valid: Bool[Tensor, "*batch points"] | None = None,
) -> Float[Tensor, "*batch candidates 4"]:
    """Return the BFoVs among which bfov_from_directions chooses, the paper's first.

    Raises:
        ValueError: If a batch entry has no valid point, or a valid one is zero or not finite.

    Examples:
        >>> bfov_candidates(torch.tensor([[0.0, 1.0, 0.0], [0.1, 1.0, 0.1]])).shape
        torch.Size([16, 4])
    """
    weight, directions = _checked_points(directions, valid)
    centres = _starting_centres(directions, weight)
    fits: list[Tensor] = []
    for _ in range(_RECENTRINGS + 1):
        fit, centres = _symmetric_fit(directions, centres)
        fits.append(fit)
    return torch.cat(fits, dim=-2)


def smallest_bfov(candidates: Float[Tensor, "*batch candidates 4"]) -> Float[Tensor, "*batch 4"]:
    """Return the first candidate, or the smallest one if that is at least 1 % smaller.

    Examples:
        >>> smallest_bfov(torch.tensor([[0.0, 0.0, 0.2, 0.2], [0.1, 0.0, 0.2, 0.1]]))
        tensor([0.1000, 0.0000, 0.2000, 0.1000])
    """
    # a margin of a milliradian keeps the order sensible among regions without area
    cost = bfov_area(candidates.detach() + candidates.new_tensor([0.0, 0.0, 1e-3, 1e-3]))
    # the slope lets rounding decide nothing among equals
    slope = torch.linspace(1.01, 1.0101, cost.shape[-1], dtype=cost.dtype, device=cost.device)
    slope[0] = 1.0
    best = (cost * slope).argmin(-1)[..., None, None].expand(*cost.shape[:-1], 1, 4)
    return candidates.gather(-2, best).squeeze(-2)


def _checked_points(
    directions: Float[Tensor, "*batch points 3"], valid: Bool[Tensor, "*batch points"] | None
) -> tuple[Float[Tensor, "*batch points"], Float[Tensor, "*batch points 3"]]:
    """Return the weight of each point (0 or 1) and unit directions, the invalid ones replaced."""
    if valid is None:
        valid = torch.ones(directions.shape[:-1], dtype=torch.bool, device=directions.device)
    missing = ~valid.any(-1)
    if missing.any():
        index = tuple(int(i) for i in missing.nonzero()[0])
        raise ValueError(f"directions: found no valid point in entry {index}, expected one in each")
    # a repeated point changes neither gaps nor extents, so the first valid one fills the holes
    first = valid.int().argmax(-1)[..., None, None].expand(*directions.shape[:-2], 1, 3)
    filled = torch.where(valid[..., None], directions, directions.gather(-2, first))
    length = filled.square().sum(-1, keepdim=True).sqrt()
    bad = ~(length.isfinite() & (length > 0)).squeeze(-1)
    if bad.any():
        found = [float(x) for x in filled[bad][0]]
        raise ValueError(f"directions: found {found}, expected finite numbers, not all zero")
    return valid.to(directions.dtype), filled / length


def _starting_centres(
    directions: Float[Tensor, "*batch points 3"], weight: Float[Tensor, "*batch points"]
) -> Float[Tensor, "*batch starts 2"]:
    """Return the centres from which the fit starts, the paper's first."""
    mean = lonlat_from_direction((directions * weight[..., None]).sum(-2))
    # polar points see every meridian: seen from the mean direction they are in the middle
    turned = directions @ camera_from_turned(mean * mean.new_tensor([1.0, 0.0]))
    lon, lat = _lonlat_from_axes(*turned.unbind(-1))
    lon = wrap_angle(lon + mean[..., :1])
    low, high = lat.amin(-1), lat.amax(-1)
    ordered = lon.sort(-1).values
    gap = torch.cat((ordered[..., 1:], ordered[..., :1] + 2 * math.pi), -1) - ordered
    opposite = ordered + gap / 2 + math.pi
    # of about equal gaps, take the one behind the mean direction: that choice turns with the points
    preference = gap + 1e-2 * (opposite - mean[..., :1]).cos()
    widest = preference.argmax(-1, keepdim=True)
    middle = wrap_angle(opposite.gather(-1, widest).squeeze(-1))
    level = torch.zeros_like(middle)
    pole = torch.where(mean[..., 1] >= 0, level + math.pi / 2, level - math.pi / 2)
    around = [torch.stack((middle, rise), -1) for rise in ((low + high) / 2, level, pole)]
    return torch.stack((around[0], mean, *around[1:]), dim=-2)


def _symmetric_fit(
    directions: Float[Tensor, "*batch points 3"], centre: Float[Tensor, "*batch centres 2"]
) -> tuple[Float[Tensor, "*batch centres 4"], Float[Tensor, "*batch centres 2"]]:
    """Return the smallest BFoV of the points at each centre, and the middle of what it sees."""
    camera = camera_from_turned(centre)
    # (right, forward, up) of all centres in one product, points last: several times faster
    turned = camera.transpose(-1, -2).flatten(-3, -2) @ directions.transpose(-1, -2)
    lon, lat = _lonlat_from_axes(turned[..., 0::3, :], turned[..., 1::3, :], turned[..., 2::3, :])
    low = torch.stack((lon.amin(-1), lat.amin(-1)), -1)
    high = torch.stack((lon.amax(-1), lat.amax(-1)), -1)
    extent = 2 * torch.maximum(-low, high) + 0.0  # no negative zero
    fit = torch.cat((wrap_angle(centre[..., :1]), centre[..., 1:], extent), dim=-1)
    moved = (camera @ direction_from_lonlat((low + high) / 2)[..., None]).squeeze(-1)
    middle = lonlat_from_direction(moved)
    # at a pole lon is only the roll of the camera: noise must not choose it
    steady = moved[..., :2].square().sum(-1, keepdim=True) > 1e-6
    middle_lon = torch.where(steady, middle[..., :1], centre[..., :1])
    return fit, torch.cat((middle_lon, middle[..., 1:]), dim=-1)


def _lonlat_from_axes(
    x: Float[Tensor, "*batch"], y: Float[Tensor, "*batch"], z: Float[Tensor, "*batch"]
) -> tuple[Float[Tensor, "*batch"], Float[Tensor, "*batch"]]:
    """Return lon in [-pi, pi] and lat of unit directions; lon is 0 within rounding of a pole."""
    across = x.square() + y.square()
    polar = across < (16 * torch.finfo(x.dtype).eps) ** 2
    lon = torch.atan2(torch.where(polar, 0.0, x), torch.where(polar, 1.0, y))
    # a floor, so that there is no gradient of sqrt(0)
    return lon, torch.atan2(z, across.clamp_min(1e-30).sqrt())


def _column_span(
    mask: Bool[Tensor, "*batch height width"],
) -> tuple[Float[Tensor, "*batch width"], Float[Tensor, "*batch width"]]:
    """Return where the pixels of each column begin and end, in rows; (height, 0) if empty."""
    height = mask.shape[-2]
    top = torch.full_like(mask[..., 0, :], height, dtype=torch.int32)
    bottom = torch.zeros_like(top)
    # byte arithmetic is several times faster than indices, but counts to 255 only
    for begin in range(0, height, 255):
        block = mask[..., begin : begin + 255, :].to(torch.uint8)
        rows = block.shape[-2]
        count = torch.arange(1, rows + 1, dtype=torch.uint8, device=mask.device)[:, None]
        from_top = (block * count).amax(-2).int()
        from_bottom = (block * count.flip(0)).amax(-2).int()
        bottom = torch.where(from_top > 0, begin + from_top, bottom)
        top = torch.where(from_bottom > 0, torch.minimum(top, begin + rows - from_bottom), top)
    return top.float(), bottom.float()


def _span_directions(
    lon: Float[Tensor, "*batch columns"],
    span: Float[Tensor, "2 *batch columns"],
    occupied: Bool[Tensor, "*batch columns"],
    pole_gap: float,
) -> tuple[Float[Tensor, "*batch points 3"], Bool[Tensor, "*batch points"]]:
    """Return both ends of every column's lat span, then the two poles, and which are occupied.

    A pole has no lon, so a column that reaches it ends pole_gap before, to keep its width.
    """
    ends = span.clamp(pole_gap - math.pi / 2, math.pi / 2 - pole_gap)
    lonlat = torch.stack((torch.cat((lon, lon), -1), torch.cat((ends[0], ends[1]), -1)), -1)
    poles = lon.new_tensor([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]).expand(*lon.shape[:-1], 2, 3)
    polar = ((span != ends) & occupied).any(-1)
    valid = torch.cat((occupied, occupied, polar[0][..., None], polar[1][..., None]), -1)
    return torch.cat((direction_from_lonlat(lonlat), poles), dim=-2), valid


def _grown_over_columns(
    fits: Float[Tensor, "*batch fits 4"],
    lon: Float[Tensor, "*batch columns"],
    span: Float[Tensor, "2 *batch columns"],
    occupied: Bool[Tensor, "*batch columns"],
) -> Float[Tensor, "*batch fits 4"]:
    """Return the fits, grown where a column bulges beyond its two ends.

    Along a meridian lon' is monotone, so the ends decide the width; but |lat'| may peak in
    between, where the meridian passes nearest to the turned pole. That only happens to objects
    that reach far around the sphere. A width within two steps of the full circle is made full.
    """
    lon_low_high = torch.stack((lon, *span)).unsqueeze(-2)
    (cos_lon, *cos_ends), (sin_lon, *sin_ends) = lon_low_high.cos(), lon_low_high.sin()
    centre_sin, centre_cos = (
        fits[..., None, :2].sin().unbind(-1),
        fits[..., None, :2].cos().unbind(-1),
    )
    cos_turn = cos_lon * centre_cos[0] + sin_lon * centre_sin[0]
    sin_turn = sin_lon * centre_cos[0] - cos_lon * centre_sin[0]
    # at lat t of a column sin lat' = centre_cos[1] sin t + across cos t: is its slope zero inside?
    across = -centre_sin[1] * cos_turn
    slopes = [centre_cos[1] * c - across * s for c, s in zip(cos_ends, sin_ends, strict=True)]
    bulging = occupied.unsqueeze(-2) & (slopes[0] * slopes[1] <= 0)
    rest = torch.where(bulging, (centre_sin[1] * sin_turn).abs(), 1.0).amin(-1)  # cos of the peak
    height = torch.maximum(fits[..., 3], 2 * torch.atan2((1 - rest.square()).sqrt(), rest))
    full = fits[..., 2] > 2 * math.pi * (1 - 2 / lon.shape[-1])
    width = torch.where(full, 2 * math.pi, fits[..., 2])
    return torch.stack((fits[..., 0], fits[..., 1], width, height), dim=-1)
