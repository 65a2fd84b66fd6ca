"""The methods that a score table compares: ours, the authors' settings, baselines and oracles."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Literal, Protocol, runtime_checkable

import torch

from panoscene.arrange import PRESETS, arrange_scenes
from panoscene.eval._fov import FOV_DEG, run_by_fov
from panoscene.geometry import OrientedBoxes, direction_from_lonlat, wrap_angle
from panoscene.scene import MEAN_SIZE, Layout, Objects, Scene, Shapes, relations_from_boxes

MethodKind = Literal["ours", "released", "input", "baseline", "oracle"]

_CHUNK = 64
_ROOM_SIDE = 4.0
_CEILING = 2.6
_FARTHEST = 8.0


@runtime_checkable
class Simulate(Protocol):
    """Makes estimates of all targets."""

    def __call__(self, *, true_layout: bool = False, weak_relations: bool = False) -> list[Scene]:
        """Return the same estimates of objects, in another layout or with worse relations."""
        ...


@dataclass(frozen=True)
class Inputs:
    """What methods may look at: the same rooms, one after the other; made when asked for."""

    targets: Sequence[Scene]
    simulate: Simulate

    @cached_property
    def estimates(self) -> list[Scene]:
        """Return what the simulated networks say."""
        return self.simulate()

    @cached_property
    def in_true_layout(self) -> list[Scene]:
        """Return the same objects, with the true layout and relations to its walls."""
        return self.simulate(true_layout=True)

    @cached_property
    def with_weak_relations(self) -> list[Scene]:
        """Return the same objects and layout, with many more wrong relations."""
        return self.simulate(weak_relations=True)


@dataclass(frozen=True, slots=True)
class Method:
    """One row of a score table."""

    kind: MethodKind
    """``oracle``: it was told part of the truth; ``baseline``: it does not think."""
    description: str
    run: Callable[[Inputs], list[Scene]]
    """To predictions, in the order of the targets."""
    fov_deg: int = FOV_DEG[0]
    """Horizontal degrees that it sees at a time."""


def mean_box_scene(estimate: Scene) -> Scene:
    """Return the trivial baseline: what is known without looking at layout, pose or context.

    Each detection becomes a box of its category's mean size that faces the camera, in the
    direction of its BFoV, at the distance where the mean height fills the BFoV's (at most 8 m).
    The room is a square of 4 m around the camera with a ceiling at 2.6 m. Relations are those of
    these boxes.
    """
    objects, camera = estimate.objects, estimate.panorama.camera_height
    lon, lat, _, height = objects.bfov.unbind(-1)
    size = MEAN_SIZE[objects.category].to(lon)
    half = (height / 2).clamp(1e-3, math.pi / 2 - 1e-3)
    distance = (size[:, 2] / 2 / torch.tan(half)).clamp(0.3, _FARTHEST)
    ray = direction_from_lonlat(torch.stack([lon, lat], dim=-1))
    centre = distance[:, None] * ray + ray.new_tensor([0.0, 0.0, camera])
    boxes = OrientedBoxes(centre, size, wrap_angle(math.pi - lon))
    side = _ROOM_SIDE / 2
    square = centre.new_tensor([[-side, -side], [side, -side], [side, side], [-side, side]])
    layout = Layout(square, ceiling_height=max(_CEILING, camera + 0.1))
    return replace(
        estimate,
        layout=layout,
        objects=replace(objects, boxes=boxes, shapes=Shapes()),
        relations=relations_from_boxes(boxes, layout, camera, inside="any_corner"),
    )


def with_boxes_of(estimate: Scene, target: Scene) -> Scene:
    """Return the target's objects in the estimated room, with the relations that follow."""
    objects: Objects = target.objects
    return replace(
        estimate,
        objects=objects,
        relations=relations_from_boxes(
            objects.boxes, estimate.layout, estimate.panorama.camera_height, inside="any_corner"
        ),
    )


def _arranged(estimates: Sequence[Scene], preset: str) -> list[Scene]:
    """Return repaired scenes, many at once."""
    return [
        result.scene
        for first in range(0, len(estimates), _CHUNK)
        for result in arrange_scenes(estimates[first : first + _CHUNK], PRESETS[preset])
    ]


def _by_fov(estimates: Sequence[Scene], fov_deg: int) -> list[Scene]:
    """Return scenes repaired in horizontal splits, all splits of all scenes at once."""
    parts: list[Scene] = []

    def collect(part: Scene) -> Scene:
        parts.append(part)
        return part

    for scene in estimates:
        run_by_fov(collect, scene, fov_deg)
    repaired = iter(_arranged(parts, "default"))
    return [run_by_fov(lambda _part: next(repaired), scene, fov_deg) for scene in estimates]


METHODS = MappingProxyType(
    {
        "estimates": Method(
            "input", "simulated networks, nothing repaired", lambda inputs: list(inputs.estimates)
        ),
        "default": Method(
            "ours",
            "estimates repaired with the preset default",
            lambda inputs: _arranged(inputs.estimates, "default"),
        ),
        "released": Method(
            "released",
            "estimates repaired with the authors' released settings",
            lambda inputs: _arranged(inputs.estimates, "released"),
        ),
        "default-weak": Method(
            "ours",
            "default, told relations that are about as wrong as the paper's network's",
            lambda inputs: _arranged(inputs.with_weak_relations, "default"),
        ),
        "mean-box": Method(
            "baseline",
            "mean sizes facing the camera in a square room",
            lambda inputs: [mean_box_scene(scene) for scene in inputs.estimates],
        ),
        "true-layout": Method(
            "oracle",
            "estimates with the true layout, repaired with default",
            lambda inputs: _arranged(inputs.in_true_layout, "default"),
        ),
        "true-boxes": Method(
            "oracle",
            "true boxes in the estimated layout",
            lambda inputs: [
                with_boxes_of(*pair) for pair in zip(inputs.estimates, inputs.targets, strict=True)
            ],
        ),
        "truth": Method("oracle", "the targets themselves", lambda inputs: list(inputs.targets)),
    }
    | {
        f"default-{fov}": Method(
            "ours",
            f"default, each split of {fov} degrees on its own",
            lambda inputs, fov=fov: _by_fov(inputs.estimates, fov),
            fov_deg=fov,
        )
        for fov in FOV_DEG[1:]
    }
)
"""Every method by the name of its folder of predictions."""
