"""The fused gradient: view parameters to boxes, forces on the boxes, and the chain rule back.

One set of formulas for two array libraries: ``k.xp`` is numpy for small scenes on the CPU, where
the cost is the number of operations, and torch for large batches, other devices, and for
unrolling (every operation here is differentiable). Only names that both libraries share are used.

Rows of a box: x, y, z, cos, -sin, sin, cos, half x, half y, half y, half x, half z, yaw; in this
order the axes and the half sizes, plain and exchanged, are slices.
"""

import math
from typing import Any

from panoscene.arrange._kernel import Kernel
from panoscene.arrange._terms import BEHIND

# a numpy array or a torch tensor; both have the operators and methods used here
Array = Any


def energy_gradient(x: Array, k: Kernel) -> Array:
    """Return dE/dx of the variables, "7 scenes n".

    Args:
        x: direction (2), distance, yaw and size (3) in the units of the problem, "7 scenes n".
        k: constants of the problem.
    """
    xp = k.xp
    lonlat = k.origin + k.scale * x[:2]
    yaw = -x[3] - k.turning * lonlat[0]
    angle = xp.concatenate([lonlat, yaw[None]])
    sin_lon, sin_lat, sin = xp.sin(angle)
    cos_lon, cos_lat, cos = xp.cos(angle)
    distance = x[2]
    level = distance * cos_lat
    at_x, at_y = level * sin_lon, level * cos_lon
    half_x, half_y, half_z = xp.maximum(x[4:], k.smallest) * 0.5
    box = xp.stack(
        [
            *[at_x, at_y, k.camera + distance * sin_lat],
            *[cos, -sin, sin, cos],
            *[half_x, half_y, half_y, half_x, half_z, yaw],
        ]
    )
    force, side = _corner_forces(box, k)
    by_x, by_y, by_z, by_half_x, by_half_y, by_half_z, by_yaw = _box_gradient(force, side, box)
    pair_xy, pair_z, pair_half, pair_half_z, pair_yaw, farther = _pair_gradient(box, distance, k)
    rise, grow = _height_gradient(box, k)
    by_x, by_y, by_z = by_x + pair_xy[0], by_y + pair_xy[1], by_z + pair_z + rise
    by_yaw = by_yaw + pair_yaw
    along = by_x * sin_lon + by_y * cos_lon
    out = xp.stack(
        [
            (by_x * at_y - by_y * at_x - k.turning * by_yaw) * k.scale[0],
            distance * (by_z * cos_lat - sin_lat * along) * k.scale[1],
            along * cos_lat + by_z * sin_lat + farther,
            -by_yaw,
            0.5 * (by_half_x + pair_half[0]) * (x[4] > k.smallest),
            0.5 * (by_half_y + pair_half[1]) * (x[5] > k.smallest),
            0.5 * (by_half_z + pair_half_z + grow) * (x[6] > k.smallest),
        ]
    )
    away = (x - k.start) * k.observation_slope
    return out + xp.maximum(xp.minimum(away, k.one), -k.one) * k.observation_gain


def _box_gradient(force: Array, side: Array, box: Array) -> Array:
    """Return rows (x, y, z, half x, half y, half z, yaw) of forces on corners.

    ``force`` is dE/d(corner), ``side`` which corner as signs of right, front and up; both
    "3 scenes n points".
    """
    cos, sin = box[3][..., None], box[5][..., None]
    right = force[0] * cos + force[1] * sin
    front = force[1] * cos - force[0] * sin
    x, y, z = force.sum(-1)
    half_x, half_y = (right * side[0]).sum(-1), (front * side[1]).sum(-1)
    half_z = (force[2] * side[2]).sum(-1)
    yaw = (front * side[0]).sum(-1) * box[7] - (right * side[1]).sum(-1) * box[8]
    return x, y, z, half_x, half_y, half_z, yaw


