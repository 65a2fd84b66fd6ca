"""Groups of furniture to sleep, dress and work."""

import numpy as np

from ._groups_living import bookcase, chair_at, cushions, pictures_above
from ._putting import above, at_wall, beside, carpet, free_standing, near, on_top
from ._space import Piece, Space
from ._things import ON_CHEST, ON_DESK, ON_SHELF, things_on, toys_on_floor


def double_bed(space: Space) -> Piece | None:
    """Add a wide bed with its head at a wall, between chests with lamps."""
    for sides in (0.45, 0.45, 0.3, 0.0):
        item = space.stock.take("bed", width=(1.3, 2.1), height=(0.15, 1.3))
        bed = at_wall(space, item, access=0.55, sides=sides, corner=0.05, least_wall=2.3)
        if bed is not None:
            around_bed(space, bed)
            return bed
    return single_bed(space)


def single_bed(space: Space) -> Piece | None:
    """Add a narrow bed or a bunk bed in a corner, with a chest and a lamp."""
    item = space.stock.take("bed", width=(0.8, 1.3), height=(0.15, min(2.0, space.ceiling - 0.6)))
    bed = at_wall(space, item, access=0.5, corner=0.8)
    if bed is not None:
        around_bed(space, bed)
    return bed


def around_bed(space: Space, bed: Piece) -> None:
    """Add what belongs to a bed: chests with lamps, cushions, a carpet, a picture, a bench."""
    stock, rng = space.stock, space.rng
    high = bed.size[2] > 1.35
    _nightstands(space, bed)
    if not high and space.maybe(0.6):
        cushions(space, bed, int(rng.integers(1, 3)))
    if space.maybe(0.45):
        rug = stock.take("carpet", width=(0.6, 3.0), depth=(0.5, 2.2), height=(0.002, 0.02))
        if rug is not None:
            if rug.size[0] > 1.5:
                carpet(space, rug, bed.place(0.0, 0.35), bed.yaw)
            else:
                right = space.side() * (bed.size[0] + rug.size[1] + 0.1) / 2
                carpet(space, rug, bed.place(right, 0.1), bed.yaw + np.pi / 2)
    if not high:
        pictures_above(space, bed)
    if bed.size[0] > 1.35 and space.maybe(0.2):
        bench = stock.take(
            "bench",
            width=(0.9, max(1.0, float(bed.size[0]))),
            depth=(0.2, 0.55),
            height=(0.3, 0.56),
        )
        if bench is not None:
            front = (bed.size[1] + bench.size[1]) / 2 + 0.06
            mark = space.mark()
            near(space, bench, bed, 0.0, front)
            if not space.has_free_ways():
                space.rollback(mark)


def _nightstands(space: Space, bed: Piece) -> None:
    """Add equal chests with equal lamps on both sides of a bed."""
    stock, rng = space.stock, space.rng
    chest = stock.take("chest", width=(0.33, 0.62), depth=(0.3, 0.55), height=(0.33, 0.66))
    lamp = stock.take("table_lamp", height=(0.2, 0.65))
    for side in (-1.0, 1.0):
        if chest is None or rng.random() > 0.8:
            continue
        placed = beside(space, chest, bed, side, gap=float(rng.uniform(0.01, 0.08)))
        if placed is not None:
            if rng.random() < 0.75:
                on_top(space, lamp, placed, back=0.6)
            things_on(space, placed, 0.5, "books", "books", "dishes", "candles", "vase")


def wardrobe(space: Space) -> Piece | None:
    """Add a wardrobe, sometimes two side by side."""
    placed = None
    for most in (2.6, 1.7, 1.15):
        if placed is None:
            item = space.stock.take(
                "bottom_cabinet", width=(0.8, most), depth=(0.35, 0.7),
                height=(1.4, space.ceiling - 0.05),
            )  # fmt: skip
            placed = at_wall(space, item, access=0.6, corner=0.65, tries=48)
    if placed is not None and placed.size[0] < 1.15 and space.maybe(0.4):
        beside(space, placed.item, placed, space.side(), access=0.6)
    return placed


def dresser(space: Space) -> Piece | None:
    """Add a chest of drawers with a mirror or picture above and things on it."""
    item = space.stock.take("chest", width=(0.7, 1.7), depth=(0.3, 0.6), height=(0.6, 1.05))
    placed = at_wall(space, item, access=0.6, corner=0.3)
    if placed is not None:
        if space.maybe(0.55):
            above(space, space.stock.take("mirror", height=(0.4, 1.1)), placed, 1.05)
        else:
            pictures_above(space, placed)
        things_on(space, placed, 1.4, *ON_CHEST)
        if space.maybe(0.12):
            on_top(space, space.stock.take("standing_tv", width=(0.4, 1.0)), placed)
    return placed


