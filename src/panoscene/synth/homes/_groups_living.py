"""Groups of furniture to sit, eat and watch: each function adds one to a room."""

import numpy as np

from ._putting import above, at_wall, beside, carpet, free_standing, near, on_top
from ._space import Piece, Space
from ._stock import Item
from ._things import ON_CHEST, ON_COFFEE_TABLE, ON_DINING_TABLE, ON_SHELF, things_on


def television(space: Space) -> Piece | None:
    """Add a television with a sofa that faces it across a coffee table on a carpet."""
    for _ in range(14):
        mark = space.mark()
        stand = _stand(space)
        if stand is not None and _screen(space, stand) and _facing_sofa(space, stand):
            return stand
        space.rollback(mark)
    return seating(space)


def _stand(space: Space) -> Piece | None:
    name = space.pick(
        "bottom_cabinet", "bottom_cabinet", "bottom_cabinet", "console_table", "chest"
    )
    highest = 0.75 if name == "bottom_cabinet" else 0.85
    item = space.stock.take(name, width=(0.85, 2.2), depth=(0.3, 0.62), height=(0.3, highest))
    return at_wall(space, item, access=0.6, corner=0.12, least_wall=2.0)


def _screen(space: Space, stand: Piece) -> bool:
    """Put a television on a stand or hang it above, with what belongs to it; tell whether."""
    stock, width = space.stock, stand.size[0]
    screen = None
    if space.rng.random() < 0.55:
        screen = on_top(
            space,
            stock.take("standing_tv", width=(0.45, min(width, 1.45)), depth=(0.04, 0.45)),
            stand, right=0.0, back=0.6, spread=0.2,
        )  # fmt: skip
    if screen is None:
        item = stock.take("wall_mounted_tv", width=(0.7, 1.6))
        screen = above(space, item, stand, stand.top + space.rng.uniform(0.15, 0.4))
    if screen is None:
        return False
    for side in (-1.0, 1.0):
        if space.maybe(0.3):
            speaker = stock.take("loudspeaker", height=(0.2, 1.2))
            placed = beside(space, speaker, stand, side, gap=0.06)
            if placed is None:
                small = stock.take("loudspeaker", height=(0.15, 0.45))
                on_top(space, small, stand, right=side * 0.95)
    if space.maybe(0.3):
        on_top(space, stock.take("speaker_system", width=(0.15, 0.6)), stand)
    return True


def _facing_sofa(space: Space, stand: Piece) -> bool:
    """Put a sofa opposite a television, and what belongs to it; tell whether it fits."""
    sofa = space.stock.take("sofa")
    if sofa is None:
        return False
    deep = sofa.size[1]
    edge = stand.place(0.0, stand.size[1] / 2)
    room = space.clearance(edge, stand.yaw)
    if room - deep < 1.35:
        return False
    at_back = room - deep
    far = at_back if at_back < 3.6 or space.rng.random() < 0.25 else space.rng.uniform(2.0, 3.1)
    if far > 4.6 or (at_back - far < 0.8 and far < at_back):
        far = min(at_back, 4.6)
    front = stand.size[1] / 2 + far + deep / 2
    shift = space.rng.uniform(-0.25, 0.25)
    placed = near(
        space, sofa, stand, shift, front, turn=np.pi, access=0.75,
        behind=0.5 if far < at_back - 0.01 else 0.0,
    )  # fmt: skip
    if placed is None:
        return False
    wall = space.on_wall(
        np.stack([placed.place(x * placed.size[0] / 2, -deep / 2) for x in (-1.0, 1.0)])
    )
    placed = _at(space, placed, wall)
    around_sofa(space, placed, table_front=min(far, 2.2))
    return space.has_free_ways()


def _at(space: Space, piece: Piece, wall: int | None) -> Piece:
    """Return the piece that was placed last with the wall at which it stands."""
    known = Piece(piece.item, piece.centre, piece.yaw, piece.support, piece.group, wall)
    space.pieces[-1] = known
    return known