def _corner_forces(box: Array, k: Kernel) -> tuple[Array, Array]:
    """Return the forces of walls and image on box corners, and which corners they act on."""
    at_wall, wall_side = _wall_force(box, k)
    at_image, image_side = _image_force(box, k)
    return (
        k.xp.concatenate([at_wall, at_image], -1),
        k.xp.concatenate([wall_side, image_side], -1),
    )


def _footprint(
    centre: tuple[Array, Array], axis: tuple[Array, Array], box: Array, k: Kernel
) -> tuple[Array, Array]:
    """Return the footprint corners, x and y each "scenes n 4", counter-clockwise.

    ``axis`` is the cos and sin of the box's right side in the frame of ``centre``.
    """
    (x, y), (cos, sin) = centre, axis
    right_x, right_y = (cos * box[7])[..., None], (sin * box[7])[..., None]
    front_x, front_y = (sin * box[8])[..., None], (cos * box[8])[..., None]
    to_right, to_front = k.corner_sign[0, :4], k.corner_sign[1, :4]
    return (
        x[..., None] + right_x * to_right - front_x * to_front,
        y[..., None] + right_y * to_right + front_y * to_front,
    )


def _wall_force(box: Array, k: Kernel) -> tuple[Array, Array]:
    """Return dE/d(corner) of the wall collision [wc] for the footprint corners."""
    xp = k.xp
    corner_x, corner_y = _footprint((box[0], box[1]), (box[3], box[5]), box, k)
    start_x, start_y, edge_x, edge_y, inverse, slant = k.edge
    from_x = corner_x[..., None] - start_x
    from_y = corner_y[..., None] - start_y
    along = (from_x * edge_x + from_y * edge_y) * inverse
    along = xp.maximum(xp.minimum(along, k.one), k.zero)
    away_x, away_y = from_x - along * edge_x, from_y - along * edge_y
    squared = away_x * away_x + away_y * away_y
    nearest = k.wall_base + squared.argmin(-1)
    crossed = ((from_y < 0) != (from_y < edge_y)) & (from_x < from_y * slant)
    sign = xp.where(crossed.sum(-1) % 2 == 1, -k.one, k.one)
    distance = xp.sqrt(squared.reshape(-1)[nearest] + 1e-18)
    error = xp.maximum(distance * sign + k.clearance / 2, k.zero)
    push = k.wall_gain * xp.minimum(error * k.wall_slope, k.one) * (sign / distance)
    force_x = away_x.reshape(-1)[nearest] * push
    force_y = away_y.reshape(-1)[nearest] * push
    return xp.stack([force_x, force_y, xp.zeros_like(push)]), k.wall_side


