"""From signals to rooms: exact signals, noise, hidden corners, signals of no room."""

import math

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from panoscene.geometry import (
    boundary_from_layout,
    corner_signal_from_layout,
    is_manhattan,
    polygon_iou,
    polygon_problem,
    signed_distance_to_polygon,
)
from panoscene.models.layout import room_from_signals

RECTANGLE = torch.tensor([[-2.0, -1.0], [3.0, -1.0], [3.0, 2.0], [-2.0, 2.0]]).double()
L_ROOM = torch.tensor(
    [[-2.0, -1.5], [3.0, -1.5], [3.0, 1.5], [1.0, 1.5], [1.0, 4.0], [-2.0, 4.0]]
).double()


def turned(polygon: Tensor, angle: float) -> Tensor:
    cos, sin = math.cos(angle), math.sin(angle)
    return polygon @ polygon.new_tensor([[cos, sin], [-sin, cos]])


def signals(polygon: Tensor, ceiling: float = 2.6, camera: float = 1.6) -> tuple[Tensor, Tensor]:
    boundary = torch.stack(boundary_from_layout(polygon, 0.0, ceiling, camera))
    return boundary, corner_signal_from_layout(polygon)


def wobbly(boundary: Tensor, degrees: float, seed: int) -> Tensor:
    """Return boundaries with errors that go together over dozens of columns, as networks make."""
    generator = torch.Generator().manual_seed(seed)
    error = torch.zeros_like(boundary)
    for width, share in ((60, 0.8), (15, 0.5), (3, 0.3)):
        reach = torch.arange(-3 * width, 3 * width + 1)
        kernel = torch.exp(-0.5 * (reach / width) ** 2).double()
        noise = torch.randn(2, 1, 1024 + 6 * width, generator=generator).double()
        smooth = torch.nn.functional.conv1d(noise, (kernel / kernel.sum())[None, None])[:, 0]
        error += share * smooth / smooth.std()
    return boundary + error * math.radians(degrees)


@settings(max_examples=10, deadline=None)
@given(
    angle=st.floats(-4, 4), x=st.floats(-1.5, 0.5), y=st.floats(-1.0, 1.0),
    shape=st.sampled_from([RECTANGLE, L_ROOM]), ceiling=st.floats(2.2, 3.5),
)  # fmt: skip
def test_exact_signals_give_the_room(
    angle: float, x: float, y: float, shape: Tensor, ceiling: float
) -> None:
    room = turned(shape - shape.new_tensor([x, y / 2]), angle)
    found = room_from_signals(*signals(room, ceiling), 1.6)
    polygon = found.layout.floor_polygon.double()
    assert found.regular
    assert polygon_problem(polygon) is None
    assert is_manhattan(polygon)
    assert found.layout.ceiling_height == pytest.approx(ceiling, abs=0.02)
    assert polygon_iou(polygon, room) > 0.97
    assert len(polygon) == len(room)


def test_signals_of_the_truth_are_no_worse_than_drawn() -> None:
    found = room_from_signals(*signals(L_ROOM), 1.6)
    assert found.layout.raw_polygon is not None
    drawn = polygon_iou(found.layout.raw_polygon.double(), L_ROOM)
    assert polygon_iou(found.layout.floor_polygon.double(), L_ROOM) >= drawn - 1e-3
    assert found.layout.wall_score is not None
    assert float(found.layout.wall_score.min()) > 0.9
    assert not found.ambiguous


@pytest.mark.parametrize("seed", range(6))
def test_noise_adds_no_corners_to_a_rectangle(seed: int) -> None:
    boundary, corner = signals(turned(RECTANGLE, 0.4))
    found = room_from_signals(wobbly(boundary, 1.0, seed), corner, 1.6)
    assert len(found.layout.floor_polygon) == 4
    assert polygon_iou(found.layout.floor_polygon.double(), turned(RECTANGLE, 0.4)) > 0.85


