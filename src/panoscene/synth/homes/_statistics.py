"""What a set of homes is like, in numbers."""

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from panoscene.scene import CATEGORIES

from ._boxes import placed_boxes
from ._library import ModelLibrary
from ._manhattan import area_of
from ._records import Home


@dataclass(frozen=True, slots=True)
class HomeStatistics:
    """Counts and shares over a set of homes."""

    homes: int
    rooms: int
    room_counts: dict[int, int]
    """Homes by their number of rooms."""
    corner_shares: dict[int, float]
    """Share of the rooms with 4, 6, 8, and 10 or more corners."""
    kinds: dict[str, int]
    """Rooms of each kind."""
    areas: dict[str, tuple[float, float, float]]
    """Smallest, mean and largest area of each kind of room, square metres."""
    ceilings: tuple[float, float, float]
    """Lowest, mean and highest ceiling, metres."""
    windows_per_room: float
    door_states: dict[str, float]
    """Share of the inner doorways: "closed", "ajar" (less than 45 degrees), "open", and "opening"
    for those without a door."""
    objects_per_room: dict[str, float]
    """Mean number of pieces of the 57 categories by kind of room; their doors and windows count."""
    objects_mean: float
    """The same over all rooms."""
    categories: dict[str, int]
    """Pieces of each of the 57 categories; empty without a library."""


def home_statistics(homes: Sequence[Home], library: ModelLibrary | None = None) -> HomeStatistics:
    """Return what a set of homes is like.

    Args:
        homes: at least one.
        library: the models they were furnished from; without it pieces are not counted.

    Raises:
        ValueError: if there is no home.
    """
    if not homes:
        raise ValueError("homes: expected at least one, found none")
    rooms = [room for home in homes for room in home.rooms]
    areas: defaultdict[str, list[float]] = defaultdict(list)
    for room in rooms:
        areas[room.kind].append(area_of(room.polygon))
    corners = Counter(min(len(room.polygon), 10) for room in rooms)
    heights = np.array([room.ceiling_height for room in rooms])
    categories: Counter[str] = Counter()
    pieces: defaultdict[str, list[int]] = defaultdict(list)
    for home in homes if library is not None else ():
        names = placed_boxes(home, library).category if library is not None else ()
        inside = Counter(piece.room for piece, name in zip(home.placed, names, strict=True) if name)
        categories.update(name for name in names if name)
        for index, room in enumerate(home.rooms):
            pieces[room.kind].append(inside[index])
    openings = [opening for home in homes for opening in home.openings]
    total = sum(sum(counts) for counts in pieces.values())
    return HomeStatistics(
        homes=len(homes),
        rooms=len(rooms),
        room_counts=dict(sorted(Counter(len(home.rooms) for home in homes).items())),
        corner_shares={n: corners[n] / len(rooms) for n in (4, 6, 8, 10)},
        kinds=dict(Counter(room.kind for room in rooms).most_common()),
        areas={kind: (min(a), sum(a) / len(a), max(a)) for kind, a in sorted(areas.items())},
        ceilings=(float(heights.min()), float(heights.mean()), float(heights.max())),
        windows_per_room=sum(o.kind == "window" for o in openings) / len(rooms),
        door_states=_door_states(homes),
        objects_per_room={kind: sum(n) / len(n) for kind, n in sorted(pieces.items())},
        objects_mean=total / len(rooms),
        categories={name: categories[name] for name in CATEGORIES} if library is not None else {},
    )


def _door_states(homes: Sequence[Home]) -> dict[str, float]:
    states: Counter[str] = Counter()
    for opening in (o for home in homes for o in home.openings if o.leads_to is not None):
        swing = abs(opening.swing)
        state = "closed" if swing == 0.0 else "ajar" if swing < np.pi / 4 else "open"
        states[opening.kind if opening.kind == "opening" else state] += 1
    return {
        state: states[state] / max(states.total(), 1)
        for state in ("closed", "ajar", "open", "opening")
    }
