"""The fused gradient: view parameters to boxes, forces on the boxes, and the chain rule back.

One set of formulas for two array libraries: ``k.xp`` is numpy on the CPU, where the cost of a small
scene is the number of operations, and torch on other devices and for unrolling (every operation
here is differentiable). Only names that both libraries share are used.

The floor plane is the complex plane, x + iy: the right side of a box points to e^(i yaw), a turn is
a product, and the footprint is centre + e^(i yaw) (+-half x +- i half y).
"""

import math
from typing import Any, NamedTuple

from panoscene.arrange._kernel import Kernel
from panoscene.arrange._terms import BEHIND

# a numpy array or a torch tensor; both have the operators and methods used here
Array = Any


class _Boxes(NamedTuple):
    """Boxes as the terms want them, "scenes n" each."""

    place: Array
    """Centre on the floor plane, complex."""
    right: Array
    """Unit vector of the right side, complex."""
    z: Array
    half_x: Array
    half_y: Array
    half_z: Array
    yaw: Array
    corner: Array
    """Footprint corners about the centre in the box's own frame, complex, "scenes n 4"."""


class _Slope(NamedTuple):
    """dE/d(box), "scenes n" each; ``plane`` is complex, dE/dx + i dE/dy."""

    plane: Array
    z: Array
    half_x: Array
    half_y: Array
    half_z: Array
    yaw: Array


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
    ahead = sin_lon + k.i * cos_lon
    distance = x[2]
    level = distance * cos_lat
    half = xp.maximum(x[4:], k.smallest) * 0.5
    half_x, half_y, half_z = half
    corner = half_x[..., None] * k.to_right + half_y[..., None] * k.to_front
    z = k.camera + distance * sin_lat
    box = _Boxes(level * ahead, cos + k.i * sin, z, half_x, half_y, half_z, yaw, corner)
    corners = _corner_slope(box, k)
    pairs, farther = _pair_slope(box, distance, k)
    rise, grow = _height_slope(box, k)
    plane, up = corners.plane + pairs.plane, corners.z + pairs.z + rise
    turn = corners.yaw + pairs.yaw
    # in the floor plane: along the line of sight, and across it
    seen = plane * ahead.conj()
    along = seen.real
    out = k.stack(
        [
            (-level * seen.imag - k.turning * turn) * k.scale[0],
            distance * (up * cos_lat - sin_lat * along) * k.scale[1],
            along * cos_lat + up * sin_lat + farther,
            -turn,
            corners.half_x + pairs.half_x,
            corners.half_y + pairs.half_y,
            corners.half_z + pairs.half_z + grow,
        ]
    )
    # a size is twice the half, and stands still at its floor
    out = out * k.halved * (x >= k.lowest)
    away = (x - k.start) * k.observation_slope
    return out + xp.maximum(xp.minimum(away, k.one), -k.one) * k.observation_gain


def _corner_slope(box: _Boxes, k: Kernel) -> _Slope:
    """Return dE/d(box) of the terms that act on corners: walls [wc] and image [bp]."""
    xp = k.xp
    at_image, lift, corner = _image_force(box, k)
    force = xp.concatenate([_wall_force(box, k), at_image], -1)
    side = xp.concatenate([k.wall_side, k.plane_side[corner]], -1)
    own = force * box.right.conj()[..., None]
    right, front = own.real, own.imag
    to_right, to_front = side.real, side.imag
    yaw = (front * to_right).sum(-1) * box.half_x - (right * to_front).sum(-1) * box.half_y
    return _Slope(
        force.sum(-1),
        lift.sum(-1),
        (right * to_right).sum(-1),
        (front * to_front).sum(-1),
        (lift * k.up_side[corner]).sum(-1),
        yaw,
    )


