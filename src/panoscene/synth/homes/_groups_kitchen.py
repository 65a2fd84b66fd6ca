"""Kitchens: a run of units along one or two walls, what hangs above it, and islands."""

from dataclasses import dataclass, replace

import numpy as np

from ._library import is_kitchen_sink
from ._putting import above, along, at_wall, near, on_top
from ._space import Piece, Space
from ._stock import Item
from ._things import ON_WORKTOP, things_on

_DEPTH = 0.62
_CABINETS = {"base": (0.35, 1.0), "hob": (0.59, 0.9), "tower": (0.59, 0.66)}
"""Least and largest width of cabinets, by what they are for."""


@dataclass(slots=True)
class _Leg:
    """A part of a run: units side by side at one wall, from one of its ends."""

    wall: int
    from_start: bool
    used: float
    """Metres along the wall that are taken already."""


def kitchen(space: Space) -> Piece | None:
    """Add a run of kitchen units, with a hood above the stove and cabinets on the wall."""
    height = float(space.rng.uniform(0.85, 0.92))
    best: list[Piece] = []
    for attempt in range(40):
        mark = space.mark()
        units = _units(space)
        if attempt >= 12:
            units.remove("fridge")
        design = _design(space, height)
        run = [] if design is None else _run(space, units, design)
        kinds = {piece.category for piece in run}
        complete = "sink" in kinds and _cooks(space, run) and not _is_blocked(space, run)
        complete = complete and (attempt > 15 or not _cooks_at_window(space, run))
        least = 6 if attempt < 12 else 4 if attempt < 24 else 3
        if complete and len(run) >= least and space.has_free_ways():
            best = run
            break
        space.rollback(mark)
    if not best:
        return None
    if not any(piece.category == "fridge" for piece in best):
        item = _fridge(space, 1.0)
        at_wall(space, item, access=0.7, corner=0.8)
    _above_run(space, best)
    _on_run(space, best)
    return best[0]


def _cooks(space: Space, run: list[Piece]) -> bool:
    """Return whether one can cook at a run."""
    return any(p.category in ("stove", "oven") or _has_hob(space, p) for p in run)


def _cooks_at_window(space: Space, run: list[Piece]) -> bool:
    """Return whether there is no place for a hood because of a window."""
    for unit in run:
        if unit.category in ("stove", "oven") or _has_hob(space, unit):
            walls, wall = space.walls, unit.wall
            middle = float((unit.centre[:2] - walls.start[wall]) @ walls.along[wall])
            for o in space.openings:
                beside = abs(o.start + o.width / 2 - middle) > (o.width + unit.size[0]) / 2
                if o.kind == "window" and o.wall == wall and not beside:
                    return True
    return False


def _has_hob(space: Space, unit: Piece) -> bool:
    return any(p.support is unit and p.category == "cooktop" for p in space.pieces)


def _is_blocked(space: Space, run: list[Piece]) -> bool:
    """Return whether a unit of a run that is more than a cabinet stands behind another one."""
    for unit in run:
        if not unit.category.startswith("bottom_cabinet") or _has_hob(space, unit):
            for right in (-0.4, 0.4):
                front = unit.place(right * unit.size[0], unit.size[1] / 2 + 0.15)
                for other in run:
                    turned = abs(np.sin(other.yaw)) > 0.5
                    half = other.size[[1, 0] if turned else [0, 1]] / 2
                    if (np.abs(front - other.centre[:2]) < half).all():
                        return True
    return False


def _units(space: Space) -> list[str]:
    """Return what stands in a run, in its order: fridge at an end, sink and stove apart.

    A "base" is a cabinet, a "hob" one with a cooktop and a "tower" one with an oven on it.
    """
    rng = space.rng
    cook = str(rng.choice(["stove", "hob", "oven"], p=[0.42, 0.48, 0.1]))
    base = "base"
    middle = [base, "sink", "dishwasher" if rng.random() < 0.65 else base, base, cook, base]
    if rng.random() < 0.5:
        middle = [base, cook, base, "sink", "dishwasher" if rng.random() < 0.65 else base, base]
    if rng.random() < 0.25:
        middle.insert(3, "counter")
    if rng.random() < 0.25:
        middle.append("washer")
    tall = ["fridge", "tower"] if rng.random() < (0.9 if cook == "hob" else 0.05) else ["fridge"]
    return [*tall, *middle] if rng.random() < 0.5 else [*middle, *tall[::-1]]


