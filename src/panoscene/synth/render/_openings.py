"""Where the holes in the walls of a home are, seen from both rooms."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float64

from panoscene.synth.homes._records import Home, Opening

_DEEPEST_WALL = 0.8


class WallFrame(NamedTuple):
    """A wall's own frame: along it, up, and out of the room."""

    origin: Float64[np.ndarray, "2"]
    along: Float64[np.ndarray, "2"]
    outward: Float64[np.ndarray, "2"]
    length: float

    def place(self, s, out, z) -> Float64[np.ndarray, "... 3"]:
        """Return points from metres along the wall, out of the room and above the floor."""
        s, out, z = np.broadcast_arrays(*(np.asarray(a, float) for a in (s, out, z)))
        plan = self.origin + s[..., None] * self.along + out[..., None] * self.outward
        return np.concatenate([plan, z[..., None]], axis=-1)


class Hole(NamedTuple):
    """An opening as a rectangle in one wall."""

    opening: int
    start: float
    end: float
    bottom: float
    top: float


def wall_frame(polygon: Float64[np.ndarray, "corners 2"], wall: int) -> WallFrame:
    """Return the frame of a wall of a counter-clockwise polygon."""
    a, b = polygon[wall], polygon[(wall + 1) % len(polygon)]
    length = float(np.linalg.norm(b - a))
    along = (b - a) / length
    return WallFrame(a, along, np.array([along[1], -along[0]]), length)


def wall_depth(home: Home, index: int) -> float:
    """Return how thick the wall around an opening is, in metres."""
    opening = home.openings[index]
    other = wall_behind(home, opening)
    return 2 * home.wall_thickness if other is None else max(other[2], 0.02)


def wall_behind(home: Home, opening: Opening) -> tuple[int, float, float] | None:
    """Return the wall of the room behind that an opening pierces.

    Its index, the metres along it to the nearer jamb, and the distance between both walls; None
    when the opening leads outside or no wall of that room is there.
    """
    if opening.leads_to is None:
        return None
    frame = wall_frame(home.rooms[opening.room].polygon, opening.wall)
    middle = frame.origin + frame.along * (opening.start + opening.width / 2)
    polygon = home.rooms[opening.leads_to].polygon
    best = None
    for index in range(len(polygon)):
        back = wall_frame(polygon, index)
        apart = float((back.origin - middle) @ frame.outward)
        along = float((middle - back.origin) @ back.along)
        facing = float(back.along @ frame.along) < -0.99
        inside = (
            along - opening.width / 2 > -0.01 and along + opening.width / 2 < back.length + 0.01
        )
        if facing and inside and -0.01 <= apart < (best[2] if best else _DEEPEST_WALL):
            best = (index, along - opening.width / 2, apart)
    return best


def holes_of(home: Home) -> dict[tuple[int, int], list[Hole]]:
    """Return the holes by room and wall; those between two rooms are in both."""
    holes: dict[tuple[int, int], list[Hole]] = {}
    for index, o in enumerate(home.openings):
        hole = Hole(index, o.start, o.start + o.width, o.bottom, o.top)
        holes.setdefault((o.room, o.wall), []).append(hole)
    for index, o in enumerate(home.openings):
        behind = wall_behind(home, o)
        if behind is None or o.leads_to is None:
            continue
        wall, start, _ = behind
        there = holes.setdefault((o.leads_to, wall), [])
        # a doorway may be listed from both sides
        if not any(h.start < start + o.width - 0.05 and start + 0.05 < h.end for h in there):
            there.append(Hole(index, start, start + o.width, o.bottom, o.top))
    return holes


def is_passable(opening: Opening) -> bool:
    """Return whether light passes: there is no door in the opening, or it is not shut."""
    return opening.leads_to is not None and (opening.kind != "door" or abs(opening.swing) > 0.05)


def is_second_entry(home: Home, index: int) -> bool:
    """Return whether the same doorway is listed before, for the room behind."""
    o = home.openings[index]
    here = wall_frame(home.rooms[o.room].polygon, o.wall).place(o.start + o.width / 2, 0.0, 0.0)
    for other in home.openings[:index]:
        if other.room == o.leads_to and other.leads_to == o.room:
            frame = wall_frame(home.rooms[other.room].polygon, other.wall)
            there = frame.place(other.start + other.width / 2, 0.0, 0.0)
            if float(np.linalg.norm(here - there)) < _DEEPEST_WALL:
                return True
    return False
