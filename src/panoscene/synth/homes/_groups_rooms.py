"""Groups for bathrooms, laundries, halls, and what any room may have."""

import numpy as np

from ._groups_living import pictures_above
from ._library import is_kitchen_sink
from ._putting import above, along, at_wall, beside, carpet, free_standing, on_top
from ._space import Piece, Space
from ._things import IN_BATHROOM, ON_CHEST, things_on


def bathroom(space: Space) -> Piece | None:
    """Add a bathtub or shower, a toilet and a basin: all three where there is room for them."""
    lavatory = space.rng.random() < 0.06
    for attempt in range(24):
        mark = space.mark()
        small = lavatory or attempt >= 16  # no room to bathe in
        tub = None if small else bath(space)
        seat = toilet(space)
        lead = basin(space)
        placed = [piece for piece in (tub, seat, lead) if piece is not None]
        enough = 1 if attempt >= 22 else 2 if small else 3
        if len(placed) >= enough and space.has_free_ways():
            if attempt >= 16 and not lavatory:
                bath(space)
            return placed[0]
        space.rollback(mark)
    return None


def bath(space: Space) -> Piece | None:
    """Add a bathtub or a shower in a corner."""
    names = ["bathtub", "shower"] if space.rng.random() < 0.5 else ["shower", "bathtub"]
    for name in names:
        for access in (0.6, 0.45):
            item = space.stock.take(
                name, height=(1.8, space.ceiling) if name == "shower" else None,
                where=(lambda model: model.placement == "floor") if name == "shower" else None,
            )  # fmt: skip
            placed = at_wall(space, item, access=access, corner=1.0)
            if placed is not None:
                if name == "bathtub" and space.maybe(0.35):
                    rack = space.stock.take("towel_rack", height=(0.03, 0.6), where=_hangs)
                    above(space, rack, placed, 1.15)
                return placed
    return None


def _hangs(model: object) -> bool:
    return getattr(model, "placement", "") == "wall"


def basin(space: Space) -> Piece | None:
    """Add a basin with a mirror above it and a towel beside it."""
    for widest in (1.3, 0.8, 0.65):
        item = space.stock.take(
            "sink", width=(0.4, widest), depth=(0.35, 0.66),
            where=lambda model: not is_kitchen_sink(model),
        )  # fmt: skip
        if item is None:
            continue
        # a hanging basin is hung so that its rim is at 0.85 m
        bottom = 0.85 - float(item.size[2]) if item.model.placement == "wall" else 0.0
        sink = at_wall(space, item, bottom=max(bottom, 0.0), access=0.6, corner=0.15)
        if sink is None:
            continue
        if item.size[2] < 1.2 and space.rng.random() < 0.9:
            mirror = space.stock.take(
                "mirror", width=(0.35, max(0.45, float(item.size[0]) * 1.1)), height=(0.45, 1.05),
                depth=(0.005, 0.13),
            )  # fmt: skip
            above(space, mirror, sink, 1.08)
        if space.maybe(0.5):
            rack = space.stock.take("towel_rack", where=_hangs)
            if rack is not None:
                low = 1.3 - rack.size[2] / 2
                side = space.side()
                right = side * ((sink.size[0] + rack.size[0]) / 2 + 0.1)
                along(space, rack, sink, right, bottom=float(low))
        if space.maybe(0.35):
            beside(
                space,
                space.stock.take("trash_can", height=(0.2, 0.5)),
                sink,
                space.side(),
                gap=0.05,
            )
        return sink
    return None


def toilet(space: Space) -> Piece | None:
    """Add a toilet."""
    return at_wall(space, space.stock.take("toilet"), access=0.5, sides=0.12, corner=0.1)


def towels(space: Space) -> Piece | None:
    """Add towels on the wall."""
    item = space.stock.take("towel_rack", where=_hangs)
    if item is None:
        return None
    bottom = float(space.rng.uniform(1.2, 1.4) - item.size[2] / 2)
    return at_wall(space, item, bottom=max(bottom, 0.3), corner=0.0, small=True)


