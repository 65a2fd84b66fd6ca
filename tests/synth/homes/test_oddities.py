"""What looked odd in rendered homes and must not come back."""

import functools
from itertools import combinations

import numpy as np
import pytest

from panoscene.synth.homes import (
    Home,
    Opening,
    PlacedBoxes,
    Room,
    RoomKind,
    Summary,
    SummaryLibrary,
    boards_of,
    furnish_home,
    has_top,
    is_kitchen_sink,
    placed_boxes,
    sample_home,
    stand_in_library,
)
from panoscene.synth.homes._manhattan import walls_of
from panoscene.synth.models import make_model

SEEDS = range(6)
SCREENS = ("monitor", "laptop", "standing_tv")


@functools.cache
def library() -> SummaryLibrary:
    """Return stand-ins, with the parametric shelves and their boards."""
    stand_ins = stand_in_library()
    shelves = [make_model("shelf", seed, 0) for seed in range(10)]
    known = {
        **stand_ins.by_category,
        "shelf": tuple(
            Summary(m.id, "shelf", m.size, support_height=m.support_height) for m in shelves
        ),
    }
    return SummaryLibrary(known, {m.id: boards_of(m.vertices, m.faces) for m in shelves})


@functools.cache
def home(seed: int) -> Home:
    return furnish_home(sample_home(seed), library())


@functools.cache
def boxes(seed: int) -> PlacedBoxes:
    return placed_boxes(home(seed), library())


def of(*categories: str) -> list[tuple[int, int]]:
    """Return seed and index of all pieces of some categories."""
    return [
        (seed, k)
        for seed in SEEDS
        for k, name in enumerate(boxes(seed).category)
        if name in categories
    ]


def on(seed: int, lead: int) -> list[int]:
    return [k for k, piece in enumerate(home(seed).placed) if piece.support == lead]


def room_of(kind: RoomKind, seed: int, density: float = 0.5) -> tuple[Home, PlacedBoxes]:
    room = Room(kind, np.array([[0.0, 0.0], [6.8, 0.0], [6.8, 5.6], [0.0, 5.6]]), 2.65)
    door = Opening("door", 0, 2, 0.3, 0.9, 0.0, 2.05, hinge_at_start=True)
    windows = [Opening("window", 0, 0, start, 1.3, 0.85, 2.2) for start in (1.0, 4.2)]
    made = furnish_home(Home(seed, (room,), (door, *windows), ()), library(), density=density)
    return made, placed_boxes(made, library())


def test_boards_of_a_shelf_are_where_its_boards_are() -> None:
    for seed in range(10):
        model = make_model("shelf", seed, 0)
        boards = boards_of(model.vertices, model.faces)
        assert len(boards) >= 2
        assert len({round(board.height, 2) for board in boards}) >= 2
        for board in boards:
            middle = (board.left + board.right) / 2, (board.rear + board.front) / 2
            z = board.height - model.size[2] / 2
            corners = model.vertices[model.faces]
            low, high = corners.min(axis=1), corners.max(axis=1)
            over = (low[:, :2] < middle).all(axis=1) & (high[:, :2] > middle).all(axis=1)
            # a flat face is there, and nothing flat between it and the headroom
            assert (
                over & (np.abs(high[:, 2] - z) < 0.015) & (np.ptp(corners[..., 2], 1) < 1e-4)
            ).any()
            between = (low[:, 2] > z + 0.02) & (high[:, 2] < z + board.headroom - 0.01)
            assert not (over & between).any()


def test_a_cupboard_without_a_top_is_known() -> None:
    model = make_model("bottom_cabinet_no_top", 3, 0)
    support = model.support_height
    assert support is not None
    assert has_top(model.vertices, model.faces, support)
    corners = model.vertices[model.faces]
    up = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] > 1e-9
    open_ = model.faces[~(up & (corners[..., 2].mean(1) > 0.8 * model.vertices[:, 2].max()))]
    assert not has_top(model.vertices, open_, support)