def _image_force(box: Array, k: Kernel) -> tuple[Array, Array]:
    """Return dE/d(corner) of the reprojection [bp] for the four corners that bound the view."""
    xp = k.xp
    sin_lon, cos_lon, sin_lat, cos_lat = k.turn
    axis = box[3] * cos_lon - box[5] * sin_lon, box[5] * cos_lon + box[3] * sin_lon
    centre = box[0] * cos_lon - box[1] * sin_lon, box[0] * sin_lon + box[1] * cos_lon
    x, y = _footprint(centre, axis, box, k)
    z0 = box[2] - k.camera
    x, y = x[..., None, :], y[..., None, :]
    z = (z0[..., None] + box[11][..., None] * k.low_high)[..., None]
    sin_lat, cos_lat = sin_lat[..., None, None], cos_lat[..., None, None]
    forward, up = y * cos_lat + z * sin_lat, z * cos_lat - y * sin_lat
    level = xp.sqrt(x * x + forward * forward + 1e-12)
    shape = (*box.shape[1:], 8)
    lon = xp.arctan2(x + 0 * forward, forward).reshape(shape)
    lat = xp.arctan2(up, level).reshape(shape)
    # order: lon high, lon low, lat high, lat low
    corner = xp.stack([lon.argmax(-1), lon.argmin(-1), lat.argmax(-1), lat.argmin(-1)], -1)
    place = k.corner_base + corner
    wide, tall = place[..., :2], place[..., 2:]
    lon_edge, lat_edge = lon.reshape(-1)[wide], lat.reshape(-1)[tall]
    edge = xp.concatenate([lon_edge, lat_edge], -1)
    seen = (xp.abs(lon_edge) < BEHIND).all(-1)[..., None]
    slope = _rectangle_slope(edge, k) * seen
    tx = x.reshape(-1)[k.footprint_base + corner % 4]
    ty, tz = forward.reshape(-1)[place], up.reshape(-1)[place]
    squared = tx * tx + ty * ty + 1e-12
    # lon: (ty, -tx, 0) / squared; lat: (-tz tx, -tz ty, squared) / (level (squared + tz^2))
    by_lon = slope[..., :2] / squared[..., :2]
    flat = squared[..., 2:]
    by_lat = slope[..., 2:] / (xp.sqrt(flat) * (flat + tz[..., 2:] * tz[..., 2:]))
    tilt = by_lat * tz[..., 2:]
    fx = xp.concatenate([by_lon * ty[..., :2], -tilt * tx[..., 2:]], -1)
    fy = xp.concatenate([-by_lon * tx[..., :2], -tilt * ty[..., 2:]], -1)
    fz = xp.concatenate([xp.zeros_like(by_lon), by_lat * flat], -1)
    sin_lat, cos_lat = sin_lat[..., 0], cos_lat[..., 0]
    ahead, rise = fy * cos_lat - fz * sin_lat, fy * sin_lat + fz * cos_lat
    sin_lon, cos_lon = sin_lon[..., None], cos_lon[..., None]
    force = xp.stack([fx * cos_lon + ahead * sin_lon, ahead * cos_lon - fx * sin_lon, rise])
    return force, k.corner_sign[:, corner]


def _rectangle_slope(edge: Array, k: Kernel) -> Array:
    """Return dE/d(edge) for (right, left, top, bottom) of the projected rectangle."""
    xp = k.xp
    if not k.overlap:
        error = (edge - k.edge_target) * k.reprojection_slope
        return k.reprojection_gain * xp.maximum(xp.minimum(error, k.one), -k.one)
    high, low = edge[..., 0::2], edge[..., 1::2]
    target_high, target_low = k.edge_target[..., 0::2], k.edge_target[..., 1::2]
    inner = xp.maximum(xp.minimum(high, target_high) - xp.maximum(low, target_low), k.zero)
    outer = high - low
    common = (inner[..., 0] * inner[..., 1])[..., None]
    target = target_high - target_low
    whole = (outer[..., 0] * outer[..., 1] + target[..., 0] * target[..., 1])[..., None] - common
    # e = 1 - common / whole, and whole loses what common gains
    by_inner = -(whole + common) / (whole * whole) * xp.flip(inner, (-1,)) * (common > 0)
    by_extent = common / (whole * whole) * xp.flip(outer, (-1,))
    at_high = by_inner * (high < target_high) + by_extent
    at_low = -by_inner * (low > target_low) - by_extent
    error = 1 - common / whole
    gain = k.reprojection_gain * xp.minimum(error * k.reprojection_slope, k.one)
    return gain * xp.stack([at_high, at_low], -1).reshape(edge.shape)


def _height_gradient(box: Array, k: Kernel) -> tuple[Array, Array]:
    """Return rows (z, half z) of the floor and ceiling terms [fc, cc, fa, ca]."""
    xp = k.xp
    error = xp.maximum(k.height_offset + k.height_z * box[2] + k.height_half * box[11], k.zero)
    push = k.height_gain * xp.minimum(error * k.height_slope, k.one)
    return (push * k.height_z).sum(0), (push * k.height_half).sum(0)