def seating(space: Space) -> Piece | None:
    """Add a sofa at a wall with a coffee table in front of it and chairs around that."""
    for access in (0.85, 0.85, 0.85, 0.7, 0.7, 0.6, 0.6):
        mark = space.mark()
        sofa = at_wall(space, space.stock.take("sofa"), access=access, corner=0.2)
        if sofa is not None and space.has_free_ways():
            around_sofa(space, sofa, table_front=2.0)
            return sofa
        space.rollback(mark)
    return armchair(space)


def around_sofa(space: Space, sofa: Piece, *, table_front: float) -> None:
    """Add what belongs to a sofa: coffee table, carpet, chairs, lamp, cushions, picture."""
    table = _coffee_table(space, sofa, table_front) if space.maybe(0.8) else None
    if space.maybe(0.7):
        rug = space.stock.take("carpet", width=(1.2, 3.1), depth=(1.0, 2.4), height=(0.002, 0.02))
        centre = sofa.place(0.0, sofa.size[1] / 2 + 0.75) if table is None else table.centre[:2]
        carpet(space, rug, centre, sofa.yaw)
    _armchairs(space, sofa, table)
    if table is not None:
        things_on(space, table, 1.3, *ON_COFFEE_TABLE)
    cushions(space, sofa, int(space.rng.integers(1, 4)) if space.maybe(0.65) else 0)
    if sofa.wall is not None:
        pictures_above(space, sofa)
        _at_ends(space, sofa)


def _coffee_table(space: Space, sofa: Piece, room: float) -> Piece | None:
    """Put a table before a sofa with ``room`` metres in front of it."""
    widest = max(0.75 * float(sofa.size[0]), 0.7)
    item = space.stock.take("coffee_table", width=(0.5, widest), depth=(0.4, 0.8))
    if item is None or room <= 1.2:
        return None
    gap = min(space.rng.uniform(0.32, 0.45), room - item.size[1] - 0.35)
    if gap <= 0.2:
        return None
    front = (sofa.size[1] + item.size[1]) / 2 + gap
    return near(space, item, sofa, space.rng.uniform(-0.1, 0.1), front)


def _armchairs(space: Space, sofa: Piece, table: Piece | None) -> None:
    """Put armchairs at the ends of the coffee table, or one across the end of the sofa."""
    rng, stock = space.rng, space.stock
    if table is None:
        side, chair = space.side(), stock.take("sofa_chair")
        if chair is not None and space.maybe(0.4):
            right = side * ((sofa.size[0] + chair.size[1]) / 2 + 0.1)
            near(space, chair, sofa, right, sofa.size[1] / 2 + 0.55, turn=side * np.pi / 2)
        return
    for side in (-1.0, 1.0):
        chair = stock.take("sofa_chair") if space.maybe(0.38) else None
        if chair is not None:
            right = side * ((table.size[0] + chair.size[1]) / 2 + rng.uniform(0.25, 0.4))
            near(space, chair, table, right, rng.uniform(0.0, 0.35), turn=side * np.pi / 2)


def _at_ends(space: Space, sofa: Piece) -> None:
    """Put a lamp, a plant or a small chest with a lamp beside a sofa."""
    stock, side = space.stock, space.side()
    if space.maybe(0.4):
        beside(space, stock.take("floor_lamp"), sofa, side, gap=0.06)
    if space.maybe(0.3):
        beside(space, stock.take("plant", height=(0.5, 1.9)), sofa, -side, gap=0.08)
    elif space.maybe(0.25):
        item = stock.take("chest", width=(0.3, 0.6), height=(0.3, 0.65))
        small = beside(space, item, sofa, -side, gap=0.05)
        if small is not None:
            on_top(space, stock.take("table_lamp"), small)


def cushions(space: Space, seat: Piece, count: int) -> None:
    """Add cushions on a sofa or bed, the first at its ends."""
    item = space.stock.take("cushion")
    for k in range(count):
        if item is None:
            return
        share = (-0.72, 0.72, 0.0)[k % 3] + space.rng.uniform(-0.06, 0.06)
        back = 0.5 if seat.category != "bed" else 0.97
        on_top(space, item, seat, right=share, back=back, spread=0.08)
        if space.rng.random() < 0.4:
            item = space.stock.take("cushion")


