"""Layout scores: how well the predicted room agrees with the true one, by number of corners."""

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields
from operator import attrgetter
from typing import Literal, get_args

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.eval._layout_view import (
    WORST_CORNER_ERROR,
    LayoutView,
    corner_error,
    distance_errors,
    distance_map,
    layout_view,
    surface_errors,
)
from panoscene.geometry import (
    layout_iou_3d,
    polygon_area,
    polygon_contains,
    polygon_iou,
    polygon_problem,
)
from panoscene.scene import Scene

CORNER_GROUPS = ("4", "6", "8", "10+", "odd", "overall")
"""Rows of the published layout tables: by the number of corners of the target."""

Reading = Literal["regularised", "raw"]

MISSING = "there is no prediction"
"""The problem of a scene that was not predicted at all."""


@dataclass(frozen=True, slots=True)
class LayoutErrors:
    """How one room differs from the true one, or the mean of that over scenes.

    The measures named ``scaled`` compare after the prediction was scaled to the target's camera
    height. Published layout scores are of this kind: they use the true camera height, and so
    hide every error of scale. Corner and pixel errors do not depend on scale.
    """

    iou_2d: float
    """Of the floor polygons in metres, in [0, 1]."""
    iou_3d: float
    """Shared floor area times the smaller height, over the union of the volumes."""
    scaled_iou_2d: float
    scaled_iou_3d: float
    corner_error: float
    """Mean pixel distance of corners at floor and ceiling, percent of the image's diagonal."""
    pixel_error: float
    """Percent of the pixels that show another surface (ceiling, wall, floor)."""
    solid_angle_error: float
    """The same in percent of the sphere."""
    depth_rmse: float
    """Root mean square error in metres of the distance map of the bare room."""
    depth_delta_1: float
    """Share of its pixels that agree within a factor of 1.25."""
    scaled_depth_rmse: float
    scaled_depth_delta_1: float


@dataclass(frozen=True, slots=True)
class LayoutReading:
    """The errors of one polygon of a prediction, and what made it degenerate."""

    errors: LayoutErrors
    problem: str | None = None
    """In plain words; None for a room that can be seen from its camera."""


@dataclass(frozen=True, slots=True)
class LayoutRecord:
    """The layout measures of one scene."""

    name: str
    corners: int
    """Of the target's floor polygon."""
    scale: float | None
    """Predicted over true height of the camera above the floor; None without a prediction."""
    regularised: LayoutReading
    """Of ``layout.floor_polygon``."""
    raw: LayoutReading | None = None
    """Of ``layout.raw_polygon``, when the prediction has one."""


@dataclass(frozen=True, slots=True)
class LayoutRow:
    """Mean layout measures of the scenes with one number of corners."""

    reading: Reading
    corners: str
    """One of ``CORNER_GROUPS``."""
    scenes: int
    degenerate: int
    """Scenes among them whose prediction was missing or not a room; they count at their worst."""
    scale_error: float | None
    """Mean of ``|scale - 1|`` over scenes with a prediction."""
    mean: LayoutErrors


_READINGS: tuple[Reading, ...] = get_args(Reading)
_ERRORS = tuple(field.name for field in fields(LayoutErrors))
_errors = attrgetter(*_ERRORS)


@dataclass(frozen=True, slots=True)
class _Room:
    polygon: Float[Tensor, "corners 2"]
    floor: float
    ceiling: float
    camera: float

    @property
    def below(self) -> float:
        return self.camera - self.floor

    @property
    def view(self) -> LayoutView:
        return layout_view(self.polygon, self.ceiling - self.camera, self.below)

    def scaled(self, factor: float) -> "_Room":
        """Return the room scaled about the point of the floor under the camera."""
        ceiling = self.floor + factor * (self.ceiling - self.floor)
        camera = self.floor + factor * self.below
        return _Room(self.polygon * factor, self.floor, ceiling, camera)


def layout_record(prediction: Scene | None, target: Scene) -> LayoutRecord:
    """Return the layout measures of one scene, for the regularised polygon and the raw one.

    A prediction that is missing (None) or is no valid room counts as an IoU of 0, the worst
    possible corner error (63.2), 100 percent of wrong pixels and a distance of 0 everywhere. A
    valid polygon that the camera is not inside keeps its IoU in metres; only the measures that
    look from the camera count at their worst.

    Raises:
        ValueError: the target is not a valid room with the camera inside.

    Examples:
        >>> from panoscene.synth import sample_room
        >>> import numpy as np
        >>> room = sample_room(np.random.default_rng(0), objects=0)
        >>> layout_record(room, room).regularised.errors.iou_3d
        1.0
    """
    true = _room(target, target.layout.floor_polygon)
    problem = _polygon_problem(true) or _view_problem(true)
    if problem:
        raise ValueError(
            f"target {target.name!r}: expected a room with the camera inside, but {problem}"
        )
    corners = len(true.polygon)
    view = true.view
    distance = distance_map(view)
    if prediction is None:
        worst = LayoutReading(_worst(distance), MISSING)
        return LayoutRecord(target.name, corners, None, worst)
    raw = prediction.layout.raw_polygon
    return LayoutRecord(
        name=target.name,
        corners=corners,
        scale=_room(prediction, prediction.layout.floor_polygon).below / true.below,
        regularised=_reading(
            _room(prediction, prediction.layout.floor_polygon), true, view, distance
        ),
        raw=None if raw is None else _reading(_room(prediction, raw), true, view, distance),
    )


