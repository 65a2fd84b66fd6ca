"""Ways to put a piece in a room: at a wall, beside, in front of, above or on another one."""

import numpy as np
from jaxtyping import Bool, Float

from ._space import CARPET, SOLID, Piece, Space
from ._stock import Item

_TRIES = 32
_SCREENS = ("monitor", "laptop", "standing_tv")
_WATCHED = ("standing_tv",)
"""Screens that do not stand before windows."""
_BOARDS = ("shelf", "top_cabinet", "microwave")
_BETWEEN_BOARDS = 0.27
"""Metres that are free above a board inside a piece."""


def at_wall(
    space: Space,
    item: Item | None,
    *,
    bottom: float = 0.0,
    access: float = 0.0,
    sides: float = 0.0,
    corner: float = 0.25,
    gap: float = 0.0,
    tries: int = _TRIES,
    small: bool = False,
    least_wall: float = 0.0,
) -> Piece | None:
    """Return a piece put with its whole back at a wall, or None.

    Args:
        space: the room.
        item: what to put.
        bottom: height of its lower face.
        access: metres in front that stay free.
        sides: metres on its left and right that stay free.
        corner: probability that it stands in a corner of the room.
        gap: metres between its back and the wall.
        tries: number of places that are tried.
        small: whether it may be in the access space of others.
        least_wall: metres that the wall is long at least.
    """
    if item is None:
        return None
    walls, rng = space.walls, space.rng
    spare = (walls.length - item.size[0]).clip(min=0.0) * (walls.length >= least_wall)
    if spare.sum() <= 0.0:
        return None
    wall = rng.choice(len(spare), tries, p=spare / spare.sum())
    share = rng.random(tries)
    share = np.where(rng.random(tries) < corner, np.round(share), share)
    yaw = walls.yaw[wall]
    centre = walls.start[wall] + walls.normal[wall] * (item.size[1] / 2 + gap)
    centre += walls.along[wall] * (item.size[0] / 2 + share * spare[wall])[:, None]
    height = np.full((tries, 1), bottom + item.size[2] / 2)
    return space.put(
        item, np.hstack([centre, height]), yaw, access=access, sides=sides, wall=wall,
        small=small,
    )  # fmt: skip


def near(
    space: Space,
    item: Item | None,
    lead: Piece,
    right: float,
    front: float,
    *,
    turn: float = 0.0,
    bottom: float = 0.0,
    access: float = 0.0,
    behind: float = 0.0,
) -> Piece | None:
    """Return a piece put at a place of another piece's frame, or None.

    Args:
        space: the room.
        item: what to put.
        lead: the piece whose frame is meant.
        right: metres to the right of the lead's centre.
        front: metres in front of the lead's centre.
        turn: yaw relative to the lead.
        bottom: height of the lower face.
        access: metres in front that stay free.
        behind: metres behind it that stay free.
    """
    if item is None:
        return None
    centre = np.array([[*lead.place(right, front), bottom + item.size[2] / 2]])
    return space.put(
        item, centre, np.array([_wrap(lead.yaw + turn)]), companion=True, access=access,
        behind=behind,
    )  # fmt: skip


def along(
    space: Space,
    item: Item | None,
    lead: Piece,
    right: float,
    *,
    bottom: float = 0.0,
    access: float = 0.0,
    gap: float = 0.0,
) -> Piece | None:
    """Return a piece put with its back at the wall at which another one stands, or None.

    Args:
        space: the room.
        item: what to put.
        lead: a piece at a wall.
        right: metres to the right of the lead's centre.
        bottom: height of the lower face.
        access: metres in front that stay free.
        gap: metres between its back and the wall.
    """
    if item is None or lead.wall is None:
        return None
    walls, wall = space.walls, lead.wall
    middle = float((lead.centre[:2] - walls.start[wall]) @ walls.along[wall]) + right
    return along_wall(space, item, wall, middle, bottom=bottom, access=access, gap=gap)


