"""What hangs in rooms and belongs to none of the categories: lamps, curtains, switches, sockets."""

import numpy as np
import shapely

from ._putting import along_wall, at_wall
from ._records import Opening
from ._space import CURTAIN, Space
from ._stock import Item

_HEADROOM = 2.02
"""Metres under a lamp where people walk."""
_ABOVE_TABLE = 0.72
_APART = 1.3
"""Metres between lamps, at least."""
_UNADORNED = ("bathroom", "laundry", "kitchen")
_BARE = 2.0
"""Metres of a wall with nothing on it that are too much."""
_CURTAINLESS = ("bathroom", "laundry", "kitchen", "hall")


def ceiling_lamps(space: Space) -> None:
    """Hang lamps from the ceiling: over the dining table, or in the middle, two in long rooms."""
    tables = [
        piece for piece in space.pieces
        if piece.category in ("table", "pool_table") and piece.wall is None
        and piece.size[:2].max() > 0.8 and piece.support is None
    ]  # fmt: skip
    if tables and space.rng.random() < 0.8:
        item = space.stock.take("ceiling_lamp", width=(0.0, 1.1), depth=(0.0, 1.1))
        low = min(tables[0].top + _ABOVE_TABLE, _HEADROOM)
        _hang(space, item, tables[0].centre[:2], low)
        if space.room.kind != "open_plan" and space.rng.random() < 0.7:
            return
    item = space.stock.take(
        "ceiling_lamp", height=(0.0, space.ceiling - _HEADROOM)
    ) or space.stock.take("ceiling_lamp")
    hung = [p.centre[:2] for p in space.pieces if p.item.model.placement == "ceiling"]
    for place in _middles(space):
        if all(float(np.linalg.norm(place - other)) > _APART for other in hung):
            _hang(space, item, place, _HEADROOM)
            hung.append(place)


def _middles(space: Space) -> list[np.ndarray]:
    """Return where lamps light a room best: its middle, or the middles of its halves."""
    polygon = shapely.Polygon(space.room.polygon)
    extent = np.ptp(space.room.polygon, axis=0)
    middle = np.array(polygon.centroid.coords[0])
    inside = polygon.buffer(-0.5, join_style="mitre")
    long = int(extent.argmax())
    step = np.zeros(2)
    if extent.max() > 5.2 and extent.max() > 1.35 * extent.min():
        step[long] = extent[long] / 4
    places = [middle - step, middle + step] if step.any() else [middle]
    return [
        place
        if inside.covers(shapely.Point(place)) or inside.is_empty
        else np.array(inside.representative_point().coords[0])
        for place in places
    ]


def _hang(space: Space, item: Item | None, place: np.ndarray, low: float) -> None:
    """Hang a lamp whose lower end is not below ``low``: a long one is shortened and slimmed."""
    if item is None:
        return
    shrink = min(1.0, (space.ceiling - low) / float(item.size[2]))
    size = item.size * np.array([np.sqrt(shrink), np.sqrt(shrink), shrink])
    hung = Item(item.model, size, item.look)
    centre = np.array([[*place, space.ceiling - size[2] / 2]])
    space.put(hung, centre, np.zeros(1), small=True)


def curtains(space: Space) -> None:
    """Hang curtains before the windows of rooms where people live.

    They are long where nothing stands in their way, else as long as there is room for.
    """
    if space.room.kind in _CURTAINLESS or space.rng.random() < 0.35:
        return
    chosen: Item | None = None
    short = space.rng.random() < 0.25
    for opening in space.openings:
        if opening.kind != "window":
            continue
        wide = opening.width + 0.5
        item = chosen or space.stock.fitted("curtain", (wide, 0.13, opening.top - 0.1))
        if item is None:
            return
        chosen = item
        lows = [0.03, max(0.03, opening.bottom - 0.22), opening.bottom - 0.04]
        if opening.bottom < 0.3 or space.room.kind == "open_plan":
            lows = [0.03]  # no short ones above kitchen units
        elif short:
            lows = lows[1:]
        _hang_curtain(space, item, opening, lows)


def _hang_curtain(space: Space, item: Item, opening: Opening, lows: list[float]) -> None:
    """Hang a curtain as low and as wide as possible."""
    length = space.walls.length[opening.wall]
    middle = opening.start + opening.width / 2
    room = 2 * min(middle, length - middle) - 0.02
    for low in lows:
        for beside in (0.5, 0.36, 0.24):
            width = min(opening.width + beside, room)
            top = min(opening.top + 0.14, space.ceiling - 0.02)
            if width < opening.width + 0.2 or top - low < 0.5:
                continue
            size = np.array([width, min(float(item.model.size[1]), 0.14), top - low])
            hung = Item(item.model, size, item.look)
            if along_wall(
                space, hung, opening.wall, middle, bottom=low, gap=0.01, small=True, kind=CURTAIN
            ):
                return


def bare_walls(space: Space) -> None:
    """Hang pictures, a mirror or a clock where a wall is bare over more than two metres."""
    rng = space.rng
    if space.room.kind in _UNADORNED:
        return
    for wall in range(len(space.walls.length)):
        for start, stop in space.bare_parts(wall):
            if stop - start < _BARE or rng.random() > 0.55 + 0.4 * space.density:
                continue
            count = min(3, int((stop - start) / 1.9)) if rng.random() < 0.6 else 1
            step = (stop - start) / (count + 1)
            item: Item | None = None
            for k in range(count):
                if item is None or rng.random() < 0.4:
                    item = space.stock.take("picture", width=(0.3, 1.3))
                else:
                    item = space.stock.another(item)
                if item is None:
                    break
                bottom = min(
                    1.58 - float(item.size[2]) / 2, space.ceiling - 0.15 - float(item.size[2])
                )
                place = start + (k + 1) * step + float(rng.uniform(-0.15, 0.15))
                along_wall(space, item, wall, place, bottom=bottom, small=True)


def switches(space: Space) -> None:
    """Put a switch beside each door, on the side of its handle where there is room for it."""
    item = space.stock.take("switch", height=(0.05, 0.25), width=(0.05, 0.2))
    if item is None:
        return
    for opening in space.openings:
        if opening.kind == "window" or (opening.kind == "opening" and space.rng.random() < 0.5):
            continue
        reach = float(item.size[0]) / 2 + space.rng.uniform(0.09, 0.16)
        before, after = opening.start - reach, opening.start + opening.width + reach
        bottom = 1.09 - float(item.size[2]) / 2
        for place in (after, before) if opening.hinge_at_start else (before, after):
            if along_wall(space, item, opening.wall, place, bottom=bottom, small=True):
                break


def sockets(space: Space) -> None:
    """Put some sockets low on the walls."""
    item = space.stock.take("socket", width=(0.05, 0.32), height=(0.05, 0.32))
    for _ in range(int(space.rng.integers(1, 5)) if item is not None else 0):
        at_wall(space, item, bottom=0.27, corner=0.0, small=True, tries=8)
