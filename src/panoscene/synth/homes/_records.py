"""What a furnished home is. Metres; x and y in the plan of the home, z up, floor at 0."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float64

RoomKind = Literal[
    "living", "dining", "kitchen", "bedroom", "child", "bathroom", "hall", "office", "laundry",
    "hobby", "open_plan",
]  # fmt: skip
OpeningKind = Literal["door", "opening", "window"]


@dataclass(frozen=True, slots=True)
class Opening:
    """A hole in a wall of a room: a doorway with or without a door, or a window.

    A doorway between two rooms is listed twice, once for the wall of each room; both entries
    describe the same place, and their swings have opposite signs.
    """

    kind: OpeningKind
    room: int
    """Index of the room whose wall it is in."""
    wall: int
    """Index of the wall: from corner ``wall`` to the next corner of the room's polygon."""
    start: float
    """Metres from the wall's first corner to the nearer jamb."""
    width: float
    bottom: float
    """Metres above the floor; 0 for doors and openings."""
    top: float
    leads_to: int | None = None
    """Index of the room behind; None for the outside."""
    model: str = ""
    """CadModel id of the door or window in it; "" for an empty opening."""
    swing: float = 0.0
    """Radians by which the leaf stands open into ``room``; 0 is closed, negative values open into
    the room behind."""
    hinge_at_start: bool = True
    """Whether the leaf hangs on the jamb nearer to the wall's first corner."""


@dataclass(frozen=True, slots=True)
class Room:
    """One room: its clear inside, without the walls."""

    kind: RoomKind
    polygon: Float64[np.ndarray, "corners 2"]
    """Inner corners in the home's plan, counter-clockwise from above."""
    ceiling_height: float


@dataclass(frozen=True, slots=True)
class Placed:
    """One model in a home."""

    model: str
    """CadModel id."""
    room: int
    position: tuple[float, float, float]
    """Centre of the bounding box in the home's frame, metres."""
    yaw: float
    """Counter-clockwise from above, radians; 0 faces +y."""
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Of the model's width, depth and height: jitter of the size."""
    look: int = 0
    """Seed of the recolouring; 0 keeps the model as it is."""
    support: int | None = None
    """Index of the placed model it stands on; None for floor, wall or ceiling."""
    group: int = -1
    """Pieces that belong together (a table and its chairs) share a number; -1 for none."""
    opening: int | None = None
    """Index of the opening that a door or window fills: the entry of the room it faces, which is
    the room a door swings into. The box is that of the closed leaf."""


@dataclass(frozen=True, slots=True)
class Home:
    """A furnished home. Walls are the space between rooms, ``wall_thickness`` thick."""

    seed: int
    rooms: tuple[Room, ...]
    openings: tuple[Opening, ...]
    placed: tuple[Placed, ...]
    wall_thickness: float = 0.12
    """Between rooms; outer walls are twice as thick."""
