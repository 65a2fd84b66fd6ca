"""Intersection area, volume and IoU against shapely and manifold3d, and their gradients."""

import math
import time

import manifold3d
import numpy as np
import pytest
import shapely
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor

from panoscene.geometry._boxes import box_footprint, box_volume
from panoscene.geometry._oriented_boxes import OrientedBoxes
from panoscene.geometry._overlap import (
    box_intersection_volume,
    box_iou,
    box_nms,
    paired_box_iou,
    paired_intersection_volume,
    rectangle_intersection_area,
)

DTYPES = pytest.mark.parametrize("dtype", [torch.float32, torch.float64])


def random_boxes(
    count: int, generator: torch.Generator, dtype: torch.dtype, kind: str = "any"
) -> OrientedBoxes:
    numbers = torch.rand(count, 7, generator=generator, dtype=torch.float64)
    centre, size, yaw = numbers[:, :3] * 4 - 2, numbers[:, 3:6] * 3 + 0.05, numbers[:, 6] * 7 - 3.5
    if kind == "thin":
        size[:, 0] = 1e-3
    if kind == "large":
        size *= 30
    if kind in {"aligned", "nearly aligned"}:  # on a coarse grid: many edges coincide
        centre, size = (centre * 2).round() / 2, (size * 2 + 0.6).round() / 2
        turns = (yaw * 2).round()
        off = 10 ** (-12 * numbers[:, 0]) if kind == "nearly aligned" else 0.0
        yaw = turns * (math.pi / 2) + off * (numbers[:, 1] - 0.5)
    return OrientedBoxes(centre.to(dtype), size.to(dtype), yaw.to(dtype))


def polygons(boxes: OrientedBoxes) -> np.ndarray:
    exact = OrientedBoxes(boxes.centre.double(), boxes.size.double(), boxes.yaw.double())
    return np.asarray(shapely.polygons(box_footprint(exact).numpy()))


def one_box(*numbers: float, dtype: torch.dtype = torch.float64) -> OrientedBoxes:
    values = torch.tensor(numbers, dtype=dtype)
    return OrientedBoxes(values[:3], values[3:6], values[6])


@DTYPES
@pytest.mark.parametrize("kind", ["any", "thin", "large", "aligned", "nearly aligned"])
def test_area_agrees_with_shapely(
    generator: torch.Generator, dtype: torch.dtype, kind: str
) -> None:
    a, b = random_boxes(80, generator, dtype, kind), random_boxes(80, generator, dtype, kind)
    found = rectangle_intersection_area(a[:, None], b[None, :])
    first, second = polygons(a), polygons(b)
    area = shapely.area(shapely.intersection(first[:, None], second[None, :]))
    smaller = np.minimum(shapely.area(first)[:, None], shapely.area(second)[None, :])
    assert (area > 0).mean() > 0.05
    relative = np.abs(found.double().numpy() - area) / smaller
    assert relative.max() < (5e-6 if dtype == torch.float32 else 1e-12)
    assert found.dtype == dtype
    torch.testing.assert_close(
        found, rectangle_intersection_area(b[:, None], a[None, :]).T, rtol=1e-5, atol=1e-5
    )


@DTYPES
@pytest.mark.parametrize("yaw", [0.0, 0.3, math.pi / 2, math.pi, -2.0])
def test_identical_nested_and_touching_rectangles(dtype: torch.dtype, yaw: float) -> None:
    a = one_box(1.0, 2.0, 0.5, 0.7, 1.3, 1.0, yaw, dtype=dtype)
    cases = {
        "identical": (0.0, 0.0, 0.7, 1.3, 0.91),
        "nested": (0.1, 0.2, 0.3, 0.4, 0.12),
        "nested along an edge": (0.2, 0.0, 0.3, 0.4, 0.12),
        "touching": (1.0, 0.0, 1.3, 1.0, 0.0),
        "touching at a corner": (1.0, 1.15, 1.3, 1.0, 0.0),
        "apart": (3.0, 0.0, 1.3, 1.0, 0.0),
    }
    for name, (right, front, width, depth, expected) in cases.items():
        x = 1.0 + right * math.cos(yaw) - front * math.sin(yaw)
        y = 2.0 + right * math.sin(yaw) + front * math.cos(yaw)
        for turn in range(4):
            size = (width, depth) if turn % 2 == 0 else (depth, width)
            b = one_box(x, y, 0.5, *size, 1.0, yaw + turn * math.pi / 2, dtype=dtype)
            for area in (rectangle_intersection_area(a, b), rectangle_intersection_area(b, a)):
                tolerance = 1e-6 if dtype == torch.float32 else 1e-14
                assert math.isclose(area, expected, abs_tol=tolerance), (name, turn)
    assert paired_box_iou(a, a) == pytest.approx(1.0, abs=1e-6 if dtype == torch.float32 else 1e-14)
    assert paired_box_iou(a, a) <= 1.0


