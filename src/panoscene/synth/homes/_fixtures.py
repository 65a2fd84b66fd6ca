"""What belongs to the building: doors, windows and heaters."""

from collections.abc import Callable

import numpy as np

from ._library import ModelSummary
from ._manhattan import walls_of
from ._putting import at_wall
from ._records import Home, Opening
from ._space import Piece, Space
from ._stock import Item, Stock

_OUTWARD = 0.02
"""Metres by which frames stand out of a wall on each side, at most."""


def door_piece(stock: Stock, home: Home, index: int, like: Item | None) -> Piece | None:
    """Return the closed leaf of a door in the middle of its wall, facing the room it opens into.

    Args:
        stock: where the model is chosen.
        home: the home; its opening ``index`` is the entry of the room that the door opens into.
        index: of the opening.
        like: a door of the same home, whose model is taken again.
    """
    opening = home.openings[index]
    outer = opening.leads_to is None
    thick = home.wall_thickness * (2 if outer else 1) + 2 * _OUTWARD
    deep = min(thick, 0.2)
    size = (opening.width, deep, opening.top - opening.bottom)
    if like is not None:
        item = Item(like.model, np.array(size), like.look)
    else:
        found = stock.fitted("door", size, where=lambda model: model.size[1] < 0.25)
        if found is None:
            return None
        item = found
    return _in_wall(home, index, item, home.wall_thickness * (1.0 if outer else 0.5))


def window_piece(stock: Stock, home: Home, index: int, like: Item | None) -> Piece | None:
    """Return a window in the middle of its wall."""
    opening = home.openings[index]
    size = (
        opening.width,
        min(2 * home.wall_thickness + _OUTWARD, 0.3),
        opening.top - opening.bottom,
    )
    if like is not None and _alike(like, size):
        item = Item(like.model, np.array(size), like.look)
    else:
        found = stock.fitted("window", size, where=_is_rectangular)
        if found is None:
            return None
        item = found if like is None else Item(found.model, found.size, like.look)
    return _in_wall(home, index, item, home.wall_thickness)


def _alike(item: Item, size: tuple[float, float, float]) -> bool:
    wanted = np.array(size)[[0, 2]] / np.array(item.model.size)[[0, 2]]
    return bool(np.abs(np.log(wanted)).max() < 0.35)


def _is_rectangular(model: object) -> bool:
    # models of the libraries have their names in ``source``
    name = f"{getattr(model, 'id', '')} {getattr(model, 'source', '')}".lower()
    return not any(word in name for word in ("triangle", "round"))


def _in_wall(home: Home, index: int, item: Item, behind: float) -> Piece:
    """Return a piece in an opening, its middle so far behind the wall's surface."""
    opening = home.openings[index]
    walls = walls_of(home.rooms[opening.room].polygon)
    along = opening.start + opening.width / 2
    place = walls.start[opening.wall] + walls.along[opening.wall] * along
    place = place - walls.normal[opening.wall] * behind
    centre = np.array([*place, (opening.bottom + opening.top) / 2])
    return Piece(item, centre, float(walls.yaw[opening.wall]), opening=index)


def heaters(space: Space) -> None:
    """Put heaters under most windows, and one at a wall where there are none."""
    rng, stock = space.rng, space.stock
    windows = [opening for opening in space.openings if opening.kind == "window"]
    chosen: Item | None = None
    placed = 0
    for opening in windows:
        if opening.bottom < 0.42 or rng.random() > (0.75 if placed == 0 else 0.5):
            continue
        most = (0.4, min(opening.width + 0.15, 1.7))
        height = (0.25, min(opening.bottom - 0.14, 0.75))
        if height[1] < 0.28:
            continue
        item = stock.take(
            "heater", width=most, height=height, depth=(0.05, 0.26),
            where=None if chosen is None else _is_like(chosen),
        ) or stock.take("heater", width=most, height=height, depth=(0.05, 0.26))  # fmt: skip
        if item is None:
            continue
        chosen = item
        placed += _under(space, item, opening)
    kind = space.room.kind
    if placed == 0 and rng.random() < (0.6 if kind == "bathroom" else 0.3):
        high = (0.3, 1.6) if kind == "bathroom" else (0.3, 0.85)
        item = stock.take("heater", width=(0.4, 1.1), height=high)
        if item is not None:
            bottom = 0.35 if item.size[2] > 0.9 else _lift(item)
            at_wall(space, item, bottom=bottom, corner=0.1, gap=0.0)


def _is_like(item: Item) -> Callable[[ModelSummary], bool]:
    """Return what tells whether a model is that of an item."""
    return lambda model: model.id == item.model.id


def _lift(item: Item) -> float:
    """Return at what height a heater hangs; some stand on the floor."""
    return 0.0 if item.model.placement == "floor" else 0.12


def _under(space: Space, item: Item, opening: Opening) -> bool:
    walls, wall = space.walls, opening.wall
    middle = opening.start + opening.width / 2
    place = walls.start[wall] + walls.along[wall] * middle + walls.normal[wall] * item.size[1] / 2
    bottom = min(_lift(item), max(0.0, opening.bottom - 0.06 - float(item.size[2])))
    centre = np.array([[*place, bottom + item.size[2] / 2]])
    piece = space.put(item, centre, walls.yaw[[wall]], companion=True, wall=np.array([wall]))
    return piece is not None
