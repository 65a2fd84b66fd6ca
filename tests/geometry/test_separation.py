"""Separating axes: the closed form against literal corner projections and other oracles."""

import math

import numpy as np
import pytest
import shapely
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor

from panoscene.geometry._boxes import box_corners, box_footprint
from panoscene.geometry._oriented_boxes import OrientedBoxes
from panoscene.geometry._separation import (
    boxes_collide,
    collision_error,
    gap,
    penetration_depth,
    separation_margins,
    separation_weights,
    touch_error,
)

DTYPES = pytest.mark.parametrize("dtype", [torch.float32, torch.float64])


def random_boxes(count: int, generator: torch.Generator, dtype: torch.dtype) -> OrientedBoxes:
    numbers = torch.rand(count, 7, generator=generator, dtype=torch.float64).to(dtype)
    return OrientedBoxes(
        centre=numbers[:, :3] * 3, size=numbers[:, 3:6] * 2 + 0.05, yaw=numbers[:, 6] * 10 - 5
    )


def cube(size: float, x: float = 0.0, yaw: float = 0.0) -> OrientedBoxes:
    return OrientedBoxes(
        torch.tensor([x, 0.0, 0.0], dtype=torch.float64),
        torch.full((3,), size, dtype=torch.float64),
        torch.tensor(yaw, dtype=torch.float64),
    )


def projected_intervals(a: OrientedBoxes, b: OrientedBoxes) -> tuple[Tensor, ...]:
    """Return a_min, a_max, b_min, b_max on the six axes, from the corners, as the paper says."""
    axes: list[Tensor] = []
    up = torch.tensor([0.0, 0.0, 1.0], dtype=a.yaw.dtype).expand(*a.centre.shape)
    for boxes in (a, b):
        cos, sin, zero = torch.cos(boxes.yaw), torch.sin(boxes.yaw), torch.zeros_like(boxes.yaw)
        axes += [torch.stack([cos, sin, zero], -1), torch.stack([-sin, cos, zero], -1)]
    directions = torch.stack([*axes, up, up], dim=-2)
    projected = [box_corners(boxes) @ directions.transpose(-1, -2) for boxes in (a, b)]
    return tuple(f(p, dim=-2) for p in projected for f in (torch.amin, torch.amax))


@DTYPES
def test_margins_are_the_papers_separation_distances(
    generator: torch.Generator, dtype: torch.dtype
) -> None:
    a, b = (random_boxes(500, generator, dtype) for _ in range(2))
    a_min, a_max, b_min, b_max = projected_intervals(a, b)
    distance = torch.minimum((a_max - b_min).abs(), (a_min - b_max).abs())
    overlap = (a_min <= b_max) & (b_min <= a_max)
    margins = separation_margins(a, b)
    assert 0.2 < overlap.double().mean() < 0.95
    torch.testing.assert_close(margins, torch.where(overlap, distance, -distance))
    collide = overlap.all(-1)
    zero = torch.zeros((), dtype=dtype)
    assert 0.02 < collide.double().mean() < 0.6
    assert torch.equal(boxes_collide(a, b), collide)
    torch.testing.assert_close(collision_error(a, b), torch.where(collide, distance.sum(-1), zero))
    gaps = torch.where(overlap, zero, distance).sum(-1)
    torch.testing.assert_close(touch_error(a, b), torch.where(collide, zero, gaps))


def test_the_numbers_of_the_release() -> None:
    assert collision_error(cube(2.0), cube(1.0)) == 9.0
    assert touch_error(cube(2.0), cube(1.0)) == 0.0
    assert touch_error(cube(2.0), cube(1.0, x=4.0)) == 5.0
    assert collision_error(cube(2.0), cube(1.0, x=4.0)) == 0.0


