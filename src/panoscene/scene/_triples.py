"""Relations in words: (bed-0, touching, wall-2), for tables, graphs and people."""

import math
from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from ._categories import CATEGORIES
from ._numbers import numbers_from_tensor
from ._records import Objects, Relations, Scene
from ._relations import relative_yaw_angle

PREDICATES: tuple[str, ...] = (
    "touching",
    "on_floor",
    "under_ceiling",
    "inside_room",
    "farther_than",
    "relative_yaw",
)
"""Names of the relations, in the order of tables."""

ROOM_PARTS: tuple[str, ...] = ("floor", "ceiling", "room")
"""Names that relations use for the room itself; walls are wall-0, wall-1, ..."""


@dataclass(frozen=True, slots=True)
class Triple:
    """One relation in words."""

    subject: str
    """Name of an object."""
    predicate: str
    """One of ``PREDICATES``."""
    object: str
    """Name of an object, of a wall, or of a part of the room."""
    score: float
    """Probability in [0, 1]."""
    angle: float | None = None
    """For ``relative_yaw``: radians counter-clockwise from subject to object, else None."""

    def __str__(self) -> str:
        """Return the triple as a short sentence."""
        turn = "" if self.angle is None else f" {math.degrees(self.angle):+.0f} deg"
        return f"{self.subject} {self.predicate} {self.object}{turn} ({self.score:.2f})"


def object_names(objects: Objects) -> tuple[str, ...]:
    """Return the objects' ids; without ids their category and index, such as ``bed-0``."""
    if objects.id:
        return objects.id
    categories: list[int] = numbers_from_tensor(objects.category)
    return tuple(f"{CATEGORIES[category]}-{k}" for k, category in enumerate(categories))


def wall_names(count: int) -> tuple[str, ...]:
    """Return the names of the walls in the order of the floor polygon.

    Examples:
        >>> wall_names(2)
        ('wall-0', 'wall-1')
    """
    return tuple(f"wall-{wall}" for wall in range(count))


def relation_triples(scene: Scene, *, threshold: float = 0.5) -> list[Triple]:
    """Return all relations with a score of at least ``threshold``, in words.

    Symmetric relations come once: ``touching`` between two objects with the higher of its two
    scores, and ``relative_yaw`` from the object that comes first (the opposite direction is the
    negative angle). Of the 8 relative-yaw bins only the most probable one is considered.

    Raises:
        ValueError: The scene has no relations, or the threshold is not in (0, 1].
    """
    if not 0 < threshold <= 1:
        raise ValueError(f"threshold: expected a number in (0, 1], found {threshold}")
    if scene.relations is None:
        raise ValueError("scene: expected relations, found none; derive them first")
    relations = scene.relations
    names = object_names(scene.objects)
    walls = wall_names(relations.touching_wall.shape[1])
    once = torch.ones_like(relations.touching, dtype=torch.bool).triu(1)
    either = torch.maximum(relations.touching, relations.touching.T)
    triples = _pairs("touching", names, names, torch.where(once, either, 0.0), threshold)
    triples += _pairs("touching", names, walls, relations.touching_wall, threshold)
    triples += _unary(relations, names, threshold)
    triples += _pairs("farther_than", names, names, relations.farther_than, threshold)
    triples += _turns(names, names, relations.relative_yaw, once, threshold)
    everywhere = torch.ones_like(relations.touching_wall, dtype=torch.bool)
    triples += _turns(names, walls, relations.relative_yaw_wall, everywhere, threshold)
    return triples


def _pairs(
    predicate: str,
    subjects: tuple[str, ...],
    objects: tuple[str, ...],
    score: Float[Tensor, "a b"],
    threshold: float,
) -> list[Triple]:
    chosen = score >= threshold
    places: list[list[int]] = numbers_from_tensor(chosen.nonzero())
    values: list[float] = numbers_from_tensor(score[chosen])
    return [
        Triple(subjects[a], predicate, objects[b], value)
        for (a, b), value in zip(places, values, strict=True)
    ]


def _unary(relations: Relations, names: tuple[str, ...], threshold: float) -> list[Triple]:
    triples: list[Triple] = []
    for predicate, part, score in (
        ("on_floor", "floor", relations.on_floor),
        ("under_ceiling", "ceiling", relations.under_ceiling),
        ("inside_room", "room", relations.inside_room),
    ):
        triples += _pairs(predicate, names, (part,), score[:, None], threshold)
    return triples


def _turns(
    subjects: tuple[str, ...],
    objects: tuple[str, ...],
    probability: Float[Tensor, "a b 8"],
    allowed: Bool[Tensor, "a b"],
    threshold: float,
) -> list[Triple]:
    score = probability.amax(dim=-1)
    chosen = (score >= threshold) & allowed
    angle = relative_yaw_angle(probability)
    places: list[list[int]] = numbers_from_tensor(chosen.nonzero())
    values: list[float] = numbers_from_tensor(score[chosen])
    angles: list[float] = numbers_from_tensor(angle[chosen])
    return [
        Triple(subjects[a], "relative_yaw", objects[b], value, turn)
        for (a, b), value, turn in zip(places, values, angles, strict=True)
    ]
