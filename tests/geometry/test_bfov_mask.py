"""BFoV fits to masks: whole pixels, rolling, seam, poles, tiny and empty masks."""

import math
import time

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
    bfov_from_mask,
)
from panoscene.geometry._sphere import direction_from_lonlat, direction_from_pixel

SEEDS = st.integers(0, 2**31)


def contained(bfov: torch.Tensor, directions: torch.Tensor, tolerance: float) -> torch.Tensor:
    return bfov_contains(bfov.expand(*directions.shape[:-1], 4), directions, tolerance)


def random_masks(seed: int, height: int, width: int, count: int = 3) -> torch.Tensor:
    """Return irregular blobs: random regions, each with a bite taken out."""
    generator = torch.Generator().manual_seed(seed)
    uv = torch.stack(
        torch.meshgrid(torch.arange(width) + 0.5, torch.arange(height) + 0.5, indexing="xy"), -1
    )
    directions = direction_from_pixel(uv, height, width)
    random = torch.rand(count, 5, generator=generator)
    centre = torch.stack(((random[:, 0] - 0.5) * 6.28, (random[:, 1] - 0.5) * 3.1), -1)
    bfov = torch.cat((centre, 0.3 + random[:, 2:4] * 1.2), -1)
    shape = (count, height, width)
    mask = bfov_contains(bfov[:, None, None].expand(*shape, 4), directions.expand(*shape, 3))
    bite = direction_from_lonlat(centre + 0.1)
    return mask & ((directions.expand(*shape, 3) @ bite[:, None, :, None]).squeeze(-1) < 0.99)


def pixel_corners(mask: torch.Tensor) -> torch.Tensor:
    """Return the directions of the four corners of all pixels of one mask."""
    rows, columns = mask.nonzero().unbind(-1)
    uv = torch.stack((columns, rows), -1)[:, None] + torch.tensor([[0, 0], [1, 0], [0, 1], [1, 1]])
    return direction_from_pixel(uv.flatten(0, 1).double(), *mask.shape)


@settings(max_examples=8, deadline=None)
@given(seed=SEEDS, size=st.sampled_from([(64, 128), (260, 64), (33, 77)]))
def test_mask_region_contains_whole_pixels_and_is_tight(seed, size):
    for mask in random_masks(seed, *size):
        bfov = bfov_from_mask(mask).double()
        corners = pixel_corners(mask)
        assert contained(bfov, corners, 1e-4).all()
        # nearly as small as the fit to the corners of all pixels; less so around a pole, where
        # pixels are thin slices and coarse pictures have few of them
        larger = 1.15 if abs(bfov[1]) < 1.3 else 1.4
        assert bfov_area(bfov) <= bfov_area(bfov_from_directions(corners)) * larger + 1e-3


@settings(max_examples=15, deadline=None)
@given(seed=SEEDS, columns=st.integers(-200, 200))
def test_rolled_mask_has_the_shifted_region(seed, columns):
    masks = random_masks(seed, 64, 128)
    before = bfov_from_mask(masks)
    after = bfov_from_mask(masks.roll(columns, -1))
    # nearly equal candidates, less than 1 % apart, may change places by rounding
    torch.testing.assert_close(bfov_area(after), bfov_area(before), atol=1e-4, rtol=1.5e-2)
    # away from the poles nothing is left to chance
    calm = before[:, 1].abs() + before[:, 3] / 2 < 1.4
    torch.testing.assert_close(after[calm, 1:], before[calm, 1:], atol=2e-3, rtol=0)
    shift = wrap_angle(after[:, 0] - before[:, 0] - columns * 2 * math.pi / 128)
    assert (shift[calm].abs() < 2e-3).all()


def test_mask_across_the_seam_rolls_exactly():
    mask = torch.zeros(64, 128, dtype=torch.bool)
    mask[20:40, 50:70] = True
    mask[25:30, 55:60] = False
    before, after = bfov_from_mask(mask), bfov_from_mask(mask.roll(64, -1))
    torch.testing.assert_close(after[1:], before[1:], atol=1e-5, rtol=0)
    assert abs(abs(float(after[0] - before[0])) - math.pi) < 1e-5


def test_single_pixels_have_their_own_size():
    height, width = 64, 128
    pixel = 2 * math.pi / width
    mask = torch.zeros(3, height, width, dtype=torch.bool)
    mask[0, 32, 0] = mask[1, 10, 127] = mask[2, 0, 5] = True
    bfov = bfov_from_mask(mask)
    torch.testing.assert_close(bfov[:2, 3], torch.full((2,), pixel), atol=0, rtol=0.05)
    # the lower edge of the pixel is its longest
    lower = math.cos(math.pi / 2 - 11 * pixel)
    torch.testing.assert_close(bfov[:2, 2], torch.tensor([pixel, lower * pixel]), atol=0, rtol=0.05)
    assert bfov[2, 1] > math.pi / 2 - pixel  # a sliver beside the zenith
    assert bfov[2, 2] < pixel


