import math
from functools import partial

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor

from panoscene.geometry._sphere import (
    camera_from_turned,
    direction_from_lonlat,
    direction_from_pixel,
    lonlat_from_direction,
    lonlat_from_pixel,
    pixel_from_direction,
    pixel_from_lonlat,
)

HEIGHT, WIDTH = 512, 1024

gradcheck = partial(torch.autograd.gradcheck, fast_mode=True)
few = settings(max_examples=30, deadline=None)
longitudes = st.floats(-20.0, 20.0)
latitudes_off_the_poles = st.floats(-1.55, 1.55)
dtypes = pytest.mark.parametrize(
    ("dtype", "tolerance"), [(torch.float32, 1e-3), (torch.float64, 1e-9)], ids=["f32", "f64"]
)


def lonlat(lon: float, lat: float) -> Tensor:
    return torch.tensor([lon, lat], dtype=torch.float64)


def pixel_centres(height: int, width: int, dtype: torch.dtype) -> Tensor:
    v, u = torch.meshgrid(
        torch.arange(height, dtype=dtype) + 0.5,
        torch.arange(width, dtype=dtype) + 0.5,
        indexing="ij",
    )
    return torch.stack((u, v), dim=-1)


@pytest.mark.parametrize(
    ("direction", "pixel"),
    [
        ((0.0, 1.0, 0.0), (512.0, 256.0)),  # ahead: the centre of the image
        ((1.0, 0.0, 0.0), (768.0, 256.0)),  # right
        ((-1.0, 0.0, 0.0), (256.0, 256.0)),  # left
        ((0.0, -1.0, 0.0), (0.0, 256.0)),  # behind: the seam
        ((0.0, 1.0, 1.0), (512.0, 128.0)),  # up is towards row 0
        ((0.0, 1.0, -1.0), (512.0, 384.0)),
        ((0.0, 0.0, 1.0), (512.0, 0.0)),  # the poles have no longitude: the centre column
        ((0.0, 0.0, -1.0), (512.0, 512.0)),
    ],
)
def test_known_directions(direction: tuple[float, ...], pixel: tuple[float, ...]) -> None:
    for length in (1.0, 7.0):
        found = pixel_from_direction(length * torch.tensor(direction), HEIGHT, WIDTH)
        torch.testing.assert_close(found, torch.tensor(pixel), atol=1e-4, rtol=0)


def test_first_and_last_pixel_centres_are_half_a_pixel_from_the_seam() -> None:
    ends = lonlat_from_pixel(torch.tensor([[0.5, 0.5], [WIDTH - 0.5, HEIGHT - 0.5]]), HEIGHT, WIDTH)
    half = math.pi / WIDTH
    expected = torch.tensor(
        [[-math.pi + half, math.pi / 2 - half], [math.pi - half, half - math.pi / 2]]
    )
    torch.testing.assert_close(ends, expected)


@dtypes
def test_pixel_direction_pixel_is_the_identity(dtype: torch.dtype, tolerance: float) -> None:
    uv = pixel_centres(64, 128, dtype)
    direction = direction_from_pixel(uv, 64, 128)
    assert direction.dtype == dtype
    torch.testing.assert_close(direction.norm(dim=-1), torch.ones(64, 128, dtype=dtype))
    back = pixel_from_direction(direction, 64, 128)
    torch.testing.assert_close(back, uv, atol=tolerance, rtol=0)


@few
@given(longitudes, latitudes_off_the_poles)
def test_lonlat_direction_lonlat_is_the_wrapped_identity(lon: float, lat: float) -> None:
    back = lonlat_from_direction(direction_from_lonlat(lonlat(lon, lat)))
    assert -math.pi <= float(back[0]) < math.pi
    turns = (lon - float(back[0])) / (2 * math.pi)
    assert turns == pytest.approx(round(turns), abs=1e-9)
    assert float(back[1]) == pytest.approx(lat, abs=1e-12)


@few
@given(st.floats(0.0, WIDTH - 0.01), st.integers(-3, 3), st.floats(0.0, HEIGHT))
def test_the_period_is_exactly_the_width(u: float, turns: int, v: float) -> None:
    uv = torch.tensor([[u, v], [u + turns * WIDTH, v]], dtype=torch.float64)
    here, there = lonlat_from_pixel(uv, HEIGHT, WIDTH)
    apart = (here[0] - there[0]) / (2 * math.pi)  # whole turns: near the seam it may be one
    assert float(apart) == pytest.approx(round(float(apart)), abs=1e-12)
    back = pixel_from_lonlat(here, HEIGHT, WIDTH)
    assert 0 <= float(back[0]) < WIDTH
    assert math.remainder(float(back[0]) - u, WIDTH) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_the_seam_is_column_zero_from_both_sides(dtype: torch.dtype) -> None:
    near = torch.tensor(math.pi, dtype=dtype)
    below = torch.nextafter(near, torch.zeros_like(near))
    for lon in (near, -near, below, 3 * near):
        u = float(pixel_from_lonlat(torch.stack((lon, lon * 0)), HEIGHT, WIDTH)[0])
        assert 0 <= u < WIDTH
        assert math.remainder(u, WIDTH) == pytest.approx(0, abs=1e-3)
    behind = torch.tensor([[0.0, -1.0, 0.0], [-0.0, -1.0, 0.0], [-1e-30, -1.0, 0.0]], dtype=dtype)
    lon = lonlat_from_direction(behind)[:, 0]
    assert bool(((lon >= -near) & (lon < below)).all())
    torch.testing.assert_close(lon, (-near).expand(3))