def washing(space: Space) -> Piece | None:
    """Add a washer and a dryer side by side."""
    washer = at_wall(space, space.stock.take("washer"), access=0.65, corner=0.6)
    if washer is not None:
        if space.maybe(0.55 if space.room.kind != "laundry" else 0.85):
            side = space.side()
            for turn in (side, -side):
                dryer = space.stock.take("dryer")
                if beside(space, dryer, washer, turn, gap=0.02, access=0.65) is not None:
                    break
        things_on(space, washer, 0.7, "towels", "basket", "bottles", "small_box")
        if space.maybe(0.3):
            above(space, space.stock.take("top_cabinet", depth=(0.2, 0.42)), washer, 1.45)
    return washer


def laundry_basket(space: Space) -> Piece | None:
    """Add a basket."""
    return at_wall(space, space.stock.take("basket"), corner=0.7)


def bath_mat(space: Space) -> Piece | None:
    """Add a small carpet in front of a basin, tub or toilet."""
    leads = [p for p in space.pieces if p.category in ("bathtub", "shower", "sink", "toilet")]
    item = space.stock.take("carpet", width=(0.5, 0.95), depth=(0.3, 0.7), height=(0.002, 0.03))
    if not leads or item is None:
        return None
    lead = leads[int(space.rng.integers(len(leads)))]
    front = (lead.size[1] + item.size[1]) / 2 + 0.08
    return carpet(space, item, lead.place(0.0, front), lead.yaw)


def bath_cabinet(space: Space) -> Piece | None:
    """Add a small cabinet, on the floor or on the wall."""
    if space.rng.random() < 0.5:
        item = space.stock.take(
            "top_cabinet", width=(0.3, 0.7), depth=(0.2, 0.42), height=(0.4, 0.9)
        )
        return at_wall(space, item, bottom=float(space.rng.uniform(1.3, 1.45)), corner=0.4)
    item = space.stock.take(
        "bottom_cabinet", width=(0.3, 0.75), depth=(0.3, 0.6), height=(0.5, 1.3)
    )
    placed = at_wall(space, item, access=0.45, corner=0.6)
    if placed is not None:
        things_on(space, placed, 1.2, *IN_BATHROOM)
    return placed


def towel_shelf(space: Space) -> Piece | None:
    """Add a small shelf with towels."""
    item = space.stock.take("shelf", width=(0.35, 0.85), height=(0.6, 1.75))
    placed = at_wall(space, item, access=0.4, corner=0.7)
    if placed is not None:
        things_on(space, placed, 1.6, *IN_BATHROOM)
    return placed


def entrance(space: Space) -> Piece | None:
    """Add a console or chest with a mirror above it."""
    name = space.pick("console_table", "console_table", "chest", "bench")
    item = space.stock.take(name, width=(0.5, 1.4), depth=(0.22, 0.46), height=(0.35, 1.0))
    placed = at_wall(space, item, access=0.5, corner=0.2)
    if placed is None:
        return None
    if name == "bench":
        hooks = space.stock.take("towel_rack", height=(0.03, 0.25), where=_hangs)
        above(space, hooks, placed, 1.6)
        return placed
    if space.rng.random() < 0.65:
        above(space, space.stock.take("mirror", height=(0.5, 1.2)), placed, 1.05)
    else:
        pictures_above(space, placed)
    if space.maybe(0.4):
        on_top(space, space.stock.take("table_lamp"), placed, right=space.side() * 0.8)
    things_on(space, placed, 1.0, *ON_CHEST)
    return placed


def coat_closet(space: Space) -> Piece | None:
    """Add a cabinet for coats or shoes."""
    item = space.stock.take(
        "bottom_cabinet", width=(0.6, 1.8), depth=(0.25, 0.6), height=(0.6, space.ceiling - 0.1)
    )
    return at_wall(space, item, access=0.55, corner=0.6)


def bench(space: Space) -> Piece | None:
    """Add a bench at a wall."""
    item = space.stock.take("bench", height=(0.3, 0.9))
    placed = at_wall(space, item, access=0.4, corner=0.3)
    if placed is not None:
        pictures_above(space, placed)
    return placed


def runner(space: Space) -> Piece | None:
    """Add a carpet along the longer axis of the room."""
    low, high = space.room.polygon.min(axis=0), space.room.polygon.max(axis=0)
    extent = high - low
    item = space.stock.take(
        "carpet", width=(0.8, min(2.6, max(0.9, float(extent.max()) - 0.6))),
        depth=(0.5, min(2.0, max(0.6, float(extent.min()) - 0.4))), height=(0.002, 0.02),
    )  # fmt: skip
    yaw = 0.0 if extent[0] > extent[1] else np.pi / 2
    for _ in range(8):
        place = low + extent * space.rng.uniform(0.35, 0.65, 2)
        placed = carpet(space, item, place, yaw)
        if placed is not None:
            return placed
    return None


