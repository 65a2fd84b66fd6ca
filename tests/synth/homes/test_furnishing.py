"""Furniture: what stands where, what is kept free, and what belongs together."""

import dataclasses
import functools
from typing import get_args

import numpy as np
import pytest
import shapely
import torch

from panoscene.geometry import OrientedBoxes, penetration_depth
from panoscene.scene import CATEGORIES
from panoscene.synth.homes import (
    Home,
    Opening,
    PlacedBoxes,
    Room,
    RoomKind,
    Summary,
    furnish_home,
    home_scene,
    home_statistics,
    placed_boxes,
    sample_home,
    stand_in_library,
    summary_library,
)
from panoscene.synth.homes._library import kind_of
from panoscene.synth.homes._manhattan import walls_of

LIBRARY = stand_in_library()
COUNT = 5


@functools.cache
def _home(seed: int) -> Home:
    return furnish_home(sample_home(seed), LIBRARY)


@functools.cache
def _boxes(seed: int) -> PlacedBoxes:
    return placed_boxes(_home(seed), LIBRARY)


def _footprint(boxes: PlacedBoxes, k: int) -> shapely.Polygon:
    cos, sin = np.cos(boxes.yaw[k]), np.sin(boxes.yaw[k])
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * boxes.size[k, :2] / 2
    turned = corners @ np.array([[cos, sin], [-sin, cos]]) + boxes.centre[k, :2]
    return shapely.Polygon(turned)


def _bottom(boxes: PlacedBoxes, k: int) -> float:
    return float(boxes.centre[k, 2] - boxes.size[k, 2] / 2)


def _all(*categories: str) -> list[tuple[int, int]]:
    """Return seed and index of all pieces of some categories."""
    return [
        (seed, k)
        for seed in range(COUNT)
        for k, name in enumerate(_boxes(seed).category)
        if name in categories
    ]


def _many() -> list[Home]:
    return [_home(seed) for seed in range(COUNT)]


def _empty_room(kind: RoomKind, seed: int) -> Home:
    """Return one large room with a door and two windows."""
    room = Room(kind, np.array([[0.0, 0.0], [6.8, 0.0], [6.8, 5.6], [0.0, 5.6]]), 2.65)
    door = Opening("door", 0, 2, 0.3, 0.9, 0.0, 2.05, hinge_at_start=True)
    windows = [Opening("window", 0, 0, start, 1.3, 0.85, 2.2) for start in (1.0, 4.2)]
    return Home(seed, (room,), (door, *windows), ())


@functools.cache
def _large_room(kind: RoomKind, seed: int) -> Home:
    """Return the same room, cluttered."""
    return furnish_home(_empty_room(kind, seed), LIBRARY, density=0.9)


def _rooms() -> list[Home]:
    return [_large_room(kind, 0) for kind in get_args(RoomKind)]


@pytest.mark.usefixtures("unchecked")
def test_every_category_occurs() -> None:
    more: list[tuple[RoomKind, int]] = [("child", 1), ("kitchen", 1), ("kitchen", 2), ("living", 1)]
    homes = [*_many(), *_rooms(), *(_large_room(kind, seed) for kind, seed in more)]
    statistics = home_statistics(homes, LIBRARY)
    assert [name for name in CATEGORIES if statistics.categories[name] == 0] == []
    assert 11.0 < home_statistics(_many(), LIBRARY).objects_mean < 20.0
    assert statistics.objects_per_room["living"] > statistics.objects_per_room["hall"]


def _kinds(home: Home) -> list[str]:
    models = {model.id: model for name in (*CATEGORIES, "") for model in LIBRARY.models(name)}
    return [kind_of(models[piece.model]) for piece in home.placed]


def test_decoration_is_where_it_belongs() -> None:
    seen: set[str] = set()
    for home in (*_many(), *_rooms()):
        names, boxes = _kinds(home), placed_boxes(home, LIBRARY)
        for k, (piece, name) in enumerate(zip(home.placed, names, strict=True)):
            if boxes.category[k]:
                continue
            seen.add(name)
            room, low = home.rooms[piece.room], _bottom(boxes, k)
            high = low + boxes.size[k, 2]
            if name == "ceiling_lamp":
                assert high == pytest.approx(room.ceiling_height)
                assert low > 1.25
            elif name in ("curtain", "socket", "switch"):
                assert piece.support is None
                edge = shapely.Polygon(room.polygon).exterior
                assert _footprint(boxes, k).distance(edge) < 0.02
            elif name == "toys":
                assert low < 0.031
                assert room.kind == "child"
            else:
                assert piece.support is not None
            if name == "towels":
                assert room.kind in ("bathroom", "laundry")
    assert seen == {
        *("books", "bottles", "candles", "ceiling_lamp", "curtain", "dishes", "small_box"),
        *("socket", "switch", "towels", "toys", "vase"),
    }


