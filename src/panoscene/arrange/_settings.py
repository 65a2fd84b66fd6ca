"""Settings of the arrangement optimiser and its three presets."""

import math
from typing import Annotated, Literal

import torch
from jaxtyping import Float
from pydantic import BaseModel, ConfigDict, Field
from torch import Tensor


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


class TermWeights(_Frozen):
    """The weight (lambda) of every energy term; symbols of the paper in brackets.

    Source: the paper's supplement, table of relation-optimisation weights.
    """

    object_collision: NonNegative = 1.0
    """[oc] overlap of two objects."""
    wall_collision: NonNegative = 1.0
    """[wc] box corners outside the floor polygon."""
    floor_collision: NonNegative = 1.0
    """[fc] boxes below the floor."""
    ceiling_collision: NonNegative = 1.0
    """[cc] boxes above the ceiling."""
    relative_yaw: NonNegative = 0.1
    """[rr] between objects."""
    relative_yaw_wall: NonNegative = 0.1
    """[rr] between an object and a wall."""
    touching: NonNegative = 1.0
    """[oa] between objects."""
    touching_wall: NonNegative = 1.0
    """[oa] between an object and a wall."""
    on_floor: NonNegative = 1.0
    """[fa] gap between an object and the floor."""
    under_ceiling: NonNegative = 1.0
    """[ca] gap between an object and the ceiling."""
    farther_than: NonNegative = 0.01
    """[rd] wrong order of distances from the camera."""
    direction: NonNegative = 0.0001
    """[delta] the projected centre leaves where it was seen."""
    distance: NonNegative = 0.01
    """[d] the distance leaves its estimate."""
    size: NonNegative = 1.0
    """[s] the size leaves its estimate."""
    yaw: NonNegative = 0.001
    """[theta] the yaw leaves its estimate."""
    reprojection: NonNegative = 10.0
    """[bp] the projected box leaves the BFoV."""

    def tensor(
        self, dtype: torch.dtype = torch.float32, device: torch.device | None = None
    ) -> Float[Tensor, " terms"]:
        """Return the weights as a vector in the order of ``TERM_NAMES``."""
        values = [getattr(self, name) for name in TERM_NAMES]
        return torch.tensor(values, dtype=dtype, device=device)


TERM_NAMES: tuple[str, ...] = tuple(TermWeights.model_fields)
"""The energy terms in the order of every weight vector."""

COLLISION_TERMS = TERM_NAMES[0:4]
"""E^c of the paper."""
RELATION_TERMS = TERM_NAMES[4:11]
"""E^r of the paper."""
OBSERVATION_TERMS = TERM_NAMES[11:16]
"""E^o of the paper."""


class Thresholds(_Frozen):
    """Scores above which a relation counts; a weight grows linearly from there to 1."""

    touching: float = Field(default=0.5, ge=0, lt=1)
    touching_wall: float = Field(default=0.5, ge=0, lt=1)
    on_floor: float = Field(default=0.5, ge=0, lt=1)
    under_ceiling: float = Field(default=0.5, ge=0, lt=1)
    inside_room: float = Field(default=0.5, ge=0, lt=1)
    farther_than: float = Field(default=0.5, ge=0, lt=1)
    relative_yaw: float = Field(default=0.5, ge=0, lt=1)
    observation: float = Field(default=0.5, ge=0, lt=1)