def test_noise_does_not_hide_a_niche() -> None:
    boundary, corner = signals(L_ROOM)
    found = [room_from_signals(wobbly(boundary, 0.7, seed), corner, 1.6) for seed in range(5)]
    assert sum(len(room.layout.floor_polygon) == 6 for room in found) >= 4


def test_hidden_corners_are_inferred() -> None:
    # the corner at (1, 4) and part of the far wall are behind the corner at (1, 1.5)
    room = L_ROOM - L_ROOM.new_tensor([1.8, 0.0])
    found = room_from_signals(*signals(room), 1.6).layout
    assert len(found.floor_polygon) == 6
    assert found.wall_score is not None
    assert float(found.wall_score.min()) < 0.1  # the wall that nothing sees
    drawn = polygon_iou(found.raw_polygon.double(), room)  # ty: ignore[missing-union-attribute]
    assert polygon_iou(found.floor_polygon.double(), room) > drawn


def test_a_round_room_keeps_its_drawn_polygon() -> None:
    angle = torch.arange(40).double() * 2 * math.pi / 40
    # long and round: no perpendicular walls come near
    room = torch.stack((1.2 * torch.cos(angle), 1.2 * torch.sin(angle)), dim=-1)
    room = room @ room.new_tensor([[1.0, 0.0], [0.0, 1.0]])
    found = room_from_signals(*signals(room), 1.6)
    polygon = found.layout.floor_polygon.double()
    assert polygon_iou(polygon, room) > 0.8
    assert found.regular or torch.equal(polygon, found.layout.raw_polygon.double())  # ty: ignore[missing-union-attribute]


def test_size_follows_the_camera_height() -> None:
    boundary, corner = signals(RECTANGLE)
    low, high = (room_from_signals(boundary, corner, height).layout for height in (1.0, 2.0))
    assert torch.allclose(2 * low.floor_polygon, high.floor_polygon, atol=1e-5)
    assert high.ceiling_height == pytest.approx(2 * low.ceiling_height)


@pytest.mark.parametrize(("columns", "expected"), [(57, True), (20, True), (10, False)])
def test_an_open_doorway_is_ambiguous(columns: int, expected: bool) -> None:
    boundary, corner = signals(RECTANGLE)
    through, doorway = boundary.clone(), slice(480, 480 + columns)
    # some degrees in which the floor goes on to twice the distance and the ceiling does not
    through[1, doorway] = -torch.atan(torch.tan(-boundary[1, doorway]) / 2)
    assert not room_from_signals(boundary, corner).ambiguous
    assert room_from_signals(through, corner).ambiguous == expected


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 10_000), scale=st.floats(0.0, 2.0))
def test_any_signals_give_a_valid_room(seed: int, scale: float) -> None:
    generator = torch.Generator().manual_seed(seed)
    boundary = scale * torch.randn(2, 1024, generator=generator)
    found = room_from_signals(boundary, torch.rand(1024, generator=generator), 1.6)
    for polygon in (found.layout.floor_polygon, found.layout.raw_polygon):
        assert polygon is not None
        assert polygon_problem(polygon) is None
        inside = signed_distance_to_polygon(torch.zeros(1, 2), polygon)
        assert float(inside[0]) < 0
    assert found.layout.ceiling_height > 1.6
    assert found.layout.wall_score is not None
    assert len(found.layout.wall_score) == len(found.layout.floor_polygon)


@pytest.mark.parametrize(
    ("boundary", "corner", "height", "words"),
    [
        (torch.full((2, 1024), math.nan), torch.zeros(1024), 1.6, "finite"),
        (torch.zeros(2, 1000), torch.zeros(1000), 1.6, "multiple of 256"),
        (torch.zeros(2, 1024), torch.zeros(1024), 0.0, "camera_height"),
    ],
)
def test_wrong_signals_are_refused(
    boundary: Tensor, corner: Tensor, height: float, words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        room_from_signals(boundary, corner, height)
