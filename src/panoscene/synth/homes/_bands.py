"""Floor plans: a hall or a large room, and bands of rooms on one or both of its long sides."""

from dataclasses import dataclass, field

import numpy as np

from ._manhattan import Rect
from ._program import LEAST_WIDTH, PUBLIC, SMALL, RoomNeed
from ._records import RoomKind


@dataclass(slots=True)
class Draft:
    """A room of a plan in the making."""

    kind: RoomKind
    rects: list[Rect] = field(default_factory=list)
    """Rectangles between the centre lines of the walls; together they are the room."""
    cuts: list[Rect] = field(default_factory=list)
    """Solid blocks in it: shafts and chimney breasts."""


@dataclass(slots=True)
class _Slot:
    """A place in a band: a room, or a part of the strip (``room`` 0) that reaches into it."""

    room: int
    width: float
    left: float = 0.0

    @property
    def right(self) -> float:
        return self.left + self.width


_STRIP = 0


def draft_plan(rng: np.random.Generator, needs: list[RoomNeed]) -> list[Draft]:
    """Return rooms in the order of ``needs``, as rectangles between the walls' centre lines.

    The first room is the strip along which the others lie in one or two bands. Its parts may
    reach through a band to the outside, small rooms may be cut out of their neighbours, and rooms
    at the end of a hall may take its end.
    """
    rooms = [Draft(need.kind) for need in needs]
    hub = needs[_STRIP].kind != "hall"
    upper, lower = _split(rng, needs)
    depths = [_depth(rng, needs, band) for band in (upper, lower)]
    bands = [
        _slots(rng, needs, band, depth) for band, depth in zip((upper, lower), depths, strict=True)
    ]
    _reach_through(rng, bands, hub=hub)
    least = np.sqrt(needs[_STRIP].area) * rng.uniform(0.95, 1.3) if hub else 0.0
    length = _lay_out(rng, bands, least)
    if hub:
        across = max(needs[_STRIP].area / length, 3.1)
        if across * 1.9 > 2.4 * length:
            across = length * rng.uniform(0.8, 1.1)
    else:
        across = rng.uniform(1.2, 1.75)
    across = _cm(across)
    start, stop = (0.0, _cm(length)) if hub else _span(bands)
    if not hub:
        start, stop = _take_ends(rng, rooms, bands, across, (start, stop))
    rooms[_STRIP].rects.append((start, 0.0, stop, across))
    for side, (band, depth) in enumerate(zip(bands, depths, strict=True)):
        _fill(rng, rooms, needs, band, depth, side=side, across=across)
    return rooms


def _cm(value: float) -> float:
    return round(float(value), 2)


def _split(rng: np.random.Generator, needs: list[RoomNeed]) -> tuple[list[int], list[int]]:
    """Return which rooms lie above the strip and which below, from left to right.

    Public rooms are neighbours: the ring of rooms (above from right to left, then below from left
    to right) starts with them.
    """
    others = np.arange(1, len(needs))
    public = [int(k) for k in rng.permutation(others) if needs[k].kind in PUBLIC]
    private = [int(k) for k in rng.permutation(others) if needs[k].kind not in PUBLIC]
    ring = public + private
    hub = needs[_STRIP].kind != "hall"
    one_band = len(ring) <= 2 if hub else len(ring) <= 1
    if one_band or (len(ring) <= 3 and rng.random() < 0.4):
        return ring, []
    area = np.cumsum([needs[k].area for k in ring]) / sum(needs[k].area for k in ring)
    cut = 1 + int(np.abs(area[:-1] - rng.uniform(0.42, 0.58)).argmin())
    return ring[:cut][::-1], ring[cut:]


def _depth(rng: np.random.Generator, needs: list[RoomNeed], band: list[int]) -> float:
    if not band:
        return 0.0
    largest = max(needs[k].area for k in band)
    return _cm(np.clip(np.sqrt(largest) * rng.uniform(0.86, 1.06), 2.4, 4.9))


def _slots(
    rng: np.random.Generator, needs: list[RoomNeed], band: list[int], depth: float
) -> list[_Slot]:
    slots: list[_Slot] = []
    for k in band:
        least = LEAST_WIDTH[needs[k].kind] * rng.uniform(1.0, 1.15)
        slots.append(_Slot(k, max(needs[k].area / depth, least, depth / 2.3)))
    return slots