def test_switches_are_beside_doors_on_the_side_of_the_handle() -> None:
    home = _large_room("office", 0)
    boxes, names = placed_boxes(home, LIBRARY), _kinds(home)
    (k,) = [k for k, name in enumerate(names) if name == "switch"]
    # the door is in the wall at y = 5.6, from x = 6.5 with its hinges to x = 5.6
    assert 5.3 < boxes.centre[k, 0] < 5.55
    assert boxes.centre[k, 1] == pytest.approx(5.6 - boxes.size[k, 1] / 2)
    assert boxes.centre[k, 2] == pytest.approx(1.09)


def test_curtains_hang_before_windows() -> None:
    widths = []
    for seed in range(5):
        home = _large_room("bedroom", seed)
        boxes, names = placed_boxes(home, LIBRARY), _kinds(home)
        for k in [k for k, name in enumerate(names) if name == "curtain"]:
            gap = np.abs(boxes.centre[k, 0] - np.array([1.65, 4.85])).min()
            assert gap < 1e-6
            assert boxes.centre[k, 1] < 0.1
            assert _bottom(boxes, k) + boxes.size[k, 2] > 2.2
            widths.append(boxes.size[k, 0])
    assert len(widths) > 2
    assert min(widths) > 1.45


def test_a_library_without_decoration_is_enough() -> None:
    plain = summary_library(m for name in CATEGORIES for m in LIBRARY.models(name))
    home = furnish_home(sample_home(1, rooms=3), plain)
    assert len(home.placed) > 20
    assert all(placed_boxes(home, plain).category)


@pytest.mark.parametrize("seed", range(0, COUNT, 2))
def test_boxes_do_not_overlap(seed: int) -> None:
    home, boxes = _home(seed), _boxes(seed)
    oriented = OrientedBoxes(
        torch.as_tensor(boxes.centre), torch.as_tensor(boxes.size), torch.as_tensor(boxes.yaw)
    )
    n = len(home.placed)
    i, j = torch.triu_indices(n, n, 1)
    depth = penetration_depth(oriented[i], oriented[j])
    for a, b, deep in zip(i.tolist(), j.tolist(), depth.tolist(), strict=True):
        if deep <= 1e-5 or "carpet" in (boxes.category[a], boxes.category[b]):
            continue
        supported = home.placed[a].support == b or home.placed[b].support == a
        assert supported, (home.placed[a].model, home.placed[b].model, deep)


@pytest.mark.parametrize("seed", range(1, COUNT, 3))
def test_pieces_are_inside_their_rooms(seed: int) -> None:
    home, boxes = _home(seed), _boxes(seed)
    for k, piece in enumerate(home.placed):
        if piece.opening is None:
            room = home.rooms[piece.room]
            inside = shapely.Polygon(room.polygon).buffer(1e-5)
            assert inside.covers(_footprint(boxes, k)), piece.model
            assert _bottom(boxes, k) > -1e-6
            assert _bottom(boxes, k) + boxes.size[k, 2] < room.ceiling_height + 0.031


@pytest.mark.parametrize("seed", range(0, COUNT, 2))
def test_nothing_is_in_the_way_of_doors(seed: int) -> None:
    home, boxes = _home(seed), _boxes(seed)
    for opening in home.openings:
        if opening.kind == "window":
            continue
        deep = opening.width if opening.kind == "door" and opening.swing >= 0.0 else 0.7
        walls = walls_of(home.rooms[opening.room].polygon)
        first = walls.start[opening.wall] + walls.along[opening.wall] * (opening.start + 0.01)
        last = first + walls.along[opening.wall] * (opening.width - 0.02)
        inner = first + walls.normal[opening.wall] * deep
        swing = shapely.MultiPoint([first, last, inner]).envelope
        for k, piece in enumerate(home.placed):
            flat = boxes.category[k] == "carpet" or _bottom(boxes, k) > 1.98
            if piece.room == opening.room and piece.opening is None and not flat:
                assert swing.intersection(_footprint(boxes, k)).area < 1e-6, piece.model


