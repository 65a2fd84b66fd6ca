import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.synth.homes import Placed
from panoscene.synth.physics import collision_shape
from panoscene.synth.physics._contact import overlap
from panoscene.synth.physics._rest import rest
from panoscene.synth.physics._solids import solid


@pytest.fixture(scope="module")
def shapes(models, cache):
    return {name: collision_shape(model, cache) for name, model in models.items()}


@pytest.fixture(scope="module")
def at(models, shapes):
    def make(name, x, y, low=0.0, yaw=0.0):
        z = low + models[name].size[2] / 2
        return solid(models[name], Placed(name, 0, (float(x), float(y), z), yaw), shapes[name])

    return make


@pytest.mark.parametrize("yaw", [0.0, 0.7, np.pi / 2])
def test_depth_of_two_boxes(at, yaw):
    """The cabinet is 0.8 x 0.5 m; 7 cm deep in another one in front of it."""
    front = np.array([-np.sin(yaw), np.cos(yaw)])
    first, second = at("cabinet", 1, 1, yaw=yaw), at("cabinet", *(1 + 0.43 * front), yaw=yaw)
    found = overlap(second, first)
    assert found.depth == pytest.approx(0.07, abs=1e-3)
    np.testing.assert_allclose(found.move[:2], front * found.depth, atol=1e-6)
    assert overlap(second.shifted(found.move), first).depth < 1e-3


def test_a_chair_fits_under_a_table(at):
    table, chair = at("table", 0, 0), at("chair", 0, -0.3)
    assert overlap(chair, table).depth == 0.0
    assert overlap(at("chair", 0, -0.0), table).depth > 0.05  # its back is in the top
    # the seat, to x = 0.745, is around the leg that begins at 0.66
    assert overlap(at("chair", 0.52, -0.28), table).depth == pytest.approx(0.085, abs=1e-3)


def test_something_through_a_thin_board_is_deep_in_it(at):
    """Points inside a board are never deep; the way out of it is long."""
    shelf, lamp = at("shelf", 0, 0), at("lamp", 0, 0, 0.2)
    assert overlap(lamp, shelf).depth > 0.1


def volume_of(triangles):
    """Of a closed mesh, also of one that is flat."""
    first, second, third = triangles.swapaxes(0, 1)
    return abs(float((first * np.cross(second, third)).sum())) / 6


@settings(max_examples=8, deadline=None)
@given(
    x=st.floats(-0.7, 0.7), y=st.floats(-0.7, 0.7), z=st.floats(-0.5, 0.5),
    yaw=st.floats(-3.1, 3.1), name=st.sampled_from(["chair", "cabinet", "sofa"]),
)  # fmt: skip
def test_overlap_is_where_exact_booleans_have_volume(at, *, x, y, z, yaw, name):
    first, second = at(name, x, y, z, yaw), at("cabinet", 0, 0)
    corners = np.arange(len(first.triangles) * 3).reshape(-1, 3)
    pieces = trimesh.Trimesh(first.triangles.reshape(-1, 3), corners).split()
    box = trimesh.creation.box(bounds=second.bounds)
    shared = [trimesh.boolean.intersection([box, piece]) for piece in pieces]
    volume = sum(volume_of(part.triangles) for part in shared if len(part.faces))
    found = overlap(first, second)
    if found.depth == 0.0:
        assert volume < 1e-4  # less than a sliver between two lines
    if volume == 0.0:
        assert found.depth <= 0.002 + 1e-9
    parted = overlap(first.shifted(found.move * (1 + 1e-3)), second)
    assert parted.depth <= 0.003


def test_rest_lets_down_and_lifts_out(at):
    table = {0: at("table", 0, 0)}
    for low, lift in ((0.9, -0.15), (0.75, 0.0), (0.72, 0.03)):
        found = rest(at("book", 0.2, 0.1, low), table)
        assert found.free
        assert found.support == 0
        assert found.lift == pytest.approx(lift, abs=5e-4)
    beside = rest(at("book", 2.0, 0.1, 0.9), table)
    assert (beside.support, beside.lift) == (None, pytest.approx(-0.9, abs=1e-6))


def test_rest_finds_the_board_of_a_shelf(at):
    found = rest(at("book", 0, 0, 0.47), {5: at("shelf", 0, 0)})
    assert found.support == 5
    assert found.lift == pytest.approx(-0.05, abs=5e-4)


def test_no_rest_inside_of_something_high(at):
    assert not rest(at("book", 0, 0, 0.3), {0: at("cabinet", 0, 0)}).free