def pictures_above(space: Space, lead: Piece) -> None:
    """Add one, two or three pictures on the wall above a piece."""
    if not space.maybe(0.6):
        return
    low = max(1.25, lead.top + 0.18) + space.rng.uniform(0.0, 0.15)
    item = space.stock.take("picture", width=(0.25, max(0.3, min(1.3, float(lead.size[0])))))
    if item is None:
        return
    spare = float(lead.size[0]) - item.size[0]
    if spare > 0.9 * item.size[0] and space.rng.random() < 0.45:
        count = 2 if spare < 2.2 * item.size[0] or space.rng.random() < 0.5 else 3
        step = item.size[0] + space.rng.uniform(0.08, 0.2)
        for k in range(count):
            if item is not None:
                above(space, item, lead, low, shift=(k - (count - 1) / 2) * step)
                item = space.stock.another(item)
    else:
        above(space, item, lead, low, shift=space.rng.uniform(-0.1, 0.1))


def dining(space: Space) -> Piece | None:
    """Add a table with chairs that face it, mostly free-standing, sometimes at a wall."""
    stock = space.stock
    for attempt in range(6):
        mark = space.mark()
        most = 2.3 - 0.3 * attempt
        item = stock.take(
            "table", width=(0.65, max(most, 0.8)), depth=(0.6, 1.3), height=(0.66, 0.82)
        )
        chair = stock.take("chair", height=(0.74, 1.2))
        if item is None or chair is None:
            return None
        if attempt < 4:
            table = free_standing(space, item, surround=0.72 if attempt < 3 else 0.62)
            sides = (0.0, np.pi)
        else:
            table = at_wall(space, item, access=0.7, corner=0.5)
            sides = (np.pi,)
        if table is None:
            continue
        chairs = _chairs(space, table, chair, sides)
        if chairs >= min(2, len(sides)) and space.has_free_ways():
            things_on(space, table, 1.6, *ON_DINING_TABLE)
            if table.wall is None and space.maybe(0.3):
                rug = stock.take("carpet", width=(1.4, 3.2), depth=(1.2, 2.6), height=(0.002, 0.02))
                carpet(space, rug, table.centre[:2], table.yaw)
            return table
        space.rollback(mark)
    return None


def _chairs(space: Space, table: Piece, chair: Item, sides: tuple[float, ...]) -> int:
    """Put chairs along the long sides of a table and perhaps at its ends; return how many."""
    rng, count = space.rng, 0
    seats = max(1, int((table.size[0] + 0.05) / max(0.58, chair.size[0] + 0.06)))
    for facing in sides:
        for seat in range(seats):
            if rng.random() < 0.93:
                along_side = ((seat + 0.5) / seats - 0.5) * table.size[0]
                count += chair_at(space, table, chair, facing, along_side) is not None
    for facing in (np.pi / 2, -np.pi / 2):
        if rng.random() < (0.45 if seats < 3 else 0.25) + 0.3 * (seats == 1):
            count += chair_at(space, table, chair, facing, 0.0) is not None
    return count


def chair_at(
    space: Space, table: Piece, chair: Item | None, facing: float, along_side: float
) -> Piece | None:
    """Put a chair at one side of a table, facing it; close to it and straight if it must be.

    ``facing`` is the chair's yaw relative to the table: 0 behind the table, pi in front of it,
    +pi/2 at its right end, -pi/2 at its left end; ``along_side`` the metres along that side.
    """
    if chair is None:
        return None
    turn = float(space.rng.choice([0.0, space.rng.normal(0.0, 0.12)]))
    gap = float(space.rng.choice([0.01, space.rng.uniform(0.01, 0.15)]))
    at_end = abs(abs(facing) - np.pi / 2) < 0.1
    for turned, apart in ((turn, gap), (0.0, 0.005)):
        reach = (np.cos(turned) * chair.size[1] + abs(np.sin(turned)) * chair.size[0]) / 2
        away = table.size[0 if at_end else 1] / 2 + apart + reach
        # the chair stands opposite to where it looks: its front is (-sin, cos) of ``facing``
        right = float(np.sin(facing) * away) + (0.0 if at_end else along_side)
        front = float(-np.cos(facing) * away) + (along_side if at_end else 0.0)
        placed = near(space, chair, table, right, front, turn=facing + turned)
        if placed is not None:
            return placed
    return None