def test_disjoint_boxes_share_exactly_nothing(generator: torch.Generator) -> None:
    a = random_boxes(200, generator, torch.float32)
    away = OrientedBoxes(a.centre + torch.tensor([9.0, 3.0, 0.0]), a.size, a.yaw.flip(0))
    assert (rectangle_intersection_area(a[:, None], away[None, :]) == 0).all()
    above = OrientedBoxes(a.centre + torch.tensor([0.0, 0.0, 9.0]), a.size, a.yaw)
    assert (box_iou(a, above) == 0).all()


@DTYPES
def test_a_box_shares_no_more_than_it_has(generator: torch.Generator, dtype: torch.dtype) -> None:
    inner = random_boxes(300, generator, dtype)
    outer = OrientedBoxes(inner.centre, inner.size + 40.0, inner.yaw.flip(0))
    assert (rectangle_intersection_area(inner, outer) <= inner.size[:, 0] * inner.size[:, 1]).all()
    assert (paired_box_iou(inner, inner) <= 1).all()


def test_volume_agrees_with_manifold(generator: torch.Generator) -> None:
    a, b = (random_boxes(12, generator, torch.float64) for _ in range(2))

    def solid(boxes: OrientedBoxes, index: int) -> manifold3d.Manifold:
        cube = manifold3d.Manifold.cube(boxes.size[index].tolist(), True)
        turned = cube.rotate((0.0, 0.0, math.degrees(boxes.yaw[index])))
        return turned.translate(boxes.centre[index].tolist())

    expected = torch.tensor(
        [[(solid(a, i) ^ solid(b, j)).volume() for j in range(12)] for i in range(12)],
        dtype=torch.float64,
    )
    assert (expected > 0).sum() > 10
    found = box_intersection_volume(a, b)
    torch.testing.assert_close(found, expected, atol=1e-5, rtol=1e-5)
    union = box_volume(a)[:, None] + box_volume(b)[None, :] - expected
    torch.testing.assert_close(box_iou(a, b), expected / union, atol=1e-5, rtol=1e-5)


@given(
    shift=st.tuples(*[st.floats(-1.5, 1.5)] * 3),
    yaw=st.floats(-7, 7),
    common=st.floats(-7, 7),
    width=st.floats(1e-3, 4.0),
)
def test_iou_is_a_symmetric_invariant_fraction(
    shift: tuple[float, float, float], yaw: float, common: float, width: float
) -> None:
    a = one_box(0.0, 0.0, 0.0, 1.0, 1.5, 2.0, 0.0)
    b = one_box(*shift, width, 0.8, 1.2, yaw)
    iou = paired_box_iou(a, b)
    assert 0 <= iou <= 1
    torch.testing.assert_close(iou, paired_box_iou(b, a), rtol=0, atol=1e-12)
    cos, sin = math.cos(common), math.sin(common)
    x, y, z = shift
    a = one_box(5.0, -3.0, 1.0, 1.0, 1.5, 2.0, common)
    moved = one_box(
        5 + x * cos - y * sin, -3 + x * sin + y * cos, 1 + z, width, 0.8, 1.2, yaw + common
    )
    torch.testing.assert_close(iou, paired_box_iou(a, moved), rtol=0, atol=1e-12)
    # a half turn is the same box
    turned = OrientedBoxes(moved.centre, moved.size, moved.yaw + math.pi)
    torch.testing.assert_close(iou, paired_box_iou(a, turned), rtol=0, atol=1e-12)


