"""Windows and the front door: holes in the outer walls."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from ._manhattan import Walls, area_of, blocks_around, walls_of
from ._records import Opening, Room, RoomKind

_FREE_OUTSIDE = 1.2
"""Metres of open air that a window needs."""
_CORNER = 0.28
"""Metres between a window and the nearest corner of the room, at least."""

SILL: dict[RoomKind, tuple[float, float]] = {
    "kitchen": (0.98, 1.12), "bathroom": (1.10, 1.45), "laundry": (1.05, 1.4),
    "living": (0.60, 0.92), "dining": (0.70, 0.92), "open_plan": (0.90, 1.0),
    "hall": (0.85, 1.2),
}  # fmt: skip
_USUAL_SILL = (0.78, 0.95)
_FRENCH: dict[RoomKind, float] = {"living": 0.4, "open_plan": 0.4, "dining": 0.3, "bedroom": 0.12}
"""Probability of windows down to the floor."""
_WINDOWLESS: dict[RoomKind, float] = {"bathroom": 0.4, "hall": 0.5, "laundry": 0.4}
"""Probability that a room with outer walls has no window all the same."""


@dataclass(frozen=True, slots=True)
class OuterPart:
    """A part of a room's wall behind which there is open air."""

    room: int
    wall: int
    start: float
    stop: float
    side: int
    """Quarter of the compass it faces, 0 to 3."""

    @property
    def length(self) -> float:
        """Metres."""
        return self.stop - self.start


def outer_parts(
    rooms: list[Room], solids: Float[np.ndarray, "blocks 4"], thickness: float
) -> list[OuterPart]:
    """Return the parts of walls with open air behind.

    Args:
        rooms: all rooms of the home.
        solids: rectangles without air that are not rooms, such as shafts.
        thickness: of the walls between rooms; outer walls are twice as thick.
    """
    filled = np.concatenate([*(_pieces(room.polygon) for room in rooms), solids])
    parts: list[OuterPart] = []
    for index, room in enumerate(rooms):
        walls = walls_of(room.polygon)
        for wall in range(len(walls.length)):
            side = int(np.round(np.degrees(walls.yaw[wall]) / 90.0)) % 4
            parts += [
                OuterPart(index, wall, start, stop, side)
                for start, stop in _free(walls, wall, filled, thickness)
            ]
    return parts


def _pieces(polygon: Float[np.ndarray, "corners 2"]) -> Float[np.ndarray, "pieces 4"]:
    """Return the rectangles that make up a room."""
    xs, ys = np.unique(polygon[:, 0]), np.unique(polygon[:, 1])
    cells = np.array([(a, b, c, d) for a, c in pairwise(xs) for b, d in pairwise(ys)])
    blocks = {tuple(block) for block in blocks_around(polygon).round(6)}
    return np.array([cell for cell in cells if tuple(cell.round(6)) not in blocks])


def _free(
    walls: Walls, wall: int, filled: Float[np.ndarray, "blocks 4"], thickness: float
) -> list[tuple[float, float]]:
    """Return the parts of a wall (metres along it) behind which nothing is filled."""
    low, high = filled[:, :2], filled[:, 2:]
    out, along, start = -walls.normal[wall], walls.along[wall], walls.start[wall]
    ends = np.stack([(low - start) @ out, (high - start) @ out])
    behind = (ends.max(axis=0) > 0.02) & (ends.min(axis=0) < 2 * thickness + _FREE_OUTSIDE)
    spans = np.stack([(low - start) @ along, (high - start) @ along])[:, behind]
    begin, end = spans.min(axis=0) - thickness, spans.max(axis=0) + thickness
    free: list[tuple[float, float]] = []
    position = 0.0
    for k in np.argsort(begin):
        if begin[k] > position:
            free.append((position, float(min(begin[k], walls.length[wall]))))
        position = max(position, float(end[k]))
    if position < walls.length[wall]:
        free.append((position, float(walls.length[wall])))
    return [(a, b) for a, b in free if b - a > 0.05]