def test_deep_pano_context_pixels_are_half_a_pixel_further_and_latitudes_negated() -> None:
    """Facts 1.2 and 14.1: theirs are u = lon W / 2 pi + W / 2 + 0.5 with lat positive down."""
    # their world looks along +x with +y to the left: theirs -> our camera axes
    theirs = torch.tensor(
        [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, -1.0]], dtype=torch.float64
    )
    published = torch.tensor(
        [[512.5, 256.5], [768.5, 256.5], [256.5, 256.5], [512.5, 384.5]], dtype=torch.float64
    )
    ours_from_theirs = torch.tensor(
        [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64
    )
    direction = theirs @ ours_from_theirs.mT
    ours = pixel_from_direction(direction, HEIGHT, WIDTH)
    torch.testing.assert_close(ours + 0.5, published)
    # an array index i of theirs is read as coordinate i, so its pixel lies at i + 0.5 for us and
    # at i - 0.5 when their number is taken for ours: one pixel, 0.35 degrees
    index = published.floor()
    naive = lonlat_from_pixel(index + 0.5, HEIGHT, WIDTH)
    meant = (index - WIDTH / 2 - 0.5) * (2 * math.pi / WIDTH)
    assert float((naive[:, 0] - meant[:, 0]).abs().max()) == pytest.approx(2 * math.pi / WIDTH)
    lat_down = torch.asin(-direction[:, 2] / direction.norm(dim=-1))
    torch.testing.assert_close(lonlat_from_direction(direction)[:, 1], -lat_down)


def test_the_poles_have_longitude_zero_whatever_the_signs_of_their_zeros() -> None:
    zeros = [(x, y, z) for x in (0.0, -0.0) for y in (0.0, -0.0) for z in (1.0, -1.0, 0.0)]
    lon, lat = lonlat_from_direction(torch.tensor(zeros)).unbind(-1)
    assert bool((lon == 0).all())
    assert float(lat[0]) == pytest.approx(math.pi / 2)
    assert bool((lat[2::3] == 0).all())


@few
@given(longitudes, st.floats(-math.pi / 2, math.pi / 2))
def test_the_turned_camera_is_a_rotation_that_looks_at_its_target(lon: float, lat: float) -> None:
    camera = camera_from_turned(lonlat(lon, lat))
    eye = torch.eye(3, dtype=torch.float64)
    torch.testing.assert_close(camera @ camera.mT, eye, atol=1e-12, rtol=0)
    assert float(torch.linalg.det(camera)) == pytest.approx(1)
    torch.testing.assert_close(camera[:, 1], direction_from_lonlat(lonlat(lon, lat)))
    assert float(camera[2, 0]) == 0  # no roll: its right stays level
    assert float(camera[2, 2]) >= -1e-12  # and its up points up
    yaw_then_pitch = camera_from_turned(lonlat(lon, 0)) @ camera_from_turned(lonlat(0, lat))
    torch.testing.assert_close(camera, yaw_then_pitch, atol=1e-12, rtol=0)


def test_turns_about_the_vertical_add_up() -> None:
    first, second = camera_from_turned(lonlat(1.1, 0)), camera_from_turned(lonlat(2.7, 0))
    torch.testing.assert_close(first @ second, camera_from_turned(lonlat(3.8, 0)))


def test_any_batch_shape_passes_through() -> None:
    for batch in ((), (0,), (2, 3)):
        uv = torch.full((*batch, 2), 3.0)
        assert direction_from_pixel(uv, 8, 16).shape == (*batch, 3)
        assert pixel_from_direction(torch.ones(*batch, 3), 8, 16).shape == (*batch, 2)
        assert camera_from_turned(uv).shape == (*batch, 3, 3)


@pytest.mark.parametrize("function", [lonlat_from_pixel, pixel_from_lonlat])
@pytest.mark.parametrize("shape", [(0, 16), (8, 0), (-8, 16)])
def test_an_empty_panorama_is_refused(function, shape: tuple[int, int]) -> None:
    with pytest.raises(ValueError, match="at least 1 x 1"):
        function(torch.zeros(2), *shape)


def test_gradients_are_right_off_the_poles_and_across_the_seam() -> None:
    rng = torch.Generator().manual_seed(3)
    uv = torch.rand(6, 2, generator=rng, dtype=torch.float64) * torch.tensor([16.0, 7.0]) + 0.3
    direction = torch.randn(6, 3, generator=rng, dtype=torch.float64)
    lonlats = torch.randn(6, 2, generator=rng, dtype=torch.float64)
    behind = torch.tensor([[1e-3, -1.0, 0.2], [-1e-3, -1.0, 0.2]], dtype=torch.float64)
    for tensor in (uv, direction, lonlats, behind):
        tensor.requires_grad_()
    assert gradcheck(lambda x: direction_from_pixel(x, 8, 16), uv)
    assert gradcheck(lambda x: pixel_from_direction(x, 8, 16), direction)
    assert gradcheck(lonlat_from_direction, direction)
    assert gradcheck(lonlat_from_direction, behind)
    assert gradcheck(camera_from_turned, lonlats)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_gradients_are_finite_at_the_poles_and_at_nothing(dtype: torch.dtype) -> None:
    direction = torch.tensor(
        [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.0, 0.0, 0.0], [1e-30, 0.0, 1.0]], dtype=dtype
    ).requires_grad_()
    pixel_from_direction(direction, 8, 16).sum().backward()
    assert direction.grad is not None
    assert bool(direction.grad[:3].isfinite().all())
    assert bool(direction.grad[:2, :2].eq(0).all())
    assert not bool(direction.grad.isnan().any())