def along_wall(
    space: Space,
    item: Item,
    wall: int,
    middle: float,
    *,
    bottom: float = 0.0,
    access: float = 0.0,
    gap: float = 0.0,
    small: bool = False,
    kind: int = SOLID,
) -> Piece | None:
    """Return a piece put with its back at a place of a wall, or None.

    Args:
        space: the room.
        item: what to put.
        wall: index of the wall.
        middle: metres from the wall's first corner to the middle of the piece.
        bottom: height of the lower face.
        access: metres in front that stay free.
        gap: metres between its back and the wall.
        small: whether it may be in the access space of others.
        kind: of the box it fills.
    """
    walls = space.walls
    if middle < item.size[0] / 2 - 1e-6 or middle > walls.length[wall] - item.size[0] / 2 + 1e-6:
        return None
    place = walls.start[wall] + walls.along[wall] * middle
    place = place + walls.normal[wall] * (item.size[1] / 2 + gap)
    return space.put(
        item, np.array([[*place, bottom + item.size[2] / 2]]), np.array([walls.yaw[wall]]),
        companion=True, small=small, access=access, wall=np.array([wall]), kind=kind,
    )  # fmt: skip


def beside(
    space: Space,
    item: Item | None,
    lead: Piece,
    side: float,
    *,
    gap: float = 0.0,
    access: float = 0.0,
) -> Piece | None:
    """Return a piece put at the same wall on the right (1) or left (-1) of another, or None."""
    if item is None:
        return None
    return along(space, item, lead, side * ((lead.size[0] + item.size[0]) / 2 + gap), access=access)


def above(
    space: Space, item: Item | None, lead: Piece, low: float, *, shift: float = 0.0
) -> Piece | None:
    """Return a piece hung on the wall above another one, at ``low`` or higher, or None."""
    if item is None:
        return None
    bottom = max(low, lead.top + 0.08)
    if bottom + item.size[2] > space.ceiling - 0.08:
        return None
    return along(space, item, lead, shift, bottom=bottom)


def on_top(
    space: Space,
    item: Item | None,
    lead: Piece,
    *,
    right: float | None = None,
    back: float = 0.5,
    turn: float = 0.0,
    spread: float = 0.25,
) -> Piece | None:
    """Return a piece put on another one, or None.

    Args:
        space: the room.
        item: what to put; it must fit on the lead.
        lead: what it stands on.
        right: share of the spare width, -1 the left to 1 the right end; anywhere when None.
        back: share of the spare depth, 0 the front to 1 the rear edge.
        turn: yaw relative to the lead.
        spread: by how much ``back`` varies.
    """
    if item is None or lead.item.support is None:
        return None
    cos, sin = abs(np.cos(turn)), abs(np.sin(turn))
    wide = cos * item.size[0] + sin * item.size[1]
    deep = sin * item.size[0] + cos * item.size[1]
    spare = np.array([lead.size[0] - wide, lead.size[1] - deep]) - 0.02
    if spare.min() < 0.0:
        return None
    tries = 12
    shares = space.rng.uniform(-1.0, 1.0, tries) if right is None else np.full(tries, right)
    rear = (1.0 - 2.0 * back) + space.rng.uniform(-spread, spread, tries)
    offsets = np.stack([shares, rear.clip(-1.0, 1.0)], axis=1) * spare / 2
    places = np.array([lead.place(x, y) for x, y in offsets])
    bottom = lead.bottom + lead.item.support
    if item.size[2] > headroom(lead):
        return None
    clear = ~_before_screen(space, item, lead, places)
    if item.model.category in _WATCHED:
        clear &= ~space.before_window(places, item.size, bottom)
    places = places[clear]
    tries = len(places)
    centre = np.hstack([places, np.full((tries, 1), bottom + item.size[2] / 2)])
    yaw = np.full(tries, _wrap(lead.yaw + turn))
    return space.put(item, centre, yaw, small=True, support=lead)


