"""What one solve keeps constant: variables' units, weights and targets as tensors."""

import math
from dataclasses import dataclass, fields, replace
from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.arrange._batch import ArrangementBatch
from panoscene.arrange._settings import TERM_NAMES, ArrangementSettings
from panoscene.geometry import OrientedBoxes, wrap_angle

SMALLEST_SIZE = 0.01
"""Metres below which no size may shrink; a box that is thinner keeps at least what it has."""
SMALLEST_BETA = 1e-9
"""Stands for the plain absolute error."""
PIXEL_WIDTH = 1024
"""Width of the panorama in whose pixels the release measures directions."""
WIDEST_BFOV = 2.6
"""Radians; the rectangle of a wider object says nothing, so it is not compared."""


@dataclass(frozen=True, slots=True)
class Confidence:
    """How much every entry of a term counts, in [0, 1]; 0 on padding and diagonals."""

    object_pair: Float[Tensor, "scenes n n"]
    inside_room: Float[Tensor, "scenes n"]
    touching: Float[Tensor, "scenes n n"]
    touching_wall: Float[Tensor, "scenes n m"]
    on_floor: Float[Tensor, "scenes n"]
    under_ceiling: Float[Tensor, "scenes n"]
    farther_than: Float[Tensor, "scenes n n"]
    relative_yaw: Float[Tensor, "scenes n n"]
    relative_yaw_wall: Float[Tensor, "scenes n m"]
    valid: Float[Tensor, "scenes n"]
    direction: Float[Tensor, "scenes n"]
    distance: Float[Tensor, "scenes n"]
    size: Float[Tensor, "scenes n"]
    yaw: Float[Tensor, "scenes n"]
    reprojection: Float[Tensor, "scenes n"]


@dataclass(frozen=True, slots=True)
class Problem:
    """One batch under one setting, ready for the terms and the solver."""

    batch: ArrangementBatch
    settings: ArrangementSettings
    weights: Float[Tensor, " terms"]
    scale: dict[str, Float[Tensor, " scenes"]]
    """Weight of a term divided by its number of entries where the reduction is a mean."""
    confidence: Confidence
    yaw_target: Float[Tensor, "scenes n n"]
    yaw_target_wall: Float[Tensor, "scenes n m"]
    start: Float[Tensor, "7 scenes n"]
    """Start values of direction (2), distance, view-relative yaw, size (3)."""
    direction_scale: Float[Tensor, "2 scenes n"]
    """Radians of lon and lat for one unit of the direction variables."""
    direction_origin: Float[Tensor, "2 scenes n"]
    """Lon and lat at zero direction variables."""
    smallest: Float[Tensor, "3 scenes n"]
    """Metres below which the sizes act as this."""

    @property
    def view_relative(self) -> bool:
        """Whether the yaw variable turns with the line of sight."""
        return self.settings.variables != "metric"

    @property
    def beta(self) -> float:
        """Error in metres or radians below which errors are squared."""
        return max(self.settings.loss_beta, SMALLEST_BETA)

    @property
    def apart(self) -> float:
        """Metres by which objects are held apart; negative where overlap is forgiven."""
        return self.settings.clearance - self.settings.tolerance

    @property
    def pace(self) -> Float[Tensor, "scenes n"]:
        """Part of a step that each object goes."""
        pace = 1 - self.settings.firmness * self.batch.score
        return torch.where(self.batch.built_in, pace * self.settings.built_in_pace, pace)

    @property
    def off_walls(self) -> float:
        """Metres by which corners are held off walls; negative where they may stand out."""
        return self.settings.clearance / 2 - self.settings.tolerance


def make_problem(
    batch: ArrangementBatch,
    settings: ArrangementSettings,
    weights: Float[Tensor, " terms"] | None = None,
) -> Problem:
    """Return the constants of a solve; gradients flow from them to scores, boxes and weights."""
    centre = batch.boxes.centre
    weights = settings.weights.tensor(centre.dtype, centre.device) if weights is None else weights
    start, scale, origin = _variables(batch, settings)
    return Problem(
        batch=batch,
        settings=settings,
        weights=weights,
        scale=_term_scales(batch, settings, weights),
        confidence=_confidence(batch, settings),
        yaw_target=_yaw_target(batch.relative_yaw, settings),
        yaw_target_wall=_yaw_target(batch.relative_yaw_wall, settings),
        start=start,
        direction_scale=scale,
        direction_origin=origin,
        smallest=start[4:].clamp(max=SMALLEST_SIZE),
    )