def _wall_force(box: _Boxes, k: Kernel) -> Array:
    """Return dE/d(footprint corner) of the wall collision [wc], complex "scenes n 4"."""
    xp = k.xp
    corner = box.place[..., None] + box.right[..., None] * box.corner
    offset = corner[..., None] - k.wall_start
    along = (offset * k.wall_scale).real
    away = offset - xp.maximum(xp.minimum(along, k.one), k.zero) * k.wall_edge
    squared = away.real * away.real + away.imag * away.imag
    nearest = k.wall_base + squared.argmin(-1)
    level = offset.imag
    crossed = ((level < 0) != (level < k.wall_edge.imag)) & (offset.real < level * k.wall_slant)
    sign = xp.where(crossed.sum(-1) % 2 == 1, -k.one, k.one)
    distance = xp.sqrt(squared.reshape(-1)[nearest] + 1e-18)
    error = xp.maximum(distance * sign + k.off_walls, k.zero)
    push = k.wall_gain * xp.minimum(error * k.wall_slope, k.one) * sign / distance
    return away.reshape(-1)[nearest] * push


def _image_force(box: _Boxes, k: Kernel) -> tuple[Array, Array, Array]:
    """Return the reprojection's dE/d(corner) for the four corners that bound the view [bp].

    In the floor plane (complex) and upwards, and which of the eight corners; "scenes n 4" each.
    """
    xp = k.xp
    at = (box.place * k.turn)[..., None] + (box.right * k.turn)[..., None] * box.corner
    aside = at.real
    z = (box.z - k.camera)[..., None] + box.half_z[..., None] * k.low_high
    # forward and up of the camera that is turned to the BFoV's centre
    tilted = (at.imag[..., None, :] + k.i * z[..., None]) * k.pitch[..., None, None]
    forward, up = tilted.real, tilted.imag
    squared = (aside * aside)[..., None, :] + forward * forward + 1e-12
    shape = (*box.z.shape, 8)
    lon = xp.arctan2(aside[..., None, :], forward).reshape(shape)
    lat = xp.arctan2(up, xp.sqrt(squared)).reshape(shape)
    # order: lon high, lon low, lat high, lat low
    corner = k.stack_last([lon.argmax(-1), lon.argmin(-1), lat.argmax(-1), lat.argmin(-1)])
    place = k.corner_base + corner
    lon_edge = lon.reshape(-1)[place[..., :2]]
    edge = xp.concatenate([lon_edge, lat.reshape(-1)[place[..., 2:]]], -1)
    seen = (xp.abs(lon_edge) < BEHIND).all(-1)[..., None]
    slope = _rectangle_slope(edge, k) * seen
    bound = tilted.reshape(-1)[place]
    bound_plane = aside.reshape(-1)[k.footprint_base + corner % 4] + k.i * bound.real
    squared = squared.reshape(-1)[place]
    wide, tall = squared[..., :2], squared[..., 2:]
    height = bound.imag[..., 2:]
    by_lat = slope[..., 2:] / (xp.sqrt(tall) * (tall + height * height))
    # lon: (forward, -aside, 0) / squared; lat: (-up aside, -up forward, squared) / (level r^2)
    factor = xp.concatenate([-k.i * (slope[..., :2] / wide), -by_lat * height], -1)
    lift = xp.concatenate([xp.zeros_like(wide), by_lat * tall], -1)
    force = factor * bound_plane
    upright = (force.imag + k.i * lift) * k.pitch.conj()[..., None]
    plane = (force.real + k.i * upright.real) * k.turn.conj()[..., None]
    return plane, upright.imag, corner


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


def _height_slope(box: _Boxes, k: Kernel) -> tuple[Array, Array]:
    """Return rows (z, half z) of the floor and ceiling terms [fc, cc, fa, ca]."""
    xp = k.xp
    error = xp.maximum(k.height_offset + k.height_z * box.z + k.height_half * box.half_z, k.zero)
    push = k.height_gain * xp.minimum(error * k.height_slope, k.one)
    return (push * k.height_z).sum(0), (push * k.height_half).sum(0)


