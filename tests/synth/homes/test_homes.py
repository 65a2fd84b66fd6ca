"""Floor plans: shapes, walls, doors and windows of homes without furniture."""

import dataclasses
import functools

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.synth.homes import Home, Summary, home_statistics, room_layouts, sample_home
from panoscene.synth.homes._library import kind_of
from panoscene.synth.homes._manhattan import inset, outline, shared_walls, walls_of

PLANS = 40


@functools.cache
def _home(seed: int) -> Home:
    return sample_home(seed)


def _homes(count: int) -> list[Home]:
    return [_home(seed) for seed in range(count)]


@pytest.mark.usefixtures("unchecked")
def test_rooms_have_the_wanted_numbers_of_corners() -> None:
    statistics = home_statistics(_homes(PLANS))
    shares = statistics.corner_shares
    assert sum(shares.values()) == pytest.approx(1.0)
    for corners, wanted in {4: 0.60, 6: 0.22, 8: 0.10, 10: 0.08}.items():
        assert shares[corners] == pytest.approx(wanted, abs=0.07)


def test_homes_differ() -> None:
    statistics = home_statistics(_homes(PLANS))
    assert set(statistics.room_counts) == set(range(2, 9))
    assert len(statistics.kinds) == 11
    assert 2.3 <= statistics.ceilings[0] < 2.45
    assert 3.1 < statistics.ceilings[2] <= 3.4
    assert min(statistics.door_states.values()) > 0.05
    for kind, (low, mean, high) in statistics.areas.items():
        if statistics.kinds[kind] >= 12:
            assert 1.4 * low < high, kind
        assert low < mean < high
    thickness = {home.wall_thickness for home in _homes(PLANS)}
    assert len(thickness) >= 4
    levels = [{room.ceiling_height for room in home.rooms} for home in _homes(PLANS)]
    assert 0.1 < np.mean([len(level) > 1 for level in levels]) < 0.9


@settings(max_examples=20, deadline=None)
@given(st.integers(0, PLANS - 1))
def test_rooms_keep_the_thickness_of_a_wall_between_them(seed: int) -> None:
    home = _home(seed)
    shapes = [shapely.Polygon(room.polygon) for room in home.rooms]
    walls = [walls_of(room.polygon) for room in home.rooms]
    for a, first in enumerate(shapes):
        assert first.is_valid
        assert first.exterior.is_ccw
        for b in range(a):
            distance = first.distance(shapes[b])
            assert distance >= home.wall_thickness - 1e-9
            shared = shared_walls(walls[a], walls[b], home.wall_thickness)
            # rooms side by side share a wall exactly
            assert bool(shared) == (distance < home.wall_thickness + 1e-6) or distance > 0.1
    for room in home.rooms:
        step = np.roll(room.polygon, -1, axis=0) - room.polygon
        assert (np.abs(step) < 1e-9).any(axis=1).all()
        assert np.abs(step).max(axis=1).min() > 0.2


@settings(max_examples=20, deadline=None)
@given(st.integers(0, PLANS - 1))
def test_rooms_are_humane(seed: int) -> None:
    for room in _home(seed).rooms:
        shape = shapely.Polygon(room.polygon)
        low, high = np.sort(np.ptp(room.polygon, axis=0))
        assert shape.area > 2.8
        assert low > 1.0
        if room.kind != "hall":
            assert high / low < 2.7
            # no slivers: one can stand nearly everywhere
            standing = shape.buffer(-0.44, join_style="mitre").buffer(0.44, join_style="mitre")
            assert standing.area > 0.92 * shape.area


@settings(max_examples=20, deadline=None)
@given(st.integers(0, PLANS - 1))
def test_every_room_can_be_reached(seed: int) -> None:
    home = _home(seed)
    graph = nx.Graph()
    graph.add_nodes_from(range(len(home.rooms)))
    graph.add_edges_from((o.room, o.leads_to) for o in home.openings if o.leads_to is not None)
    assert nx.is_connected(graph)
    entrances = [o for o in home.openings if o.kind == "door" and o.leads_to is None]
    assert len(entrances) == 1


def _ends(home: Home, index: int) -> np.ndarray:
    opening = home.openings[index]
    walls = walls_of(home.rooms[opening.room].polygon)
    first = walls.start[opening.wall] + walls.along[opening.wall] * opening.start
    return np.stack([first, first + walls.along[opening.wall] * opening.width])


@settings(max_examples=20, deadline=None)
@given(st.integers(0, PLANS - 1))
def test_doorways_are_in_line_on_both_sides(seed: int) -> None:
    home = _home(seed)
    inner = [k for k, o in enumerate(home.openings) if o.leads_to is not None]
    for k in inner:
        opening, ends = home.openings[k], _ends(home, k)
        twins = [
            j for j in inner
            if home.openings[j].room == opening.leads_to
            and np.abs(_ends(home, j)[::-1] - ends).max() < home.wall_thickness + 1e-6
        ]  # fmt: skip
        assert len(twins) == 1
        twin = home.openings[twins[0]]
        assert twin.leads_to == opening.room
        assert twin.swing == -opening.swing
        assert (twin.top, twin.kind) == (opening.top, opening.kind)
        assert twin.hinge_at_start != opening.hinge_at_start
        step = np.abs(_ends(home, twins[0])[::-1] - ends)
        assert np.allclose(np.sort(step, axis=1), [0.0, home.wall_thickness], atol=1e-6)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, PLANS - 1))