def test_windows_are_not_hidden() -> None:
    hidden = 0
    for seed in range(COUNT):
        home, boxes = _home(seed), _boxes(seed)
        names = _kinds(home)
        for opening in home.openings:
            if opening.kind != "window":
                continue
            walls = walls_of(home.rooms[opening.room].polygon)
            first = walls.start[opening.wall] + walls.along[opening.wall] * opening.start
            last = first + walls.along[opening.wall] * opening.width
            zone = shapely.MultiPoint([first, last + walls.normal[opening.wall] * 0.1]).envelope
            for k, piece in enumerate(home.placed):
                high = _bottom(boxes, k) + boxes.size[k, 2] > opening.bottom + 0.05
                low = _bottom(boxes, k) < opening.top
                if piece.room == opening.room and piece.opening is None and high and low:
                    overlap = zone.intersection(_footprint(boxes, k)).area
                    # things on furniture may reach above the sill
                    free = piece.support is not None or names[k] == "curtain"
                    hidden += overlap > 1e-6 and not free
    assert hidden == 0


def test_things_rest_on_something() -> None:
    for seed in range(COUNT):
        home, boxes = _home(seed), _boxes(seed)
        for k, piece in enumerate(home.placed):
            if piece.support is not None:
                lead = piece.support
                assert lead < k
                low, high = _bottom(boxes, lead), _bottom(boxes, lead) + boxes.size[lead, 2]
                assert low - 1e-6 <= _bottom(boxes, k) <= high + 1e-6
                assert _footprint(boxes, lead).buffer(1e-6).covers(_footprint(boxes, k))
            elif boxes.category[k] in ("chair", "bed", "sofa", "table", "chest", "fridge", "plant"):
                assert _bottom(boxes, k) < 0.031


def test_beds_stand_with_their_head_at_a_wall_between_chests() -> None:
    beds = _all("bed")
    beside = 0
    for seed, k in beds:
        home, boxes = _home(seed), _boxes(seed)
        shape = shapely.Polygon(home.rooms[home.placed[k].room].polygon)
        front = np.array([-np.sin(boxes.yaw[k]), np.cos(boxes.yaw[k])])
        head = boxes.centre[k, :2] - front * (boxes.size[k, 1] / 2 + 0.02)
        assert not shape.covers(shapely.Point(head))
        beside += any(
            home.placed[j].group == home.placed[k].group and boxes.category[j] == "chest"
            for j in range(len(home.placed))
            if home.placed[k].group >= 0
        )
    assert len(beds) > 6
    assert beside > 0.6 * len(beds)


def test_groups_are_within_rooms() -> None:
    for home in _many():
        rooms: dict[int, set[int]] = {}
        for piece in home.placed:
            if piece.group >= 0:
                rooms.setdefault(piece.group, set()).add(piece.room)
        assert all(len(found) == 1 for found in rooms.values())
        assert len(rooms) > 2


def test_sofas_face_the_television() -> None:
    facing = []
    for seed, k in _all("standing_tv", "wall_mounted_tv"):
        home, boxes = _home(seed), _boxes(seed)
        sofas = [
            j
            for j, name in enumerate(boxes.category)
            if name == "sofa" and home.placed[j].group == home.placed[k].group >= 0
        ]
        turn = [(boxes.yaw[j] - boxes.yaw[k]) % (2 * np.pi) for j in sofas]
        facing += [abs(angle - np.pi) < 0.1 for angle in turn]
    assert len(facing) > 3
    assert all(facing)


def test_chairs_face_their_table() -> None:
    seen = 0
    for seed, k in _all("chair", "office_chair"):
        home, boxes = _home(seed), _boxes(seed)
        group = home.placed[k].group
        tables = [
            j
            for j, name in enumerate(boxes.category)
            if name == "table" and home.placed[j].group == group >= 0
        ]
        for j in tables:
            front = np.array([-np.sin(boxes.yaw[k]), np.cos(boxes.yaw[k])])
            ray = shapely.LineString([boxes.centre[k, :2], boxes.centre[k, :2] + 1.0 * front])
            assert ray.intersects(_footprint(boxes, j))
            seen += 1
    assert seen > 6