def test_gradients(generator: torch.Generator) -> None:
    a, b = (random_boxes(6, generator, torch.float64) for _ in range(2))
    near = OrientedBoxes(a.centre + 0.2 * (b.centre - a.centre), b.size, b.yaw)
    assert (paired_box_iou(a, near) > 0).all()

    def iou(*fields: Tensor) -> Tensor:
        return paired_box_iou(OrientedBoxes(*fields[:3]), OrientedBoxes(*fields[3:]))

    fields = (a.centre, a.size, a.yaw, near.centre, near.size, near.yaw)
    torch.autograd.gradcheck(iou, tuple(f.clone().requires_grad_() for f in fields))


def gradient(a: OrientedBoxes, b: OrientedBoxes) -> Tensor:
    leaves = [f.clone().requires_grad_() for f in (b.centre, b.size, b.yaw)]
    paired_intersection_volume(a, OrientedBoxes(*leaves)).sum().backward()
    found = [torch.zeros_like(leaf) if leaf.grad is None else leaf.grad for leaf in leaves]
    return torch.cat([found[0], found[1], found[2].unsqueeze(-1)], dim=-1)


@pytest.mark.parametrize("kind", ["any", "thin", "aligned", "nearly aligned"])
@DTYPES
def test_gradients_stay_bounded(generator: torch.Generator, dtype: torch.dtype, kind: str) -> None:
    a, b = random_boxes(400, generator, dtype, kind), random_boxes(400, generator, dtype, kind)
    a = OrientedBoxes(a.centre, a.size, torch.where(torch.arange(400) < 200, b.yaw, a.yaw))
    for other in (b, a):
        # a face moved by one metre changes the volume by at most its area
        assert gradient(a, other).abs().max() < 40


def test_gradients_in_single_precision_match_double(generator: torch.Generator) -> None:
    a, b = (random_boxes(400, generator, torch.float32) for _ in range(2))
    exact = [OrientedBoxes(x.centre.double(), x.size.double(), x.yaw.double()) for x in (a, b)]
    torch.testing.assert_close(gradient(a, b), gradient(*exact).float(), atol=1e-4, rtol=1e-4)


def test_flat_and_missing_boxes() -> None:
    flat = one_box(0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.3)
    solid = one_box(0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 0.3)
    assert paired_box_iou(flat, flat) == 0
    assert paired_box_iou(flat, solid) == 0
    assert gradient(solid, flat).isfinite().all()
    none = OrientedBoxes(torch.zeros(0, 3), torch.zeros(0, 3), torch.zeros(0))
    some = OrientedBoxes(torch.zeros(4, 3), torch.ones(4, 3), torch.zeros(4))
    assert box_iou(none, some).shape == (0, 4)
    assert box_iou(some, none).shape == (4, 0)


def test_many_pairs_take_well_under_a_second(generator: torch.Generator) -> None:
    a, b = (random_boxes(500, generator, torch.float32) for _ in range(2))
    seconds: list[float] = []
    for _ in range(3):
        start = time.process_time()
        box_iou(a, b)
        seconds.append(time.process_time() - start)
    assert min(seconds) < 1.0


def test_nms_of_boxes_keeps_the_best_of_each_place_and_category():
    centre = torch.tensor([[0.0, 0.0, 1.0], [0.3, 0.0, 1.0], [0.6, 0.0, 1.0], [5.0, 0.0, 1.0]])
    boxes = OrientedBoxes(centre, torch.ones(4, 3), torch.zeros(4))  # IoU 0.54 side by side
    score = torch.tensor([0.9, 0.8, 0.7, 0.1])
    assert box_nms(boxes, score, iou_threshold=0.5).tolist() == [0, 2, 3]
    category = torch.tensor([1, 2, 2, 1])
    assert box_nms(boxes, score, category, iou_threshold=0.5).tolist() == [0, 1, 3]
    assert box_nms(boxes[:0], score[:0], iou_threshold=0.5).tolist() == []
    with pytest.raises(ValueError, match=r"iou_threshold: found 1\.5"):
        box_nms(boxes, score, iou_threshold=1.5)