def picture(space: Space) -> Piece | None:
    """Add a picture, two or three in a row, on a wall."""
    item = space.stock.take("picture", width=(0.2, 1.2))
    if item is None:
        return None
    middle = space.rng.uniform(1.45, 1.65)
    bottom = float(min(middle - item.size[2] / 2, space.ceiling - 0.15 - item.size[2]))
    first = at_wall(space, item, bottom=bottom, corner=0.0, small=True)
    if first is not None and item.size[0] < 0.7 and space.maybe(0.35):
        step = item.size[0] + space.rng.uniform(0.06, 0.18)
        for k in range(1, int(space.rng.integers(2, 4))):
            other = space.stock.another(item)
            if along(space, other, first, k * step, bottom=bottom) is None:
                break
    return first


def wall_clock(space: Space) -> Piece | None:
    """Add a clock on a wall."""
    if space.count("wall_clock", "grandfather_clock"):
        return None
    item = space.stock.take("wall_clock")
    if item is None:
        return None
    bottom = float(
        min(space.rng.uniform(1.85, 2.05) - item.size[2] / 2, space.ceiling - 0.15 - item.size[2])
    )
    return at_wall(space, item, bottom=bottom, corner=0.0, small=True)


def wall_mirror(space: Space) -> Piece | None:
    """Add a tall mirror."""
    item = space.stock.take("mirror", width=(0.35, 0.8), height=(0.9, 1.8))
    if item is None:
        return None
    return at_wall(
        space, item, bottom=float(max(0.15, 1.75 - item.size[2])), access=0.4, corner=0.0
    )


def plant(space: Space) -> Piece | None:
    """Add a plant at a wall, mostly in a corner."""
    item = space.stock.take(
        "plant", width=(0.15, 0.9), depth=(0.15, 0.9), height=(0.4, min(2.0, space.ceiling - 0.2))
    )
    return at_wall(space, item, corner=0.75, gap=0.03)


def floor_lamp(space: Space) -> Piece | None:
    """Add a lamp that stands in a corner."""
    return at_wall(space, space.stock.take("floor_lamp"), corner=0.8, gap=0.04)


def trash_can(space: Space) -> Piece | None:
    """Add a trash can in a corner."""
    item = space.stock.take("trash_can")
    return at_wall(space, item, corner=0.6, gap=0.02)


def basket(space: Space) -> Piece | None:
    """Add a basket in a corner."""
    return at_wall(space, space.stock.take("basket"), corner=0.6, gap=0.03)


def stool(space: Space) -> Piece | None:
    """Add a stool at a wall."""
    return at_wall(space, space.stock.take("stool", height=(0.35, 0.6)), corner=0.4, gap=0.03)


def loose_carpet(space: Space) -> Piece | None:
    """Add a carpet on the free floor."""
    item = space.stock.take("carpet", width=(1.0, 2.6), depth=(0.8, 2.0), height=(0.002, 0.02))
    if item is None or space.count("carpet") > 1:
        return None
    low, high = space.room.polygon.min(axis=0), space.room.polygon.max(axis=0)
    for _ in range(8):
        place = low + (high - low) * space.rng.uniform(0.3, 0.7, 2)
        placed = carpet(space, item, place, float(space.rng.choice([0.0, np.pi / 2])))
        if placed is not None:
            return placed
    return None


def high_cabinet(space: Space) -> Piece | None:
    """Add a cabinet that hangs on a wall."""
    item = space.stock.take("top_cabinet", depth=(0.2, 0.42))
    return at_wall(space, item, bottom=1.45, corner=0.5)


def loose_chair(space: Space) -> Piece | None:
    """Add a chair at a wall, its back to it, if there is none yet."""
    if any(p.category == "chair" and p.wall is not None for p in space.pieces):
        return None
    return at_wall(
        space, space.stock.take("chair", height=(0.7, 1.2)), access=0.3, corner=0.3, gap=0.04
    )


def pouf(space: Space) -> Piece | None:
    """Add a stool or armchair somewhere on the floor, at any yaw."""
    name = space.pick("stool", "sofa_chair")
    item = space.stock.take(name, height=(0.35, 1.0))
    return free_standing(space, item, surround=0.4, turned=True)