def _reach_through(rng: np.random.Generator, bands: list[list[_Slot]], *, hub: bool) -> None:
    """Let the strip reach through a band: an entrance, or an alcove of the large room."""
    few = hub and sum(len(band) for band in bands) == 1
    if rng.random() < (0.6 if few else 0.22 if hub else 0.3):
        band = bands[int(rng.integers(2)) if bands[1] else 0]
        width = rng.uniform(1.9, 3.0) if hub else rng.uniform(1.35, 1.9)
        band.insert(int(rng.integers(len(band) + 1)), _Slot(_STRIP, float(width)))


def _lay_out(rng: np.random.Generator, bands: list[list[_Slot]], least: float) -> float:
    """Set where the slots lie along the strip and return the strip's length."""
    lengths = [sum(slot.width for slot in band) for band in bands]
    longest = max(*lengths, least)
    for band, length in zip(bands, lengths, strict=True):
        if not band:
            continue
        stretch = longest / length
        if stretch > 1.28:
            stretch = rng.uniform(1.0, 1.15)
        left = 0.0 if rng.random() < 0.5 else longest - length * stretch
        if stretch == longest / length:
            left = 0.0
        for slot in band:
            right = left + slot.width * stretch
            slot.left, slot.width = _cm(left), _cm(right) - _cm(left)
            left = right
    return longest


def _span(bands: list[list[_Slot]]) -> tuple[float, float]:
    slots = [slot for band in bands for slot in band]
    return _cm(min(s.left for s in slots)), _cm(max(s.right for s in slots))


def _take_ends(
    rng: np.random.Generator,
    rooms: list[Draft],
    bands: list[list[_Slot]],
    across: float,
    span: tuple[float, float],
) -> tuple[float, float]:
    """Give ends of the hall to the rooms there and return where it begins and ends then."""
    start, stop = span
    reaches = any(slot.room == _STRIP for band in bands for slot in band)
    sides = [1] if not reaches else [0, 1]
    for side in sides:
        if rng.random() > 0.72:
            continue
        edge = (start, stop)[side]
        ends = [band[-side] for band in bands if band]
        at_edge = [s for s in ends if abs((s.left, s.right)[side] - edge) < 0.005]
        takers = [s for s in at_edge if s.room != _STRIP and rooms[s.room].kind not in SMALL]
        if not takers:
            continue
        taker = takers[int(rng.integers(len(takers)))]
        rest = [s for s in ends if s is not taker]
        spare = min([s.width for s in rest if s in at_edge], default=99.0) - 1.25
        if spare >= taker.width and rng.random() < 0.75:
            width = taker.width
        else:
            width = min(spare, taker.width - 1.2)
            if width < 1.1:
                continue
            width = rng.uniform(1.1, width)
        if stop - start - width < 1.4:
            continue
        cut = _cm(edge - width if side else edge + width)
        if side:
            rooms[taker.room].rects.append((cut, 0.0, stop, across))
            stop = cut
        else:
            rooms[taker.room].rects.append((start, 0.0, cut, across))
            start = cut
    return start, stop


def _fill(
    rng: np.random.Generator,
    rooms: list[Draft],
    needs: list[RoomNeed],
    band: list[_Slot],
    depth: float,
    *,
    side: int,
    across: float,
) -> None:
    """Add the rectangles of one band's rooms; small rooms may leave the rear to a neighbour."""
    for place, slot in enumerate(band):
        near, far = 0.0, depth
        need = needs[slot.room]
        around = [band[k] for k in (place - 1, place + 1) if 0 <= k < len(band)]
        hosts = [s for s in around if s.room != _STRIP and needs[s.room].kind not in SMALL]
        deep = _cm(np.clip(need.area / slot.width, 1.9, max(depth - 1.5, 1.9)))
        if need.kind in SMALL and hosts and depth - deep >= 1.45 and rng.random() < 0.5:
            host = hosts[int(rng.integers(len(hosts)))]
            rooms[host.room].rects.append(
                _placed((slot.left, slot.right), (deep, depth), side=side, across=across)
            )
            far = deep
        rooms[slot.room].rects.append(
            _placed((slot.left, slot.right), (near, far), side=side, across=across)
        )


def _placed(
    sides: tuple[float, float], depths: tuple[float, float], *, side: int, across: float
) -> Rect:
    """Return a rectangle of a band, given by its ends and its distances from the strip."""
    (left, right), (near, far) = sides, depths
    low, high = (across + near, across + far) if side == 0 else (-far, -near)
    return _cm(left), _cm(low), _cm(right), _cm(high)
