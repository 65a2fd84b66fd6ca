"""Groups of furniture that belong together; each function adds one group to a room.

A group puts its leading piece at a random free place and the others relative to it. What does not
fit is left out, and so is everything after the wanted number of objects has been reached.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from panoscene.synth._furnishing import Furnishing, Piece

Group = Callable[[Furnishing], Piece | None]
"""Adds pieces and returns the leading one, or None when it did not fit."""


def _chance(room: Furnishing, probability: float) -> bool:
    return bool(room.rng.random() < probability)


def _pick(room: Furnishing, *names: str) -> str:
    return names[int(room.rng.integers(len(names)))]


def door(room: Furnishing) -> Piece | None:
    """Add a door with space to open it."""
    return room.put_at_wall("door", access=0.8, corner=0.1)


def window(room: Furnishing) -> Piece | None:
    """Add a window, sometimes with a heater under it."""
    size = room.sample_size("window")
    sill = min(float(room.rng.uniform(0.75, 1.0)), room.ceiling - 0.1 - size[2])
    placed = room.put_at_wall("window", bottom=sill, corner=0.0, size=size)
    if placed is not None and _chance(room, 0.4):
        heater = room.sample_size("heater")
        heater[2] = min(heater[2], sill - 0.08)
        room.put_along("heater", placed, 0.0, size=heater)
    return placed


def seating(room: Furnishing) -> Piece | None:
    """Add a sofa at a wall, a coffee table in front of it and sofa chairs around that."""
    sofa = room.put_at_wall("sofa", access=1.3, corner=0.1)
    if sofa is None:
        return None
    size = room.sample_size("coffee_table")
    front = sofa.size[1] / 2 + float(room.rng.uniform(0.3, 0.45)) + size[1] / 2
    coffee = room.put_near("coffee_table", sofa, 0.0, front, size=size)
    if coffee is not None:
        if _chance(room, 0.3):
            room.put_on("laptop", coffee)
        for side in (-1.0, 1.0):
            if _chance(room, 0.55):
                chair = room.sample_size("sofa_chair")
                right = side * ((coffee.size[0] + chair[1]) / 2 + 0.3)
                turn = side * np.pi / 2
                room.put_near("sofa_chair", coffee, right, 0.2, turn=turn, size=chair)
    if _chance(room, 0.7):
        room.put_above("picture", sofa, 1.3)
    if _chance(room, 0.5):
        _beside(room, "floor_lamp", sofa, _side(room), gap=0.08)
    return sofa


def television(room: Furnishing) -> Piece | None:
    """Add a low cabinet with a television on or above it and loudspeakers beside."""
    stand = room.put_at_wall(_pick(room, "bottom_cabinet", "chest"), access=1.0, corner=0.1)
    if stand is None:
        return None
    if _chance(room, 0.5):
        room.put_above("wall_mounted_tv", stand, 1.05)
    else:
        room.put_on("standing_tv", stand, back=0.8)
    if _chance(room, 0.4):
        room.put_on("loudspeaker", stand, back=0.6)
    if _chance(room, 0.4):
        _beside(room, "speaker_system", stand, _side(room), gap=0.06)
    return stand


def dining(room: Furnishing) -> Piece | None:
    """Add a free-standing table with chairs that face it."""
    table = room.put_free("table", surround=0.72)
    if table is None:
        return None
    seats = max(1, int(table.size[0] / 0.62))
    for facing in (0.0, np.pi):
        for seat in range(seats):
            along = ((seat + 0.5) / seats - 0.5) * table.size[0]
            _chair(room, table, "chair", facing, along)
    for facing in (np.pi / 2, -np.pi / 2):
        if _chance(room, 0.4):
            _chair(room, table, "chair", facing, 0.0)
    if _chance(room, 0.3):
        room.put_on("laptop", table)
    return table


def desk(room: Furnishing) -> Piece | None:
    """Add a table at a wall with a chair that faces it and things to work with on top."""
    table = room.put_at_wall("table", access=0.75)
    if table is None:
        return None
    along = float(room.rng.uniform(-0.15, 0.15)) * table.size[0]
    _chair(room, table, _pick(room, "chair", "office_chair"), np.pi, along)
    if _chance(room, 0.6):
        room.put_on("monitor", table, back=0.85)
    if _chance(room, 0.5):
        room.put_on("laptop", table, back=0.2)
    if _chance(room, 0.5):
        room.put_on("table_lamp", table, back=0.8)
    if _chance(room, 0.4):
        room.put_above("picture", table, 1.45)
    return table


def sleeping(room: Furnishing) -> Piece | None:
    """Add a bed with its head at a wall and chests with lamps beside it."""
    bed = room.put_at_wall("bed", access=0.6, corner=0.15)
    if bed is None:
        return None
    for side in (-1.0, 1.0):
        if _chance(room, 0.75):
            chest = room.sample_size("chest")
            chest[0] = min(chest[0], 0.75)
            gap = float(room.rng.uniform(0.0, 0.08))
            placed = _beside(room, "chest", bed, side, gap=gap, size=chest)
            if placed is not None and _chance(room, 0.7):
                room.put_on("table_lamp", placed)
    if _chance(room, 0.6):
        room.put_above("picture", bed, 1.35)
    return bed


def cabinet(room: Furnishing) -> Piece | None:
    """Add a cabinet, shelf or the like at a wall, with something on top or above."""
    name = _pick(
        room, "shelf", "bottom_cabinet", "bottom_cabinet", "bottom_cabinet_no_top", "chest"
    )
    placed = room.put_at_wall(name, access=0.6, corner=0.4)
    if placed is not None and placed.top < 1.1:
        if _chance(room, 0.5):
            room.put_on(_pick(room, "table_lamp", "loudspeaker", "coffee_machine"), placed)
        if _chance(room, 0.5):
            room.put_above(_pick(room, "mirror", "picture", "wall_clock"), placed, 1.35)
    return placed


def storage(room: Furnishing) -> Piece | None:
    """Add a cabinet, or one of the rarer pieces that stand at walls of living rooms."""
    name = _pick(room, *["cabinet"] * 6, "console_table", "piano", "grandfather_clock")
    if name == "cabinet":
        return cabinet(room)
    placed = room.put_at_wall(name, access=0.6, corner=0.4)
    if placed is not None and name == "piano":
        stool = room.sample_size("stool")
        front = (placed.size[1] + stool[1]) / 2 + 0.1
        room.put_near("stool", placed, 0.0, front, turn=np.pi, size=stool)
    elif placed is not None and name == "console_table" and _chance(room, 0.6):
        room.put_on("table_lamp", placed)
    return placed


def kitchen(room: Furnishing) -> Piece | None:
    """Add a run of kitchen units side by side, with hanging cabinets and a hood above."""
    lead = room.put_at_wall("bottom_cabinet", access=0.9, corner=0.7)
    if lead is None:
        return None
    units = room.rng.permutation(
        ["stove", "sink", "dishwasher", "bottom_cabinet", "oven", "fridge", "bottom_cabinet"]
    )
    run, last, side = [lead], lead, 1.0
    for name in units[: int(room.rng.integers(2, 6))].tolist():
        placed = None
        for direction in (side, -side):
            end = last if direction == side else lead
            placed = _beside(room, name, end, direction)
            if placed is not None:
                last, lead = (placed, lead) if direction == side else (last, placed)
                run.append(placed)
                break
    for unit in run:
        if unit.category in ("bottom_cabinet", "dishwasher", "sink") and _chance(room, 0.7):
            size = room.sample_size("top_cabinet")
            size[0] = unit.size[0]
            bottom = room.ceiling - size[2]
            if bottom > unit.top + 0.3:
                room.put_along("top_cabinet", unit, 0.0, bottom=bottom, size=size)
        if unit.category == "stove" and _chance(room, 0.7):
            room.put_above("range_hood", unit, 1.6)
        if unit.category == "bottom_cabinet" and _chance(room, 0.5):
            room.put_on(_pick(room, "microwave", "coffee_machine"), unit)
    return run[0]


def bathroom(room: Furnishing) -> Piece | None:
    """Add one sanitary piece; a sink gets a mirror above it."""
    name = _pick(room, "bathtub", "shower", "toilet", "sink", "sink")
    corner = {"bathtub": 0.7, "shower": 1.0}.get(name, 0.1)
    placed = room.put_at_wall(name, access=0.6, corner=corner)
    if placed is not None and name == "sink" and _chance(room, 0.8):
        room.put_above("mirror", placed, 1.2)
    if placed is not None and name in ("bathtub", "toilet") and _chance(room, 0.4):
        room.put_above("towel_rack", placed, 1.2)
    return placed


def laundry(room: Furnishing) -> Piece | None:
    """Add a washer and a dryer side by side."""
    washer = room.put_at_wall("washer", access=0.7, corner=0.5)
    if washer is not None and _chance(room, 0.8):
        _beside(room, "dryer", washer, _side(room), gap=float(room.rng.choice([0.0, 0.02])))
    return washer


def wall_decoration(room: Furnishing) -> Piece | None:
    """Add something that hangs on a wall."""
    name = _pick(room, "picture", "picture", "picture", "mirror", "wall_clock", "wall_mounted_tv")
    size = room.sample_size(name)
    low = {"wall_clock": 1.8, "wall_mounted_tv": 1.0}.get(name, 1.25)
    bottom = min(low + float(room.rng.uniform(0.0, 0.25)), room.ceiling - 0.1 - size[2])
    return room.put_at_wall(name, bottom=bottom, corner=0.0, size=size)


def hanging_cabinet(room: Furnishing) -> Piece | None:
    """Add a cabinet that hangs under the ceiling."""
    size = room.sample_size("top_cabinet")
    return room.put_at_wall("top_cabinet", bottom=room.ceiling - size[2], corner=0.5, size=size)


def beside_wall(room: Furnishing) -> Piece | None:
    """Add one piece that usually stands at a wall of a living room."""
    return room.put_at_wall(_pick(room, "plant", "floor_lamp", "guitar", "bench"), corner=0.5)


def in_corner(room: Furnishing) -> Piece | None:
    """Add one small piece that usually stands in a corner."""
    return room.put_at_wall(_pick(room, "plant", "trash_can", "basket"), corner=0.8)


def free_standing(room: Furnishing) -> Piece | None:
    """Add one piece somewhere on the floor, at any yaw."""
    name = _pick(room, "plant", "sofa_chair", "stool", "basket", "office_chair")
    return room.put_free(name, surround=0.25, turned=True)


def large_free_standing(room: Furnishing) -> Piece | None:
    """Add one large piece in the middle of the room, parallel to the walls."""
    return room.put_free(_pick(room, "pool_table", "treadmill", "crib"), surround=0.5)


def carpet(room: Furnishing) -> Piece | None:
    """Add a carpet where nothing stands."""
    return room.put_free("carpet")


def _side(room: Furnishing) -> float:
    return float(room.rng.choice([-1.0, 1.0]))


def _beside(
    room: Furnishing,
    name: str,
    lead: Piece,
    side: float,
    *,
    gap: float = 0.0,
    size: Float[np.ndarray, " 3"] | None = None,
) -> Piece | None:
    """Put a piece at the same wall, to the right (side 1) or left (side -1) of another one."""
    size = room.sample_size(name) if size is None else size
    right = side * ((lead.size[0] + size[0]) / 2 + gap)
    return room.put_along(name, lead, right, size=size)


def _chair(room: Furnishing, table: Piece, name: str, facing: float, along: float) -> None:
    """Put a chair at one side of a table, facing it; close to it and straight if it must be.

    ``facing`` is the chair's yaw relative to the table: 0 behind the table, pi in front of it,
    +pi/2 at its right end, -pi/2 at its left end; ``along`` the metres along that side.
    """
    size = room.sample_size(name)
    turn = float(room.rng.choice([0.0, room.rng.uniform(-0.25, 0.25)]))
    gap = float(room.rng.choice([0.0, room.rng.uniform(0.02, 0.15)]))
    at_end = abs(abs(facing) - np.pi / 2) < 0.1
    for turned, apart in ((turn, gap), (0.0, 0.0)):
        reach = (np.cos(turned) * size[1] + abs(np.sin(turned)) * size[0]) / 2
        away = table.size[0 if at_end else 1] / 2 + apart + reach
        # the chair stands opposite to where it looks: its front is (-sin, cos) of ``facing``
        right = float(np.sin(facing) * away) + (0.0 if at_end else along)
        front = float(-np.cos(facing) * away) + (along if at_end else 0.0)
        if room.put_near(name, table, right, front, turn=facing + turned, size=size) is not None:
            return


GROUPS: dict[str, dict[Group, float]] = {
    "living": {
        seating: 6.0, television: 4.0, storage: 4.0, dining: 3.0, desk: 1.0, carpet: 0.7,
        wall_decoration: 3.0, beside_wall: 2.0, in_corner: 1.5, free_standing: 2.0,
        large_free_standing: 0.3,
    },
    "bedroom": {
        sleeping: 6.0, storage: 4.0, desk: 3.0, television: 1.0, wall_decoration: 3.0,
        beside_wall: 1.0, in_corner: 1.0, free_standing: 1.0, carpet: 0.7,
        large_free_standing: 0.3,
    },
    "kitchen": {
        kitchen: 6.0, dining: 5.0, cabinet: 2.0, hanging_cabinet: 1.5, laundry: 1.0,
        wall_decoration: 2.0, in_corner: 2.0,
    },
    "bathroom": {
        bathroom: 7.0, laundry: 2.0, cabinet: 2.0, hanging_cabinet: 1.0, wall_decoration: 1.5,
        in_corner: 2.0, carpet: 0.3,
    },
    "office": {
        desk: 7.0, storage: 4.0, wall_decoration: 2.0, beside_wall: 1.0, in_corner: 1.0,
        seating: 1.0, free_standing: 1.5, dining: 1.5,
    },
    "open plan": {
        seating: 3.0, television: 2.0, dining: 4.0, desk: 2.0, sleeping: 1.0, kitchen: 2.0,
        storage: 3.0, bathroom: 0.7, laundry: 0.5, wall_decoration: 3.0, hanging_cabinet: 0.5,
        beside_wall: 1.0, in_corner: 1.0, free_standing: 1.5, carpet: 0.5,
        large_free_standing: 0.7,
    },
}  # fmt: skip
"""How often each group is tried, by the kind of room."""