def desk(space: Space) -> Piece | None:
    """Add a table at a wall with a chair that faces it and things to work with on top."""
    stock = space.stock
    table = None
    for most in (1.95, 1.95, 1.4, 1.4, 1.15):
        mark = space.mark()
        item = stock.take("table", width=(0.9, most), depth=(0.5, 0.95), height=(0.68, 1.1))
        table = at_wall(space, item, access=0.8, corner=0.4)
        chair = stock.take("office_chair" if space.rng.random() < 0.7 else "chair")
        if table is not None:
            shift = float(space.rng.uniform(-0.12, 0.12)) * table.size[0]
            if chair_at(space, table, chair, np.pi, shift) and space.has_free_ways():
                break
        space.rollback(mark)
        table = None
    if table is None:
        return None
    screen = None
    if space.rng.random() < 0.6:
        monitor = stock.take("monitor", width=(0.3, 0.8))
        twin = table.size[0] > 1.45 and space.maybe(0.15)
        for right in (-0.45, 0.45) if twin else (float(space.rng.uniform(-0.2, 0.2)),):
            screen = on_top(space, monitor, table, right=right, back=0.75, spread=0.1) or screen
    if screen is None or space.maybe(0.15):
        on_top(
            space, stock.take("laptop"), table, right=None if screen else 0.0, back=0.35, spread=0.1
        )
    if space.maybe(0.6):
        on_top(
            space,
            stock.take("table_lamp", height=(0.2, 0.6)),
            table,
            right=space.side() * 0.95,
            back=0.85,
            spread=0.1,
        )
    if space.maybe(0.15):
        on_top(space, stock.take("loudspeaker", height=(0.15, 0.4)), table, back=0.9, spread=0.05)
    things_on(space, table, 1.2, *ON_DESK)
    if space.maybe(0.35):
        pictures_above(space, table)
    if space.maybe(0.4):
        beside(space, stock.take("trash_can", height=(0.2, 0.5)), table, space.side(), gap=0.05)
    return table


def crib(space: Space) -> Piece | None:
    """Add a crib at a wall."""
    return at_wall(space, space.stock.take("crib"), access=0.5, corner=0.5)


def toys(space: Space) -> Piece | None:
    """Add a basket with toys around it, sometimes on a small carpet."""
    basket = at_wall(space, space.stock.take("basket"), corner=0.4)
    if basket is not None and space.maybe(0.3):
        rug = space.stock.take("carpet", width=(0.8, 2.0), depth=(0.8, 2.0), height=(0.002, 0.02))
        carpet(space, rug, basket.place(0.0, 1.0), basket.yaw)
    toys_on_floor(space, basket)
    return basket


def play_table(space: Space) -> Piece | None:
    """Add a small table with small chairs."""
    stock = space.stock
    item = stock.take("table", width=(0.5, 0.8), depth=(0.4, 0.8), height=(0.4, 0.56))
    chair = stock.take("chair", width=(0.24, 0.42), depth=(0.24, 0.45), height=(0.45, 0.75))
    table = free_standing(space, item, surround=0.45)
    if table is not None:
        for facing in (0.0, np.pi):
            chair_at(space, table, chair, facing, 0.0)
    return table


def exercise(space: Space) -> Piece | None:
    """Add a treadmill, its front towards the room or a wall."""
    item = space.stock.take("treadmill")
    return at_wall(space, item, access=0.6, corner=0.3, gap=0.1, least_wall=1.4)


def billiards(space: Space) -> Piece | None:
    """Add a pool table with space around it."""
    item = space.stock.take("pool_table", width=(1.1, 2.7), depth=(1.0, 2.7))
    for surround in (1.1, 0.85, 0.7):
        placed = free_standing(space, item, surround=surround, tries=120)
        if placed is not None:
            return placed
    return None


def music(space: Space) -> Piece | None:
    """Add a guitar on its stand, sometimes with a loudspeaker as its amplifier and a stool."""
    guitar = at_wall(space, space.stock.take("guitar"), corner=0.5, gap=0.05)
    if guitar is not None:
        if space.maybe(0.4):
            amplifier = space.stock.take("loudspeaker", height=(0.25, 1.1))
            beside(space, amplifier, guitar, space.side(), gap=0.15)
        if space.maybe(0.3):
            stool = space.stock.take("stool", height=(0.35, 0.8))
            if stool is not None:
                near(space, stool, guitar, space.side() * 0.4, 0.7)
    return guitar


def hanging_screen(space: Space) -> Piece | None:
    """Add a television on the wall."""
    item = space.stock.take("wall_mounted_tv")
    return at_wall(space, item, bottom=float(space.rng.uniform(0.95, 1.35)), corner=0.0)


def office_shelves(space: Space) -> Piece | None:
    """Add shelves, or filing cabinets with things on top."""
    if space.rng.random() < 0.6:
        return bookcase(space)
    item = space.stock.take(
        "bottom_cabinet", width=(0.35, 1.7), depth=(0.35, 0.62), height=(0.5, 1.2)
    )
    placed = at_wall(space, item, access=0.6, corner=0.5)
    if placed is not None:
        things_on(space, placed, 1.4, *ON_SHELF, "coffee_machine", "loudspeaker")
    return placed
