"""What furniture belongs in which room: first what it must have, then what it may have."""

from collections.abc import Callable

from . import _groups_kitchen as cook
from . import _groups_living as live
from . import _groups_rooms as any_room
from . import _groups_sleeping as rest
from ._records import RoomKind
from ._space import Piece, Space

Group = Callable[[Space], Piece | None]
"""Adds pieces to a room and returns the leading one, or None when it did not fit."""

FIRST: dict[RoomKind, list[tuple[Group, float]]] = {
    "living": [(live.television, 1.0), (live.bookcase, 0.5)],
    "dining": [(live.dining, 1.0), (live.sideboard, 0.7)],
    "kitchen": [(cook.kitchen, 1.0), (live.dining, 0.75)],
    "bedroom": [(rest.double_bed, 1.0), (rest.wardrobe, 0.85)],
    "child": [(rest.single_bed, 0.97), (rest.desk, 0.7), (rest.wardrobe, 0.4), (rest.toys, 0.7)],
    "bathroom": [(any_room.bathroom, 1.0)],
    "hall": [(any_room.entrance, 0.6), (any_room.coat_closet, 0.4)],
    "office": [(rest.desk, 1.0), (rest.office_shelves, 0.8)],
    "laundry": [(any_room.washing, 1.0), (any_room.basin, 0.6), (any_room.laundry_basket, 0.6)],
    "hobby": [],
    "open_plan": [
        (cook.kitchen, 1.0), (live.television, 0.97), (live.dining, 0.85), (cook.island, 0.3),
    ],
}  # fmt: skip
"""Groups in the order in which they are put, with their probabilities."""

HOBBIES: tuple[tuple[Group, ...], ...] = (
    (rest.billiards, live.seating, rest.hanging_screen),
    (rest.exercise, rest.hanging_screen, any_room.bench, any_room.wall_mirror),
    (live.piano, rest.music, live.bookcase, live.armchair),
    (rest.desk, rest.desk, live.bookcase, rest.music),
    (rest.billiards, rest.exercise, rest.music),
)
"""What a hobby room may be for."""

MORE: dict[RoomKind, dict[Group, float]] = {
    "living": {
        live.bookcase: 2.0, live.sideboard: 2.0, live.armchair: 1.3, any_room.plant: 2.5,
        any_room.floor_lamp: 1.2, any_room.picture: 3.0, any_room.wall_clock: 0.8,
        live.piano: 1.0, rest.music: 0.5, live.large_clock: 0.5, live.dining: 1.6,
        rest.desk: 0.5, any_room.basket: 0.5, any_room.bench: 0.3, live.divider: 0.8,
        any_room.loose_carpet: 0.4, any_room.pouf: 0.5, rest.crib: 0.15,
    },
    "dining": {
        any_room.plant: 2.0, any_room.picture: 3.0, live.sideboard: 1.5, live.large_clock: 0.8,
        any_room.wall_clock: 0.7, live.bookcase: 1.0, any_room.floor_lamp: 0.7,
        live.armchair: 0.7, any_room.wall_mirror: 0.4, any_room.loose_chair: 0.6,
        any_room.bench: 0.4, live.piano: 0.4,
    },
    "kitchen": {
        any_room.trash_can: 2.0, any_room.wall_clock: 1.2, any_room.picture: 1.0,
        cook.island: 1.0, live.sideboard: 0.8, any_room.plant: 0.9, any_room.high_cabinet: 0.8,
        any_room.stool: 0.7, any_room.basket: 0.7, live.bookcase: 0.4, any_room.loose_chair: 0.4,
    },
    "bedroom": {
        rest.dresser: 2.5, rest.desk: 1.2, any_room.picture: 2.5, any_room.plant: 1.5,
        any_room.wall_mirror: 1.0, rest.wardrobe: 1.0, live.armchair: 1.0, rest.crib: 1.6,
        any_room.loose_carpet: 0.7, any_room.floor_lamp: 0.8, live.bookcase: 0.8,
        rest.hanging_screen: 0.4, any_room.bench: 0.5, any_room.basket: 0.7,
        any_room.loose_chair: 0.7, any_room.wall_clock: 0.3, rest.music: 0.2,
        rest.exercise: 0.35, any_room.trash_can: 0.3,
    },
    "child": {
        rest.toys: 2.0, live.bookcase: 1.8, any_room.picture: 2.5, rest.play_table: 1.0,
        rest.crib: 2.2, rest.dresser: 1.0, rest.music: 0.6, any_room.loose_carpet: 1.2,
        any_room.pouf: 0.7, any_room.trash_can: 0.6, any_room.wall_clock: 0.5,
        any_room.plant: 0.5, any_room.floor_lamp: 0.5,
    },
    "bathroom": {
        any_room.towels: 2.0, any_room.bath_mat: 2.0, any_room.washing: 1.5,
        any_room.laundry_basket: 1.0, any_room.bath_cabinet: 2.0, any_room.trash_can: 0.8,
        any_room.plant: 0.5, any_room.stool: 0.5, any_room.picture: 0.5,
        any_room.towel_shelf: 1.3,
    },
    "hall": {
        any_room.picture: 3.0, any_room.runner: 1.5, any_room.plant: 1.0, any_room.bench: 1.0,
        any_room.coat_closet: 1.2, any_room.wall_mirror: 1.2,
        any_room.wall_clock: 0.6, live.large_clock: 0.6, any_room.basket: 0.6,
        any_room.floor_lamp: 0.4, live.bookcase: 0.6, any_room.stool: 0.3,
        any_room.trash_can: 0.3, any_room.entrance: 0.5,
    },
    "office": {
        rest.office_shelves: 2.0, any_room.plant: 1.5, any_room.picture: 2.0,
        any_room.wall_clock: 1.0, live.armchair: 1.0, live.seating: 0.6, rest.desk: 0.8,
        any_room.floor_lamp: 0.7, any_room.trash_can: 0.8, any_room.loose_chair: 0.8,
        any_room.loose_carpet: 0.6, rest.music: 0.3, live.dining: 0.3,
    },
    "laundry": {
        any_room.bath_cabinet: 2.0, any_room.laundry_basket: 1.5, any_room.towels: 1.0,
        any_room.high_cabinet: 1.2, live.bookcase: 0.8, any_room.trash_can: 0.8,
        any_room.coat_closet: 0.7, any_room.stool: 0.5, any_room.wall_clock: 0.3,
        any_room.towel_shelf: 0.8,
    },
    "hobby": {
        any_room.picture: 2.0, any_room.plant: 1.0, live.bookcase: 1.2, live.armchair: 0.8,
        any_room.wall_clock: 0.7, any_room.floor_lamp: 0.7, rest.music: 0.8,
        any_room.bench: 0.7, live.divider: 0.5, live.sideboard: 0.8, any_room.pouf: 0.7,
        any_room.loose_carpet: 0.6, any_room.trash_can: 0.4, rest.hanging_screen: 0.5,
        rest.exercise: 1.0, rest.billiards: 0.5,
    },
    "open_plan": {
        live.bookcase: 1.5, live.sideboard: 1.5, any_room.plant: 2.5, any_room.picture: 3.0,
        any_room.floor_lamp: 1.0, live.armchair: 1.0, rest.desk: 0.7, any_room.wall_clock: 0.8,
        live.divider: 1.0, rest.music: 0.4, any_room.trash_can: 1.0, live.piano: 0.4,
        any_room.loose_chair: 0.4, any_room.basket: 0.5, any_room.pouf: 0.6, live.large_clock: 0.3,
        any_room.bench: 0.3,
    },
}  # fmt: skip
"""Groups that are tried afterwards, with their weights."""