def test_without_duplicates_parallel_axes_count_once() -> None:
    for yaw in (0.0, math.pi / 2, math.pi, -math.pi / 2):
        once = collision_error(cube(2.0), cube(1.0, yaw=yaw), duplicate_axes=False)
        torch.testing.assert_close(once, torch.tensor(4.5, dtype=torch.float64))
        once = touch_error(cube(2.0), cube(1.0, x=4.0, yaw=yaw), duplicate_axes=False)
        torch.testing.assert_close(once, torch.tensor(2.5, dtype=torch.float64))
    weights = separation_weights(cube(1.0), cube(1.0, yaw=math.pi / 4))
    assert weights.tolist() == [1.0, 1.0, 1.0, 1.0, 0.5, 0.5]


def test_the_variant_without_duplicates_is_continuous_at_parallel_boxes() -> None:
    parallel = collision_error(cube(2.0), cube(1.0), duplicate_axes=False)
    nearly = collision_error(cube(2.0), cube(1.0, yaw=1e-9), duplicate_axes=False)
    torch.testing.assert_close(parallel, nearly, atol=1e-8, rtol=0.0)


@pytest.mark.parametrize("duplicate_axes", [True, False])
def test_errors_agree_in_both_orders_and_in_turned_rooms(
    generator: torch.Generator, duplicate_axes: bool
) -> None:
    boxes = random_boxes(20, generator, torch.float64)
    cos, sin = math.cos(0.7), math.sin(0.7)
    turn = torch.tensor([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]], dtype=torch.float64)
    moved = OrientedBoxes(boxes.centre @ turn.T + 5.0, boxes.size, boxes.yaw + 0.7)
    for error in (collision_error, touch_error):
        pairs = error(boxes[:, None], boxes[None, :], duplicate_axes=duplicate_axes)
        again = error(moved[:, None], moved[None, :], duplicate_axes=duplicate_axes)
        assert pairs.shape == (20, 20)
        torch.testing.assert_close(pairs, pairs.T)
        torch.testing.assert_close(pairs, again)


def test_collision_agrees_with_shapely(generator: torch.Generator) -> None:
    boxes = random_boxes(60, generator, torch.float64)
    flat = OrientedBoxes(boxes.centre * torch.tensor([1.0, 1.0, 0.0]), boxes.size, boxes.yaw)
    polygons = np.asarray(shapely.polygons(box_footprint(flat).numpy()))
    expected = shapely.intersects(polygons[:, None], polygons[None, :])
    assert (boxes_collide(flat[:, None], flat[None, :]).numpy() == expected).all()
    distance = shapely.distance(polygons[:, None], polygons[None, :])
    found = gap(flat[:, None], flat[None, :])
    torch.testing.assert_close(found, torch.as_tensor(distance), atol=1e-12, rtol=1e-9)


def test_gap_adds_the_vertical_distance() -> None:
    lifted = OrientedBoxes(
        torch.tensor([4.5, 0.0, 5.5], dtype=torch.float64),
        torch.ones(3, dtype=torch.float64),
        torch.tensor(0.0, dtype=torch.float64),
    )
    assert gap(cube(2.0), lifted) == 5.0
    assert gap(cube(2.0), cube(1.0, x=1.0)) == 0.0
    assert gap(cube(2.0), cube(1.0, x=1.5)) == 0.0
    above = OrientedBoxes(lifted.centre * torch.tensor([0.0, 0.0, 1.0]), lifted.size, lifted.yaw)
    assert gap(cube(2.0), above) == 4.0


@given(yaw=st.floats(-4, 4), x=st.floats(-0.9, 0.9), width=st.floats(0.1, 2.0))
def test_moving_by_the_penetration_depth_separates(yaw: float, x: float, width: float) -> None:
    a = cube(2.0, yaw=0.4)
    b = OrientedBoxes(
        torch.tensor([x, 0.2, 0.1], dtype=torch.float64),
        torch.tensor([width, 0.7, 0.9], dtype=torch.float64),
        torch.tensor(yaw, dtype=torch.float64),
    )
    depth = penetration_depth(a, b)
    assert depth > 0
    every_way = torch.linspace(0, 2 * math.pi, 721, dtype=torch.float64)
    quarters = torch.arange(4, dtype=torch.float64) * (math.pi / 2)
    along_axes = torch.cat([a.yaw + quarters, b.yaw + quarters])

    def moved(angles: Tensor, length: Tensor) -> OrientedBoxes:
        step = torch.stack([angles.cos(), angles.sin(), 0 * angles], -1) * length
        count = len(angles)
        return OrientedBoxes(b.centre + step, b.size.expand(count, 3), b.yaw.expand(count))

    first = OrientedBoxes(a.centre[None], a.size[None], a.yaw[None])
    assert boxes_collide(first, moved(every_way, depth * 0.999)).all()
    clearance = separation_margins(a, b)[4]  # or over the top
    free = ~boxes_collide(first, moved(along_axes, depth + 1e-9))
    assert free.any() or clearance == depth


