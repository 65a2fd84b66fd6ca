import math
from functools import partial

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from panoscene.geometry._cube import cube_from_panorama, panorama_from_cube
from panoscene.geometry._perspective import (
    perspective_crop,
)
from panoscene.geometry._resample import panorama_directions, rotate_panorama, sample_panorama
from panoscene.geometry._sphere import (
    camera_from_turned,
    direction_from_pixel,
)

from .conftest import noise, panorama, scene

gradcheck = partial(torch.autograd.gradcheck, fast_mode=True)
few = settings(max_examples=15, deadline=None)
angles = st.floats(-3.0, 3.0)
modes = pytest.mark.parametrize("mode", ["bilinear", "nearest", "bicubic"])


def rotation(lon: float, lat: float, roll: float) -> Tensor:
    turn = camera_from_turned(torch.tensor([lon, lat], dtype=torch.float64))
    c, s = math.cos(roll), math.sin(roll)
    about_y = torch.tensor([[c, 0, s], [0, 1, 0], [-s, 0, c]], dtype=torch.float64)
    return turn @ about_y


def pixels(*uv: tuple[float, float]) -> Tensor:
    return torch.tensor([uv], dtype=torch.float64)


# --- sampling


@modes
def test_pixel_centres_give_the_pixels_back(mode: str) -> None:
    image = noise(2, 3, 6, 12)
    v, u = torch.meshgrid(torch.arange(6.0), torch.arange(12.0), indexing="ij")
    uv = torch.stack((u, v), dim=-1).double() + 0.5
    torch.testing.assert_close(sample_panorama(image, uv, mode), image)
    for turns in (-2, 1):
        shifted = uv + torch.tensor([turns * 12.0, 0.0], dtype=torch.float64)
        torch.testing.assert_close(sample_panorama(image, shifted, mode), image)


@modes
@few
@given(st.floats(-30, 30), st.floats(-15, 15), st.integers(0, 11))
def test_sampling_commutes_with_rolling(mode: str, u: float, v: float, columns: int) -> None:
    image = noise(1, 6, 12)
    u = round(u, 2) + 0.003  # off the steps of "nearest"
    v = round(v, 2) + 0.003
    here = sample_panorama(image, pixels((u, v)), mode)
    there = sample_panorama(image.roll(columns, -1), pixels((u + columns, v)), mode)
    torch.testing.assert_close(here, there)


@modes
@few
@given(st.floats(0, 12), st.floats(0, 1.4))
def test_over_the_pole_comes_the_other_side(mode: str, u: float, beyond: float) -> None:
    image = noise(1, 6, 12)
    u, beyond = round(u, 2) + 0.003, round(beyond, 2) + 0.003
    for edge, inwards in ((0.0, 1.0), (6.0, -1.0)):
        over = sample_panorama(image, pixels((u, edge - inwards * beyond)), mode)
        across = sample_panorama(image, pixels((u + 6, edge + inwards * beyond)), mode)
        torch.testing.assert_close(over, across)


def test_the_seam_and_the_poles_are_averaged_with_their_neighbours() -> None:
    image = noise(1, 4, 8)
    found = sample_panorama(image, pixels((8.0, 1.5), (0.0, 1.5), (2.5, 0.0), (6.5, 4.0)))[0, 0]
    seam = (image[0, 1, 7] + image[0, 1, 0]) / 2
    top = (image[0, 0, 2] + image[0, 0, 6]) / 2
    bottom = (image[0, 3, 6] + image[0, 3, 2]) / 2
    torch.testing.assert_close(found, torch.stack((seam, seam, top, bottom)))


