"""Doorways: which rooms are connected, where, and how the doors stand."""

from dataclasses import dataclass

import networkx as nx
import numpy as np

from ._manhattan import SharedWall, Walls, shared_walls, walls_of
from ._program import SMALL
from ._records import Opening, OpeningKind, Room

DOOR_HEIGHT = (1.98, 2.12)
DOOR_WIDTH = {"bathroom": (0.68, 0.82), "laundry": (0.68, 0.82)}
_USUAL_WIDTH = (0.76, 0.94)
_JAMB = 0.10
"""Metres between a doorway and the nearest corner, at least."""

_WIDE = {
    frozenset(("living", "dining")): 0.8, frozenset(("living", "kitchen")): 0.35,
    frozenset(("kitchen", "dining")): 0.6, frozenset(("hall", "living")): 0.35,
    frozenset(("hall", "open_plan")): 0.5, frozenset(("open_plan", "dining")): 0.7,
    frozenset(("hall", "dining")): 0.4, frozenset(("hall", "kitchen")): 0.25,
    frozenset(("open_plan", "office")): 0.25, frozenset(("living", "office")): 0.2,
}  # fmt: skip
"""Probability that two rooms are connected by an opening without a door."""
_ALSO = {
    frozenset(("living", "dining")): 0.75, frozenset(("living", "kitchen")): 0.45,
    frozenset(("kitchen", "dining")): 0.75, frozenset(("bedroom", "bathroom")): 0.12,
    frozenset(("living", "office")): 0.2, frozenset(("kitchen", "laundry")): 0.35,
}  # fmt: skip
"""Probability that rooms are connected although there is another way."""


@dataclass(frozen=True, slots=True)
class _Link:
    first: int
    second: int
    shared: SharedWall


@dataclass(frozen=True, slots=True)
class _Taken:
    """Where a doorway is: the segment's ends and the space that its leaf or a person needs."""

    low: tuple[float, float]
    high: tuple[float, float]


def sample_doorways(
    rng: np.random.Generator, rooms: list[Room], thickness: float, entrance: Opening
) -> list[Opening] | None:
    """Return doors and openings that connect all rooms, both entries of each; None if they cannot.

    Rooms are entered from the first room, a hall or a large one, where possible. No door is in
    the way of the entrance.
    """
    links: dict[tuple[int, int], _Link] = {}
    sides = [walls_of(room.polygon) for room in rooms]
    for a in range(len(rooms)):
        for b in range(a + 1, len(rooms)):
            shared = shared_walls(sides[a], sides[b], thickness)
            longest = max(shared, key=lambda part: part.length, default=None)
            if longest is not None and longest.length >= 0.95:
                links[a, b] = _Link(a, b, longest)
    graph = nx.Graph()
    graph.add_nodes_from(range(len(rooms)))
    for a, b in links:
        graph.add_edge(a, b, weight=_reluctance(rooms, a, b))
    if not nx.is_connected(graph):
        return None
    tree = {tuple(sorted(edge)) for edge in nx.minimum_spanning_edges(graph, data=False)}
    # a bedroom or bathroom must not be the way to another room
    for a, b in tree:
        if _reluctance(rooms, a, b) >= 50.0:
            return None
    wanted = list(tree)
    for pair in links:
        kinds = frozenset((rooms[pair[0]].kind, rooms[pair[1]].kind))
        if pair not in tree and rng.random() < _ALSO.get(kinds, 0.0):
            wanted.append(pair)
    walls = walls_of(rooms[entrance.room].polygon)
    segment = _segment(walls, entrance.wall, entrance.start, entrance.width)
    taken = [_zone(segment, walls, entrance.wall, (entrance.width, 0.1))]
    openings: list[Opening] = []
    for pair in sorted(wanted, key=lambda pair: (links[pair].shared.length, pair)):
        both = _doorway(rng, rooms, links[pair], taken)
        if both is None and pair in tree:
            return None
        openings += both or []
    return openings


def _reluctance(rooms: list[Room], a: int, b: int) -> float:
    """Return how odd it is to go from one room to the other; from 50 on it is not done."""
    kinds = {rooms[a].kind, rooms[b].kind}
    if 0 in (a, b):
        return 1.0
    if kinds & {"hall", "open_plan"}:
        return 2.0
    if "living" in kinds and not kinds & {"bathroom"}:
        return 3.0
    if kinds <= {"kitchen", "dining", "laundry"} and kinds != {"laundry"}:
        return 4.0
    if kinds == {"bedroom", "bathroom"}:
        return 6.0
    return 50.0


