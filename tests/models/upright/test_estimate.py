import dataclasses
import io
import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from torch import Tensor

from panoscene.geometry import panorama_directions, rotate_panorama
from panoscene.models.upright import LEAST_CONFIDENCE, UprightEstimate, upright_rotation
from panoscene.scene import Panorama, upright_photo
from panoscene.synth.dataset import PanoramaItem, open_dataset

SAMPLES = Path(__file__).parents[3] / "samples" / "synth"
WALLS = 0.3
"""Yaw of the drawn room."""


def tilted(tilt: float, lean: float) -> Tensor:
    """A turn by a tilt in radians about a level axis."""
    x, y = math.cos(lean), math.sin(lean)
    axis = torch.tensor([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]], dtype=torch.float64)
    return torch.linalg.matrix_exp(tilt * axis)


def degrees_apart(first: Tensor, second: Tensor) -> float:
    """Between two unit vectors; exact for small angles."""
    cross = torch.linalg.cross(first, second).norm()
    return math.degrees(math.atan2(float(cross), float(first @ second)))


def drawn_room(upright_from_photo: Tensor, height: int = 256, yaw: float = WALLS) -> Tensor:
    """A box with a window in each wall and tiles on the floor, as a tilted camera sees it."""
    fine = panorama_directions(2 * height, 4 * height, like=torch.zeros((), dtype=torch.float64))
    c, s = math.cos(yaw), math.sin(yaw)
    room_from_world = torch.tensor([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]).double()
    ray = fine @ (room_from_world @ upright_from_photo).T
    low = torch.tensor([-1.7, -2.4, -1.6]).double()
    high = torch.tensor([2.2, 3.1, 1.1]).double()
    travel = torch.where(ray > 0, high, low) / torch.where(ray == 0, 1e-9, ray)
    distance, axis = travel.min(dim=-1)
    place = ray * distance[..., None]
    side = (ray.gather(-1, axis[..., None])[..., 0] > 0).double()
    grey = 0.35 + 0.1 * axis + 0.12 * side
    along = torch.where(axis == 0, place[..., 1], place[..., 0])
    window = (axis < 2) & ((along - 0.3).abs() < 0.8) & ((place[..., 2] + 0.2).abs() < 0.6)
    tile = ((place[..., 0] / 0.5).floor() + (place[..., 1] / 0.5).floor()) % 2
    grey = torch.where(window, 0.95, grey)
    grey = torch.where((axis == 2) & (side == 0), 0.2 + 0.1 * tile, grey)
    grey = torch.nn.functional.avg_pool2d(grey[None, None].float(), 2)[0, 0]
    return grey.expand(3, -1, -1).contiguous()


@cache
def samples() -> tuple[PanoramaItem, ...]:
    """The rendered panoramas of the repository, 512 x 256."""
    return tuple(open_dataset(SAMPLES))


def test_the_turn_is_the_one_that_labels_hold() -> None:
    rotation = tilted(0.35, 2.0)
    estimate = upright_rotation(drawn_room(rotation))
    up = rotation[2]
    assert degrees_apart(estimate.rotation[2], up) < 0.2
    # the photo's middle stays at lon 0, as in the labels of the set
    middle = estimate.rotation @ torch.tensor([0.0, 1.0, 0.0]).double()
    assert abs(float(middle[0])) < 1e-12
    assert float(middle[1]) > 0
    assert estimate.tilt == pytest.approx(math.acos(float(up[2])), abs=0.004)
    panorama = Panorama(512, 256, upright_from_photo=estimate.upright_from_photo)
    turned = upright_photo(drawn_room(rotation), panorama)
    assert upright_rotation(turned).tilt < math.radians(0.3)


@settings(max_examples=8)
@given(tilt=st.floats(0.0, 30.0), lean=st.floats(-3.1, 3.1), yaw=st.floats(-0.7, 0.7))
def test_a_drawn_room_is_made_upright(tilt: float, lean: float, yaw: float) -> None:
    rotation = tilted(math.radians(tilt), lean)
    estimate = upright_rotation(drawn_room(rotation, 128, yaw))
    assert estimate.confidence > LEAST_CONFIDENCE
    assert degrees_apart(estimate.rotation[2], rotation[2]) < 0.5
    assert estimate.rotation @ estimate.rotation.T == pytest.approx(np.eye(3), abs=1e-9)


def test_walls_have_the_yaw_of_the_room() -> None:
    estimate = upright_rotation(drawn_room(torch.eye(3).double(), yaw=0.6))
    assert estimate.wall_yaw == pytest.approx(0.6, abs=0.005)
    turned = upright_rotation(drawn_room(torch.eye(3).double(), yaw=0.6 + math.pi / 2))
    assert turned.wall_yaw == pytest.approx(0.6, abs=0.005)


def test_rendered_panoramas_are_made_upright() -> None:
    errors = []
    for index, item in enumerate(samples()):
        true = torch.tensor(item.scene().panorama.upright_from_photo, dtype=torch.float64)
        turn = tilted(math.radians(3.0 * index), 2.4 * index)
        estimate = upright_rotation(rotate_panorama(item.image(), turn))
        errors.append(degrees_apart(estimate.rotation[2], (true @ turn.T)[2]))
    assert np.median(errors) < 0.5
    assert max(errors) < 2.0


