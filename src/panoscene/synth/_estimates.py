"""What a pipeline of networks would say of a room: misses, inventions, wrong boxes and layout."""

from dataclasses import dataclass, field, fields, replace

import numpy as np
import torch
from jaxtyping import Float, Int64
from torch import Tensor

from panoscene.geometry import (
    OrientedBoxes,
    bfov_from_boxes,
    boundary_from_layout,
    corner_signal_from_layout,
    layout_from_boundary,
)
from panoscene.scene import (
    CATEGORIES,
    MEAN_SIZE,
    Layout,
    Objects,
    Scene,
    Shapes,
    object_names,
    relations_from_boxes,
    select_objects,
)
from panoscene.synth._corrupt import corrupt_relations
from panoscene.synth._perturb import PerturbNoise, perturb_scene

_COLUMNS = 1024
_HARMONICS = 12


@dataclass(frozen=True, slots=True)
class EstimateNoise:
    """How wrong a pipeline of networks is; the defaults are those of the published scores."""

    boxes: PerturbNoise = field(default_factory=PerturbNoise)
    """Errors of the boxes of what is detected."""
    miss: float = 0.1
    """Probability that an object is not detected."""
    invent: float = 0.06
    """Expected false detections for each true object."""
    confuse: float = 0.04
    """Probability of a wrong category."""
    boundary: float = 0.008
    """Radians, the standard deviation of the slowly varying error of the layout's boundary."""
    relation_flip: float = 0.1
    """Probability of a wrong answer about a relation."""
    false_alarm: float = 0.01
    """Probability of claiming a contact where there is none."""

    def __post_init__(self) -> None:
        for item in fields(self)[1:]:
            value = getattr(self, item.name)
            if not 0.0 <= value <= 1.0:
                raise ValueError(f"{item.name}: expected a number in [0, 1], found {value}")


def estimate_scene(
    scene: Scene,
    rng: np.random.Generator,
    noise: EstimateNoise | None = None,
    *,
    layout: Layout | None = None,
) -> Scene:
    """Return the scene as an imperfect detector, layout, pose and relation network would.

    A stand-in for networks, to measure what follows them: objects are missed, invented and
    confused, boxes are wrong (``perturb_scene``), the floor polygon is recovered from a boundary
    signal with errors (``layout.raw_polygon`` is its general reading, ``layout.floor_polygon``
    the Manhattan one), and the relations are those of the true boxes with the estimated walls,
    corrupted (``corrupt_relations``). Invented objects have a category's mean size, stand
    somewhere in the room and have low scores; their true relations are those of the place.

    Args:
        scene: the true scene.
        rng: source of randomness.
        noise: how wrong.
        layout: the room to use instead of the recovered one, such as the true one for an oracle;
            the same state of ``rng`` then gives the same objects.
    """
    noise = noise or EstimateNoise()
    recovered = _estimated_layout(scene, rng, noise.boundary)
    layout = recovered if layout is None else layout
    kept = torch.from_numpy(np.flatnonzero(rng.random(len(scene.objects.boxes)) >= noise.miss))
    named = replace(scene.objects, id=object_names(scene.objects), shapes=Shapes())
    found = select_objects(named, kept)
    spurious = _invented(scene, rng, int(rng.poisson(noise.invent * len(scene.objects.boxes))))
    height = scene.panorama.camera_height
    truth = _joined(found, spurious)
    relations = relations_from_boxes(truth.boxes, layout, height, inside="any_corner")
    start = Scene(scene.panorama, layout, found, None, scene.name, scene.seed)
    wrong = perturb_scene(start, rng, replace(noise.boxes, layout=0.0)).objects
    objects = _joined(wrong, spurious)
    return replace(
        start,
        objects=replace(objects, category=_confused(objects.category, rng, noise.confuse)),
        relations=corrupt_relations(
            relations, rng, flip=noise.relation_flip, false_alarm=noise.false_alarm
        ),
    )


def _estimated_layout(scene: Scene, rng: np.random.Generator, deviation: float) -> Layout:
    layout, camera = scene.layout, scene.panorama.camera_height
    ceiling, floor = boundary_from_layout(
        layout.floor_polygon, layout.floor_height, layout.ceiling_height, camera, _COLUMNS
    )
    corners = corner_signal_from_layout(layout.floor_polygon, _COLUMNS)
    ceiling, floor = (
        signal + _wave(rng, deviation).to(signal) for signal in (ceiling, floor)
    )  # fmt: skip
    above = ceiling.clamp(0.02, 1.55)
    below = floor.clamp(-1.55, -0.02)
    raw = layout_from_boundary(above, below, torch.zeros_like(corners), camera, manhattan=False)
    regular = layout_from_boundary(above, below, corners, camera)
    return Layout(
        regular.polygon,
        ceiling_height=max(regular.ceiling_height, camera + 0.1),
        raw_polygon=raw.polygon,
    )


def _wave(rng: np.random.Generator, deviation: float) -> Float[Tensor, " width"]:
    """Return a periodic signal of the given standard deviation that varies slowly."""
    turn = np.linspace(0.0, 2 * np.pi, _COLUMNS, endpoint=False)
    order = np.arange(1, _HARMONICS + 1)[:, None]
    strength = rng.normal(size=(2, _HARMONICS, 1)) / np.sqrt(_HARMONICS)
    wave = strength[0] * np.cos(order * turn) + strength[1] * np.sin(order * turn)
    return torch.from_numpy(deviation * wave.sum(axis=0))


def _invented(scene: Scene, rng: np.random.Generator, count: int) -> Objects:
    polygon = scene.layout.floor_polygon
    low, high = polygon.amin(0), polygon.amax(0)
    category = torch.from_numpy(rng.integers(len(CATEGORIES), size=count))
    size = MEAN_SIZE[category].to(polygon)
    place = low + torch.from_numpy(rng.random((count, 2))).to(polygon) * (high - low)
    centre = torch.cat([place, size[:, 2:] / 2], dim=-1)
    yaw = torch.from_numpy(rng.uniform(-np.pi, np.pi, count)).to(polygon)
    boxes = OrientedBoxes(centre, size, yaw)
    score, distance, turn = torch.from_numpy(rng.uniform(0.2, 0.7, (3, count))).to(polygon)
    names = tuple(f"invented_{k}" for k in range(count))
    bfov = bfov_from_boxes(boxes, scene.panorama.camera_height)
    return Objects(boxes, category, score, bfov, distance, turn, names)


def _confused(
    category: Int64[Tensor, " n"], rng: np.random.Generator, probability: float
) -> Int64[Tensor, " n"]:
    wrong = torch.from_numpy(rng.random(len(category)) < probability)
    other = torch.from_numpy(rng.integers(len(CATEGORIES), size=len(category)))
    return torch.where(wrong, other, category)


def _joined(first: Objects, second: Objects) -> Objects:
    """Return the objects of both, without shapes."""

    def both(one: Tensor, other: Tensor) -> Tensor:
        return torch.cat([one, other.to(one)])

    return Objects(
        OrientedBoxes(
            both(first.boxes.centre, second.boxes.centre),
            both(first.boxes.size, second.boxes.size),
            both(first.boxes.yaw, second.boxes.yaw),
        ),
        both(first.category, second.category),
        both(first.score, second.score),
        both(first.bfov, second.bfov),
        both(first.distance_score, second.distance_score),
        both(first.yaw_score, second.yaw_score),
        object_names(first) + object_names(second),
        Shapes(),
    )