def _design(space: Space, height: float) -> Item | None:
    """Return the cabinet of which all those of a kitchen are copies of other widths."""
    names = ["bottom_cabinet", "bottom_cabinet_no_top"]
    for name in names if space.rng.random() < 0.75 else names[::-1]:
        item = space.stock.take(
            name, width=(0.42, 1.0), depth=(0.54, 0.66), height=(height - 0.012, height + 0.012),
            where=lambda model: model.support_height is not None,
        )  # fmt: skip
        if item is not None and item.support is not None:
            return item
    return None


def _unit(space: Space, name: str, design: Item, most: float) -> Item | None:
    """Return one unit, at most ``most`` metres wide and as deep and high as the others."""
    stock, height = space.stock, float(design.size[2])
    if name == "fridge":
        return _fridge(space, most)
    if name == "sink":
        item = stock.take(
            "sink", width=(0.55, min(1.25, most)), depth=(0.56, 0.66),
            height=(height, height + 0.38), where=is_kitchen_sink,
        )  # fmt: skip
        if item is not None or any(map(is_kitchen_sink, stock.models("sink"))):
            return item
        return stock.take(
            "sink", width=(0.45, min(1.2, most)), depth=(0.42, 0.66), height=(0.8, 1.25)
        )
    if name in _CABINETS:
        least, widest = _CABINETS[name]
        usual = float(design.size[0]) * space.rng.uniform(0.75, 1.25)
        width = float(np.clip(usual, least, min(widest, most)))
        return replace(design, size=np.array([width, *design.size[1:]]))
    flush = (height - 0.012, height + 0.012)
    widest = 1.9 if name == "counter" else 0.92
    return stock.take(name, width=(0.3, min(widest, most)), depth=(0.52, 0.66), height=flush)


def _fridge(space: Space, most: float) -> Item | None:
    return space.stock.take(
        "fridge", width=(0.5, min(0.95, most)), depth=(0.55, 0.75), height=(0.8, 2.1)
    )


def _run(space: Space, units: list[str], design: Item) -> list[Piece]:
    """Put units along a wall, and around the corner where the wall ends."""
    walls, rng = space.walls, space.rng
    wall = int(rng.choice(len(walls.length), p=walls.length**2 / (walls.length**2).sum()))
    legs = [_Leg(wall, bool(rng.random() < 0.5), 0.0)]
    leg = legs[0]
    run: list[Piece] = []
    turned, begun = False, 0
    rest = list(units)
    item: Item | None = None
    while rest:
        room = walls.length[leg.wall] - leg.used
        placed = None
        if item is None or item.size[0] > room:
            item = _unit(space, rest[0], design, max(room, 0.3))
        if item is not None and item.size[0] <= room + 1e-6:
            placed = _place_unit(space, leg, item)
        if placed is not None:
            run.append(placed)
            _equip(space, rest.pop(0), placed)
            item = None
            continue
        if begun == len(run) and room > 1.2:
            leg.used += 0.15  # a door or a window down to the floor: begin behind it
            continue
        if rest[0] not in ("sink", "stove", "hob") and len(rest) > 1 and rng.random() < 0.5:
            rest.pop(0)
            item = None
            continue
        if turned or room > 0.75:
            break
        following = _around_corner(space, leg)
        if following is None:
            break
        leg, turned, begun = following, True, len(run)
    return run


def _equip(space: Space, name: str, unit: Piece) -> None:
    """Put a cooktop or an oven on a unit that is meant for it."""
    wide, deep = float(unit.size[0]) - 0.025, float(unit.size[1]) - 0.025
    if name in ("hob", "oven"):
        item = space.stock.take("cooktop", width=(min(0.5, wide), wide), depth=(0.4, deep))
        on_top(space, item, unit, right=0.0, back=0.5, spread=0.0)
    elif name == "tower":
        item = space.stock.take("oven", width=(0.5, wide), depth=(0.42, deep), height=(0.35, 0.65))
        on_top(space, item, unit, right=0.0, back=0.2, spread=0.0)


