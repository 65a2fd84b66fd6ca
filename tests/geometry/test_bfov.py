"""BFoV fits: containment, symmetry under turning, seam, poles, masks, refusals, gradients."""

import math

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.geometry._angles import wrap_angle
from panoscene.geometry._bfov import (
    bfov_area,
    bfov_contains,
    bfov_from_contour,
    bfov_from_directions,
)
from panoscene.geometry._sphere import (
    camera_from_turned,
    direction_from_lonlat,
)

SEEDS = st.integers(0, 2**31)


def cloud(seed: int, spread: float, points: int = 30, batch: int = 8) -> torch.Tensor:
    """Return directions scattered around one centre per batch entry, in float64."""
    generator = torch.Generator().manual_seed(seed)
    centre = torch.randn(batch, 1, 3, generator=generator, dtype=torch.float64)
    centre = centre / centre.norm(dim=-1, keepdim=True)
    offset = torch.randn(batch, points, 3, generator=generator, dtype=torch.float64)
    return centre + spread * offset


def about_the_vertical(directions: torch.Tensor, angle: float) -> torch.Tensor:
    """Return directions turned so that every lon grows by angle."""
    turn = camera_from_turned(torch.tensor([angle, 0.0], dtype=directions.dtype))
    return directions @ turn.T


def uniform_directions(count: int) -> torch.Tensor:
    """Return directions spread evenly over the sphere (a Fibonacci lattice), float64."""
    index = torch.arange(count, dtype=torch.float64) + 0.5
    up = 1 - 2 * index / count
    around = index * math.pi * (1 + math.sqrt(5))
    across = (1 - up.square()).sqrt()
    return torch.stack((across * around.cos(), across * around.sin(), up), -1)


def contained(bfov: torch.Tensor, directions: torch.Tensor, tolerance: float) -> torch.Tensor:
    shape = (*directions.shape[:-1], 4)
    return bfov_contains(bfov.unsqueeze(-2).expand(shape), directions, tolerance)


# --- fit to directions -------------------------------------------------------------------------


@settings(max_examples=25, deadline=None)
@given(
    seed=SEEDS, spread=st.floats(0.0, 3.0), dtype=st.sampled_from([torch.float32, torch.float64])
)
def test_all_directions_are_contained_and_the_region_is_bounded(seed, spread, dtype):
    directions = cloud(seed, spread).to(dtype)
    bfov = bfov_from_directions(directions)
    assert bfov.dtype == dtype
    assert contained(bfov, directions, 1e-5 if dtype == torch.float32 else 1e-9).all()
    assert ((bfov[:, 0] >= -math.pi) & (bfov[:, 0] < math.pi)).all()
    assert (bfov[:, 1].abs() <= math.pi / 2 + 1e-6).all()
    assert ((bfov[:, 2] >= 0) & (bfov[:, 2] <= 2 * math.pi + 1e-5)).all()
    assert ((bfov[:, 3] >= 0) & (bfov[:, 3] <= math.pi + 1e-5)).all()


@settings(max_examples=25, deadline=None)
@given(seed=SEEDS, spread=st.floats(0.05, 0.6), angle=st.floats(-10.0, 10.0))
def test_turning_about_the_vertical_only_shifts_lon(seed, spread, angle):
    directions = cloud(seed, spread)
    before = bfov_from_directions(directions)
    after = bfov_from_directions(about_the_vertical(directions, angle))
    torch.testing.assert_close(after[:, 1:], before[:, 1:], atol=1e-7, rtol=0)
    shift = wrap_angle(after[:, 0] - before[:, 0] - angle)
    torch.testing.assert_close(shift, torch.zeros_like(shift), atol=1e-7, rtol=0)


