"""Furniture for homes: room by room, by rules and group templates."""

from collections import Counter
from dataclasses import replace

import numpy as np

from ._fixtures import door_piece, heaters, window_piece
from ._groups_sleeping import double_bed, wardrobe
from ._hangings import bare_walls, ceiling_lamps, curtains, sockets, switches
from ._library import ModelLibrary
from ._manhattan import area_of
from ._recipes import FIRST, HOBBIES, MORE, Group
from ._records import Home, Opening, Placed
from ._space import Piece, Space
from ._stock import Item, Stock


def furnish_home(
    home: Home,
    library: ModelLibrary,
    rng: np.random.Generator | None = None,
    density: float | None = None,
) -> Home:
    """Return a home with doors and windows in its openings and furniture in its rooms.

    Groups of furniture are put by rules: beds at walls between chests with lamps, sofas that face
    a television across a coffee table, chairs around tables, kitchen units in a run, and so on;
    what does not fit is left out. Boxes do not overlap but by contact, nothing stands in the
    swing of a door or before a doorway, there is a way of 52 cm between all doorways and to all
    that needs access, and only what is lower than its sill stands before a window. Pieces rest on
    the floor, on what supports them, or on a wall; carpets lie under furniture.

    Args:
        home: a home without furniture, from ``sample_home``.
        library: the models; categories it does not have are left out.
        rng: source of randomness; made from the home's seed when None.
        density: 0 is sparse, 1 is cluttered; random when None.

    Raises:
        ValueError: if the density is outside [0, 1] or the home has furniture already.
    """
    if home.placed:
        raise ValueError(f"home: expected one without furniture, found {len(home.placed)} pieces")
    if density is not None and not 0.0 <= density <= 1.0:
        raise ValueError(f"density must be in [0, 1], found {density}")
    rng = np.random.default_rng([home.seed, 2]) if rng is None else rng
    usual = float(rng.beta(2.0, 2.0)) if density is None else density
    stock = Stock(library, rng)
    placed: list[Placed] = []
    openings = list(home.openings)
    _fill_openings(stock, home, placed, openings)
    for index in range(len(home.rooms)):
        spread = 0.0 if density is not None else float(rng.normal(0.0, 0.12))
        around = tuple(opening for opening in home.openings if opening.room == index)
        space = Space(home.rooms[index], around, stock, float(np.clip(usual + spread, 0.0, 1.0)))
        _furnish_room(space, home)
        known = max((piece.group for piece in placed), default=-1)
        placed += _records(space, index, offset=len(placed), groups=known + 1)
    return replace(home, placed=tuple(placed), openings=tuple(openings))


def _fill_openings(stock: Stock, home: Home, placed: list[Placed], openings: list[Opening]) -> None:
    """Add the doors and windows: most doors of a home are alike, and so are its windows."""
    inner: Item | None = None
    glass: Item | None = None
    for index, opening in enumerate(home.openings):
        if opening.kind == "opening" or opening.swing < 0.0:
            continue
        if opening.kind == "door" and opening.leads_to is not None:
            twin = _twin(home, index)
            if opening.swing == 0.0 and twin < index:
                continue  # a closed door is placed once, facing the room that is listed first
            piece = door_piece(stock, home, index, inner if stock.rng.random() < 0.85 else None)
            inner = inner or (piece.item if piece else None)
        elif opening.kind == "door":
            twin = index
            piece = door_piece(stock, home, index, None)
        else:
            twin = index
            piece = window_piece(stock, home, index, glass)
            glass = glass or (piece.item if piece else None)
        if piece is None:
            continue
        for entry in {index, twin}:
            openings[entry] = replace(openings[entry], model=piece.item.model.id)
        placed.append(_record(piece, opening.room, None, -1))