def _around_corner(space: Space, leg: _Leg) -> _Leg | None:
    """Return the leg that begins at the far end of another one, at an inner corner."""
    walls = space.walls
    count = len(walls.length)
    other = (leg.wall + (1 if leg.from_start else -1)) % count
    first, second = (leg.wall, other) if leg.from_start else (other, leg.wall)
    inner = float(walls.along[first] @ walls.normal[second]) < -0.5
    return _Leg(other, leg.from_start, _DEPTH + 0.04) if inner else None


def _place_unit(space: Space, leg: _Leg, item: Item) -> Piece | None:
    walls = space.walls
    middle = leg.used + item.size[0] / 2
    if not leg.from_start:
        middle = walls.length[leg.wall] - middle
    place = walls.start[leg.wall] + walls.along[leg.wall] * middle
    place = place + walls.normal[leg.wall] * item.size[1] / 2
    placed = space.put(
        item, np.array([[*place, item.size[2] / 2]]), walls.yaw[[leg.wall]], access=0.8,
        companion=True, wall=np.array([leg.wall]),
    )  # fmt: skip
    if placed is not None:
        leg.used += float(item.size[0]) + 0.002
    return placed


def _above_run(space: Space, run: list[Piece]) -> None:
    """Hang a hood above the stove and cabinets above the other low units."""
    stock = space.stock
    hung = space.rng.random() < 0.8
    bottom = float(space.rng.uniform(1.38, 1.5))
    highest = min(0.95, space.ceiling - bottom - 0.02)
    cabinet = stock.take(
        "top_cabinet", width=(0.35, 0.9), depth=(0.28, 0.42), height=(0.45, highest)
    )
    cooks = [p for p in run if p.category in ("stove", "oven") or _has_hob(space, p)]
    for unit in cooks:
        wide = (0.45, max(0.55, float(unit.size[0])))
        hood = stock.take("range_hood", width=wide, height=(0.1, max(0.2, space.ceiling - 1.65)))
        above(space, hood, unit, 1.55)
    for unit in run:
        if unit in cooks:
            continue
        if hung and unit.size[2] < 1.3 and cabinet is not None:
            width = float(unit.size[0])
            share = max(1, round(width / float(cabinet.size[0])))
            if 0.6 < width / share / cabinet.size[0] < 1.5:
                item = replace(cabinet, size=np.array([width / share - 0.002, *cabinet.size[1:]]))
                for k in range(share):
                    right = ((k + 0.5) / share - 0.5) * width
                    along(space, item, unit, right, bottom=bottom)


def _on_run(space: Space, run: list[Piece]) -> None:
    """Put things on the units: a microwave, a coffee machine, dishes."""
    stock = space.stock
    tops = [p for p in run if p.category.startswith(("bottom_cabinet", "counter", "dishwasher"))]
    for name, chance in (("microwave", 0.55), ("coffee_machine", 0.55), ("plant", 0.2)):
        if tops and space.maybe(chance):
            lead = tops[int(space.rng.integers(len(tops)))]
            size = (0.1, 0.6)
            item = stock.take(name, width=size, depth=(0.1, 0.5), height=(0.1, 0.45))
            on_top(space, item, lead, back=0.8, spread=0.15)
    for lead in tops:
        things_on(space, lead, 0.5, *ON_WORKTOP)


def island(space: Space) -> Piece | None:
    """Add a counter in the middle of a large kitchen, with stools on one side."""
    runs = [p for p in space.pieces if p.category in ("stove", "sink", "dishwasher")]
    item = space.stock.take("counter", width=(1.0, 2.0), depth=(0.6, 1.0), height=(0.8, 1.0))
    if not runs or item is None:
        return None
    stool = space.stock.take("stool", height=(0.6, 1.15))
    for _ in range(20):
        mark = space.mark()
        lead = runs[int(space.rng.integers(len(runs)))]
        front = (lead.size[1] + item.size[1]) / 2 + space.rng.uniform(0.95, 1.2)
        placed = near(space, item, lead, space.rng.uniform(-1.0, 1.0), front, turn=np.pi)
        if placed is not None:
            count = min(int(placed.size[0] / 0.55), 3)
            for k in range(count if stool is not None else 0):
                right = ((k + 0.5) / count - 0.5) * placed.size[0]
                away = -(placed.size[1] + stool.size[1]) / 2 - 0.03 if stool is not None else 0.0
                near(space, stool, placed, right, away)
            if space.has_free_ways():
                things_on(space, placed, 1.2, *ON_WORKTOP, "plant")
                return placed
        space.rollback(mark)
    return None