@pytest.mark.parametrize(
    ("distance", "tolerance", "collide"),
    [
        (0.95, 0.0, True),
        (0.95, 0.04, True),
        (0.95, 0.06, False),
        (1.0, 0.0, False),
        (1.05, 0.0, False),
        (1.05, -0.04, False),
        (1.05, -0.06, True),
    ],
)
def test_tolerance_is_taken_off_every_extent(
    distance: float, tolerance: float, collide: bool
) -> None:
    a, b = cube(1.0), cube(1.0, x=distance)
    assert bool(boxes_collide(a, b, tolerance)) is collide
    assert bool(collision_error(a, b, tolerance=tolerance) > 0) is collide
    assert bool(penetration_depth(a, b, tolerance) > 0) is collide
    expected = max(distance - (1.0 - tolerance), 0.0) * 2
    assert math.isclose(touch_error(a, b, tolerance=tolerance), expected, abs_tol=1e-12)


def test_shrinking_keeps_thin_boxes() -> None:
    thin = OrientedBoxes(torch.zeros(3), torch.tensor([1.0, 0.001, 0.05]), torch.tensor(0.0))
    margins = separation_margins(thin, thin)
    assert collision_error(thin, thin) == margins.sum()
    assert math.isclose(
        collision_error(thin, thin, tolerance=0.1), 2 * (0.9 + 0.001 + 0.01), rel_tol=1e-6
    )


@pytest.mark.parametrize("duplicate_axes", [True, False])
def test_gradients(generator: torch.Generator, duplicate_axes: bool) -> None:
    a, b = (random_boxes(3, generator, torch.float64) for _ in range(2))
    near = OrientedBoxes(a.centre + 0.1 * (b.centre - a.centre), b.size, b.yaw)

    def errors(*fields: Tensor) -> tuple[Tensor, ...]:
        first, second = OrientedBoxes(*fields[:3]), OrientedBoxes(*fields[3:])
        return (
            collision_error(first, second, duplicate_axes=duplicate_axes, tolerance=0.02),
            touch_error(first, second, duplicate_axes=duplicate_axes),
            penetration_depth(first, second),
            gap(first, second),
        )

    for other in (near, b):
        fields = (a.centre, a.size, a.yaw, other.centre, other.size, other.yaw)
        torch.autograd.gradcheck(errors, tuple(f.clone().requires_grad_() for f in fields))


def test_gradients_are_finite_for_identical_and_touching_boxes() -> None:
    for other in (cube(1.0), cube(1.0, x=1.0), cube(0.0), cube(1.0, x=3.0)):
        centre, size = other.centre.clone().requires_grad_(), other.size.clone().requires_grad_()
        yaw = other.yaw.clone().requires_grad_()
        moving = OrientedBoxes(centre, size, yaw)
        here = cube(1.0)
        total = collision_error(here, moving) + touch_error(here, moving) + gap(here, moving)
        (total + penetration_depth(here, moving)).backward()
        for leaf in (centre, size, yaw):
            assert leaf.grad is not None
            assert leaf.grad.isfinite().all()


def test_no_boxes() -> None:
    none = OrientedBoxes(torch.zeros(0, 3), torch.zeros(0, 3), torch.zeros(0))
    assert collision_error(none[:, None], none[None, :]).shape == (0, 0)
    assert gap(none, none).shape == (0,)