def boxes_from_variables(variables: Float[Tensor, "7 scenes n"], problem: Problem) -> OrientedBoxes:
    """Return the world boxes of the optimiser's variables (parametrisation of Sec. 3.1)."""
    lon, lat = problem.direction_origin + problem.direction_scale * variables[:2]
    distance = variables[2]
    horizontal = distance * torch.cos(lat)
    height = problem.batch.camera_height[:, None] + distance * torch.sin(lat)
    centre = torch.stack([horizontal * torch.sin(lon), horizontal * torch.cos(lon), height], -1)
    yaw = -variables[3] - lon if problem.view_relative else -variables[3]
    size = torch.maximum(variables[4:], problem.smallest).movedim(0, -1)
    return OrientedBoxes(centre, size, wrap_angle(yaw))


def variables_from_boxes(boxes: OrientedBoxes, problem: Problem) -> Float[Tensor, "7 scenes n"]:
    """Return the variables of other boxes in the same problem: its inverse, nearest to the start.

    Angles are unwrapped to lie within half a turn of those of the start.
    """
    lonlat, distance = _view(boxes, problem.batch)
    start = problem.start
    start_lonlat = problem.direction_origin + problem.direction_scale * start[:2]
    direction = start[:2] + wrap_angle(lonlat - start_lonlat) / problem.direction_scale
    turn = start_lonlat[0] + wrap_angle(lonlat - start_lonlat)[0] if problem.view_relative else 0.0
    yaw = start[3] + wrap_angle(-boxes.yaw - turn - start[3])
    size = boxes.size.movedim(-1, 0)
    return torch.cat([direction, torch.stack([distance, yaw]), size])


def _view(boxes: OrientedBoxes, batch: ArrangementBatch) -> tuple[Tensor, Tensor]:
    """Return lon and lat, "2 scenes n", and distance of the centres from the camera."""
    x, y, z = boxes.centre.unbind(-1)
    z = z - batch.camera_height[:, None]
    # a centre exactly over the camera has no lon; the offset keeps the gradient finite
    y = torch.where((x.abs() + y.abs()) < 1e-9, y + 1e-9, y)
    horizontal = torch.sqrt(x * x + y * y)
    distance = torch.sqrt(horizontal * horizontal + z * z)
    return torch.stack([torch.atan2(x, y), torch.atan2(z, horizontal)]), distance


def _variables(
    batch: ArrangementBatch, settings: ArrangementSettings
) -> tuple[Tensor, Tensor, Tensor]:
    """Return start values, scale and origin of the variables."""
    lonlat, distance = _view(batch.boxes, batch)
    lon, lat = lonlat
    if settings.variables == "delta":
        scale = -batch.bfov[..., 2:].movedim(-1, 0).clamp(min=1e-3)
        origin = batch.bfov[..., :2].movedim(-1, 0)
        direction = wrap_angle(lonlat - origin) / scale
        origin = lonlat - direction * scale
    elif settings.variables == "pixel":
        step = 2 * math.pi / PIXEL_WIDTH
        signs = lonlat.new_tensor([step, -step])
        scale = signs[:, None, None].expand_as(lonlat)
        origin = torch.zeros_like(lonlat)
        direction = lonlat / scale
    else:
        across = torch.stack([distance * torch.cos(lat).clamp(min=0.2), distance])
        scale = 1 / across.clamp(min=0.1)
        origin = lonlat
        direction = torch.zeros_like(lonlat)
    # the released yaw is relative to the line of sight; ours, in metric variables, is not
    turn = lon if settings.variables != "metric" else torch.zeros_like(lon)
    yaw = wrap_angle(-batch.boxes.yaw - turn)
    start = torch.cat([direction, torch.stack([distance, yaw]), batch.boxes.size.movedim(-1, 0)])
    return start, scale, origin


def _weight(score: Tensor, threshold: float, label: str) -> Tensor:
    """Return the weight of a relation from its score (soft form: relu above the threshold)."""
    if label == "binary":
        return (score > threshold).to(score.dtype)
    return torch.relu(score - threshold) / (1 - threshold)