def armchair(space: Space) -> Piece | None:
    """Add an armchair in a corner or at a wall, sometimes with a lamp."""
    item = space.stock.take("sofa_chair")
    if item is None:
        return None
    chair = at_wall(space, item, access=0.5, corner=0.3, gap=0.05)
    if chair is not None:
        if space.maybe(0.4):
            beside(space, space.stock.take("floor_lamp"), chair, space.side(), gap=0.08)
        if space.maybe(0.3):
            cushions(space, chair, 1)
    return chair


def piano(space: Space) -> Piece | None:
    """Add a piano with a stool in front of it."""
    item = space.stock.take("piano", width=(1.0, 1.7), depth=(0.4, 1.6))
    placed = at_wall(space, item, access=0.85, corner=0.2)
    if placed is not None:
        stool = space.stock.take("stool", height=(0.35, 0.6))
        if stool is not None:
            near(space, stool, placed, 0.0, (placed.size[1] + stool.size[1]) / 2 + 0.12, turn=np.pi)
        pictures_above(space, placed)
    return placed


def sideboard(space: Space) -> Piece | None:
    """Add a low cabinet or chest with things on and above it."""
    name = space.pick("bottom_cabinet", "chest", "chest", "console_table")
    item = space.stock.take(name, width=(0.7, 2.0), depth=(0.25, 0.62), height=(0.55, 1.1))
    placed = at_wall(space, item, access=0.55, corner=0.25)
    if placed is not None:
        if space.maybe(0.35):
            on_top(space, space.stock.take("table_lamp"), placed, right=space.side() * 0.8)
        things_on(space, placed, 1.4, *ON_CHEST, "speaker_system", "loudspeaker")
        over = space.pick("picture", "picture", "mirror", "wall_clock")
        if over == "picture":
            pictures_above(space, placed)
        elif space.maybe(0.6):
            most = {"mirror": (0.5, 1.1), "wall_clock": (0.2, 0.8)}[over]
            above(
                space,
                space.stock.take(over, height=most),
                placed,
                1.15 if over == "mirror" else 1.6,
            )
    return placed


def bookcase(space: Space) -> Piece | None:
    """Add a shelf with things in it, sometimes a second one beside it."""
    item = space.stock.take("shelf", height=(0.7, min(2.4, space.ceiling - 0.05)))
    placed = at_wall(space, item, access=0.55, corner=0.5)
    if placed is not None:
        things_on(space, placed, 1.8, *ON_SHELF, "loudspeaker")
        if space.maybe(0.25):
            second = beside(space, placed.item, placed, space.side(), access=0.55)
            if second is not None:
                things_on(space, second, 1.5, *ON_SHELF)
    return placed


def large_clock(space: Space) -> Piece | None:
    """Add a grandfather clock where there is no clock yet."""
    if space.count("wall_clock", "grandfather_clock"):
        return None
    item = space.stock.take("grandfather_clock", height=(1.5, space.ceiling - 0.05))
    return at_wall(space, item, access=0.4, corner=0.4)


def divider(space: Space) -> Piece | None:
    """Add a railing at right angles to a wall, which parts a large room."""
    item = space.stock.take("fence")
    if item is None:
        return None
    for _ in range(24):
        mark = space.mark()
        walls = space.walls
        wall = int(space.rng.choice(len(walls.length), p=walls.length / walls.length.sum()))
        lit = any(o.wall == wall and o.kind == "window" for o in space.openings)
        if walls.length[wall] < 3.0 or lit or space.count("fence") > 0:
            continue
        place = walls.start[wall] + walls.normal[wall] * item.size[0] / 2
        place = place + walls.along[wall] * space.rng.uniform(0.3, 0.7) * walls.length[wall]
        yaw = float((walls.yaw[wall] + np.pi / 2 + np.pi) % (2 * np.pi) - np.pi)
        centre = np.array([[*place, item.size[2] / 2]])
        placed = space.put(item, centre, np.array([yaw]), access=0.3, behind=0.3, companion=True)
        if placed is not None and space.has_free_ways():
            return placed
        space.rollback(mark)
    return None