class ArrangementSettings(_Frozen):
    """Everything that defines one way of arranging; start from a preset and change fields.

    Examples:
        >>> ArrangementSettings.preset("paper").steps
        100
        >>> PRESETS["default"].model_copy(update={"steps": 20}).steps
        20
    """

    name: str = "default"
    weights: TermWeights = TermWeights()
    thresholds: Thresholds = Thresholds()
    label: Literal["binary", "confidence"] = "confidence"
    """A relation's weight: 1 above its threshold, or growing from 0 at the threshold to 1."""
    inside_room_label: Literal["probability", "confidence"] = "confidence"
    """Weight of the wall terms: the score itself (paper), or as ``label`` (release)."""
    inside_room_on_touching: bool = True
    """Whether the contact with walls is weighted with inside_room too."""
    observation_confidence: bool = True
    """Whether distance, size and yaw are held by their confidence above the threshold."""
    doubtful_yield: bool = False
    """Whether the observation is held by the detection score too, so that of two objects that
    cannot both be right the doubtful one gives way."""
    reduction: Literal["sum", "mean"] = "sum"
    """Sum of all entries of a term, or their mean (zeros included)."""
    loss_beta: NonNegative = 0.0
    """Errors below this are squared (Huber, 'SmoothL1'); 0 is the plain absolute error."""
    firmness: float = Field(default=0.0, ge=0, lt=1)
    """Part by which an object of detection score 1 moves more slowly than one of score 0, so that
    of two in each other's way the doubtful one makes room."""
    built_in_pace: float = Field(default=1.0, ge=0, le=1)
    """Part of a step that doors and windows go: with a small one, what is in their way makes
    room."""
    nested_stay: bool = False
    """Whether pairs of which one may lie in the box of the other may overlap: cushions on sofas,
    plants in shelves (``panoscene.scene.nested``)."""
    collision: Literal["sum", "depth"] = "sum"
    """Object-object collision: overlap summed over the separating axes (paper), or the
    smallest one, which is how far the boxes must really move."""
    axis_weight: Positive = 1.0
    """Weight of each of the six separating axes in a sum over them: 1 as in the paper, or 1/2, so
    that the axes of parallel boxes, which come in pairs, count once."""
    projection: Literal["edges", "iou"] = "edges"
    """Reprojection error: difference of the four edges in radians, or 1 - IoU."""
    variables: Literal["delta", "pixel", "metric"] = "metric"
    """Unit of the direction variable: BFoV sizes (paper), pixels of a panorama 1024 wide
    (release), or metres across the line of sight with the yaw in the world frame."""
    relative_yaw_target: Literal["argmax", "mean"] = "argmax"
    """The angle of the most probable bin (stop-gradient), or the circular mean of all bins."""
    clearance: NonNegative = 0.0
    """Metres: objects are held this far apart and half as far from walls, floor and ceiling, and
    contact relations are content with this gap, so that contact never ends in penetration."""
    tolerance: NonNegative = 0.0
    """Metres of overlap with other objects and of standing out of walls that are forgiven, as by
    the paper's counts: what is that small is within the error of an estimate."""
    size_range: float = Field(default=math.inf, ge=1)
    """Largest factor by which an extent may grow or shrink; 1 holds sizes as they are."""
    solver: Literal["sgd", "adam"] = "adam"
    steps: int = Field(default=100, ge=0)
    learning_rate: Positive = 1.0
    momentum: float = Field(default=0.9, ge=0, lt=1)
    direction_gradient_scale: Positive = 1.0
    """Factor on the gradient of the direction variable (the release: 1000)."""
    safe: bool = False
    """Keep the input rather than anything worse in energy, collisions or out-of-room volume."""
    safe_by: Literal["scene", "object"] = "scene"
    """What goes back towards the input where ``safe`` refuses the solution: all objects, or first
    those alone that are in the way."""

    @staticmethod
    def preset(name: str) -> "ArrangementSettings":
        """Return the preset ``paper``, ``released`` or ``default``.

        Raises:
            ValueError: there is no preset of that name.
        """
        if name not in PRESETS:
            raise ValueError(f"preset: found {name!r}, expected one of {sorted(PRESETS)}")
        return PRESETS[name]


_PAPER = ArrangementSettings(
    name="paper",
    label="binary",
    inside_room_label="probability",
    inside_room_on_touching=False,
    observation_confidence=False,
    reduction="sum",
    loss_beta=0.0,
    collision="sum",
    axis_weight=1.0,
    projection="iou",
    variables="delta",
    solver="sgd",
    steps=100,
    learning_rate=1.0,
    momentum=0.9,
)

_RELEASED = ArrangementSettings(
    name="released",
    weights=TermWeights(
        object_collision=0.1, touching=0.1, relative_yaw=0.01, relative_yaw_wall=0.1
    ),
    thresholds=Thresholds(
        touching=0.07, touching_wall=0.18, on_floor=0.1, under_ceiling=0.007, inside_room=0.95
    ),
    label="confidence",
    inside_room_label="confidence",
    inside_room_on_touching=True,
    observation_confidence=True,
    reduction="mean",
    loss_beta=1.0,
    collision="sum",
    axis_weight=1.0,
    projection="edges",
    variables="pixel",
    solver="sgd",
    steps=100,
    learning_rate=1.0,
    momentum=0.9,
    direction_gradient_scale=1000.0,
)

_DEFAULT = ArrangementSettings(
    name="default",
    # found by random search on sampled rooms (seeds 1000 to 1039, true and corrupted relations)
    weights=TermWeights(
        object_collision=1.4,
        wall_collision=0.73,
        floor_collision=1.9,
        ceiling_collision=2.8,
        relative_yaw=0.036,
        relative_yaw_wall=0.77,
        touching=0.15,
        touching_wall=0.95,
        on_floor=1.1,
        under_ceiling=1.1,
        farther_than=0.002,
        direction=0.093,
        distance=0.014,
        size=0.43,
        yaw=0.37,
        reprojection=2.1,
    ),
    thresholds=Thresholds(
        touching=0.7, on_floor=0.3, farther_than=0.1, relative_yaw=0.2, observation=0.1
    ),
    loss_beta=0.01,
    collision="depth",
    axis_weight=0.5,
    projection="edges",
    variables="metric",
    clearance=0.004,
    size_range=1.35,
    solver="adam",
    steps=50,
    learning_rate=0.1,
    momentum=0.6,
    safe=True,
)

PRESETS: dict[str, ArrangementSettings] = {
    "paper": _PAPER,
    "released": _RELEASED,
    "default": _DEFAULT,
}
"""``paper``: plain sums and the paper's weights. ``released``: the authors' released reductions,
weights and gradient scaling. ``default``: ours."""