def _confidence(batch: ArrangementBatch, settings: ArrangementSettings) -> Confidence:
    """Return the weight of every entry, as the authors' release has it."""
    at, label = settings.thresholds, settings.label
    valid = batch.valid.to(batch.score.dtype)
    pair = batch.pair_valid.to(valid.dtype)
    kept_apart = pair * ~batch.nested if settings.nested_stay else pair
    wall_pair = batch.wall_pair_valid.to(valid.dtype)
    inside = batch.inside_room
    if settings.inside_room_label == "confidence":
        inside = _weight(inside, at.inside_room, "confidence")
    touching_wall = _weight(batch.touching_wall, at.touching_wall, label) * wall_pair
    if settings.inside_room_on_touching:
        touching_wall = touching_wall * inside[..., None]

    held = valid * batch.score if settings.doubtful_yield else valid

    def observation(score: Tensor) -> Tensor:
        if not settings.observation_confidence:
            return held
        return _weight(score, at.observation, "confidence") * held

    narrow = (batch.bfov[..., 2:] < WIDEST_BFOV).all(-1).to(valid.dtype)
    symmetric = (batch.touching + batch.touching.transpose(-1, -2)) / 2
    most = batch.relative_yaw.amax(-1), batch.relative_yaw_wall.amax(-1)
    return Confidence(
        object_pair=kept_apart,
        inside_room=inside * valid,
        touching=_weight(symmetric, at.touching, label) * pair,
        touching_wall=touching_wall,
        on_floor=_weight(batch.on_floor, at.on_floor, label) * valid,
        under_ceiling=_weight(batch.under_ceiling, at.under_ceiling, label) * valid,
        farther_than=_weight(batch.farther_than, at.farther_than, label) * pair,
        relative_yaw=_weight(most[0], at.relative_yaw, label) * pair,
        relative_yaw_wall=_weight(most[1], at.relative_yaw, label) * wall_pair,
        valid=valid,
        direction=held,
        distance=observation(batch.distance_score),
        size=observation(batch.score),
        yaw=observation(batch.yaw_score),
        reprojection=held * narrow,
    )


def _yaw_target(
    probability: Float[Tensor, "*batch 8"], settings: ArrangementSettings
) -> Float[Tensor, "*batch"]:
    """Return the relative yaw that the bins stand for."""
    bins = torch.arange(8, dtype=probability.dtype, device=probability.device)
    angle = bins * (math.pi / 4) - math.pi
    if settings.relative_yaw_target == "argmax":
        return angle[probability.argmax(-1)]
    return torch.atan2(probability @ torch.sin(angle), probability @ torch.cos(angle) + 1e-3)


def _term_scales(
    batch: ArrangementBatch, settings: ArrangementSettings, weights: Tensor
) -> dict[str, Tensor]:
    """Return weight / number of entries for each scene."""
    one = torch.ones_like(batch.floor_height)
    by_name = dict(zip(TERM_NAMES, weights.unbind(0), strict=True))
    if settings.reduction == "sum":
        return {name: weight * one for name, weight in by_name.items()}
    n = batch.valid.sum(-1).clamp(min=1).to(one.dtype)
    m = batch.wall_valid.sum(-1).clamp(min=1).to(one.dtype)
    entries = {
        **dict.fromkeys(("object_collision", "touching", "farther_than", "relative_yaw"), n * n),
        **dict.fromkeys(("wall_collision", "floor_collision", "ceiling_collision"), 8 * n),
        **dict.fromkeys(("touching_wall", "relative_yaw_wall"), n * m),
        **dict.fromkeys(("on_floor", "under_ceiling", "distance", "yaw"), n),
        "direction": 2 * n,
        "size": 3 * n,
        "reprojection": (4 if settings.projection == "edges" else 1) * n,
    }
    return {name: weight / entries[name] for name, weight in by_name.items()}


def repeat_problem(problem: Problem, times: int) -> Problem:
    """Return the problem of the same scenes several times over, one behind the other.

    Judging several states at once costs little more than judging one when scenes are few.
    """

    def scenes_first(record: Any) -> Any:
        values = {}
        for field in fields(record):
            value = getattr(record, field.name)
            values[field.name] = (
                value.repeat(times, *[1] * (value.ndim - 1))
                if isinstance(value, Tensor)
                else scenes_first(value)
            )
        return type(record)(**values)

    return replace(
        problem,
        batch=scenes_first(problem.batch),
        confidence=scenes_first(problem.confidence),
        scale={name: value.repeat(times) for name, value in problem.scale.items()},
        yaw_target=problem.yaw_target.repeat(times, 1, 1),
        yaw_target_wall=problem.yaw_target_wall.repeat(times, 1, 1),
        start=problem.start.repeat(1, times, 1),
        direction_scale=problem.direction_scale.repeat(1, times, 1),
        direction_origin=problem.direction_origin.repeat(1, times, 1),
        smallest=problem.smallest.repeat(1, times, 1),
    )