def test_labels_and_estimates_agree_on_rendered_tilts() -> None:
    tilted_ones = [item for item in samples() if item.labels().camera.pitch != 0.0]
    for item in tilted_ones:
        true = torch.tensor(item.scene().panorama.upright_from_photo, dtype=torch.float64)
        if degrees_apart(true[2], torch.tensor([0.0, 0.0, 1.0]).double()) > 1.0:
            estimate = upright_rotation(item.image())
            assert (estimate.rotation - true).abs().max() < math.radians(0.3)


def test_rolling_turns_the_yaw_only() -> None:
    image = drawn_room(tilted(0.3, 1.0))
    first = upright_rotation(image)
    for columns in (128, 77):
        second = upright_rotation(image.roll(columns, dims=-1))
        assert second.tilt == pytest.approx(first.tilt, abs=math.radians(0.2))
        lon = 2 * math.pi * columns / image.shape[-1]
        c, s = math.cos(lon), math.sin(lon)
        rolled = torch.tensor([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]).double()
        assert degrees_apart(second.rotation[2], rolled @ first.rotation[2]) < 0.2
        # what is left between the two is a turn about the vertical
        between = second.rotation @ rolled @ first.rotation.T
        assert float(between[2, 2]) > math.cos(math.radians(0.2))


def test_a_mirrored_photo_has_the_mirrored_tilt() -> None:
    image = drawn_room(tilted(0.25, 0.7))
    first, second = upright_rotation(image), upright_rotation(image.flip(-1))
    mirror = torch.tensor([-1.0, 1.0, 1.0]).double()
    assert degrees_apart(second.rotation[2], mirror * first.rotation[2]) < 0.15
    assert first.wall_yaw is not None
    assert second.wall_yaw == pytest.approx(-first.wall_yaw, abs=0.005)


def is_identity(estimate: UprightEstimate) -> bool:
    """Whether the photo is left as it is, and nobody is told otherwise."""
    same = torch.equal(estimate.rotation, torch.eye(3).double())
    return same and estimate.tilt == 0.0 and estimate.wall_yaw is None


@pytest.mark.parametrize("size", [(8, 16), (64, 128), (256, 512)])
def test_a_blank_photo_stays_as_it_is(size: tuple[int, int]) -> None:
    estimate = upright_rotation(torch.full((3, *size), 0.5))
    assert is_identity(estimate)
    assert estimate.confidence == 0.0
    assert estimate.segments == 0


def test_noise_is_no_evidence(generator: torch.Generator) -> None:
    estimate = upright_rotation(torch.rand(3, 256, 512, generator=generator))
    assert is_identity(estimate)
    assert estimate.confidence < LEAST_CONFIDENCE


def test_one_line_is_no_evidence() -> None:
    image = torch.zeros(3, 256, 512)
    image[:, 60:200, 100:103] = 1.0
    assert is_identity(upright_rotation(image))
    level = torch.zeros(3, 256, 512)
    level[:, 128:] = 1.0
    assert is_identity(upright_rotation(level))


def test_blocks_of_strong_compression_are_no_lines() -> None:
    image = rotate_panorama(samples()[3].image(), tilted(0.3, 1.0))

    def saved(quality: int) -> UprightEstimate:
        stream = io.BytesIO()
        pixels = (image * 255).round().byte().permute(1, 2, 0).contiguous().numpy()
        Image.fromarray(pixels).save(stream, "JPEG", quality=quality)
        read = np.array(Image.open(stream), dtype=np.float32) / 255
        return upright_rotation(torch.from_numpy(read).permute(2, 0, 1).contiguous())

    assert saved(60).tilt == pytest.approx(upright_rotation(image).tilt, abs=0.01)
    assert saved(60).tilt > 0.2
    worst = saved(8)
    assert is_identity(worst)
    assert worst.confidence == 0.0


def test_estimates_repeat_and_leave_the_photo_alone() -> None:
    image = samples()[0].image()
    before = image.clone()
    first, second = upright_rotation(image), upright_rotation(image)
    assert first == second
    assert torch.equal(image, before)
    assert dataclasses.is_dataclass(first)
    with pytest.raises(dataclasses.FrozenInstanceError):
        first.tilt = 0.0  # ty: ignore[invalid-assignment]


def test_large_and_double_precision_photos_are_taken() -> None:
    rotation = tilted(0.2, -1.0)
    image = drawn_room(rotation)
    large = torch.nn.functional.interpolate(image[None], scale_factor=6, mode="bilinear")[0]
    for other in (large, image.double()):
        assert degrees_apart(upright_rotation(other).rotation[2], rotation[2]) < 0.3


def test_a_photo_of_half_a_sphere_is_refused() -> None:
    with pytest.raises(ValueError, match="image: found 64 x 64 pixels, expected a width of 2 x"):
        upright_rotation(torch.zeros(3, 64, 64))
    with pytest.raises(ValueError, match="image: found 0 x 0 pixels"):
        upright_rotation(torch.zeros(3, 0, 0))