def _pair_gradient(box: Array, distance: Array, k: Kernel) -> tuple[Array, ...]:
    """Return rows (xy, z, half xy, half z, yaw) of [oc, oa, rr], and dE/d(distance) of [rd]."""
    xp = k.xp
    subject = box[..., None]
    other = xp.concatenate([box, k.walls], -1)[:, :, None, :]
    gap_x, gap_y, gap_z = other[:3] - subject[:3]
    own_half, own_swapped = subject[7:9], subject[9:11]
    half, swapped = other[7:9], other[9:11]
    along_own = subject[3:5] * gap_x + subject[5:7] * gap_y
    along_other = other[3:5] * gap_x + other[5:7] * gap_y
    # cos of the relative yaw, and minus its sin
    turn = subject[3] * other[3:5] + subject[5] * other[5:7]
    by_cos, by_sin = xp.abs(turn)
    margin = xp.concatenate(
        [
            own_half + by_cos * half + by_sin * swapped - xp.abs(along_own),
            half + by_cos * own_half + by_sin * own_swapped - xp.abs(along_other),
            (subject[11] + other[11] - xp.abs(gap_z))[None],
        ]
    )
    push = _collision_push(margin, k) + _touching_push(margin, k)
    own, others, up = push[:2], push[2:4], push[4]
    slide, slide_other = own * xp.sign(along_own), others * xp.sign(along_other)
    sign = xp.sign(turn)
    yaw = (
        sign[1] * turn[0] * (own * swapped + others * own_swapped).sum(0)
        - sign[0] * turn[1] * (own * half + others * own_half).sum(0)
        - slide[0] * along_own[1]
        + slide[1] * along_own[0]
        + _yaw_push(subject[12], other[12], k)
    ).sum(-1)
    along_x, along_y = slide.sum(-1)
    by_x = along_x * box[3] + along_y * box[4] + (slide_other * other[3:5]).sum(0).sum(-1)
    by_y = along_x * box[5] + along_y * box[6] + (slide_other * other[5:7]).sum(0).sum(-1)
    straight, crosswise = (others * by_cos).sum(-1), (others * by_sin).sum(-1)
    wide, deep = own.sum(-1)
    by_half = (wide + straight[0] + crosswise[1], deep + straight[1] + crosswise[0])
    nearer = distance[..., None, :] - distance[..., None]
    farther = k.farther_back * xp.minimum(xp.maximum(-nearer, k.zero) * k.farther_back_slope, k.one)
    nearer = k.farther_gain * xp.minimum(xp.maximum(nearer, k.zero) * k.farther_slope, k.one)
    return (
        (by_x, by_y),
        (up * xp.sign(gap_z)).sum(-1),
        by_half,
        up.sum(-1),
        yaw,
        (farther - nearer).sum(-1),
    )


def _collision_push(margin: Array, k: Kernel) -> Array:
    """Return dE/d(margin) of the object-object collision, "5 scenes n m"."""
    xp = k.xp
    margin = margin + k.clearance
    least = xp.amin(margin, 0)
    if k.depth:
        error = xp.maximum(least, k.zero)
        push = k.collision_gain * xp.minimum(error * k.collision_slope, k.one)
        return (margin == least) * push
    error = (margin * k.axis_weight).sum(0) * (least > 0)
    push = k.collision_gain * xp.minimum(error * k.collision_slope, k.one)
    return push * k.axis_weight


def _touching_push(margin: Array, k: Kernel) -> Array:
    """Return dE/d(margin) of the contact relations, "5 scenes n m"."""
    xp = k.xp
    gap = -margin - k.clearance
    apart = xp.maximum(gap, k.zero) * k.axis_weight
    push = k.touching_gain * xp.minimum(apart.sum(0) * k.touching_slope, k.one)
    return -push * k.axis_weight * (gap > 0)


def _yaw_push(yaw: Array, other: Array, k: Kernel) -> Array:
    """Return dE/d(yaw of the subject) of the relative yaws, "scenes n m"."""
    xp = k.xp
    off = other - yaw - k.yaw_target
    off = off - xp.round(off * (1 / (2 * math.pi))) * (2 * math.pi)
    return -(k.yaw_gain * xp.maximum(xp.minimum(off * k.yaw_slope, k.one), -k.one)).sum(0)