def test_masks_all_the_way_round_and_over_the_poles():
    mask = torch.zeros(5, 64, 128, dtype=torch.bool)
    mask[0] = True
    mask[1, 28:36] = True  # a band on the horizon
    mask[2, :8] = True  # a cap at the zenith
    mask[3, -8:] = True  # a cap at the nadir
    mask[4, :, 60:68] = True  # a strip from pole to pole
    bfov = bfov_from_mask(mask)
    quarter = math.pi / 2
    expected = torch.tensor(
        [
            [0.0, 4 * quarter, 2 * quarter],
            [0.0, 4 * quarter, math.pi / 8],
            [quarter, math.pi / 4, math.pi / 4],
            [-quarter, math.pi / 4, math.pi / 4],
            [0.0, math.pi / 8, 2 * quarter],
        ]
    )
    torch.testing.assert_close(bfov[:, 1:], expected, atol=1e-3, rtol=0)
    assert bfov[4, 0].abs() < 1e-3


@pytest.mark.parametrize("size", [(1, 2), (2, 4), (8, 16)])
def test_tiny_masks_contain_all_their_pixel_borders(size):
    generator = torch.Generator().manual_seed(0)
    masks = torch.rand(20, *size, generator=generator) < 0.3
    for mask in masks[masks.any(-1).any(-1)]:
        rows, columns = mask.nonzero().unbind(-1)
        fine = torch.linspace(0, 1, 9)
        steps = torch.cartesian_prod(fine, fine)
        uv = torch.stack((columns, rows), -1)[:, None] + steps
        directions = direction_from_pixel(uv.flatten(0, 1), *size)
        assert contained(bfov_from_mask(mask), directions, 5e-3).all()


def test_batches_of_any_shape_equal_single_masks():
    masks = random_masks(4, 48, 96, count=6)
    batched = bfov_from_mask(masks.reshape(2, 3, 48, 96))
    single = torch.stack([bfov_from_mask(mask) for mask in masks])
    torch.testing.assert_close(batched.flatten(0, 1), single)


@pytest.mark.parametrize(("column", "row"), [(500, 250), (1020, 120), (5, 400)])
def test_agrees_with_the_contour_of_the_mask(column, row):
    mask = torch.zeros(512, 1024, dtype=torch.bool)
    columns = torch.arange(column - 20, column + 20) % 1024
    mask[row - 10 : row + 10, columns] = True
    u = torch.arange(-20.0, 20.25, 0.25) + column
    v = torch.arange(-10.0, 10.25, 0.25) + row
    border = torch.cat([torch.cartesian_prod(u, v[[0, -1]]), torch.cartesian_prod(u[[0, -1]], v)])
    torch.testing.assert_close(
        bfov_from_mask(mask), bfov_from_contour(border, 512, 1024), atol=2e-3, rtol=0
    )


def test_columns_that_bulge_past_their_ends_are_contained():
    """A strip over the zenith, seen from a centre at 45 degrees: lat' peaks inside its columns."""
    mask = torch.zeros(3, 64, 128, dtype=torch.bool)
    mask[0, :40, 50:78] = True
    mask[0, :20] = True
    mask[1, 5:60, 60:68] = mask[1, 5:12, :] = True
    mask[2, 2:62, 20:108] = True
    for one in mask:
        assert contained(bfov_from_mask(one).double(), pixel_corners(one), 1e-4).all()


def test_no_masks_give_no_regions():
    assert bfov_from_mask(torch.ones(0, 8, 16, dtype=torch.bool)).shape == (0, 4)


def test_empty_mask_is_refused_by_its_index():
    masks = torch.ones(2, 3, 8, 16, dtype=torch.bool)
    masks[1, 2] = False
    with pytest.raises(ValueError, match=r"no pixel in mask \(1, 2\)"):
        bfov_from_mask(masks)
    with pytest.raises(ValueError, match="expected at least 1 x 1"):
        bfov_from_mask(torch.ones(0, 16, dtype=torch.bool))


def test_twenty_full_size_masks_are_fast():
    masks = torch.zeros(20, 512, 1024, dtype=torch.bool)
    masks[:, 100:300, :150] = masks[:, 150:250, -100:] = True
    bfov_from_mask(masks)
    start = time.perf_counter()
    bfov_from_mask(masks)
    assert time.perf_counter() - start < 1.0  # about 0.05 s alone on one core; CI machines vary