def _before_screen(
    space: Space, item: Item, lead: Piece, places: Float[np.ndarray, "k 2"]
) -> Bool[np.ndarray, " k"]:
    """Return at which places something would hide a screen, or be a hidden screen itself."""
    hidden = np.zeros(len(places), bool)
    right = np.array([np.cos(lead.yaw), np.sin(lead.yaw)])
    front = np.array([-right[1], right[0]])
    screen = item.model.category in _SCREENS
    for other in space.pieces:
        if other.support is not lead or other.top - other.bottom < 0.03:
            continue
        if not screen and other.category not in _SCREENS:
            continue
        away = places - other.centre[:2]
        beside = np.abs(away @ right) < 0.9 * (item.size[0] + other.size[0]) / 2
        ahead = away @ front
        hidden |= beside & ((ahead < 0) if screen else (ahead > 0))
    return hidden


def on_board(space: Space, item: Item | None, lead: Piece, tries: int = 6) -> Piece | None:
    """Return a piece put on one of the boards inside another one, or None."""
    if item is None:
        return None
    able = [
        board
        for board in lead.item.boards
        if board.headroom > item.size[2]
        and board.right - board.left > item.size[0] + 0.02
        and board.front - board.rear > item.size[1]
    ]
    for _ in range(tries if able else 0):
        board = able[int(space.rng.integers(len(able)))]
        spare = (board.right - board.left - item.size[0]) / 2 - 0.01
        across = (board.left + board.right) / 2 + space.rng.uniform(-spare, spare)
        deep = (board.front - board.rear - item.size[1]) / 2
        place = lead.place(
            float(across),
            float((board.rear + board.front) / 2 + space.rng.uniform(-0.3, 0.6) * deep),
        )
        bottom = lead.bottom + board.height
        placed = space.put(
            item, np.array([[*place, bottom + item.size[2] / 2]]), np.array([lead.yaw]),
            small=True, support=lead,
        )  # fmt: skip
        if placed is not None:
            return placed
    return None


def headroom(lead: Piece) -> float:
    """Return how high things on a piece can be: less on a board inside it than on its top."""
    support = lead.item.support
    if support is None or lead.category not in _BOARDS or support > 0.85 * lead.size[2]:
        return 3.0
    return _BETWEEN_BOARDS


def free_standing(
    space: Space,
    item: Item | None,
    *,
    surround: float = 0.0,
    turned: bool = False,
    tries: int = 48,
) -> Piece | None:
    """Return a piece put anywhere on the floor, or None.

    Args:
        space: the room.
        item: what to put.
        surround: metres on all sides that stay free.
        turned: at any yaw instead of parallel to a wall.
        tries: number of places that are tried.
    """
    if item is None:
        return None
    low, high = space.room.polygon.min(axis=0), space.room.polygon.max(axis=0)
    yaw = space.rng.integers(4, size=tries) * (np.pi / 2)
    if turned:
        yaw = space.rng.uniform(-np.pi, np.pi, tries)
    place = low + (high - low) * space.rng.random((tries, 2))
    # the nearer to the middle of the room, the sooner it is tried
    order = np.argsort(np.abs(place - (low + high) / 2).max(axis=1) + space.rng.random(tries))
    centre = np.hstack([place, np.full((tries, 1), item.size[2] / 2)])[order]
    return space.put(item, centre, _wrapped(yaw), access=surround, sides=surround, behind=surround)


def carpet(
    space: Space, item: Item | None, place: Float[np.ndarray, " 2"], yaw: float
) -> Piece | None:
    """Return a carpet laid at a place; furniture may stand on it."""
    if item is None:
        return None
    centre = np.array([[*place, item.size[2] / 2]])
    return space.put(item, centre, np.array([_wrap(yaw)]), kind=CARPET)


def _wrap(yaw: float) -> float:
    return float((yaw + np.pi) % (2 * np.pi) - np.pi)


def _wrapped(yaw: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
    return (yaw + np.pi) % (2 * np.pi) - np.pi
