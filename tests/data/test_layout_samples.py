"""Samples of the layout network: image and targets move together, exactly."""

import math
from pathlib import Path

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from panoscene.data import (
    LayoutAugmentation,
    LayoutSamples,
    RoomView,
    collate_layout,
    layout_targets,
    moved_photo,
    moved_room,
)
from panoscene.geometry import (
    boundary_from_layout,
    panorama_directions,
    polygon_area,
    polygon_problem,
    rotate_panorama,
)
from panoscene.synth.dataset import open_dataset

SAMPLES = Path(__file__).parents[2] / "samples" / "synth"
ROOM = RoomView(
    torch.tensor(
        [[-2.0, -1.5], [3.0, -1.5], [3.0, 1.0], [1.0, 1.0], [1.0, 4.0], [-2.0, 4.0]],
        dtype=torch.float64,
    ),
    0.0,
    2.7,
    1.6,
)  # fmt: skip
SIZE = (128, 256)


def drawn(room: RoomView, rows: int, columns: int) -> Tensor:
    """Return a picture of a bare room: ceiling 1, wall 0, floor -1."""
    ceiling, floor = boundary_from_layout(
        room.polygon, room.floor_height, room.ceiling_height, room.camera_height, columns
    )
    direction = panorama_directions(rows, columns, like=ceiling)
    lat = torch.asin(direction[..., 2])
    return ((lat > ceiling).float() - (lat < floor).float()).expand(3, -1, -1)


@settings(max_examples=15, deadline=None)
@given(
    turn=st.floats(-7, 7), mirrored=st.booleans(),
    scale=st.tuples(st.floats(0.6, 2.0), st.floats(0.6, 2.0)),
)  # fmt: skip
def test_photo_and_room_move_together(
    turn: float, mirrored: bool, scale: tuple[float, float]
) -> None:
    moved = moved_photo(drawn(ROOM, 512, 1024), SIZE, turn, mirrored, scale)
    expected = drawn(moved_room(ROOM, turn, mirrored, scale), *SIZE)
    # only pixels that a boundary runs through may differ
    wrong = (moved - expected).abs() > 0.75
    assert float(wrong.float().mean()) < 0.01


def test_a_turn_is_a_roll() -> None:
    photo = torch.rand(3, 64, 128, generator=torch.Generator().manual_seed(0))
    moved = moved_photo(photo, (64, 128), 2 * math.pi * 5 / 128, False, (1.0, 1.0))
    assert torch.allclose(moved, photo.roll(5, -1), atol=1e-3)
    plain = moved_photo(photo, (64, 128), 0.0, True, (1.0, 1.0))
    assert torch.allclose(plain, photo.flip(-1), atol=1e-4)


def test_moved_rooms_stay_rooms() -> None:
    moved = moved_room(ROOM, 1.0, True, (1.5, 0.8))
    assert polygon_problem(moved.polygon) is None
    area = float(polygon_area(ROOM.polygon)) * 1.5 * 0.8
    assert float(polygon_area(moved.polygon)) == pytest.approx(area)


def test_stretching_by_hand() -> None:
    moved = moved_room(ROOM, 0.0, False, (2.0, 1.0))
    boundary, _ = layout_targets(moved)
    # to the right the wall was 3 m away and is at 6 m; columns 767 and 768 look there
    assert float(boundary[1, 768]) == pytest.approx(-math.atan(1.6 / 6.0), abs=1e-3)
    assert float(boundary[0, 768]) == pytest.approx(math.atan(1.1 / 6.0), abs=1e-3)


@pytest.fixture(scope="module")
def samples() -> LayoutSamples:
    """Return three of the ten panoramas in the repository."""
    return LayoutSamples(open_dataset(SAMPLES)[:3], (64, 128))


def test_a_sample_is_a_function_of_its_seed(samples: LayoutSamples) -> None:
    settings = LayoutAugmentation()
    one = samples.augmented(0, torch.Generator().manual_seed(5), settings)
    same = samples.augmented(0, torch.Generator().manual_seed(5), settings)
    other = samples.augmented(0, torch.Generator().manual_seed(6), settings)
    assert all(torch.equal(a, b) for a, b in zip(one, same, strict=True))
    assert not torch.equal(one.boundary, other.boundary)
    assert one.image.shape == (3, 64, 128)
    assert 0 <= float(one.image.min()) <= float(one.image.max()) <= 1


def test_nothing_is_augmented_when_all_is_off(samples: LayoutSamples) -> None:
    off = LayoutAugmentation(stretch=1, roll=False, flip=False, gamma=1, photometric=None)
    one = samples.augmented(1, torch.Generator().manual_seed(5), off)
    plain = samples.plain(1)
    assert torch.equal(one.boundary, plain.boundary)
    assert float((one.image - plain.image).abs().mean()) < 0.01


def test_batches_have_the_targets_shapes(samples: LayoutSamples) -> None:
    batch = collate_layout([samples.plain(index) for index in range(3)])
    assert batch.boundary.shape == (3, 2, 1024)
    assert batch.corner.shape == (3, 1024)
    assert bool((batch.boundary[:, 0] > 0).all() and (batch.boundary[:, 1] < 0).all())
    assert float(batch.corner.max()) > 0.95


def test_tilted_photos_are_turned_upright() -> None:
    tilted = [
        item
        for item in open_dataset(SAMPLES)
        if not torch.allclose(
            torch.tensor(item.scene().panorama.upright_from_photo), torch.eye(3), atol=1e-4
        )
    ]
    assert tilted
    rotation = torch.tensor(tilted[0].scene().panorama.upright_from_photo).double()
    upright = rotate_panorama(tilted[0].image(), rotation)
    found = LayoutSamples(tilted[:1], (256, 512)).photo(0)
    assert float((found - upright.clamp(0, 1)).abs().mean()) < 0.01
