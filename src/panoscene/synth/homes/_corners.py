"""More corners for some rooms: shafts, chimney breasts, bays and recesses."""

from collections.abc import Callable

import numpy as np
import shapely
from jaxtyping import Float

from ._bands import Draft
from ._manhattan import Rect, Walls, area_of, corners_of, walls_of

MORE_CORNERS = {
    4: {0: 0.72, 2: 0.065, 4: 0.065, 6: 0.15},
    6: {0: 0.80, 2: 0.12, 4: 0.08},
    8: {0: 0.85, 2: 0.15},
}
"""How often a room of so many corners gets so many more."""

_TRIES = 12

_Change = Callable[[np.random.Generator, list[Draft], int, Walls], bool]


def polygon_of(draft: Draft) -> Float[np.ndarray, "corners 2"] | None:
    """Return the room's corners on the centre lines of its walls; None if it is not one piece."""
    shape = shapely.union_all([shapely.box(*rect) for rect in draft.rects])
    if draft.cuts:
        shape = shape.difference(shapely.union_all([shapely.box(*rect) for rect in draft.cuts]))
    return corners_of(shape)


def add_corners(rng: np.random.Generator, drafts: list[Draft]) -> None:
    """Change some of the rooms so that they have 2, 4 or 6 corners more."""
    for index, draft in enumerate(drafts):
        polygon = polygon_of(draft)
        if polygon is None:
            continue
        shares = MORE_CORNERS.get(len(polygon), {0: 1.0})
        missing = int(rng.choice(list(shares), p=list(shares.values())))
        if area_of(polygon) < 8.0:
            missing = min(missing, 2)
        while missing > 0:
            changes: list[tuple[int, _Change]] = [(2, _shaft), (2, _shaft), (2, _recess)]
            if missing >= 4:
                changes = [(4, _breast), (4, _bay), (4, _breast), (2, _shaft)]
            added, change = changes[int(rng.integers(len(changes)))]
            walls = walls_of(polygon)
            if not any(change(rng, drafts, index, walls) for _ in range(_TRIES)):
                added = 2
                if not any(_shaft(rng, drafts, index, walls) for _ in range(_TRIES)):
                    break
            missing -= added
            polygon = polygon_of(draft)
            if polygon is None:
                break


def is_outside(drafts: list[Draft], rect: Rect) -> bool:
    """Return whether no room's rectangle reaches into one."""
    return not any(_overlap(rect, other) for draft in drafts for other in draft.rects)


def _overlap(a: Rect, b: Rect) -> bool:
    slack = 1e-6
    return (
        a[0] < b[2] - slack and b[0] < a[2] - slack and a[1] < b[3] - slack and b[1] < a[3] - slack
    )


def _rect(first: Float[np.ndarray, " 2"], second: Float[np.ndarray, " 2"]) -> Rect:
    low, high = np.minimum(first, second).round(2), np.maximum(first, second).round(2)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _cut(draft: Draft, walls: Walls, rect: Rect, corners: int) -> bool:
    """Cut a block out of a room if that gives it so many corners; tell whether it did."""
    draft.cuts.append(rect)
    after = polygon_of(draft)
    if after is None or len(after) != len(walls.length) + corners:
        draft.cuts.pop()
        return False
    return True


def _corner(rng: np.random.Generator, walls: Walls) -> int:
    """Return a corner that points outwards."""
    before = np.concatenate((walls.along[-1:], walls.along[:-1]))
    return int(rng.choice(np.flatnonzero((before * walls.normal).sum(axis=1) < -0.5)))


def _shaft(rng: np.random.Generator, drafts: list[Draft], index: int, walls: Walls) -> bool:
    """Build pipes into a corner."""
    corner = _corner(rng, walls)
    sides = rng.uniform(0.35, 0.95, 2)
    if (walls.length[[corner - 1, corner]] < sides[::-1] + 1.15).any() or sides.min() > 0.7:
        return False
    point = walls.start[corner]
    away = point + walls.along[corner] * sides[1] - walls.along[corner - 1] * sides[0]
    return _cut(drafts[index], walls, _rect(point, away), 2)


def _recess(rng: np.random.Generator, drafts: list[Draft], index: int, walls: Walls) -> bool:
    """Cut a balcony out of an outer corner of a large room."""
    corner = _corner(rng, walls)
    sides = rng.uniform(1.2, 2.2, 2)
    point = walls.start[corner]
    back, ahead = -walls.along[corner - 1], walls.along[corner]
    roomy = (walls.length[[corner - 1, corner]] >= sides + 1.9).all()
    if not roomy or area_of(walls.start) - sides.prod() < 13.0:
        return False
    beside = _rect(point, point + back * sides[0] - ahead * 1.5)
    before = _rect(point, point + ahead * sides[1] - back * 1.5)
    if not (is_outside(drafts, beside) and is_outside(drafts, before)):
        return False
    return _cut(drafts[index], walls, _rect(point, point + back * sides[0] + ahead * sides[1]), 2)


def _breast(rng: np.random.Generator, drafts: list[Draft], index: int, walls: Walls) -> bool:
    """Build a chimney breast or a column into a wall."""
    wall = int(rng.integers(len(walls.length)))
    width, deep = rng.uniform(0.5, 1.4), rng.uniform(0.25, 0.45)
    if walls.length[wall] < width + 2.1:
        return False
    begin = rng.uniform(0.95, walls.length[wall] - width - 0.95)
    first = walls.start[wall] + walls.along[wall] * begin
    second = first + walls.along[wall] * width + walls.normal[wall] * deep
    return _cut(drafts[index], walls, _rect(first, second), 4)


def _bay(rng: np.random.Generator, drafts: list[Draft], index: int, walls: Walls) -> bool:
    """Build a bay out of an outer wall."""
    draft = drafts[index]
    if draft.kind in ("hall", "bathroom", "laundry"):
        return False
    wall = int(rng.integers(len(walls.length)))
    width, deep = rng.uniform(1.7, 2.7), rng.uniform(0.6, 1.1)
    if walls.length[wall] < width + 1.3:
        return False
    begin = rng.uniform(0.6, walls.length[wall] - width - 0.6)
    first = walls.start[wall] + walls.along[wall] * begin
    second = first + walls.along[wall] * width
    out = -walls.normal[wall]
    margin = walls.along[wall] * 0.4
    if not is_outside(drafts, _rect(first - margin, second + margin + out * (deep + 1.5))):
        return False
    draft.rects.append(_rect(first, second + out * deep))
    after = polygon_of(draft)
    if after is None or len(after) != len(walls.length) + 4:
        draft.rects.pop()
        return False
    return True
