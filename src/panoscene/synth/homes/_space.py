"""A room being furnished: what stands where, what is still free, and the ways to put a piece."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from panoscene.synth._frames import place_of

from ._manhattan import blocks_around, walls_of
from ._paths import FloorGrid
from ._records import Opening, Room
from ._stock import Item, Stock

_SLACK = 1e-6
_TRIES = 32
"""Candidate places that are tested at once for one piece."""
_ROWS = 700

SOLID, ACCESS, DOORWAY, CARPET, WINDOW, CURTAIN = 0, 1, 2, 3, 4, 5
"""What a box in the room is: a thing; space that companions may use; space that nothing may use;
something flat that only others of its sort may not overlap; space that only curtains may use; a
thing that may use it."""


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A model that was put in a room."""

    item: Item
    centre: Float[np.ndarray, " 3"]
    yaw: float
    support: "Piece | None" = None
    group: int = -1
    wall: int | None = None
    """The wall at which it stands."""
    opening: int | None = None

    @property
    def category(self) -> str:
        """One of the 57, or "" for decoration."""
        return self.item.model.category

    @property
    def size(self) -> Float[np.ndarray, " 3"]:
        """Width, depth, height in metres."""
        return self.item.size

    @property
    def bottom(self) -> float:
        """Height of the lower face in metres."""
        return float(self.centre[2] - self.size[2] / 2)

    @property
    def top(self) -> float:
        """Height of the upper face in metres."""
        return float(self.centre[2] + self.size[2] / 2)

    def place(self, right: float, front: float) -> Float[np.ndarray, " 2"]:
        """Return the point that lies so far to the piece's right and front of its centre."""
        return place_of(self.centre, self.yaw, right, front)