@pytest.mark.parametrize("mode", ["bilinear", "bicubic"])
def test_interpolation_agrees_with_grid_sample_inside(mode: str) -> None:
    image, uv = noise(3, 16, 32), 3 + noise(5, 7, 2, seed=1) * torch.tensor([26.0, 10.0])
    grid = 2 * uv / torch.tensor([32.0, 16.0], dtype=torch.float64) - 1
    theirs = torch.nn.functional.grid_sample(image[None], grid[None], align_corners=False)[0]
    ours = sample_panorama(image, uv.double(), mode)
    if mode == "bilinear":
        torch.testing.assert_close(ours, theirs)
    else:  # ours has a = -1/2 and so keeps parabolas, which torch's a = -3/4 does not
        row = torch.arange(16, dtype=torch.float64)[:, None] + 0.5
        parabola = (row**2).expand(1, 16, 32)
        torch.testing.assert_close(sample_panorama(parabola, uv, mode)[0], uv[..., 1] ** 2)


@pytest.mark.parametrize("dtype", [torch.int64, torch.uint8, torch.bool])
def test_labels_stay_exact(dtype: torch.dtype) -> None:
    labels = (noise(1, 6, 12) * 200).to(dtype)
    found = sample_panorama(labels, 12 * noise(9, 9, 2, seed=2), "nearest")
    assert found.dtype == dtype
    turned = rotate_panorama(labels, rotation(2 * math.pi * 5 / 12, 0, 0), "nearest")
    assert torch.equal(turned, labels.roll(5, -1))
    crop = perspective_crop(labels, torch.tensor([0.1, 0.2, 1.0, 1.0]), (8, 8), mode="nearest")
    assert bool(torch.isin(crop, labels).all()) if dtype != torch.bool else crop.dtype == dtype
    faces = cube_from_panorama(labels, 4, "nearest")
    assert panorama_from_cube(faces, 6, 12, "nearest").dtype == dtype


def test_leading_axes_broadcast_and_none_is_mixed_up() -> None:
    images, uv = noise(2, 1, 3, 6, 12), 6 * noise(2, 4, 5, 7, 2, seed=1)
    found = sample_panorama(images, uv)
    assert found.shape == (2, 4, 3, 5, 7)
    assert found.is_contiguous()
    for i in range(2):
        for j in range(4):
            alone = sample_panorama(images[i, 0], uv[i, j])
            torch.testing.assert_close(found[i, j], alone)
    assert sample_panorama(images, uv[0, 0]).shape == (2, 1, 3, 5, 7)
    assert sample_panorama(images[0, 0], uv[:, :0]).shape == (2, 0, 3, 5, 7)


def test_channels_last_memory_is_read_correctly() -> None:
    image = noise(6, 12, 3).permute(2, 0, 1)
    uv = 6 * noise(4, 4, 2, seed=3)
    torch.testing.assert_close(sample_panorama(image, uv), sample_panorama(image.contiguous(), uv))


@pytest.mark.parametrize("shape", [(1, 1), (1, 2), (2, 1), (3, 7), (8, 16)])
@modes
def test_tiny_and_odd_panoramas_are_read_without_a_crash(shape: tuple[int, int], mode: str) -> None:
    image = torch.full((1, *shape), 0.25)
    uv = torch.tensor([[[0.0, 0.0], [100.3, -40.2], [float("inf"), 1.0], [-7.0, float("nan")]]])
    found = sample_panorama(image, uv, mode)[0, 0]
    torch.testing.assert_close(found[:2], torch.full((2,), 0.25))


def test_sampling_refuses_what_it_cannot_do() -> None:
    image, uv = noise(1, 4, 8), noise(2, 2, 2)
    with pytest.raises(ValueError, match=r"mode: found 'linear', expected one of bilinear"):
        sample_panorama(image, uv, "linear")
    with pytest.raises(ValueError, match=r"image: found torch.int64 for mode 'bilinear'"):
        sample_panorama(image.long(), uv)
    with pytest.raises(ValueError, match="0 x 8 pixels"):
        sample_panorama(image[:, :0], uv)


@pytest.mark.parametrize("mode", ["bilinear", "bicubic"])
def test_sampling_has_the_right_gradient(mode: str) -> None:
    image = noise(2, 1, 4, 8).requires_grad_()
    uv = torch.tensor(
        [[[3.3, 1.2], [7.9, 2.2], [0.2, 2.8], [5.1, 0.2], [2.7, 3.9]]], dtype=torch.float64
    ).requires_grad_()
    assert gradcheck(lambda i, x: sample_panorama(i, x, mode), (image, uv))


