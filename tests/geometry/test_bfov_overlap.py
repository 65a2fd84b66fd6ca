"""Overlap of BFoVs: areas against directions counted on the sphere, IoU, NMS, union."""

import math
import time

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.geometry._angles import wrap_angle
from panoscene.geometry._bfov import bfov_area, bfov_contains
from panoscene.geometry._bfov_overlap import (
    bfov_intersection_area,
    bfov_iou,
    bfov_nms,
    bfov_union,
)
from panoscene.geometry._sphere import camera_from_turned, direction_from_lonlat

SEEDS = st.integers(0, 2**31)
LARGEST = torch.tensor([2 * math.pi, math.pi], dtype=torch.float64)


def random_bfov(generator: torch.Generator, count: int, largest: float = 1.0) -> torch.Tensor:
    """Return BFoVs centred anywhere on the sphere, up to a fraction of the full size."""
    random = torch.rand(count, 4, generator=generator, dtype=torch.float64)
    lon, lat = (random[:, 0] - 0.5) * 2 * math.pi, (2 * random[:, 1] - 1).asin()
    return torch.cat((torch.stack((lon, lat), -1), random[:, 2:] * LARGEST * largest), -1)


def uniform_directions(generator: torch.Generator, count: int) -> torch.Tensor:
    random = torch.randn(count, 3, generator=generator, dtype=torch.float64)
    return random / random.norm(dim=-1, keepdim=True)


def membership(bfov: torch.Tensor, directions: torch.Tensor, tolerance: float = 0.0):
    shape = (bfov.shape[0], directions.shape[0])
    bfov, directions = bfov[:, None].expand(*shape, 4), directions.expand(*shape, 3)
    return bfov_contains(bfov, directions, tolerance)


def inside_directions(bfov: torch.Tensor, generator: torch.Generator, count: int) -> torch.Tensor:
    """Return directions inside each BFoV, batch x count x 3."""
    random = torch.rand(bfov.shape[0], count, 2, generator=generator, dtype=bfov.dtype)
    turned = direction_from_lonlat((random - 0.5) * bfov[:, None, 2:])
    return turned @ camera_from_turned(bfov[:, :2]).transpose(-1, -2)


# --- intersection area -------------------------------------------------------------------------


@pytest.mark.parametrize("largest", [1.0, 0.5, 0.25])
def test_area_agrees_with_directions_counted_on_the_sphere(generator, largest):
    a, b = random_bfov(generator, 8, largest), random_bfov(generator, 8, largest)
    if largest == 1.0:
        a[0, 2:], a[1, 2], b[0, 3], b[1, 2] = LARGEST, 2 * math.pi, math.pi, 2 * math.pi
        a[2, 1], b[2, 1] = math.pi / 2, -math.pi / 2
    count = 100_000
    directions = uniform_directions(generator, count)
    in_a, in_b = membership(a, directions).double(), membership(b, directions).double()
    share = in_a @ in_b.T / count
    noise = (share * (1 - share) / count).sqrt()
    difference = bfov_intersection_area(a, b) / (4 * math.pi) - share
    assert (difference.abs() <= 4.5 * noise + 1e-5).all()


@settings(max_examples=25, deadline=None)
@given(seed=SEEDS, largest=st.floats(0.02, 1.0), angle=st.floats(-10.0, 10.0))
def test_iou_is_symmetric_bounded_and_does_not_see_a_common_turn(seed, largest, angle):
    generator = torch.Generator().manual_seed(seed)
    a, b = random_bfov(generator, 6, largest), random_bfov(generator, 5, largest)
    b[0] = a[0]
    b[1] = a[1] * 0.999
    iou = bfov_iou(a, b)
    assert ((iou >= 0) & (iou <= 1)).all()
    torch.testing.assert_close(iou, bfov_iou(b, a).T, atol=1e-5, rtol=0)
    turn = torch.tensor([angle, 0, 0, 0], dtype=torch.float64)
    torch.testing.assert_close(bfov_iou(a + turn, b + turn), iou, atol=1e-6, rtol=0)


@settings(max_examples=20, deadline=None)
@given(seed=SEEDS, dtype=st.sampled_from([torch.float32, torch.float64]))
def test_iou_with_itself_is_exactly_one(seed, dtype):
    bfov = random_bfov(torch.Generator().manual_seed(seed), 6).to(dtype)
    bfov[0, 2:] = 0.0  # no area at all
    bfov[1, 2:] = LARGEST.to(dtype)
    bfov[2, 0] = -math.pi
    assert (bfov_iou(bfov, bfov).diagonal() == 1).all()
    # the same regions, written one turn later
    again = bfov + torch.tensor([2 * math.pi, 0, 0, 0], dtype=dtype)
    diagonal = bfov_iou(bfov, again).diagonal()[1:]
    torch.testing.assert_close(diagonal, torch.ones_like(diagonal), atol=1e-4, rtol=0)