def score_layout(records: Sequence[LayoutRecord]) -> tuple[LayoutRow, ...]:
    """Return mean layout measures by number of corners of the target, regularised, then raw.

    Groups without scenes are left out. Scenes without any prediction count in the raw rows too,
    if other scenes have a raw polygon.

    Examples:
        >>> score_layout([])
        ()
    """
    return layout_of_sums(layout_sums(records).sum(axis=0)) if records else ()


def layout_sums(records: Sequence[LayoutRecord]) -> Float[np.ndarray, "scenes columns"]:
    """Return for each scene what it adds to each row: reading by reading, group by group."""
    with_raw = any(record.raw is not None for record in records)
    table = np.zeros((len(records), len(_READINGS), len(CORNER_GROUPS), 4 + len(_ERRORS)))
    for scene, record in enumerate(records):
        groups = [CORNER_GROUPS.index(_group(record.corners)), CORNER_GROUPS.index("overall")]
        raw = record.raw
        if raw is None and record.regularised.problem == MISSING:
            raw = record.regularised
        readings = (record.regularised, raw if with_raw else None)
        scale_error = 0.0 if record.scale is None else abs(record.scale - 1)
        for row, reading in enumerate(readings):
            if reading is not None:
                degenerate, scaled = reading.problem is not None, record.scale is not None
                errors = _errors(reading.errors)
                table[scene, row, groups] = (1, degenerate, scaled, scale_error, *errors)
    return table.reshape(len(records), -1)


def layout_of_sums(sums: Float[np.ndarray, " columns"]) -> tuple[LayoutRow, ...]:
    """Return ``score_layout`` for added rows of ``layout_sums``."""
    table = sums.reshape(len(_READINGS), len(CORNER_GROUPS), -1).tolist()
    rows: list[LayoutRow] = []
    for reading, groups in zip(_READINGS, table, strict=True):
        for group, numbers in zip(CORNER_GROUPS, groups, strict=True):
            scenes, degenerate, scaled, scale_error, *errors = numbers
            if not scenes:
                continue
            rows.append(
                LayoutRow(
                    reading=reading,
                    corners=group,
                    scenes=round(scenes),
                    degenerate=round(degenerate),
                    scale_error=scale_error / scaled if scaled else None,
                    mean=LayoutErrors(*(error / scenes for error in errors)),
                )
            )
    return tuple(rows)


def _group(corners: int) -> str:
    if corners % 2:
        return "odd"
    return str(corners) if corners < 10 else "10+"


def _room(scene: Scene, polygon: Float[Tensor, "corners 2"]) -> _Room:
    polygon = polygon.detach().to("cpu", torch.float64)
    if len(polygon) >= 3 and float(polygon_area(polygon)) < 0:
        polygon = polygon.flip(0)
    layout = scene.layout
    camera = scene.panorama.camera_height
    return _Room(polygon, float(layout.floor_height), float(layout.ceiling_height), float(camera))


def _polygon_problem(room: _Room) -> str | None:
    problem = polygon_problem(room.polygon)
    if problem is None and not math.inf > room.ceiling - room.floor > 0:
        return f"its ceiling at {room.ceiling:g} m is not above its floor at {room.floor:g} m"
    return f"the floor polygon is not valid: {problem}" if problem else None


def _view_problem(room: _Room) -> str | None:
    if not room.floor < room.camera < room.ceiling:
        return f"the camera at {room.camera:g} m is not between floor and ceiling"
    if not bool(polygon_contains(torch.zeros(1, 2, dtype=torch.float64), room.polygon)):
        return "the camera is outside the floor polygon"
    return None


def _reading(
    room: _Room, true: _Room, view: LayoutView, distance: Float[Tensor, "height width"]
) -> LayoutReading:
    problem = _polygon_problem(room)
    if problem:
        return LayoutReading(_worst(distance), problem)
    iou_2d, iou_3d = _iou(room, true)
    problem = _view_problem(room)
    if problem:
        return LayoutReading(LayoutErrors(iou_2d, iou_3d, *astuple(_worst(distance))[2:]), problem)
    scale = true.below / room.below
    own = room.view
    own_distance = distance_map(own)
    in_metres = distance_errors(own_distance, distance)
    errors = LayoutErrors(
        iou_2d,
        iou_3d,
        *_iou(room.scaled(scale), true),
        corner_error(own, view),
        *surface_errors(own, view),
        *in_metres,
        *(in_metres if scale == 1 else distance_errors(own_distance * scale, distance)),
    )
    if not all(map(math.isfinite, astuple(errors))):
        return LayoutReading(_worst(distance), "its size is beyond all measure")
    return LayoutReading(errors)


def _iou(room: _Room, true: _Room) -> tuple[float, float]:
    heights, true_heights = (room.floor, room.ceiling), (true.floor, true.ceiling)
    return (
        polygon_iou(room.polygon, true.polygon),
        layout_iou_3d(room.polygon, heights, true.polygon, true_heights),
    )


def _worst(distance: Float[Tensor, "height width"]) -> LayoutErrors:
    """Return the errors of a room that is not there: its distances are 0."""
    rmse = float(distance.square().mean().sqrt())
    return LayoutErrors(0.0, 0.0, 0.0, 0.0, WORST_CORNER_ERROR, 100.0, 100.0, rmse, 0.0, rmse, 0.0)
