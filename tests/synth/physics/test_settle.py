import sys
from dataclasses import replace

import numpy as np
import pytest

from panoscene.synth.homes import Opening
from panoscene.synth.physics import check_home, settle_home
from panoscene.synth.physics._engine import Body, simulate

mujoco = pytest.importorskip("mujoco", reason="the engine is an optional package")


@pytest.fixture(scope="module")
def crowded(put, home_of):
    """A room in which a good deal is wrong."""
    return home_of(
        put("table", 2.5, 2.0), put("chair", 2.2, 1.55), put("chair", 2.8, 2.45, yaw=np.pi),
        put("lamp", 2.5, 2.0, 0.77, support=0), put("lamp", 3.19, 1.8, 0.75, support=0),
        put("shelf", 0.48, 3.85, yaw=np.pi), put("book", 0.47, 3.85, 0.43, support=5),
        put("sofa", 2.5, 0.47), put("cushion", 2.2, 0.2, 0.42, support=7),
        put("picture", 2.5, 3.9, 1.2, yaw=np.pi), put("carpet", 2.5, 2.0),
        put("pendant", 2.5, 2.0, 2.1), put("cabinet", 4.5, 0.24), put("cabinet", 3.8, 0.25),
    )  # fmt: skip


@pytest.fixture(scope="module")
def settled(crowded, models, cache):
    return settle_home(crowded, models, cache=cache)


def test_the_faults_are_found_first(crowded, models, cache):
    found = {(fault.kind, fault.first) for fault in check_home(crowded, models, cache=cache)}
    assert {("floating", 3), ("floating", 9), ("floating", 11)} <= found
    assert ("penetration", 8) in found or ("penetration", 7) in found
    assert ("penetration", 12) in found


def test_afterwards_nothing_floats_or_is_in_anything(settled, models, cache):
    home, report = settled
    assert check_home(home, models, cache=cache) == ()
    assert report.removed == ()
    assert len(home.placed) == len(report.objects) == 14
    assert report.penetration <= 0.01
    assert report.gap <= 0.001
    assert report.steps > 40


def test_what_was_right_stays_where_it_was(crowded, settled):
    for index in (0, 1, 2, 5):
        assert settled[0].placed[index] == crowded.placed[index] or index == 0
        assert settled[1].objects[index].outcome == "kept"
        assert settled[1].objects[index].moved < 1e-6


def test_things_hang_flush_and_carpets_lie_flat(settled, models):
    home, _ = settled
    picture, pendant, carpet = (home.placed[k] for k in (9, 11, 10))
    assert picture.position[1] == pytest.approx(4.0 - models["picture"].size[1] / 2, abs=1e-6)
    assert pendant.position[2] == pytest.approx(2.6 - models["pendant"].size[2] / 2, abs=1e-6)
    assert models["carpet"].size[2] * carpet.scale[2] == pytest.approx(0.01)
    assert carpet.position[2] == pytest.approx(0.005)


def test_what_stands_on_something_says_so(settled):
    supports = [piece.support for piece in settled[0].placed]
    assert [supports[k] for k in (0, 3, 4, 6, 8)] == [None, 0, 0, 5, 7]


def test_the_same_bits_again(crowded, settled, models, cache):
    again = settle_home(crowded, models, cache=cache)
    assert again[0].placed == settled[0].placed
    assert again[1] == settled[1]


def test_a_lamp_over_the_edge_falls_and_takes_nothing_else_along(put, home_of, models, cache):
    home = home_of(
        put("table", 2.5, 2.0), put("lamp", 3.24, 2.0, 0.75, support=0),
        put("book", 2.5, 2.0, 0.75, support=0), put("chair", 1.0, 1.0),
    )  # fmt: skip
    new, report = settle_home(home, models, cache=cache)
    (gone,) = report.removed
    assert gone.index == 1
    assert "fell" in gone.reason
    assert gone.tilt > 0.17
    assert [piece.model for piece in new.placed] == ["table", "book", "chair"]
    assert new.placed[1].support == 0


def test_what_cannot_be_parted_goes_with_what_stands_on_it(put, home_of, models, cache):
    """A cabinet in the middle of a larger sofa, with a lamp on it."""
    home = home_of(
        put("sofa", 1.0, 0.45), put("cabinet", 0.9, 0.45), put("lamp", 0.9, 0.45, 0.9, support=1),
        corners=[(0, 0), (2.0, 0), (2.0, 0.95), (0, 0.95)],
    )  # fmt: skip
    new, report = settle_home(home, models, cache=cache)
    assert check_home(new, models, cache=cache) == ()
    assert {found.index for found in report.removed} >= {2}
    assert all(found.reason for found in report.removed)


def test_cushions_are_taken_out_of_the_backrest(put, home_of, models, cache):
    home = home_of(put("sofa", 2.5, 0.45), put("cushion", 2.5, 0.12, 0.42, support=0))
    new, report = settle_home(home, models, cache=cache)
    assert check_home(new, models, cache=cache) == ()
    assert report.objects[1].outcome == "shifted"
    assert 0.1 < report.objects[1].moved < 0.3
    assert new.placed[1].support == 0


def test_rooms_that_are_not_rectangles(put, home_of, models, cache):
    corners = [(0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)]
    inner = home_of(put("cabinet", 1.64, 2.1), put("sofa", 2.95, 0.45), corners=corners)
    (fault,) = check_home(inner, models, cache=cache)
    assert (fault.kind, fault.first) == ("outside", 0)
    new, _ = settle_home(inner, models, cache=cache)
    assert check_home(new, models, cache=cache) == ()
    assert len(new.placed) == 2


def test_open_doors_are_left_alone_and_numbers_follow(put, home_of, models, cache):
    door = put("cabinet", 2.5, -0.1, opening=0)
    home = home_of(put("lamp", 1.0, 1.0, 0.95, support=3), door, put("chair", 4.0, 3.0))
    home = replace(
        home,
        openings=(Opening("door", 0, 0, 2.1, 0.8, 0.0, 2.0, swing=1.2),),
        placed=(*home.placed, put("cabinet", 1.0, 1.0)),
    )
    new, report = settle_home(home, models, cache=cache)
    assert new.placed[1] == door
    assert report.objects[1].outcome == "fixed"
    assert new.placed[0].support == 3


def test_a_picture_on_no_wall_is_left_out(put, home_of, models, cache):
    new, report = settle_home(home_of(put("picture", 2.5, 2.0, 1.2)), models, cache=cache)
    assert new.placed == ()
    assert report.removed[0].reason == "hangs on no wall"


def test_an_empty_home(home_of, models, cache):
    new, report = settle_home(home_of(), models, cache=cache)
    assert new.placed == ()
    assert (report.objects, report.steps, report.penetration) == ((), 0, 0.0)


def test_errors(put, home_of, models, monkeypatch, cache):
    home = home_of(put("chair", 1.0, 1.0))
    with pytest.raises(ValueError, match="no model 'chair'"):
        settle_home(home, {}, cache=cache)
    lost = home_of(put("lamp", 1.0, 1.0, support=4))
    with pytest.raises(ValueError, match="stands on 4"):
        check_home(lost, models, cache=cache)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(ModuleNotFoundError, match=r"panoscene\[synth\]"):
        settle_home(home, models, cache=cache)


def test_the_engine_leaves_no_log_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    corners = np.array([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])
    boxes = np.array([[[-0.1, -0.1, -0.1], [0.1, 0.1, 0.1]]])
    lost = Body(boxes, np.array([0.0, 0.0, 1e11]), 0.0, "free")
    simulate([lost], corners, 3)
    assert list(tmp_path.iterdir()) == []
