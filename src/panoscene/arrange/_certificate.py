"""What a result is worth: energy and physical violations before and after."""

from dataclasses import asdict, dataclass, fields

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene.arrange._batch import ArrangementBatch
from panoscene.arrange._settings import TERM_NAMES
from panoscene.geometry import (
    OrientedBoxes,
    box_footprint,
    box_in_room_fraction,
    box_volume,
    separation_margins,
    signed_distance_to_polygon,
)

COLLISION_TOLERANCE = 0.1
"""Metres of overlap that the paper's counts forgive."""
SLACK = 1e-5
"""Relative and absolute rounding error that does not count as worse."""


@dataclass(frozen=True, slots=True)
class Violations:
    """Energy and physical violations of one scene."""

    energy: float
    terms: dict[str, float]
    """Weighted energy of each term; they add up to ``energy``."""
    colliding_pairs: int
    """Pairs of objects that overlap by more than 0.1 m (the paper's count)."""
    worst_penetration: float
    """Largest distance in metres that two objects would have to move to separate."""
    total_penetration: float
    """Sum of that distance over all pairs."""
    worst_out_of_room: float
    """Largest distance in metres of a box outside walls, floor or ceiling, among the objects
    that belong in the room (inside_room of at least one half)."""
    out_of_room_volume: float
    """Volume in cubic metres of all boxes outside the room."""

    def as_dict(self) -> dict[str, object]:
        """Return the fields as plain values, for JSON."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class Certificate:
    """What happened to a scene, so that nobody has to trust the optimiser."""

    preset: str
    steps: int
    changed: bool
    """False when the input was returned as it came."""
    converged: bool
    """The last quarter of the steps brought less than 1 % of the energy's decrease."""
    outcome: str
    """In words: why the result is what it is. "solved" is the end of a descent that had converged;
    "improved, not converged" the end of one that had not, so that more steps may help."""
    largest_size_change: float
    """Largest factor, at least 1, by which an extent of any box grew or shrank."""
    left_outside: int
    """Objects that do not belong in the room by their inside_room score, so walls let them be."""
    before: Violations
    after: Violations

    def as_dict(self) -> dict[str, object]:
        """Return the fields as plain values, for JSON."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class Measures:
    """Violations of a batch as tensors, "scenes" each; what ``safe`` compares."""

    energy: Float[Tensor, "scenes terms"]
    pairs: Float[Tensor, " scenes"]
    worst_penetration: Float[Tensor, " scenes"]
    total_penetration: Float[Tensor, " scenes"]
    worst_outside: Float[Tensor, " scenes"]
    outside_volume: Float[Tensor, " scenes"]

    def violations(self, scene: int) -> Violations:
        """Return those of one scene."""
        terms = self.energy[scene].tolist()
        return Violations(
            energy=float(sum(terms)),
            terms=dict(zip(TERM_NAMES, terms, strict=True)),
            colliding_pairs=int(self.pairs[scene]),
            worst_penetration=float(self.worst_penetration[scene]),
            total_penetration=float(self.total_penetration[scene]),
            worst_out_of_room=float(self.worst_outside[scene]),
            out_of_room_volume=float(self.outside_volume[scene]),
        )

    def where(self, mask: Bool[Tensor, " scenes"], other: "Measures") -> "Measures":
        """Return these measures for the scenes of the mask, and the other's elsewhere."""
        pairs = [
            (getattr(self, field.name), getattr(other, field.name)) for field in fields(Measures)
        ]
        return Measures(*[torch.where(mask.view(-1, *[1] * (a.ndim - 1)), a, b) for a, b in pairs])

    def split(self, parts: int) -> "list[Measures]":
        """Return the measures of as many equal parts of the scenes, in order."""
        columns = [getattr(self, field.name).chunk(parts) for field in fields(Measures)]
        return [Measures(*part) for part in zip(*columns, strict=True)]

    def columns(self) -> Float[Tensor, "scenes measures"]:
        """Return everything that must not grow: energy, collisions, out-of-room."""
        return torch.stack(
            [
                self.energy.sum(-1),
                self.pairs,
                self.worst_penetration,
                self.total_penetration,
                self.worst_outside,
                self.outside_volume,
            ],
            -1,
        )

    def acceptable(self, before: "Measures") -> Bool[Tensor, " scenes"]:
        """Return for each scene whether nothing that must not grow has grown."""
        new, old = self.columns(), before.columns()
        return (new <= old + SLACK * (1 + old.abs())).all(-1) & torch.isfinite(new).all(-1)


@dataclass(frozen=True, slots=True)
class Faults:
    """What is wrong with the boxes of a batch, before it is summed up."""

    overlap: Float[Tensor, "scenes n n"]
    """Metres that two objects would have to move to separate."""
    outside: Float[Tensor, "scenes n"]
    """Metres of a box outside the room, for objects that belong in it."""
    volume: Float[Tensor, "scenes n"]
    """Cubic metres of a box outside the room."""


def find_faults(boxes: OrientedBoxes, batch: ArrangementBatch) -> Faults:
    """Return what is wrong with boxes of batch shape (scenes, n)."""
    first = OrientedBoxes(boxes.centre[:, :, None], boxes.size[:, :, None], boxes.yaw[:, :, None])
    other = OrientedBoxes(boxes.centre[:, None], boxes.size[:, None], boxes.yaw[:, None])
    overlap = torch.relu(separation_margins(first, other).amin(-1)) * batch.pair_valid
    valid = batch.valid.to(overlap.dtype)
    corner = box_footprint(boxes)
    aside = signed_distance_to_polygon(corner.flatten(1, 2), batch.polygon)
    aside = aside.unflatten(1, corner.shape[1:3]).amax(-1)
    half = boxes.size[..., 2] / 2
    below = batch.floor_height[:, None] - boxes.centre[..., 2] + half
    above = boxes.centre[..., 2] + half - batch.ceiling_height[:, None]
    outside = torch.relu(torch.stack([aside, below, above]).amax(0)) * valid
    inside = (batch.inside_room >= 0.5).to(valid.dtype)
    fraction = box_in_room_fraction(boxes, batch.polygon, batch.floor_height, batch.ceiling_height)
    volume = box_volume(boxes) * (1 - fraction) * valid
    return Faults(overlap, outside * inside, volume)


def measure(faults: Faults, energy: Float[Tensor, "scenes terms"]) -> Measures:
    """Return the violations of each scene."""
    overlap = faults.overlap
    # the paper takes half the tolerance off each side of both boxes
    pairs = (overlap > COLLISION_TOLERANCE).sum((-1, -2)) / 2

    def worst(values: Tensor) -> Tensor:
        return torch.cat([values, values.new_zeros((len(values), 1))], -1).amax(-1)

    return Measures(
        energy=energy,
        pairs=pairs.to(overlap.dtype),
        worst_penetration=worst(overlap.flatten(1)),
        total_penetration=overlap.sum((-1, -2)) / 2,
        worst_outside=worst(faults.outside),
        outside_volume=faults.volume.sum(-1),
    )
