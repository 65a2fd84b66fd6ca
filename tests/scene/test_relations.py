import dataclasses
import math

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.geometry import OrientedBoxes
from panoscene.scene import (
    RELATIVE_YAW_BINS,
    Layout,
    Relations,
    Scene,
    relations_from_boxes,
    relative_yaw_angle,
    relative_yaw_bins,
)

SOUTH, EAST, NORTH, WEST = range(4)


def one_box(
    x: float, y: float, z: float, size: tuple[float, float, float], yaw: float = 0.0
) -> OrientedBoxes:
    return OrientedBoxes(torch.tensor([[x, y, z]]), torch.tensor([size]), torch.tensor([yaw]))


def random_boxes(seed: int, n: int, dtype: torch.dtype = torch.float32) -> OrientedBoxes:
    generator = torch.Generator().manual_seed(seed)
    uniform = torch.rand((n, 7), generator=generator, dtype=dtype)
    return OrientedBoxes(
        uniform[:, :3] * 4 - torch.tensor([2.0, 2.0, 1.0], dtype=dtype),
        uniform[:, 3:6] + 0.1,
        (uniform[:, 6] * 2 - 1) * math.pi,
    )


def test_bedroom(bedroom: Scene) -> None:
    relations = bedroom.relations
    assert relations is not None
    # the bed's right edge is at x = 0.8, the nightstand's left edge too; nothing else is close
    expected = torch.zeros(4, 4)
    expected[0, 1] = expected[1, 0] = 1
    assert torch.equal(relations.touching, expected)
    walls = torch.zeros(4, 4)
    walls[0, NORTH] = walls[1, NORTH] = walls[3, EAST] = 1
    assert torch.equal(relations.touching_wall, walls)
    assert relations.on_floor.tolist() == [1, 1, 0, 0]
    assert relations.under_ceiling.tolist() == [0, 0, 1, 0]
    assert relations.inside_room.tolist() == [1, 1, 1, 1]
    # bed and nightstand are parallel, the bed is turned by 180 degrees against the lamp, and the
    # picture faces west: a quarter turn clockwise from the bed, which faces south
    turns = relative_yaw_angle(relations.relative_yaw[0]) * 180 / math.pi
    assert turns[1:].round().tolist() == [0, -180, -90]
    # the north wall faces south as the bed does; the south wall faces north
    turns = relative_yaw_angle(relations.relative_yaw_wall[0]) * 180 / math.pi
    assert turns.round().tolist() == [-180, -90, 0, 90]
    # distances from the camera at 1.6 m: 1.64, 2.44, 1.58, 1.98
    order = relations.farther_than.sum(dim=1)
    assert order.tolist() == [1, 3, 0, 2]


@pytest.mark.parametrize(("gap", "touch"), [(-0.2, 1.0), (0.0, 1.0), (0.09, 1.0), (0.11, 0.0)])
def test_touching_allows_the_tolerance_between_two_boxes(
    room: Layout, gap: float, touch: float
) -> None:
    boxes = OrientedBoxes(
        torch.tensor([[-0.5, 0.0, 0.5], [0.5 + gap, 0.0, 0.5]]), torch.ones(2, 3), torch.zeros(2)
    )
    relations = relations_from_boxes(boxes, room)
    assert relations.touching.tolist() == [[0.0, touch], [touch, 0.0]]


@pytest.mark.parametrize(("gap", "touch"), [(0.05, 1.0), (0.09, 1.0), (0.11, 0.0)])
def test_walls_are_touched_within_the_same_tolerance(
    room: Layout, gap: float, touch: float
) -> None:
    box = one_box(1.5 - gap, 0.0, 0.5, (1.0, 1.0, 1.0))
    assert relations_from_boxes(box, room).touching_wall[0, EAST] == touch


@pytest.mark.parametrize(("gap", "contact"), [(-0.3, 1.0), (0.09, 1.0), (0.11, 0.0)])
def test_floor_and_ceiling_allow_the_full_tolerance(
    room: Layout, gap: float, contact: float
) -> None:
    low = one_box(0.0, 0.0, 0.5 + gap, (1.0, 1.0, 1.0))
    assert relations_from_boxes(low, room).on_floor.tolist() == [contact]
    high = one_box(0.0, 0.0, room.ceiling_height - 0.5 - gap, (1.0, 1.0, 1.0))
    relations = relations_from_boxes(high, room)
    assert relations.under_ceiling.tolist() == [contact]
    assert relations.on_floor.tolist() == [0.0]