def test_hoods_hang_above_stoves() -> None:
    hoods = _all("range_hood")
    for seed, k in hoods:
        boxes = _boxes(seed)
        below = [
            j
            for j, name in enumerate(boxes.category)
            if name in ("stove", "oven", "cooktop")
            and _footprint(boxes, j).intersects(_footprint(boxes, k))
        ]
        assert below
        assert _bottom(boxes, k) > 1.5
    assert len(hoods) > 2


def test_doors_and_windows_fill_their_openings() -> None:
    for home in _many():
        seed = home.seed
        boxes = _boxes(seed)
        filled = {piece.opening for piece in home.placed if piece.opening is not None}
        for k in filled:
            assert k is not None
            assert home.openings[k].swing >= 0.0
        for k, piece in enumerate(home.placed):
            if piece.opening is None:
                continue
            opening = home.openings[piece.opening]
            assert opening.model == piece.model
            assert boxes.category[k] == opening.kind
            assert boxes.size[k, 0] == pytest.approx(opening.width)
            assert boxes.size[k, 2] == pytest.approx(opening.top - opening.bottom)
            assert _bottom(boxes, k) == pytest.approx(opening.bottom)
        doors = sum(o.kind == "door" and o.leads_to is not None for o in home.openings) // 2
        windows = sum(o.kind == "window" for o in home.openings)
        assert len(filled) == doors + windows + 1


def test_cluttered_homes_hold_more_than_sparse_ones() -> None:
    home = sample_home(5, rooms=3)
    counts = [len(furnish_home(home, LIBRARY, density=d).placed) for d in (0.0, 1.0)]
    assert counts[1] > 1.4 * counts[0]


def test_one_seed_gives_one_furnishing() -> None:
    home, first = _empty_room("office", 0), _large_room("office", 0)
    assert furnish_home(home, LIBRARY, density=0.9).placed == first.placed
    other = furnish_home(home, LIBRARY, np.random.default_rng(1), density=0.9)
    assert other.placed != first.placed


def test_a_small_library_leaves_things_out() -> None:
    bed = Summary("bed/1", "bed", (1.6, 2.05, 0.6), support_height=0.5)
    door = Summary("door/1", "door", (0.9, 0.12, 2.05), "in_wall")
    home = furnish_home(sample_home(1, rooms=4), summary_library([bed, door]))
    assert {piece.model for piece in home.placed} == {"bed/1", "door/1"}
    empty = furnish_home(sample_home(1, rooms=4), summary_library([]))
    assert empty.placed == ()


def test_wrong_arguments_are_refused() -> None:
    home = sample_home(0)
    with pytest.raises(ValueError, match="density must be in"):
        furnish_home(home, LIBRARY, density=1.5)
    with pytest.raises(ValueError, match="without furniture"):
        furnish_home(_home(0), LIBRARY)
    with pytest.raises(ValueError, match="expected the models of the home"):
        placed_boxes(_home(0), summary_library([]))
    with pytest.raises(ValueError, match="room must be 0 to"):
        home_scene(_home(0), LIBRARY, 99, (0.0, 0.0))


def test_a_room_is_a_scene() -> None:
    home, boxes = _home(4), _boxes(4)
    middle = home.rooms[1].polygon.mean(axis=0)
    scene = home_scene(home, LIBRARY, 1, (float(middle[0]), float(middle[1])), yaw=0.4)
    inside = [k for k, piece in enumerate(home.placed) if piece.room == 1 and boxes.category[k]]
    assert len(scene.objects.category) >= len(inside)
    assert scene.objects.id[3].endswith("_3")
    distance = scene.objects.boxes.centre[:, :2].norm(dim=1).numpy()
    offset = np.linalg.norm(boxes.centre[inside, :2] - middle, axis=1)
    assert np.abs(distance[:, None] - offset).min(axis=0).max() < 1e-4
    assert scene.layout.ceiling_height == home.rooms[1].ceiling_height


def test_summaries_of_any_source_are_a_library() -> None:
    shuffled = [model for name in reversed(CATEGORIES) for model in LIBRARY.models(name)]
    library = summary_library(shuffled)
    names = [model.id for model in library.models("chair")]
    assert names == sorted(names)
    assert dataclasses.is_dataclass(library)