def test_openings_fit_in_their_walls(seed: int) -> None:
    home = _home(seed)
    for k, opening in enumerate(home.openings):
        room = home.rooms[opening.room]
        length = walls_of(room.polygon).length[opening.wall]
        assert opening.start > 0.05
        assert opening.start + opening.width < length - 0.05
        assert 0.0 <= opening.bottom < opening.top - 0.4
        assert opening.top < room.ceiling_height - 0.05
        assert (opening.kind == "opening") <= (opening.width >= 0.9)
        assert (opening.bottom > 0.0) <= (opening.kind == "window")
        for other in home.openings[:k]:
            if (other.room, other.wall) == (opening.room, opening.wall):
                gap = max(
                    opening.start - other.start - other.width,
                    other.start - opening.start - opening.width,
                )
                assert gap > 0.03


@settings(max_examples=20, deadline=None)
@given(st.integers(0, PLANS - 1))
def test_windows_look_into_the_open(seed: int) -> None:
    home = _home(seed)
    shapes = [shapely.Polygon(room.polygon) for room in home.rooms]
    lit = {o.room for o in home.openings if o.kind == "window"}
    for k, room in enumerate(home.rooms):
        assert k in lit or room.kind in ("hall", "bathroom", "laundry")
    for k, opening in enumerate(home.openings):
        if opening.leads_to is not None:
            continue
        first, last = _ends(home, k)
        out = -walls_of(home.rooms[opening.room].polygon).normal[opening.wall]
        view = shapely.MultiPoint([first + 0.01 * out, last + 1.1 * out]).envelope
        assert not any(view.intersects(shape) for shape in shapes)


def test_some_bathrooms_have_no_window() -> None:
    lit = [
        any(o.room == k and o.kind == "window" for o in home.openings)
        for home in _homes(PLANS)
        for k, room in enumerate(home.rooms)
        if room.kind == "bathroom"
    ]
    assert 0.2 < np.mean(lit) < 0.8


def test_one_seed_gives_one_home() -> None:
    first, second = sample_home(11), sample_home(11)
    assert first.openings == second.openings
    assert all(
        np.array_equal(a.polygon, b.polygon) and a.kind == b.kind
        for a, b in zip(first.rooms, second.rooms, strict=True)
    )
    drawn = sample_home(np.random.default_rng(5))
    assert sample_home(drawn.seed).openings == drawn.openings
    assert sample_home(12).openings != first.openings


@pytest.mark.parametrize("rooms", range(2, 9))
def test_the_number_of_rooms_can_be_chosen(rooms: int) -> None:
    assert len(sample_home(3, rooms=rooms).rooms) == rooms


@pytest.mark.parametrize("rooms", [1, 9])
def test_other_numbers_of_rooms_are_refused(rooms: int) -> None:
    with pytest.raises(ValueError, match="rooms must be 2 to 8"):
        sample_home(0, rooms=rooms)


def test_negative_seeds_are_refused() -> None:
    with pytest.raises(ValueError, match="seed"):
        sample_home(-1)


def test_statistics_need_a_home() -> None:
    with pytest.raises(ValueError, match="at least one"):
        home_statistics([])


def test_unions_with_holes_are_no_rooms() -> None:
    ring = [(0.0, 0.0, 3.0, 1.0), (0.0, 2.0, 3.0, 3.0), (0.0, 0.0, 1.0, 3.0), (2.0, 0.0, 3.0, 3.0)]
    assert outline(ring) is None
    assert outline(ring[:2]) is None
    joined = outline(ring[:3])
    assert joined is not None
    assert len(joined) == 8


def test_an_inset_moves_every_wall() -> None:
    joined = outline([(0.0, 0.0, 4.0, 2.0), (0.0, 2.0, 2.0, 4.0)])
    assert joined is not None
    expected = shapely.Polygon(joined).buffer(-0.25, join_style="mitre")
    assert shapely.Polygon(inset(joined, 0.25)).symmetric_difference(expected).area < 1e-9


def test_layouts_are_in_the_frame_of_the_camera() -> None:
    home = _home(4)
    middle = home.rooms[0].polygon.mean(axis=0)
    layouts = room_layouts(home, (float(middle[0]), float(middle[1])), yaw=0.7)
    for room, layout in zip(home.rooms, layouts, strict=True):
        polygon = layout.floor_polygon.numpy()
        assert np.abs(shapely.Polygon(polygon).area - shapely.Polygon(room.polygon).area) < 1e-3
        assert layout.ceiling_height == room.ceiling_height
    # what lies in the direction of the panorama's centre column is on +y
    ahead = middle + 2.0 * np.array([-np.sin(0.7), np.cos(0.7)])
    moved = dataclasses.replace(
        home, rooms=(dataclasses.replace(home.rooms[0], polygon=ahead + home.rooms[0].polygon),)
    )
    shift = (
        room_layouts(moved, (float(middle[0]), float(middle[1])), yaw=0.7)[0].floor_polygon
        - layouts[0].floor_polygon
    ).mean(dim=0)
    turn = np.array([[np.cos(0.7), np.sin(0.7)], [-np.sin(0.7), np.cos(0.7)]])
    assert np.allclose(shift.numpy(), turn @ ahead, atol=1e-4)


@pytest.mark.parametrize(
    ("name", "category", "kind"),
    [("parametric/toys/12", "", "toys"), ("eTeks/1", "", ""), ("parametric/bed/1", "bed", "bed")],
)
def test_kinds_are_read_from_ids(name: str, category: str, kind: str) -> None:
    assert kind_of(Summary(name, category, (0.3, 0.3, 0.3))) == kind