def _twin(home: Home, index: int) -> int:
    """Return the index of the same doorway's entry for the room behind."""
    opening = home.openings[index]
    return next(
        k
        for k, other in enumerate(home.openings)
        if other.room == opening.leads_to
        and other.leads_to == opening.room
        and abs(other.width - opening.width) < 1e-9
        and other.top == opening.top
    )


def _furnish_room(space: Space, home: Home) -> None:
    rng, kind = space.rng, space.room.kind
    switches(space)
    late_heaters = kind in ("kitchen", "bathroom", "laundry", "open_plan")
    if not late_heaters:
        heaters(space)
    first = list(FIRST[kind])
    kinds = [room.kind for room in home.rooms]
    if kind == "open_plan" and not {"bedroom", "child"} & set(kinds):
        first[1:1] = [(double_bed, 1.0), (wardrobe, 0.8)]
    if kind == "living" and not {"bedroom", "child"} & set(kinds):
        first.insert(1, (double_bed, 1.0))
    if kind == "hobby":
        hobby = HOBBIES[int(rng.integers(len(HOBBIES)))]
        first += [(group, 0.9) for group in hobby]
    for group, probability in first:
        if rng.random() < probability:
            _add(space, group, tries=5)
    more = MORE[kind]
    weight = np.array(list(more.values()))
    area = area_of(space.room.polygon)
    count = int(np.round(np.sqrt(area) * (0.4 + 2.2 * space.density) * rng.uniform(0.75, 1.25)))
    for _ in range(count):
        group = list(more)[int(rng.choice(len(weight), p=weight / weight.sum()))]
        _add(space, group)
    space.group = -1
    if late_heaters:
        heaters(space)
    ceiling_lamps(space)
    curtains(space)
    bare_walls(space)
    sockets(space)


def _add(space: Space, group: Group, tries: int = 1) -> None:
    """Add one group, unless it blocks a way."""
    space.new_group()
    for _ in range(tries):
        mark = space.mark()
        if group(space) is not None and space.has_free_ways():
            return
        space.rollback(mark)


def _records(space: Space, room: int, offset: int, groups: int) -> list[Placed]:
    """Return a room's pieces as records, from index ``offset`` and group ``groups`` on."""
    numbers = {id(piece): offset + k for k, piece in enumerate(space.pieces)}
    sizes = Counter(piece.group for piece in space.pieces if piece.group >= 0)
    shared = [group for group, count in sorted(sizes.items()) if count > 1]
    group_of = {group: groups + k for k, group in enumerate(shared)}
    carpets = [p for p in space.pieces if p.category == "carpet"]
    records: list[Placed] = []
    lifts: dict[int, float] = {}
    for piece in space.pieces:
        support = None if piece.support is None else numbers[id(piece.support)]
        lift = 0.0
        if piece.support is not None:
            lift = lifts[id(piece.support)]
        elif piece.bottom < 1e-6 and piece.category != "carpet":
            lift = max((c.top for c in carpets if _over(piece, c)), default=0.0)
        lifts[id(piece)] = lift
        group = group_of.get(piece.group, -1)
        records.append(_record(piece, room, support, group, lift))
    return records


def _over(piece: Piece, carpet: Piece) -> bool:
    """Return whether a piece stands on a carpet, at least with its edge."""
    gap = np.abs(piece.centre[:2] - carpet.centre[:2])
    reach = [np.abs([np.cos(p.yaw), np.sin(p.yaw)]) for p in (piece, carpet)]
    half = sum(
        np.array([c * p.size[0] + s * p.size[1], s * p.size[0] + c * p.size[1]]) / 2
        for (c, s), p in zip(reach, (piece, carpet), strict=True)
    )
    return bool((gap < half - 0.01).all())


def _record(piece: Piece, room: int, support: int | None, group: int, lift: float = 0.0) -> Placed:
    x, y, z = piece.centre.tolist()
    return Placed(
        piece.item.model.id, room, (x, y, z + lift), piece.yaw, piece.item.scale,
        piece.item.look, support, group, piece.opening,
    )  # fmt: skip