@settings(max_examples=15, deadline=None)
@given(seed=SEEDS, spread=st.floats(0.05, 0.4))
def test_never_larger_than_the_fit_at_the_middle_of_the_pixel_box(seed, spread):
    """The paper's centre: the middle of the axis-aligned box on the panorama."""
    directions = cloud(seed, spread)
    lon = torch.atan2(directions[..., 0], directions[..., 1])
    lat = (directions[..., 2] / directions.norm(dim=-1)).asin()
    # the box on the panorama turned so that the mean direction is its centre column
    mean = directions.sum(-2)
    mean_lon = torch.atan2(mean[:, 0], mean[:, 1])[:, None]
    apart = wrap_angle(lon - mean_lon)
    middle = mean_lon[:, 0] + (apart.amin(-1) + apart.amax(-1)) / 2
    centre = torch.stack((middle, (lat.amin(-1) + lat.amax(-1)) / 2), -1)
    turned = directions @ camera_from_turned(centre)
    width = 2 * torch.atan2(turned[..., 0], turned[..., 1]).abs().amax(-1)
    height = 2 * (turned[..., 2] / turned.norm(dim=-1)).asin().abs().amax(-1)
    paper = width * 2 * (height / 2).sin()
    # narrow clouds only: otherwise the box of the widest gap is another one
    narrow = (apart.amax(-1) - apart.amin(-1)) < 3
    ours = bfov_area(bfov_from_directions(directions))
    assert (ours <= paper * 1.01 + 1e-9)[narrow].all()


@pytest.mark.parametrize("lonlat", [(0.0, 0.0), (math.pi, 0.0), (3.0, 0.6), (0.3, -1.2)])
def test_finds_the_region_whose_border_is_given(lonlat):
    width, height = 0.8, 0.5
    x = torch.linspace(-0.5, 0.5, 41, dtype=torch.float64)
    end = torch.full_like(x, 0.5)
    turned = torch.cat(
        [torch.stack(p, -1) for p in ((x, end), (x, -end), (end, x), (-end, x))]
    ) * torch.tensor([width, height], dtype=torch.float64)
    centre = torch.tensor(lonlat, dtype=torch.float64)
    directions = direction_from_lonlat(turned) @ camera_from_turned(centre).T
    bfov = bfov_from_directions(directions)
    # the centre is found by a few recentrings: close to the exact one, not equal
    assert bfov_area(bfov) <= width * 2 * math.sin(height / 2) * 1.01
    apart = (direction_from_lonlat(bfov[:2]) @ direction_from_lonlat(centre)).clamp(-1, 1).acos()
    assert apart < 0.03


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_points_around_a_pole_get_a_region_over_it(up):
    lon = torch.arange(16, dtype=torch.float64) * (math.pi / 8)
    lat = torch.full_like(lon, up * (math.pi / 2 - 0.2))
    bfov = bfov_from_directions(direction_from_lonlat(torch.stack((lon, lat), -1)))
    assert bfov[1].item() == pytest.approx(up * math.pi / 2, abs=0.01)
    assert bfov[2].item() == pytest.approx(0.4, abs=0.02)
    assert bfov[3].item() == pytest.approx(0.4, abs=0.02)


def test_a_ring_around_the_horizon_is_full_width_and_flat():
    lon = torch.arange(360, dtype=torch.float64) * (math.pi / 180) - math.pi
    lonlat = torch.stack((lon, 0.1 * (5 * lon).sin()), -1)
    bfov = bfov_from_directions(direction_from_lonlat(lonlat))
    assert bfov[2] > 2 * math.pi - 0.04
    assert bfov[3].item() == pytest.approx(0.2, abs=0.02)


def test_a_strip_from_pole_to_pole_is_narrow():
    lat = torch.linspace(-math.pi / 2, math.pi / 2, 101)
    bfov = bfov_from_directions(
        direction_from_lonlat(torch.stack((torch.full_like(lat, 3.0), lat), -1))
    )
    torch.testing.assert_close(bfov, torch.tensor([3.0, 0.0, 0.0, math.pi]), atol=1e-5, rtol=0)


@pytest.mark.parametrize("lonlat", [(0.0, 0.0), (-math.pi, 0.3), (1.0, math.pi / 2), (2.0, -1.5)])
def test_one_point_has_no_size(lonlat):
    direction = direction_from_lonlat(torch.tensor([lonlat]))
    bfov = bfov_from_directions(3 * direction)
    assert (bfov[2:] < 1e-5).all()
    torch.testing.assert_close(direction_from_lonlat(bfov[:2]), direction[0], atol=1e-6, rtol=0)