def _doorway(
    rng: np.random.Generator, rooms: list[Room], link: _Link, taken: list[_Taken]
) -> list[Opening] | None:
    """Return the two entries of a doorway through a shared wall; None when it has no place."""
    a, b, shared = link.first, link.second, link.shared
    kinds = frozenset((rooms[a].kind, rooms[b].kind))
    spare = shared.length - 2 * _JAMB
    kind: OpeningKind = "door"
    small = [DOOR_WIDTH[k] for k in (rooms[a].kind, rooms[b].kind) if k in DOOR_WIDTH]
    width = rng.uniform(*(small[0] if small else _USUAL_WIDTH))
    ceiling = min(rooms[a].ceiling_height, rooms[b].ceiling_height)
    top = rng.uniform(*DOOR_HEIGHT)
    if spare >= 1.1 and rng.random() < _WIDE.get(kinds, 0.0):
        kind = "opening"
        width = min(rng.uniform(1.0, 2.4), spare)
        top = min(rng.uniform(2.05, 2.45), ceiling - 0.15)
    width = min(width, spare)
    if width < 0.66:
        return None
    into_second = _opens_into_second(rng, rooms, a, b)
    for attempt in range(24):
        start = _place(rng, shared, width, kind)
        near_start = start - shared.start < shared.stop - start - width
        walls = walls_of(rooms[a].polygon)
        segment = _segment(walls, shared.wall, start, width)
        deep = width if kind == "door" else 0.5
        reach = (0.45, deep) if into_second else (deep, 0.45)
        zone = _zone(segment, walls, shared.wall, reach if attempt < 16 else (0.3, 0.3))
        if any(_meet(zone, other) for other in taken):
            continue
        taken.append(zone)
        swing = _swing(rng) if kind == "door" else 0.0
        if kind == "door" and into_second:
            swing = -swing
        first = Opening(
            kind, a, shared.wall, start, width, 0.0, top, b, swing=swing,
            hinge_at_start=near_start,
        )  # fmt: skip
        return [first, _mirrored(first, rooms, shared)]
    return None


def _mirrored(opening: Opening, rooms: list[Room], shared: SharedWall) -> Opening:
    """Return the entry of the same doorway for the wall of the room behind."""
    first, second = rooms[opening.room].polygon, rooms[opening.leads_to or 0].polygon
    walls, others = walls_of(first), walls_of(second)
    end = walls.start[shared.wall] + walls.along[shared.wall] * (opening.start + opening.width)
    start = float((end - others.start[shared.other_wall]) @ others.along[shared.other_wall])
    return Opening(
        opening.kind, opening.leads_to or 0, shared.other_wall, start, opening.width,
        opening.bottom, opening.top, opening.room, swing=-opening.swing,
        hinge_at_start=not opening.hinge_at_start,
    )  # fmt: skip


def _place(rng: np.random.Generator, shared: SharedWall, width: float, kind: str) -> float:
    """Return where a doorway begins: doors mostly near a corner, openings mostly in the middle."""
    low = shared.start + _JAMB
    high = max(low, shared.stop - _JAMB - width)
    margin = min(rng.uniform(0.0, 0.12), high - low)
    style = rng.random()
    if kind == "door" and style < 0.7:
        return float(low + margin if rng.random() < 0.5 else high - margin)
    if kind == "opening" and style < 0.5:
        return float((low + high) / 2)
    return float(rng.uniform(low, high))


def _opens_into_second(rng: np.random.Generator, rooms: list[Room], a: int, b: int) -> bool:
    """Return whether the leaf swings into room b: doors open into rooms, not into halls."""
    rank = [
        0 if room == 0 or rooms[room].kind == "hall" else 1 if rooms[room].kind in SMALL else 2
        for room in (a, b)
    ]
    if rank[0] == rank[1]:
        return bool(rng.random() < 0.5)
    return rank[1] > rank[0]


def _swing(rng: np.random.Generator) -> float:
    """Return how far a leaf stands open: a third closed, a fifth ajar, the others open."""
    state = rng.random()
    if state < 0.3:
        return 0.0
    return float(rng.uniform(0.12, 0.7) if state < 0.5 else rng.uniform(1.1, np.pi / 2))


def _segment(walls: Walls, wall: int, start: float, width: float) -> tuple[np.ndarray, np.ndarray]:
    first = walls.start[wall] + walls.along[wall] * start
    return first, first + walls.along[wall] * width


def _zone(
    segment: tuple[np.ndarray, np.ndarray], walls: Walls, wall: int, reach: tuple[float, float]
) -> _Taken:
    inner = segment[0] + walls.normal[wall] * reach[0]
    outer = segment[1] - walls.normal[wall] * reach[1]
    points = np.stack([*segment, inner, outer])
    low, high = points.min(axis=0) - 0.05, points.max(axis=0) + 0.05
    return _Taken((float(low[0]), float(low[1])), (float(high[0]), float(high[1])))


def _meet(a: _Taken, b: _Taken) -> bool:
    return all(
        low < other and other_low < high
        for low, high, other_low, other in zip(a.low, a.high, b.low, b.high, strict=True)
    )