def test_on_the_horizon_overlap_is_that_of_intervals():
    """Borders run along each other here: the hard case for exact arcs."""
    lon = torch.tensor([0.0, 0.1, 0.4, 0.39, math.pi, -math.pi, 3.0], dtype=torch.float64)
    size = torch.tensor([0.4, 0.3], dtype=torch.float64)
    bfov = torch.cat((torch.stack((lon, torch.zeros(7).double()), -1), size.expand(7, 2)), -1)
    common = (0.4 - wrap_angle(lon[:, None] - lon).abs()).clamp_min(0)
    expected = common * 2 * math.sin(0.15)
    torch.testing.assert_close(bfov_intersection_area(bfov, bfov), expected, atol=1e-6, rtol=0)
    low = bfov.clone()
    low[:, 3] = 0.2  # nested in height, sides in common
    torch.testing.assert_close(
        bfov_intersection_area(bfov, low), common * 2 * math.sin(0.1), atol=1e-6, rtol=0
    )


def test_tiles_cover_the_sphere_once():
    """Twelve lunes and a band share all their borders and add up exactly."""
    step = 2 * math.pi / 12
    lon = torch.arange(12, dtype=torch.float64) * step - math.pi
    zero = torch.zeros_like(lon)
    lunes = torch.stack((lon, zero, zero + step, zero + math.pi), -1)
    shared = bfov_intersection_area(lunes, lunes)
    expected = torch.eye(12, dtype=torch.float64) * 4 * math.pi / 12
    torch.testing.assert_close(shared, expected, atol=1e-5, rtol=0)
    anything = random_bfov(torch.Generator().manual_seed(1), 20)
    total = bfov_intersection_area(anything, lunes).sum(-1)
    torch.testing.assert_close(total, bfov_area(anything), atol=5e-5, rtol=0)


def test_nested_crossing_and_disjoint():
    bfov = torch.tensor(
        [
            [0.0, 0.0, 1.0, 1.0],
            [0.1, 0.1, 0.2, 0.2],  # inside the first
            [0.0, 0.0, 2.0, 0.2],  # a cross with the first
            [2.0, 0.0, 0.4, 0.4],  # apart from all
        ]
    )
    shared = bfov_intersection_area(bfov, bfov)
    area = bfov_area(bfov)
    torch.testing.assert_close(shared[0, 1], area[1])
    torch.testing.assert_close(shared[0, 2], torch.tensor(1.0 * 2 * math.sin(0.1)))
    assert (shared[3, :3] == 0).all()
    assert (shared[:3, 3] == 0).all()


def test_everything_contains_everything():
    full = torch.tensor([[0.7, 0.3, 2 * math.pi, math.pi]], dtype=torch.float64)
    some = random_bfov(torch.Generator().manual_seed(2), 20)
    for shared in (bfov_intersection_area(full, some)[0], bfov_intersection_area(some, full)[:, 0]):
        torch.testing.assert_close(shared, bfov_area(some), atol=3e-5, rtol=0)


def test_no_regions_and_bad_regions():
    some, none = torch.ones(3, 4), torch.ones(0, 4)
    assert bfov_iou(some, none).shape == (3, 0)
    assert bfov_iou(none, some).shape == (0, 3)
    bad = some.clone()
    bad[1, 3] = -0.1
    with pytest.raises(ValueError, match=r"b: found .* at index 1, expected finite"):
        bfov_iou(some, bad)
    bad[1, 3] = math.nan
    with pytest.raises(ValueError, match=r"a: found .* at index 1"):
        bfov_iou(bad, some)
    bad[1, 3] = 3.5
    with pytest.raises(ValueError, match="height <= pi"):
        bfov_intersection_area(bad, some)


def test_a_hundred_by_a_hundred_is_fast():
    generator = torch.Generator().manual_seed(0)
    a, b = (random_bfov(generator, 100, 0.3).float() for _ in range(2))
    bfov_iou(a, b)
    start = time.perf_counter()
    bfov_iou(a, b)
    assert time.perf_counter() - start < 2.0  # about 0.1 s alone on one core; CI machines vary


# --- suppression -------------------------------------------------------------------------------


def greedy(iou: torch.Tensor, score: torch.Tensor, threshold: float) -> list[int]:
    """Return what the textbook loop keeps."""
    kept: list[int] = []
    for index in score.argsort(descending=True, stable=True).tolist():
        if all(iou[index, other] <= threshold for other in kept):
            kept.append(index)
    return kept