def test_invalid_points_do_not_count_even_when_not_finite():
    directions = cloud(5, 0.3, points=12)
    valid = torch.ones(directions.shape[:-1], dtype=torch.bool)
    valid[:, 7:] = False
    directions[:, 7] = 0.0
    directions[:, 8] = math.nan
    torch.testing.assert_close(
        bfov_from_directions(directions, valid), bfov_from_directions(directions[:, :7])
    )


def test_refuses_nothing_to_fit_and_names_the_entry():
    directions = cloud(0, 0.1)
    valid = torch.ones(directions.shape[:-1], dtype=torch.bool)
    valid[3] = False
    with pytest.raises(ValueError, match=r"no valid point in entry \(3,\)"):
        bfov_from_directions(directions, valid)
    with pytest.raises(ValueError, match="no valid point"):
        bfov_from_directions(directions[:, :0])
    directions[2, 4] = 0.0
    with pytest.raises(ValueError, match="not all zero"):
        bfov_from_directions(directions)
    directions[2, 4] = math.nan
    with pytest.raises(ValueError, match="expected finite"):
        bfov_from_directions(directions)


def test_no_batch_entries_give_no_regions():
    assert bfov_from_directions(torch.ones(0, 5, 3)).shape == (0, 4)
    assert bfov_area(torch.ones(0, 4)).shape == (0,)


def test_gradient_agrees_with_finite_differences():
    directions = cloud(11, 0.2, points=5, batch=1).requires_grad_()
    assert torch.autograd.gradcheck(bfov_from_directions, (directions,))


def test_gradient_is_finite_at_a_single_point_and_at_a_pole():
    directions = torch.tensor([[[0.0, 1.0, 0.0]], [[0.0, 0.0, 1.0]]], requires_grad=True)
    bfov_from_directions(directions).sum().backward()
    assert directions.grad is not None
    assert directions.grad.isfinite().all()


# --- containment and area ----------------------------------------------------------------------


def test_area_is_the_share_of_uniform_directions_contained():
    directions = uniform_directions(100_000)
    bfov = torch.tensor(
        [
            [0.0, 0.0, 0.5, 0.3],
            [3.1, 0.4, 1.0, 0.7],
            [-2.0, 1.4, 1.2, 1.0],
            [1.0, -0.8, 4.0, 2.0],
            [0.3, 0.5, 2 * math.pi, 1.0],
            [0.0, 1.0, 2 * math.pi, math.pi],
        ],
        dtype=torch.float64,
    )
    share = contained(bfov, directions.expand(6, -1, 3), 0.0).double().mean(-1)
    torch.testing.assert_close(share * 4 * math.pi, bfov_area(bfov), atol=1e-3, rtol=0)


def test_tolerance_is_an_angle_on_the_sphere():
    bfov = torch.tensor([[0.0, 0.0, 0.4, 2.0]])
    beside = direction_from_lonlat(torch.tensor([[0.21, 0.9]]))  # 0.01 in lon, 0.0062 as an angle
    assert not bfov_contains(bfov, beside).any()
    assert bfov_contains(bfov, beside, tolerance=0.007).all()
    assert not bfov_contains(bfov, beside, tolerance=0.005).any()


# --- contours ----------------------------------------------------------------------------------


def test_contour_may_leave_the_image_to_the_right():
    uv = torch.tensor([[1000.0, 200.0], [1060.0, 200.0], [1060.0, 260.0], [1000.0, 260.0]])
    wrapped = uv.clone()
    wrapped[:, 0] %= 1024
    torch.testing.assert_close(
        bfov_from_contour(uv, 512, 1024), bfov_from_contour(wrapped, 512, 1024), atol=1e-5, rtol=0
    )
    assert bfov_from_contour(uv, 512, 1024)[2] < 0.5


def test_contour_refuses_rows_outside_the_image():
    uv = torch.tensor([[10.0, 20.0], [10.0, 600.0]])
    with pytest.raises(ValueError, match=r"v = 600, expected 0 <= v <= 512"):
        bfov_from_contour(uv, 512, 1024)
    only_first = bfov_from_contour(uv, 512, 1024, torch.tensor([True, False]))
    assert (only_first[2:] < 1e-5).all()
