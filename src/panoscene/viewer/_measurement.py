"""What is wrong with a scene, object by object, fast enough to follow a drag."""

from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.arrange import PRESETS, Violations, arrange
from panoscene.geometry import (
    OrientedBoxes,
    box_footprint,
    penetration_depth,
    signed_distance_to_polygon,
)
from panoscene.scene import Relations, Scene, nested, relations_from_boxes

SHOWN_FROM = 0.01
"""Metres of overlap, or outside the room, from which an object is shown as in trouble; the
pictures hatch from the same centimetre."""
COUNTED_FROM = 0.1
"""Metres of overlap from which the paper, and so the certificate, counts a collision."""

_LOOK = PRESETS["default"].model_copy(update={"steps": 0, "safe": False})


@dataclass(frozen=True, slots=True)
class Overlap:
    """Two objects that overlap."""

    first: int
    second: int
    depth: float
    """Metres that one must move for them to separate."""


@dataclass(frozen=True, slots=True)
class Measurement:
    """What is wrong with a scene, and which relations hold."""

    violations: Violations
    """Energy and violations as in a certificate of the preset ``default``."""
    overlaps: tuple[Overlap, ...]
    """Pairs that overlap by at least a centimetre and should not, the deepest first."""
    outside: Float[Tensor, " n"]
    """Metres by which each object that belongs in the room reaches out of it."""
    relations: Relations
    """What holds as the boxes are."""

    @property
    def trouble(self) -> Float[Tensor, " n"]:
        """Metres by which each object overlaps another or reaches out of the room, the larger."""
        worst = self.outside.clone()
        for overlap in self.overlaps:
            for k in (overlap.first, overlap.second):
                worst[k] = max(float(worst[k]), overlap.depth)
        return worst


def measure_scene(scene: Scene) -> Measurement:
    """Return what is wrong with a scene as it stands.

    Raises:
        ValueError: boxes, layout or relations that nothing can be measured of.
    """
    violations = arrange(scene, _LOOK).certificate.before
    boxes = scene.objects.boxes
    depth = penetration_depth(boxes[:, None], boxes[None, :]).triu(1)
    depth = depth.masked_fill(nested(scene.objects.category), 0.0)
    first, second = (depth >= SHOWN_FROM).nonzero().unbind(1)
    found = zip(first.tolist(), second.tolist(), depth[first, second].tolist(), strict=True)
    overlaps = sorted((Overlap(a, b, d) for a, b, d in found), key=lambda overlap: -overlap.depth)
    relations = relations_from_boxes(boxes, scene.layout, scene.panorama.camera_height)
    outside = _outside(boxes, scene)
    if scene.relations is not None:
        outside = outside * (scene.relations.inside_room >= 0.5)
    return Measurement(violations, tuple(overlaps), outside, relations)


def _outside(boxes: OrientedBoxes, scene: Scene) -> Float[Tensor, " n"]:
    """Return how far the farthest corner of each box is outside walls, floor or ceiling."""
    layout, half = scene.layout, boxes.size[:, 2] / 2
    corners = box_footprint(boxes).flatten(0, 1)
    aside = signed_distance_to_polygon(corners, layout.floor_polygon.to(corners))
    below = layout.floor_height - boxes.centre[:, 2] + half
    above = boxes.centre[:, 2] + half - layout.ceiling_height
    return torch.stack([aside.reshape(-1, 4).amax(1), below, above]).amax(0).relu()
