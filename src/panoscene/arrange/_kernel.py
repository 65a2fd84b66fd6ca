"""The gradient of the energy in closed form: every term fused, every scene and pair at once.

``_terms.py`` says what the terms are; a test holds this file against their automatic gradient.
The formulas use only differentiable tensor operations, so that a solve can be unrolled through.

Layout of the tensors: components first, then scenes, subjects (n) and objects (n + m: the
objects and behind them the walls). Places on the floor are complex, x + iy. The gradient of a
symmetric pair term is taken for the subject only; the other half appears when the roles are
exchanged.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np
import torch
from torch import Tensor

from panoscene.arrange._problem import Problem

_CORNER_X = (-1.0, 1.0, 1.0, -1.0)
_CORNER_Y = (-1.0, -1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Kernel:
    """Constants of one problem in the form the fused gradient wants them.

    Arrays of the library ``xp`` (numpy or torch). ``slope`` is the weight of an entry divided by
    beta, ``gain`` the weight times the scale of the term: dE/d(error) = gain min(error slope, 1).
    """

    xp: ModuleType
    stack: Callable[[list[Any]], Any]
    """Join along a new first axis."""
    stack_last: Callable[[list[Any]], Any]
    least: Callable[[Any], Any]
    """Smallest along the first axis."""
    i: Any
    """The imaginary unit, in the precision of the problem."""
    turning: float
    clearance: float
    apart: float
    off_walls: float
    depth: bool
    overlap: bool
    collision_slope: float
    origin: Any
    scale: Any
    start: Any
    camera: Any
    wall_planes: Any
    wall_rows: Any
    axis_weight: Any
    collision_gain: Any
    touching_slope: Any
    touching_gain: Any
    yaw_target: Any
    yaw_slope: Any
    yaw_gain: Any
    farther_slope: Any
    farther_gain: Any
    farther_back_slope: Any
    farther_back: Any
    wall_start: Any
    wall_edge: Any
    wall_scale: Any
    wall_slant: Any
    wall_slope: Any
    wall_gain: Any
    wall_base: Any
    wall_side: Any
    height_offset: Any
    height_z: Any
    height_half: Any
    height_slope: Any
    height_gain: Any
    observation_slope: Any
    observation_gain: Any
    turn: Any
    edge_target: Any
    reprojection_slope: Any
    reprojection_gain: Any
    to_right: Any
    to_front: Any
    plane_side: Any
    up_side: Any
    pitch: Any
    halved: Any
    lowest: Any
    corner_base: Any
    footprint_base: Any
    low_high: Any
    zero: Any
    one: Any
    smallest: Any
    least_allowed: Any
    most_allowed: Any
    pace: Any
    """Part of a step that each object goes."""

    def numpy(self) -> "Kernel":
        """Return the same constants as numpy arrays that share the memory."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        arrays = {
            name: value.detach().numpy() if isinstance(value, Tensor) else value
            for name, value in values.items()
        }
        library: dict[str, Any] = {
            "xp": np,
            "stack": np.array,
            "stack_last": _stack_last,
            "least": np.minimum.reduce,
        }
        return Kernel(**(arrays | library))


def _stack_last(rows: list[Any]) -> Any:
    return np.array(rows).transpose(1, 2, 0)