@pytest.mark.usefixtures("unchecked")
def test_shelves_hold_things_on_their_boards() -> None:
    shelves = of("shelf")
    assert len(shelves) > 5
    held = [len(on(seed, k)) for seed, k in shelves]
    assert np.mean(held) > 3
    assert np.mean(np.array(held) == 0) < 0.15
    for seed, k in shelves:
        top = boxes(seed).centre[k, 2] + boxes(seed).size[k, 2] / 2
        for thing in on(seed, k):
            assert boxes(seed).centre[thing, 2] < top  # inside, not out of sight above
            away = boxes(seed).centre[thing, :2] - boxes(seed).centre[k, :2]
            assert np.abs(away).max() < boxes(seed).size[k, :2].max() / 2


def test_things_in_a_shelf_do_not_touch() -> None:
    for seed, k in of("shelf"):
        b = boxes(seed)
        for i, j in combinations(on(seed, k), 2):
            gap = np.abs(b.centre[i] - b.centre[j])
            turned = abs(np.sin(b.yaw[k])) > 0.5
            half = (b.size[i] + b.size[j])[[1, 0, 2] if turned else [0, 1, 2]] / 2
            assert not (gap < half - 1e-4).all()


@pytest.mark.parametrize("kind", ["hall", "living", "office"])
def test_walls_are_not_bare_for_long(kind: RoomKind) -> None:
    bare, walls = 0, 0
    for seed in range(6):
        made, found = room_of(kind, seed)
        wall = walls_of(made.rooms[0].polygon)
        for w in range(len(wall.length)):
            spots = np.arange(0.2, wall.length[w], 0.1)
            free = np.ones(len(spots), bool)
            for opening in made.openings:
                if opening.wall == w:
                    free &= (spots < opening.start) | (spots > opening.start + opening.width)
            away = (found.centre[:, :2] - wall.start[w]) @ wall.normal[w]
            along = (found.centre[:, :2] - wall.start[w]) @ wall.along[w]
            top = found.centre[:, 2] + found.size[:, 2] / 2
            for k in np.flatnonzero((away < 0.6) & (top > 1.2)):
                free &= np.abs(spots - along[k]) > found.size[k, :2].max() / 2
            runs = np.diff(np.flatnonzero(~np.r_[False, free, False]))
            bare += runs.max(initial=0) * 0.1 > 3.2
            walls += 1
    assert bare / walls < 0.25


def test_no_picture_is_shown_twice_in_a_home() -> None:
    count = 0
    for seed in SEEDS:
        shown = [
            (home(seed).placed[k].model, home(seed).placed[k].look)
            for k, name in enumerate(boxes(seed).category)
            if name == "picture"
        ]
        count += len(shown)
        assert len(set(shown)) == len(shown)
        old = [model for model, _ in shown if not model.startswith("parametric/")]
        assert len(set(old)) == len(old)  # their motif does not depend on the look
    assert count > 20


def test_nothing_stands_before_a_screen() -> None:
    screens = of(*SCREENS)
    assert len(screens) > 4
    for seed, k in screens:
        support, b = home(seed).placed[k].support, boxes(seed)
        if support is None:
            continue
        front = np.array([-np.sin(b.yaw[k]), np.cos(b.yaw[k])])
        right = np.array([front[1], -front[0]])
        for other in on(seed, support):
            away = b.centre[other, :2] - b.centre[k, :2]
            if other != k and b.size[other, 2] > 0.03 and away @ front > 0.02:
                assert abs(away @ right) > 0.4 * (b.size[k, 0] + b.size[other, 0])


def test_no_television_stands_before_a_window() -> None:
    count = 0
    for seed in range(12):
        made, found = room_of("living", seed)
        for k in np.flatnonzero([name == "standing_tv" for name in found.category]):
            count += 1
            x, y, _ = found.centre[k]
            top = found.centre[k, 2] + found.size[k, 2] / 2
            for window in (o for o in made.openings if o.kind == "window"):
                beside = (
                    abs(x - window.start - window.width / 2) > (window.width + found.size[k, 0]) / 2
                )
                assert beside or y > 0.8 or top < window.bottom + 0.06
    assert count > 2


def test_kitchens_have_kitchen_sinks_and_bathrooms_basins() -> None:
    models = {m.id: m for m in library().models("sink")}
    assert 2 <= sum(map(is_kitchen_sink, models.values())) < len(models)
    for kind in ("kitchen", "bathroom"):
        found = 0
        for seed in range(4):
            made, _ = room_of(kind, seed)
            for piece in made.placed:
                if piece.model in models:
                    found += 1
                    assert is_kitchen_sink(models[piece.model]) == (kind == "kitchen")
        assert found > 2