@pytest.mark.parametrize(
    ("x", "full", "any_corner"),
    [(0.0, 1, 1), (1.55, 1, 1), (1.65, 0, 1), (2.4, 0, 1), (2.52, 0, 1), (2.6, 0, 0), (9.0, 0, 0)],
)
def test_inside_room_by_the_paper_and_by_the_release(
    room: Layout, x: float, full: float, any_corner: float
) -> None:
    box = one_box(x, 0.0, 0.5, (1.0, 1.0, 1.0))
    assert relations_from_boxes(box, room).inside_room.tolist() == [full]
    released = relations_from_boxes(box, room, inside="any_corner")
    assert released.inside_room.tolist() == [any_corner]


def test_objects_outside_the_room_touch_no_wall(room: Layout) -> None:
    behind = one_box(2.6, 0.0, 0.5, (0.5, 0.5, 1.0))
    assert relations_from_boxes(behind, room).touching_wall.sum() == 0


def test_thin_pictures_half_in_the_wall_are_inside(room: Layout) -> None:
    picture = one_box(2.0, 0.0, 1.5, (1.0, 0.04, 0.6), math.pi / 2)
    relations = relations_from_boxes(picture, room)
    assert relations.inside_room.tolist() == [1.0]
    assert relations.touching_wall.tolist() == [[0.0, 1.0, 0.0, 0.0]]


def test_a_wall_through_the_middle_of_a_box_puts_it_outside() -> None:
    # a U-shaped room: the box spans the gap, with all its corners inside the two arms
    room = Layout(
        torch.tensor(
            [[-3.0, -2], [3, -2], [3, 2], [0.5, 2], [0.5, -1], [-0.5, -1], [-0.5, 2], [-3, 2]]
        )
    )
    spanning = one_box(0.0, 0.5, 0.5, (4.0, 1.0, 1.0))
    assert relations_from_boxes(spanning, room).inside_room.tolist() == [0.0]
    in_one_arm = one_box(1.8, 0.5, 0.5, (2.0, 1.0, 1.0))
    assert relations_from_boxes(in_one_arm, room).inside_room.tolist() == [1.0]


@pytest.mark.parametrize(("z", "inside"), [(0.3, 0), (0.45, 1), (2.15, 1), (2.3, 0)])
def test_inside_room_looks_at_the_height_too(room: Layout, z: float, inside: float) -> None:
    box = one_box(0.0, 0.0, z, (1.0, 1.0, 1.0))
    assert relations_from_boxes(box, room).inside_room.tolist() == [inside]


def test_parallel_furniture_has_relative_yaw_zero_wherever_it_stands(room: Layout) -> None:
    # the authors' release would say -45 degrees here: the lines of sight differ by 50 degrees
    boxes = OrientedBoxes(
        torch.tensor([[-0.7, 1.5, 0.5], [0.7, 1.5, 0.5]]), torch.ones(2, 3), torch.full((2,), 0.3)
    )
    bins = relations_from_boxes(boxes, room).relative_yaw
    assert bins[0, 1].argmax() == bins[1, 0].argmax() == 4


def test_bins_wrap() -> None:
    angles = torch.tensor([-180.0, -158, -157, 157, 158, 180, 22, 23, 360, 339]) * math.pi / 180
    assert relative_yaw_bins(angles).argmax(-1).tolist() == [0, 0, 1, 7, 0, 0, 4, 5, 4, 4]
    assert len(RELATIVE_YAW_BINS) == 8
    back = relative_yaw_angle(relative_yaw_bins(torch.tensor(RELATIVE_YAW_BINS)))
    torch.testing.assert_close(back, torch.tensor(RELATIVE_YAW_BINS))