def make_kernel(problem: Problem) -> Kernel:
    """Return the constants of the fused gradient."""
    batch, settings, conf, scale = (
        problem.batch,
        problem.settings,
        problem.confidence,
        problem.scale,
    )
    beta = problem.beta
    one = batch.boxes.centre.new_ones(())

    def pair(name: str, weight: Tensor) -> Tensor:
        return scale[name][:, None, None] * weight

    def single(name: str, weight: Tensor) -> Tensor:
        return scale[name][:, None] * weight

    walls = batch.walls
    right = torch.polar(torch.ones_like(walls.yaw), walls.yaw)
    wall_half = (walls.size / 2).unbind(-1)
    imaginary = torch.complex(one * 0, one)
    no_wall = torch.zeros_like(conf.touching_wall)
    back = conf.relative_yaw.transpose(-1, -2)
    yaw_weight = torch.stack(
        [
            torch.cat([conf.relative_yaw, conf.relative_yaw_wall], -1),
            torch.cat([back, no_wall], -1),
        ]
    )
    yaw_scale = torch.cat(
        [pair("relative_yaw", torch.ones_like(back)), pair("relative_yaw_wall", no_wall + 1)], -1
    )
    yaw_target = torch.stack(
        [
            torch.cat([problem.yaw_target, problem.yaw_target_wall], -1),
            torch.cat([-problem.yaw_target.transpose(-1, -2), no_wall], -1),
        ]
    )
    touching = torch.cat([conf.touching, conf.touching_wall], -1)
    touching_scale = torch.cat(
        [pair("touching", 2 * torch.ones_like(back)), pair("touching_wall", no_wall + 1)], -1
    )
    farther, nearer = conf.farther_than, conf.farther_than.transpose(-1, -2)
    # corners: eight in the paper, of which the upper and lower four share their place
    corner = torch.complex(*batch.polygon.unbind(-1))[:, None, None, :]
    edge = torch.roll(corner, -1, dims=-1) - corner
    floor, ceiling = batch.floor_height[:, None], batch.ceiling_height[:, None]
    corners = 4.0 if settings.reduction == "mean" else 1.0
    other = 4.0 if settings.reduction == "mean" else 0.0
    valid = conf.valid
    height_weight = torch.stack([valid, valid, conf.on_floor, conf.under_ceiling, valid, valid])
    height_scale = torch.stack(
        [
            corners * single("floor_collision", valid),
            corners * single("ceiling_collision", valid),
            single("on_floor", valid),
            single("under_ceiling", valid),
            other * single("floor_collision", valid),
            other * single("ceiling_collision", valid),
        ]
    )
    floor, ceiling = floor * valid, ceiling * valid
    observation = torch.stack(
        [conf.direction, conf.direction, conf.distance, conf.yaw, conf.size, conf.size, conf.size]
    )
    observation_scale = torch.stack(
        [
            single("direction", valid),
            single("direction", valid),
            single("distance", valid),
            single("yaw", valid),
            *[single("size", valid)] * 3,
        ]
    )
    lon, lat, wide, tall = batch.bfov.unbind(-1)
    bits = torch.arange(8, device=one.device)
    table = torch.tensor([_CORNER_X, _CORNER_Y], dtype=one.dtype, device=one.device)
    side_x, side_y = table[0][bits % 4], table[1][bits % 4]
    endless = torch.full_like(problem.start[:4], math.inf)
    bounds = -endless[:3], endless[:3]
    if math.isfinite(settings.size_range):
        bounds = problem.start[4:] / settings.size_range, problem.start[4:] * settings.size_range
    scenes, n = batch.valid.shape
    near = settings.clearance / 2
    m = batch.polygon.shape[1]
    count = torch.arange(scenes * n * 4, device=one.device)
    return Kernel(
        xp=torch,
        stack=torch.stack,
        stack_last=partial(torch.stack, dim=-1),
        least=partial(torch.amin, dim=0),
        i=imaginary,
        origin=problem.direction_origin,
        scale=problem.direction_scale,
        start=problem.start,
        camera=batch.camera_height[:, None],
        turning=1.0 if problem.view_relative else 0.0,
        wall_planes=torch.stack([torch.complex(*walls.centre.unbind(-1)[:2]), right]),
        wall_rows=torch.stack([walls.centre[..., 2], *wall_half, walls.yaw]),
        axis_weight=settings.axis_weight * one.new_tensor([1, 1, 1, 1, 2]).view(5, 1, 1, 1),
        clearance=settings.clearance,
        apart=problem.apart,
        off_walls=problem.off_walls,
        depth=settings.collision == "depth",
        collision_slope=1 / beta,
        collision_gain=torch.cat([2 * pair("object_collision", conf.object_pair), no_wall], -1),
        touching_slope=touching / beta,
        touching_gain=touching_scale * touching,
        yaw_target=yaw_target,
        yaw_slope=yaw_weight / beta,
        yaw_gain=yaw_scale * yaw_weight,
        farther_slope=farther / beta,
        farther_gain=pair("farther_than", farther),
        farther_back_slope=nearer / beta,
        farther_back=pair("farther_than", nearer),
        wall_start=corner,
        wall_edge=edge,
        wall_scale=edge.conj().resolve_conj() / (edge * edge.conj()).real.clamp(min=1e-12),
        wall_slant=edge.real / torch.where(edge.imag.abs() < 1e-12, one, edge.imag),
        wall_slope=(conf.inside_room / beta)[..., None],
        wall_gain=(2 * single("wall_collision", conf.inside_room))[..., None],
        height_offset=torch.stack(
            [
                *(floor + near, near - ceiling),
                *(-floor - settings.clearance, ceiling - settings.clearance),
                *(floor + near, near - ceiling),
            ]
        ),
        height_z=one.new_tensor([-1, 1, 1, -1, -1, 1]).view(6, 1, 1),
        height_half=one.new_tensor([1, 1, -1, -1, -1, -1]).view(6, 1, 1),
        height_slope=height_weight / beta,
        height_gain=height_scale * height_weight,
        observation_slope=observation / problem.beta,
        observation_gain=observation_scale * observation,
        turn=torch.polar(torch.ones_like(lon), lon),
        pitch=torch.polar(torch.ones_like(lat), -lat),
        edge_target=torch.stack([wide, -wide, tall, -tall], -1) / 2,
        reprojection_gain=single("reprojection", conf.reprojection)[..., None],
        reprojection_slope=(conf.reprojection / problem.beta)[..., None],
        overlap=settings.projection == "iou",
        to_right=side_x[:4],
        to_front=side_y[:4] * imaginary,
        plane_side=torch.complex(side_x, side_y),
        up_side=torch.where(bits < 4, -one, one),
        halved=one.new_tensor([1, 1, 1, 1, 0.5, 0.5, 0.5]).view(7, 1, 1),
        lowest=torch.cat([-endless, problem.smallest]),
        wall_base=(count * m).view(scenes, n, 4),
        wall_side=torch.complex(side_x, side_y)[:4].expand(scenes, n, 4),
        corner_base=(count[: scenes * n] * 8).view(scenes, n, 1),
        footprint_base=(count[: scenes * n] * 4).view(scenes, n, 1),
        low_high=one.new_tensor([-1, 1]),
        zero=one * 0,
        one=one,
        smallest=problem.smallest,
        least_allowed=torch.cat([-endless, bounds[0]]),
        most_allowed=torch.cat([endless, bounds[1]]),
        pace=problem.pace,
    )