def _pair_slope(box: _Boxes, distance: Array, k: Kernel) -> tuple[_Slope, Array]:
    """Return dE/d(box) of the pair terms [oc, oa, rr], and dE/d(distance) of [rd]."""
    xp = k.xp
    plane = xp.concatenate([k.stack([box.place, box.right]), k.wall_planes], -1)[:, :, None]
    rows = [box.z, box.half_x, box.half_y, box.half_z, box.yaw]
    z, wide, deep, tall, yaw = xp.concatenate([k.stack(rows), k.wall_rows], -1)[:, :, None]
    place, right = plane
    own_z, own_wide, own_deep, own_tall, own_yaw = (row[..., None] for row in rows)
    back = box.right.conj()[..., None]
    gap, up = place - box.place[..., None], z - own_z
    own, other, turn = gap * back, gap * right.conj(), right * back
    cos, sin = turn.real, turn.imag
    by_cos, by_sin = xp.abs(cos), xp.abs(sin)
    margin = k.stack(
        [
            own_wide + by_cos * wide + by_sin * deep - xp.abs(own.real),
            own_deep + by_sin * wide + by_cos * deep - xp.abs(own.imag),
            wide + by_cos * own_wide + by_sin * own_deep - xp.abs(other.real),
            deep + by_sin * own_wide + by_cos * own_deep - xp.abs(other.imag),
            own_tall + tall - xp.abs(up),
        ]
    )
    push = _collision_push(margin, k) - _touching_push(margin, k)
    p0, p1, p2, p3, lift = push
    slide = p0 * xp.sign(own.real) + k.i * (p1 * xp.sign(own.imag))
    slide_other = p2 * xp.sign(other.real) + k.i * (p3 * xp.sign(other.imag))
    by_turn = (
        xp.sign(cos) * sin * (p0 * wide + p1 * deep + p2 * own_wide + p3 * own_deep)
        - xp.sign(sin) * cos * (p0 * deep + p1 * wide + p2 * own_deep + p3 * own_wide)
        + (slide * own.conj()).imag
        + _yaw_push(own_yaw, yaw, k)
    )
    slope = _Slope(
        slide.sum(-1) * box.right + (slide_other * right).sum(-1),
        (lift * xp.sign(up)).sum(-1),
        (p0 + p2 * by_cos + p3 * by_sin).sum(-1),
        (p1 + p2 * by_sin + p3 * by_cos).sum(-1),
        lift.sum(-1),
        by_turn.sum(-1),
    )
    nearer = distance[..., None, :] - distance[..., None]
    farther = k.farther_back * xp.minimum(xp.maximum(-nearer, k.zero) * k.farther_back_slope, k.one)
    nearer = k.farther_gain * xp.minimum(xp.maximum(nearer, k.zero) * k.farther_slope, k.one)
    return slope, (farther - nearer).sum(-1)


def _collision_push(margin: Array, k: Kernel) -> Array:
    """Return dE/d(margin) of the object-object collision, "5 scenes n m"."""
    xp = k.xp
    least = k.least(margin)
    if k.depth:
        error = xp.maximum(least + k.apart, k.zero)
        push = k.collision_gain * xp.minimum(error * k.collision_slope, k.one)
        return (margin == least) * push
    margin = margin + k.apart
    error = (margin * k.axis_weight).sum(0) * (least + k.apart > 0)
    push = k.collision_gain * xp.minimum(error * k.collision_slope, k.one)
    return push * k.axis_weight


def _touching_push(margin: Array, k: Kernel) -> Array:
    """Return -dE/d(margin) of the contact relations, "5 scenes n m"."""
    xp = k.xp
    apart = xp.maximum(-k.clearance - margin, k.zero) * k.axis_weight
    push = k.touching_gain * xp.minimum(apart.sum(0) * k.touching_slope, k.one)
    return xp.sign(apart) * k.axis_weight * push


def _yaw_push(yaw: Array, other: Array, k: Kernel) -> Array:
    """Return dE/d(yaw of the subject) of the relative yaws, "scenes n m"."""
    xp = k.xp
    off = other - yaw - k.yaw_target
    off = off - xp.round(off * (1 / (2 * math.pi))) * (2 * math.pi)
    return -(k.yaw_gain * xp.maximum(xp.minimum(off * k.yaw_slope, k.one), -k.one)).sum(0)