# --- rotation


@modes
@pytest.mark.parametrize("columns", [1, 31, 64, 100])
def test_a_turn_about_the_vertical_is_a_roll(mode: str, columns: int) -> None:
    image = noise(3, 64, 128, dtype=torch.float32)
    lon = torch.tensor([2 * math.pi * columns / 128, 0.0], dtype=torch.float64)
    for precise in (torch.float32, torch.float64):
        turned = rotate_panorama(image, camera_from_turned(lon.to(precise)), mode)
        assert turned.dtype == torch.float32
        torch.testing.assert_close(turned, image.roll(columns, -1), atol=1e-5, rtol=0)


@pytest.mark.parametrize("columns", [1, 511, 1000])
def test_a_wide_panorama_of_single_precision_rolls_exactly(columns: int) -> None:
    image = noise(1, 16, 1024, dtype=torch.float32)
    lon = torch.tensor([2 * math.pi * columns / 1024, 0.0], dtype=torch.float64)
    turned = rotate_panorama(image, camera_from_turned(lon))
    torch.testing.assert_close(turned, image.roll(columns, -1), atol=1e-6, rtol=0)
    quarter = torch.tensor([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = rotate_panorama(image, quarter)
    torch.testing.assert_close(turned, image.roll(256, -1), atol=1e-6, rtol=0)


@few
@given(angles, st.floats(-1.5, 1.5), angles)
def test_a_rotated_panorama_shows_the_rotated_world(lon: float, lat: float, roll: float) -> None:
    new_from_old = rotation(lon, lat, roll)
    turned = rotate_panorama(panorama(48, 96), new_from_old)
    new = panorama_directions(48, 96, like=new_from_old)
    expected = scene(new @ new_from_old)  # d_old = inverse(new_from_old) @ d_new
    # bilinear error is about 1e-3 here; the inverse rotation or half a pixel is far above
    torch.testing.assert_close(turned, expected, atol=2.5e-3, rtol=0)


def test_rotations_compose_and_invert() -> None:
    image = panorama(64, 128)
    first, second = rotation(0.7, 0.9, -0.2), rotation(-1.9, -0.3, 1.1)
    twice = rotate_panorama(rotate_panorama(image, first), second)
    torch.testing.assert_close(twice, rotate_panorama(image, second @ first), atol=3e-3, rtol=0)
    wrong_order = rotate_panorama(image, first @ second)
    assert float((twice - wrong_order).abs().max()) > 0.1
    back = rotate_panorama(rotate_panorama(image, first), first.mT)
    torch.testing.assert_close(back, image, atol=3e-3, rtol=0)


def test_rotations_broadcast_and_carry_gradients() -> None:
    rotations = torch.stack((rotation(0.3, 0.1, 0.0), rotation(-1.0, 0.5, 0.2)))
    both = rotate_panorama(panorama(8, 16), rotations)
    assert both.shape == (2, 3, 8, 16)
    torch.testing.assert_close(both[1], rotate_panorama(panorama(8, 16), rotations[1]))
    lonlat = torch.tensor([0.31, 0.17], dtype=torch.float64, requires_grad=True)

    def turned(lonlat: Tensor) -> Tensor:
        return rotate_panorama(panorama(4, 8), camera_from_turned(lonlat))

    assert gradcheck(turned, lonlat)


@pytest.mark.parametrize("diagonal", [(2.0, 2.0, 2.0), (-1.0, 1.0, 1.0), (math.nan, 1.0, 1.0)])
def test_what_is_no_rotation_is_refused(diagonal: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="new_from_old"):
        rotate_panorama(torch.zeros(1, 4, 8), torch.diag(torch.tensor(diagonal)))


def test_panorama_directions_are_those_of_the_pixel_centres() -> None:
    v, u = torch.meshgrid(torch.arange(6.0), torch.arange(12.0), indexing="ij")
    expected = direction_from_pixel(torch.stack((u, v), -1) + 0.5, 6, 12)
    torch.testing.assert_close(panorama_directions(6, 12, like=torch.zeros(())), expected)
