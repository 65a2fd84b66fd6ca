"""What settling says of a home."""

from dataclasses import dataclass
from typing import Literal, Protocol, runtime_checkable

from panoscene.synth.assets import CadModel

Outcome = Literal["fixed", "kept", "settled", "shifted", "removed"]
"""``fixed`` on a wall or ceiling or lying flat; ``kept`` where it was; ``settled`` moved by the
engine or on its support; ``shifted`` put aside because it was in something; ``removed``."""


@runtime_checkable
class Models(Protocol):
    """Models by id: a dictionary or a library."""

    def __getitem__(self, identifier: str, /) -> CadModel:
        """Return a model."""
        ...

    def __contains__(self, identifier: object, /) -> bool:
        """Return whether there is a model of this id."""
        ...


@dataclass(frozen=True, slots=True)
class ObjectReport:
    """What became of one placed model. Metres and radians."""

    index: int
    """In the home that was given."""
    model: str
    outcome: Outcome
    moved: float = 0.0
    """Distance from where it was put."""
    turned: float = 0.0
    """Change of its yaw."""
    tilt: float = 0.0
    """Angle to the vertical in the engine, before it was set upright again."""
    penetration: float = 0.0
    """Deepest overlap with another mesh, a wall or the floor that is left."""
    gap: float = 0.0
    """Free height between it and what it stands on, or free depth to the wall it hangs on."""
    reason: str = ""
    """Why it was removed or shifted."""


@dataclass(frozen=True, slots=True)
class SettleReport:
    """What became of all placed models of a home."""

    objects: tuple[ObjectReport, ...]
    """In the order of the home that was given."""
    steps: int
    """Engine steps of all rooms together."""

    @property
    def removed(self) -> tuple[ObjectReport, ...]:
        """The models that are not in the settled home."""
        return tuple(found for found in self.objects if found.outcome == "removed")

    @property
    def penetration(self) -> float:
        """Deepest overlap in the settled home, metres."""
        left = (found.penetration for found in self.objects if found.outcome != "removed")
        return max(left, default=0.0)

    @property
    def gap(self) -> float:
        """Greatest gap in the settled home, metres."""
        return max((f.gap for f in self.objects if f.outcome != "removed"), default=0.0)


@dataclass(frozen=True, slots=True)
class Fault:
    """Something wrong with a home at mesh level."""

    kind: Literal["penetration", "floating", "outside"]
    first: int
    """Index of the placed model."""
    second: int | None
    """Index of the other model; None for floor, ceiling and walls."""
    depth: float
    """Of the overlap or the gap, metres."""