@given(seed=st.integers(0, 10_000), n=st.integers(0, 6), grid=st.booleans())
@settings(max_examples=40, deadline=None)
def test_symmetries(seed: int, n: int, grid: bool) -> None:
    boxes = random_boxes(seed, n)
    if grid:  # exact multiples of 22.5 degrees: the edges of the bins
        yaw = torch.round(boxes.yaw / (math.pi / 8)) * (math.pi / 8)
        boxes = OrientedBoxes(boxes.centre, boxes.size, yaw)
    room = Layout(torch.tensor([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]]))
    relations = relations_from_boxes(boxes, room)
    assert torch.equal(relations.touching, relations.touching.T)
    off_diagonal = 1 - torch.eye(n)
    assert torch.equal(relations.farther_than + relations.farther_than.T, off_diagonal)
    reversed_bins = relations.relative_yaw[..., [0, 7, 6, 5, 4, 3, 2, 1]]
    assert torch.equal(relations.relative_yaw, reversed_bins.transpose(0, 1))
    assert torch.equal(relations.relative_yaw.sum(-1), off_diagonal)
    assert bool((relations.relative_yaw_wall.sum(-1) == 1).all())
    assert not relations.touching.diagonal().any()


@given(seed=st.integers(0, 10_000), turn=st.integers(1, 3))
@settings(max_examples=20, deadline=None)
def test_turning_room_and_boxes_together_changes_nothing(seed: int, turn: int) -> None:
    boxes = random_boxes(seed, 5, torch.float64)
    polygon = torch.tensor([[-2.0, -2.0], [2.0, -1.5], [1.5, 2.0], [-2.0, 2.0]]).double()
    angle = torch.tensor(turn * math.pi / 2 + 0.1, dtype=torch.float64)
    matrix = torch.stack(
        (torch.stack((angle.cos(), -angle.sin())), torch.stack((angle.sin(), angle.cos())))
    )
    turned = OrientedBoxes(
        torch.cat((boxes.centre[:, :2] @ matrix.T, boxes.centre[:, 2:]), 1),
        boxes.size,
        boxes.yaw + angle,
    )
    before = relations_from_boxes(boxes, Layout(polygon))
    after = relations_from_boxes(turned, Layout(polygon @ matrix.T))
    for field in dataclasses.fields(Relations):
        assert torch.equal(getattr(before, field.name), getattr(after, field.name)), field.name


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_no_objects_and_dtype(room: Layout, dtype: torch.dtype) -> None:
    none = OrientedBoxes(
        torch.zeros(0, 3, dtype=dtype), torch.zeros(0, 3, dtype=dtype), torch.zeros(0, dtype=dtype)
    )
    relations = relations_from_boxes(none, room)
    assert relations.touching.shape == (0, 0)
    assert relations.touching_wall.shape == (0, 4)
    assert relations.relative_yaw_wall.shape == (0, 4, 8)
    for field in dataclasses.fields(Relations):
        assert getattr(relations, field.name).dtype == dtype


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("centre", math.nan, "boxes.centre: expected finite"),
        ("size", math.inf, "boxes.size: expected finite"),
        ("yaw", math.nan, "boxes.yaw: expected finite"),
        ("size", 0.0, "boxes.size: expected positive"),
        ("size", -1.0, "boxes.size: expected positive"),
    ],
)
def test_bad_boxes_are_refused(room: Layout, name: str, value: float, message: str) -> None:
    box = one_box(0.0, 0.0, 0.5, (1.0, 1.0, 1.0))
    bad = dataclasses.replace(box, **{name: torch.full_like(getattr(box, name), value)})
    with pytest.raises(ValueError, match=message):
        relations_from_boxes(bad, room)


def test_bad_parameters_are_refused(room: Layout) -> None:
    box = one_box(0.0, 0.0, 0.5, (1.0, 1.0, 1.0))
    with pytest.raises(ValueError, match=r"tolerance: expected .* found -0\.1"):
        relations_from_boxes(box, room, tolerance=-0.1)
    with pytest.raises(ValueError, match=r"batch shape \(n,\), found \(\)"):
        relations_from_boxes(box[0], room)


def test_bad_rooms_are_refused(room: Layout) -> None:
    box = one_box(0.0, 0.0, 0.5, (1.0, 1.0, 1.0))
    corners = room.floor_polygon
    for polygon, message in [
        (corners.flip(0), "clockwise"),
        (corners[[0, 2, 1, 3]], "cross"),
        (corners * math.nan, "not finite"),
        (corners[:2], "2 corners"),
    ]:
        with pytest.raises(ValueError, match=f"layout.floor_polygon: .*{message}"):
            relations_from_boxes(box, Layout(polygon))
    with pytest.raises(ValueError, match="ceiling_height: expected more than the floor"):
        relations_from_boxes(box, Layout(corners, 3.0, 2.0))
    with pytest.raises(ValueError, match="camera_height: expected finite"):
        relations_from_boxes(box, room, math.nan)