def front_door(rng: np.random.Generator, parts: list[OuterPart]) -> Opening | None:
    """Return the door through which the home is entered, in its hall or largest room."""
    usual = rng.uniform(0.9, 1.02)
    able = [p for p in parts if p.room == 0 and p.length >= 1.02]
    if not able:
        return None
    shortness = np.array([1.0 / p.length**2 for p in able])
    part = able[int(rng.choice(len(able), p=shortness / shortness.sum()))]
    width = min(usual, part.length - 0.2)
    share = rng.choice([0.0, 0.5, 1.0]) if part.length < 2.2 else rng.choice([0.0, 1.0])
    start = part.start + 0.1 + share * (part.length - width - 0.2)
    return Opening(
        "door", 0, part.wall, float(start), float(width), 0.0, float(rng.uniform(2.0, 2.12)),
        None, hinge_at_start=bool(share < 0.5),
    )  # fmt: skip


def sample_windows(
    rng: np.random.Generator, rooms: list[Room], parts: list[OuterPart], doors: list[Opening]
) -> list[Opening]:
    """Return windows in the outer walls: similar ones within a home, larger ones in living rooms.

    Some sides of an apartment are without windows, as another one begins there; rooms that would
    be dark then have their windows on such a side all the same.
    """
    house = rng.random() < 0.45
    blind = set() if house else set(rng.permutation(4)[: int(rng.integers(1, 3))].tolist())
    top = rng.uniform(2.08, 2.35)
    french = rng.random()
    windows: list[Opening] = []
    for index, room in enumerate(rooms):
        if rng.random() < _WINDOWLESS.get(room.kind, 0.0):
            continue
        able = _without_doors([p for p in parts if p.room == index], doors)
        bright = [p for p in able if p.side not in blind]
        if room.kind in _WINDOWLESS:
            able = bright
        low, high = SILL.get(room.kind, _USUAL_SILL)
        sill = rng.uniform(low, high)
        if french < _FRENCH.get(room.kind, 0.0):
            sill = rng.choice([0.0, 0.08])
        windows += _in_room(rng, index, room, bright or able, (float(sill), top))
    return windows


def _without_doors(parts: list[OuterPart], doors: list[Opening]) -> list[OuterPart]:
    """Return the parts of walls that doors leave free."""
    for door in doors:
        rest: list[OuterPart] = []
        for part in parts:
            if (part.room, part.wall) != (door.room, door.wall):
                rest.append(part)
                continue
            before, after = door.start - 0.35, door.start + door.width + 0.35
            rest += [
                OuterPart(part.room, part.wall, a, b, part.side)
                for a, b in (
                    (part.start, min(part.stop, before)),
                    (max(part.start, after), part.stop),
                )
                if b - a > 0.05
            ]
        parts = rest
    return [part for part in parts if part.length >= 0.5 + 2 * _CORNER]


def _in_room(
    rng: np.random.Generator,
    index: int,
    room: Room,
    parts: list[OuterPart],
    heights: tuple[float, float],
) -> list[Opening]:
    """Return the windows of one room, the longest walls first, until there is enough glass."""
    sill, top = heights
    small = room.kind in ("bathroom", "laundry", "hall")
    top = min(top + (0.04 if sill < 0.2 else 0.0), room.ceiling_height - 0.18)
    wanted = area_of(room.polygon) * (0.04 if small else rng.uniform(0.10, 0.20))
    common = rng.uniform(0.55, 0.8) if small else rng.uniform(0.85, 1.9)
    windows: list[Opening] = []
    for part in sorted(parts, key=lambda p: (-p.length * rng.uniform(0.6, 1.0), p.wall)):
        spare = part.length - 2 * _CORNER
        width = min(common, spare)
        low = sill if spare > 0.8 or sill > 0.2 else 0.9
        if width < 0.5 or top - low < 0.45:
            continue
        fit = 1 + int((spare - width) / (width + 0.6))
        count = min(fit, 3, max(1, int(np.ceil(wanted / (width * (top - low))))))
        gap = (spare - count * width) / count
        shift = rng.uniform(0.2, 0.8) if count == 1 else 0.5
        for k in range(count):
            start = part.start + _CORNER + k * (width + gap) + shift * gap
            windows.append(
                Opening("window", index, part.wall, float(start), float(width), low, float(top))
            )
        wanted -= count * width * (top - low)
        if wanted <= 0.0 or (small and windows):
            break
    return windows
