"""Where the names of objects go on a panorama: on or beside their objects, clear of each other."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

_SHARES = np.linspace(0.0, 1.0, 5)
_RINGS = (0.15, 1.0, 2.0, 3.2, 4.6)
"""Gaps between an object and a label beside it, in heights of a label."""
_ANGLES = np.arange(24) * np.pi / 12
_ON_LABEL, _ON_OBJECT, _ON_OWN, _PER_GAP = 400.0, 6.0, 5.0, 2.5
"""What it costs to cover all of another label, of other objects, of a small object itself, and
to be one height away."""


@dataclass(frozen=True, slots=True)
class Target:
    """An object that wants a label, in pixels with v down; u may leave the picture at the seam."""

    index: int
    box: Float[np.ndarray, " 4"]
    """Left, top, right, bottom of what is seen of the object."""
    size: tuple[float, float]
    """Width and height of the label."""


@dataclass(frozen=True, slots=True)
class Placed:
    """A label at its place."""

    index: int
    u: float
    v: float
    """Middle of the label."""
    leader: tuple[float, float] | None
    """The point of the object that a thin line leads to, from a label that lies apart."""


def place_labels(targets: Sequence[Target], width: int, height: int) -> list[Placed]:
    """Return one label for each object, all inside a picture of this size.

    Small objects choose first. Labels prefer the middle of their object where it is large enough,
    then the space just above it; they avoid each other before all, then other objects.
    """
    boxes = np.array([target.box for target in targets]).reshape(-1, 4)
    taken = np.zeros((0, 4))
    placed: list[Placed] = []
    area = (boxes[:, 2] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 1])
    for k in np.argsort(area, kind="stable"):
        target = targets[k]
        others = np.delete(boxes, k, axis=0)
        place = _candidates(target)
        cost = _cost(target, place, taken, others, width)
        u, v = place[int(np.argmin(cost))]
        half_width, half_height = target.size[0] / 2 + 1, target.size[1] / 2 + 1
        # at the seam one side is chosen, and the label stays on it
        u = np.clip(u % width, half_width, max(width - half_width, half_width))
        v = np.clip(v, half_height, max(height - half_height, half_height))
        rectangle = np.array([u - half_width, v - half_height, u + half_width, v + half_height])
        taken = np.concatenate([taken, rectangle[None]])
        placed.append(Placed(target.index, float(u), float(v), _leader(target, rectangle, width)))
    return placed


def _candidates(target: Target) -> Float[np.ndarray, "places 2"]:
    """Return middles of the label on a grid in the object, and on rings around it."""
    left, top, right, bottom = target.box
    width, height = target.size
    pad_u, pad_v = min(width, right - left) / 2, min(height, bottom - top) / 2
    u = left + pad_u + _SHARES * (right - left - 2 * pad_u)
    v = top + pad_v + _SHARES * (bottom - top - 2 * pad_v)
    inside = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    middle = np.array([(left + right) / 2, (top + bottom) / 2])
    rings = []
    for gap in _RINGS:
        half = np.array([(right - left + width) / 2, (bottom - top + height) / 2]) + gap * height
        direction = np.stack([np.sin(_ANGLES), -np.cos(_ANGLES)], axis=-1)
        # around the rectangle, not around a circle
        rings.append(middle + half * direction / np.abs(direction).max(-1, keepdims=True))
    return np.concatenate([inside, *rings])


def _cost(
    target: Target,
    place: Float[np.ndarray, "places 2"],
    taken: Float[np.ndarray, "labels 4"],
    others: Float[np.ndarray, "objects 4"],
    width: int,
) -> Float[np.ndarray, " places"]:
    size = np.array(target.size)
    # a label that would leave the picture is moved back into it when it is placed
    inside = np.clip(place[:, 0] % width, size[0] / 2, width - size[0] / 2)
    wrapped = np.stack([inside, place[:, 1]], axis=-1)
    rectangle = np.concatenate([wrapped - size / 2, wrapped + size / 2], axis=-1)
    near = np.concatenate([place - size / 2, place + size / 2], axis=-1)
    area = size.prod()
    own = target.box
    span = np.maximum(own[2:] - own[:2], 1.0)
    middle = (own[:2] + own[2:]) / 2
    offset = np.linalg.norm((place - middle) / (span + 2 * size), axis=-1)
    covered = _shared(near, own[None])[:, 0] / span.prod()
    gap = np.maximum(np.maximum(near[:, :2] - own[2:], own[:2] - near[:, 2:]), 0.0).max(-1)
    moved = np.abs(wrapped[:, 0] - place[:, 0] % width) / size[1]
    below = (place[:, 1] > own[3]) * 0.6
    shifted = np.concatenate([others + shift for shift in _turns(width)])
    return (
        _ON_LABEL * (_shared(rectangle, taken).sum(-1) / area)
        + _ON_OBJECT * np.minimum(_hidden_parts(rectangle, shifted), 1.5)
        + _ON_OWN * np.minimum(covered, 1.0)
        + _PER_GAP * gap / size[1]
        + 2.0 * offset
        + moved
        + below
    )


def _turns(width: int) -> Float[np.ndarray, "3 4"]:
    """Return what moves a rectangle by a whole turn to the left, not at all, and to the right."""
    return np.outer([-width, 0.0, width], [1.0, 0.0, 1.0, 0.0])


def _hidden_parts(
    rectangle: Float[np.ndarray, "places 4"], boxes: Float[np.ndarray, "objects 4"]
) -> Float[np.ndarray, " places"]:
    """Return how much of other objects each label covers; much of a small one counts most."""
    if not len(boxes):
        return np.zeros(len(rectangle))
    area = np.maximum((boxes[:, 2:] - boxes[:, :2]).prod(-1), 1.0)
    return (_shared(rectangle, boxes) / area).sum(-1)


def _shared(a: Float[np.ndarray, "m 4"], b: Float[np.ndarray, "n 4"]) -> Float[np.ndarray, "m n"]:
    """Return the areas that rectangles share."""
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, 2:], b[None, :, 2:])
    return np.maximum(high - low, 0.0).prod(-1)


def _leader(
    target: Target, rectangle: Float[np.ndarray, " 4"], width: int
) -> tuple[float, float] | None:
    """Return the point of the object nearest to a label apart from it, None if it is at it."""
    middle = (rectangle[:2] + rectangle[2:]) / 2
    shifts = [target.box + shift for shift in _turns(width)]
    nearest = [np.clip(middle, box[:2], box[2:]) for box in shifts]
    gaps = [
        np.maximum(np.maximum(point - rectangle[2:], rectangle[:2] - point), 0.0).max()
        for point in nearest
    ]
    best = int(np.argmin(gaps))
    if gaps[best] < 0.6 * target.size[1]:
        return None
    # a little into the object, so that it is clear which one is meant
    box = shifts[best]
    centre = (box[:2] + box[2:]) / 2
    inward = centre - nearest[best]
    point = nearest[best] + inward * min(1.0, 6.0 / max(float(np.linalg.norm(inward)), 1e-9))
    return float(point[0]), float(point[1])