@settings(max_examples=15, deadline=None)
@given(seed=SEEDS, threshold=st.floats(0.0, 0.8))
def test_nms_is_greedy_suppression(seed, threshold):
    generator = torch.Generator().manual_seed(seed)
    bfov = random_bfov(generator, 25, 0.4)
    score = torch.randint(0, 10, (25,), generator=generator).double() / 10  # with ties
    kept = bfov_nms(bfov, score, iou_threshold=threshold)
    assert kept.tolist() == greedy(bfov_iou(bfov, bfov), score, threshold)


def test_nms_settles_chains_of_any_length():
    # each overlaps only its neighbours: every second one stays
    lon = torch.arange(20) * 0.1
    bfov = torch.stack((lon, lon * 0, lon * 0 + 0.15, lon * 0 + 0.1), -1)
    kept = bfov_nms(bfov, torch.linspace(1, 0, 20), iou_threshold=0.1)
    assert kept.tolist() == list(range(0, 20, 2))


def test_nms_works_across_the_seam_and_within_categories():
    bfov = torch.tensor([[3.1, 0.0, 0.4, 0.2], [-3.1, 0.0, 0.4, 0.2], [3.12, 0.0, 0.4, 0.2]])
    score = torch.tensor([0.5, 0.9, 0.7])
    assert bfov_nms(bfov, score, iou_threshold=0.5).tolist() == [1]
    category = torch.tensor([7, 3, 7])
    assert bfov_nms(bfov, score, category, iou_threshold=0.5).tolist() == [1, 2]
    assert bfov_nms(bfov[:0], score[:0], iou_threshold=0.5).tolist() == []


def test_nms_refuses_bad_scores_and_thresholds():
    bfov = torch.ones(2, 4)
    with pytest.raises(ValueError, match=r"iou_threshold: found 1\.5"):
        bfov_nms(bfov, torch.ones(2), iou_threshold=1.5)
    with pytest.raises(ValueError, match="score: found a value that is not finite"):
        bfov_nms(bfov, torch.tensor([0.5, math.nan]), iou_threshold=0.5)


# --- union -------------------------------------------------------------------------------------


@settings(max_examples=20, deadline=None)
@given(
    seed=SEEDS,
    largest_and_tolerance=st.sampled_from([(0.02, 2e-4), (0.2, 2e-4), (1.0, 3e-2)]),
    regions=st.integers(1, 4),
)
def test_union_contains_all_regions(seed, largest_and_tolerance, regions):
    largest, tolerance = largest_and_tolerance
    generator = torch.Generator().manual_seed(seed)
    bfov = random_bfov(generator, 5 * regions, largest)
    union = bfov_union(bfov.reshape(5, regions, 4))
    points = inside_directions(bfov, generator, 400).reshape(5, -1, 3)
    within = bfov_contains(union[:, None].expand(*points.shape[:2], 4), points, tolerance)
    assert within.all()
    assert (bfov_area(union) <= 4 * math.pi + 1e-6).all()


@settings(max_examples=20, deadline=None)
@given(seed=SEEDS)
def test_union_of_one_region_is_that_region(seed):
    bfov = random_bfov(torch.Generator().manual_seed(seed), 8, 0.6)
    torch.testing.assert_close(bfov_union(bfov[:, None]), bfov)
    inner = bfov * torch.tensor([1.0, 1.0, 0.5, 0.5], dtype=torch.float64)
    torch.testing.assert_close(bfov_union(torch.stack((inner, bfov), 1)), bfov)


def test_two_halves_cut_at_the_seam_become_one():
    left = torch.tensor([math.pi - 0.1, 0.05, 0.2, 0.3])
    right = torch.tensor([-math.pi + 0.15, 0.05, 0.3, 0.3])
    union = bfov_union(torch.stack((left, right)))
    whole = torch.tensor([0.05 - math.pi, 0.05, 0.5, 0.3])
    torch.testing.assert_close(union, whole, atol=5e-3, rtol=0)


@settings(max_examples=15, deadline=None)
@given(seed=SEEDS, angle=st.floats(-7.0, 7.0))
def test_union_turns_with_its_regions(seed, angle):
    bfov = random_bfov(torch.Generator().manual_seed(seed), 12, 0.15).reshape(4, 3, 4)
    turn = torch.tensor([angle, 0, 0, 0], dtype=torch.float64)
    before, after = bfov_union(bfov), bfov_union(bfov + turn)
    torch.testing.assert_close(bfov_area(after), bfov_area(before), atol=1e-6, rtol=1e-3)


def test_union_skips_invalid_regions_and_refuses_none():
    bfov = torch.tensor([[0.1, 0.2, 0.3, 0.4], [math.nan, 0.0, 9.0, 9.0]])
    torch.testing.assert_close(bfov_union(bfov, torch.tensor([True, False])), bfov[0])
    with pytest.raises(ValueError, match=r"no valid region in entry \(1,\)"):
        bfov_union(bfov[:, None], torch.tensor([[True], [False]]))
    with pytest.raises(ValueError, match="expected finite"):
        bfov_union(bfov)