class Space:
    """Pieces placed so far in one room; each ``put_*`` adds one where it is free, or returns None.

    Collisions are tested between bounding boxes along the room's axes: exact for pieces parallel
    to the walls, on the safe side for turned ones. Groups are put as a whole: ``mark`` before,
    and ``rollback`` when an essential piece did not fit or a way is blocked.
    """

    def __init__(
        self, room: Room, openings: tuple[Opening, ...], stock: Stock, density: float
    ) -> None:
        self.room = room
        self.openings = openings
        self.stock = stock
        self.rng = stock.rng
        self.density = density
        self.walls = walls_of(room.polygon)
        self.ceiling = room.ceiling_height
        self.pieces: list[Piece] = []
        self.group = -1
        self._low = np.zeros((3, _ROWS))
        self._high = np.zeros((3, _ROWS))
        self._kind = np.zeros(_ROWS, dtype=np.int64)
        self._owner = np.full(_ROWS, -1)
        self._group = np.full(_ROWS, -1)
        self._used = 0
        self._corner = room.polygon.min(axis=0), room.polygon.max(axis=0)
        self.blocks = blocks_around(room.polygon)
        for block in self.blocks:
            self._occupy(np.array([*block[:2], -1.0]), np.array([*block[2:], 9.0]), SOLID)
        self._floor = FloorGrid(room.polygon, self.blocks)
        self._doorways: list[tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]] = []
        for opening in openings:
            self._keep_clear(opening)
        self._has_ways = self.has_free_ways(force=True)

    def maybe(self, probability: float) -> bool:
        """Return whether to add something that is there with a probability at middle density."""
        odds = probability / max(1.0 - probability, 1e-3) * 4.0 ** (2.0 * self.density - 1.0)
        return bool(self.rng.random() < odds / (1.0 + odds))

    def pick(self, *names: str) -> str:
        """Return one of several names."""
        return names[int(self.rng.integers(len(names)))]

    def side(self) -> float:
        """Return 1 or -1."""
        return float(self.rng.choice([-1.0, 1.0]))

    def count(self, *categories: str) -> int:
        """Return how many pieces of these categories there are."""
        return sum(piece.category in categories for piece in self.pieces)

    def new_group(self) -> None:
        """Give the following pieces a group of their own."""
        self.group += 1

    def mark(self) -> tuple[int, int]:
        """Return the state to which ``rollback`` can return."""
        return len(self.pieces), self._used

    def rollback(self, mark: tuple[int, int]) -> None:
        """Take away what was put since a mark."""
        del self.pieces[mark[0] :]
        self._used = mark[1]

    def has_free_ways(self, *, force: bool = False) -> bool:
        """Return whether one can walk between all doorways and to all that needs access."""
        if not force and not self._has_ways:
            return True  # too small a room even when empty
        used = self._used
        kind, low, high = self._kind[:used], self._low[:, :used].T, self._high[:, :used].T
        things = (kind == SOLID) & (self._owner[:used] >= 0)
        things &= (low[:, 2] < 1.6) & (high[:, 2] > 0.1)
        access = kind == ACCESS
        access &= self._owner[:used] >= 0
        return self._floor.connects(
            np.hstack([low[things, :2], high[things, :2]]),
            np.array([[*low[:2], *high[:2]] for low, high in self._doorways]).reshape(-1, 4),
            np.hstack([low[access, :2] - 0.15, high[access, :2] + 0.15]),
        )

    def put(
        self,
        item: Item | None,
        centre: Float[np.ndarray, "k 3"],
        yaw: Float[np.ndarray, " k"],
        *,
        access: float = 0.0,
        sides: float = 0.0,
        behind: float = 0.0,
        companion: bool = False,
        small: bool = False,
        support: Piece | None = None,
        kind: int = SOLID,
        wall: Int[np.ndarray, " k"] | None = None,
    ) -> Piece | None:
        """Return the piece placed at the first free candidate, or None.

        Args:
            item: what to put; None is never placed.
            centre: candidate centres.
            yaw: candidate yaws.
            access: metres in front of the piece that must be free and stay free.
            sides: the same on its left and right.
            behind: the same behind it.
            companion: whether it may stand before windows and in the access space of its group.
            small: whether it may be in the access space of all others.
            support: the piece it stands on.
            kind: of the box it fills.
            wall: index of the wall at which each candidate stands.
        """
        if item is None:
            return None
        low, high = _bounds(item.size, centre, yaw)
        owner = -2 if support is None else self._index(support)
        in_way = self._in_way(kind, companion=companion, small=small)
        free = self._is_free(low, high, in_way, ignore=owner)
        zone_low, zone_high = low, high
        if access > 0.0 or sides > 0.0 or behind > 0.0:
            grown = item.size + np.array([2 * sides, access + behind, 0.0])
            front = np.stack([-np.sin(yaw), np.cos(yaw), np.zeros_like(yaw)], axis=1)
            zone_low, zone_high = _bounds(grown, centre + front * (access - behind) / 2, yaw)
            zone_low[:, 2], zone_high[:, 2] = 0.05, 1.2
            in_way = self._in_way(ACCESS, companion=True, small=True)
            free &= self._is_free(zone_low, zone_high, in_way, ignore=owner)
        if not free.any() or self._used + 2 > _ROWS:
            return None
        best = int(free.argmax())
        at = None if wall is None else int(wall[best])
        piece = Piece(item, centre[best], float(yaw[best]), support, self.group, at)
        self.pieces.append(piece)
        number = len(self.pieces) - 1
        self._occupy(low[best], high[best], SOLID if kind == CURTAIN else kind, number)
        if access > 0.0 or sides > 0.0 or behind > 0.0:
            self._occupy(zone_low[best], zone_high[best], ACCESS, number)
        return piece

    def add(self, piece: Piece) -> None:
        """Add a piece without a test: doors and windows."""
        self.pieces.append(piece)

    def clearance(self, point: Float[np.ndarray, " 2"], yaw: float) -> float:
        """Return the distance from a point in the direction of a yaw to the next wall."""
        front = np.array([-np.sin(yaw), np.cos(yaw)])
        gaps = (self.walls.start - point) @ front
        facing = self.walls.normal @ front < -0.5
        offset = (point - self.walls.start) * self.walls.along
        along = offset.sum(axis=1)
        hit = facing & (gaps > 0.0) & (along > 0.0) & (along < self.walls.length)
        return float(gaps[hit].min(initial=99.0))

    def before_window(
        self, places: Float[np.ndarray, "k 2"], size: Float[np.ndarray, " 3"], bottom: float
    ) -> Bool[np.ndarray, " k"]:
        """Return which places are less than 0.8 m before a window that a piece would cover."""
        found = np.zeros(len(places), bool)
        for opening in self.openings:
            if opening.kind != "window" or bottom + size[2] < opening.bottom + 0.05:
                continue
            offset = places - self.walls.start[opening.wall]
            along = offset @ self.walls.along[opening.wall]
            middle = opening.start + opening.width / 2
            beside = np.abs(along - middle) < (opening.width + size[0]) / 2
            away = offset @ self.walls.normal[opening.wall]
            found |= beside & (away > 0.0) & (away < 0.8)
        return found

    def bare_parts(self, wall: int) -> list[tuple[float, float]]:
        """Return the parts of a wall, in metres along it, with nothing at the height of eyes."""
        start, along = self.walls.start[wall], self.walls.along[wall]
        normal, length = self.walls.normal[wall], float(self.walls.length[wall])
        taken = [(o.start - 0.1, o.start + o.width + 0.1) for o in self.openings if o.wall == wall]
        for piece in self.pieces:
            away = float((piece.centre[:2] - start) @ normal)
            turned = abs(np.sin(piece.yaw - self.walls.yaw[wall])) > 0.5
            wide, deep = piece.size[[1, 0] if turned else [0, 1]]
            if 0.0 < away < deep / 2 + 0.25 and piece.top > 1.15 and piece.bottom < 2.0:
                middle = float((piece.centre[:2] - start) @ along)
                taken.append((middle - wide / 2, middle + wide / 2))
        free: list[tuple[float, float]] = []
        at = 0.0
        for low, high in sorted(taken):
            if low > at:
                free.append((at, low))
            at = max(at, high)
        return [*free, (at, length)] if at < length else free

    def on_wall(self, points: Float[np.ndarray, "k 2"]) -> int | None:
        """Return the wall on which all of some points lie; None if there is none."""
        offset = points[:, None] - self.walls.start
        across = np.abs((offset * self.walls.normal).sum(axis=2))
        along = (offset * self.walls.along).sum(axis=2)
        good = (across < 0.04) & (along > -_SLACK) & (along < self.walls.length + _SLACK)
        walls = np.flatnonzero(good.all(axis=0))
        return int(walls[0]) if walls.size else None

    def _index(self, piece: Piece) -> int:
        return next(k for k, other in enumerate(self.pieces) if other is piece)

    def _keep_clear(self, opening: Opening) -> None:
        """Keep free what doors need to open, what people need to pass, and the view outside."""
        walls, wall = self.walls, opening.wall
        first = walls.start[wall] + walls.along[wall] * (opening.start - 0.04)
        last = walls.start[wall] + walls.along[wall] * (opening.start + opening.width + 0.04)

        def zone(deep: float, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
            ends = np.stack([first, last, first + walls.normal[wall] * deep])
            return np.array([*ends.min(axis=0), low]), np.array([*ends.max(axis=0), high])

        if opening.kind == "window":
            self._occupy(*zone(0.10, opening.bottom - 0.03, opening.top + 0.06), WINDOW)
            if opening.bottom < 0.3:
                self._occupy(*zone(0.65, 0.04, 2.0), WINDOW)
            else:
                self._occupy(*zone(0.6, opening.bottom + 0.15, opening.top), ACCESS)
            return
        deep = 0.75
        if opening.kind == "door" and (opening.swing >= 0.0):
            deep = opening.width + 0.06
        self._occupy(*zone(deep, 0.04, max(opening.top, 2.0)), DOORWAY)
        self._doorways.append(zone(0.8, 0.0, 2.0))

    def _occupy(
        self,
        low: Float[np.ndarray, " 3"],
        high: Float[np.ndarray, " 3"],
        kind: int,
        owner: int = -1,
    ) -> None:
        self._low[:, self._used], self._high[:, self._used] = low, high
        self._kind[self._used], self._owner[self._used] = kind, owner
        self._group[self._used] = self.group
        self._used += 1

    def _in_way(self, kind: int, *, companion: bool, small: bool) -> Bool[np.ndarray, " used"]:
        """Return which of the boxes so far a box of some kind may not touch."""
        kinds, owners = self._kind[: self._used], self._owner[: self._used]
        if kind == CARPET:
            return (kinds == CARPET) | ((kinds == SOLID) & (owners < 0))
        if kind == ACCESS:
            return kinds == SOLID
        meets = (kinds == SOLID) | (kinds == DOORWAY)
        if kind != CURTAIN:
            meets |= kinds == WINDOW
        if companion:
            of_others = (self._group[: self._used] != self.group) & (owners >= 0)
            return meets | ((kinds == ACCESS) & of_others & (not small))
        return meets if small else meets | (kinds == ACCESS)

    def _is_free(
        self,
        low: Float[np.ndarray, "k 3"],
        high: Float[np.ndarray, "k 3"],
        in_way: Bool[np.ndarray, " used"],
        *,
        ignore: int,
    ) -> Bool[np.ndarray, " k"]:
        """Return which boxes lie in the room and touch nothing that is in their way."""
        inside = (low[:, :2] >= self._corner[0] - _SLACK).all(axis=1)
        inside &= (high[:, :2] <= self._corner[1] + _SLACK).all(axis=1)
        inside &= high[:, 2] <= self.ceiling + _SLACK
        others = np.flatnonzero(in_way & (self._owner[: self._used] != ignore))
        lower, upper = self._low[:, others] + _SLACK, self._high[:, others] - _SLACK
        meets = np.ones((len(low), len(others)), dtype=bool)
        for axis in range(3):
            meets &= low[:, axis, None] < upper[axis]
            meets &= high[:, axis, None] > lower[axis]
        return inside & ~meets.any(axis=1)


def _bounds(
    size: Float[np.ndarray, " 3"], centre: Float[np.ndarray, "k 3"], yaw: Float[np.ndarray, " k"]
) -> tuple[Float[np.ndarray, "k 3"], Float[np.ndarray, "k 3"]]:
    """Return the lower and upper corners of the boxes' bounds along the room's axes."""
    cos, sin = np.abs(np.cos(yaw)), np.abs(np.sin(yaw))
    half = np.stack(
        [cos * size[0] + sin * size[1], sin * size[0] + cos * size[1], np.full_like(cos, size[2])],
        axis=1,
    )
    return centre - half / 2, centre + half / 2
