"""Every energy term: numbers worked out by hand, and gradients."""

import math
from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from panoscene.arrange import _terms as terms
from panoscene.geometry import OrientedBoxes

from .conftest import random_batch


def boxes(*rows: tuple[float, ...]) -> OrientedBoxes:
    """Boxes of rows (x, y, z, width, depth, height, yaw)."""
    values = torch.tensor(rows, dtype=torch.float64)
    return OrientedBoxes(values[:, :3], values[:, 3:6], values[:, 6])


CUBES = boxes((0, 0, 0, 2, 2, 2, 0), (0, 0, 0, 1, 1, 1, 0), (4, 0, 0, 1, 1, 1, 0))
ROOM = torch.tensor([[-2, -2], [2, -2], [2, 2], [-2, 2]], dtype=torch.float64)


def test_object_collision_of_the_fact_sheet():
    error = terms.object_collision(CUBES)
    assert error[0, 1].item() == pytest.approx(9.0)
    assert error[0, 2].item() == 0
    assert error.diagonal().abs().sum() == 0
    assert torch.equal(error, error.T)


def test_object_collision_without_duplicates_and_as_depth():
    assert terms.object_collision(CUBES, axis_weight=0.5)[0, 1].item() == pytest.approx(4.5)
    assert terms.object_collision(CUBES, kind="depth")[0, 1].item() == pytest.approx(1.5)


def test_object_collision_clearance_reaches_across_a_gap():
    near = boxes((0, 0, 0, 1, 1, 1, 0), (1.01, 0, 0, 1, 1, 1, 0))
    assert terms.object_collision(near)[0, 1].item() == 0
    apart = terms.object_collision(near, clearance=0.03, kind="depth")
    assert apart[0, 1].item() == pytest.approx(0.02)


def test_touching_of_the_fact_sheet():
    error = terms.touching(CUBES, CUBES)
    assert error[0, 2].item() == pytest.approx(5.0)
    assert error[0, 1].item() == 0
    assert terms.touching(CUBES, CUBES, axis_weight=0.5)[0, 2].item() == pytest.approx(2.5)


def test_wall_collision_is_the_distance_of_corners_outside():
    error = terms.wall_collision(boxes((2, 0, 0.5, 1, 1, 1, 0)), ROOM)
    assert sorted(error[0].tolist()) == pytest.approx([0, 0, 0.5, 0.5])
    inside = terms.wall_collision(boxes((1, 0, 0.5, 1, 1, 1, 0)), ROOM)
    assert inside.abs().sum() == 0


def test_floor_and_ceiling_terms():
    floor, ceiling = torch.tensor(0.0).double(), torch.tensor(2.5).double()
    low, floating, high = (
        boxes((0, 0, 0.4, 1, 1, 1, 0)),
        boxes((0, 0, 0.8, 1, 1, 1, 0)),
        boxes((0, 0, 2.2, 1, 1, 1, 0)),
    )
    assert terms.floor_collision(low, floor).item() == pytest.approx(0.1)
    assert terms.on_floor(low, floor).item() == 0
    assert terms.floor_collision(floating, floor).item() == 0
    assert terms.on_floor(floating, floor).item() == pytest.approx(0.3)
    assert terms.ceiling_collision(high, ceiling).item() == pytest.approx(0.2)
    assert terms.under_ceiling(high, ceiling).item() == 0
    assert terms.under_ceiling(low, ceiling).item() == pytest.approx(1.6)


def test_relative_yaw_wraps():
    pair = boxes((0, 0, 0, 1, 1, 1, 3.0), (1, 0, 0, 1, 1, 1, -3.0))
    error = terms.relative_yaw(pair, pair, torch.zeros(2, 2, dtype=torch.float64))
    assert error[0, 1].item() == pytest.approx(2 * math.pi - 6)


def test_farther_than_asks_only_where_the_order_is_wrong():
    error = terms.farther_than(torch.tensor([1.0, 3.0]))
    assert error.tolist() == [[0, 2], [0, 0]]


def test_reprojection_of_a_box_that_fits_is_zero():
    box = boxes((0, 3, 1.6, 1, 0.2, 1, 0))
    height = torch.tensor(1.6, dtype=torch.float64)
    bfov = torch.zeros(1, 4, dtype=torch.float64)
    rectangle = terms.projected_rectangle(box, bfov, height)
    fitting = torch.cat([bfov[:, :2], 2 * rectangle[:, 0:1], 2 * rectangle[:, 2:3]], -1)
    assert terms.reprojection(rectangle, fitting).abs().max() < 1e-12
    assert terms.reprojection(rectangle, fitting, kind="iou").abs().max() < 1e-12
    half = fitting * fitting.new_tensor([1, 1, 0.5, 1])
    assert terms.reprojection(rectangle, half, kind="iou").item() == pytest.approx(0.5)


def test_reprojection_ignores_boxes_around_the_camera():
    box = boxes((0, 0, 1.6, 1, 1, 1, 0.3))
    rectangle = terms.projected_rectangle(
        box, torch.ones(1, 4).double(), torch.tensor(1.6).double()
    )
    for kind in ("edges", "iou"):
        assert terms.reprojection(rectangle, torch.ones(1, 4).double(), kind=kind).sum() == 0


BATCH = random_batch(scenes=2, n=4, seed=3)
TERMS: dict[str, Callable[[OrientedBoxes], Tensor]] = {
    "object_collision": terms.object_collision,
    "object_collision depth": lambda b: terms.object_collision(b, kind="depth", clearance=0.01),
    "wall_collision": lambda b: terms.wall_collision(b, BATCH.polygon),
    "floor_collision": lambda b: terms.floor_collision(b, BATCH.floor_height),
    "floor_collision upper": lambda b: terms.floor_collision(b, BATCH.floor_height, upper=True),
    "ceiling_collision": lambda b: terms.ceiling_collision(b, BATCH.ceiling_height),
    "ceiling_collision lower": lambda b: terms.ceiling_collision(
        b, BATCH.ceiling_height, lower=True
    ),
    "touching": lambda b: terms.touching(b, b),
    "touching walls": lambda b: terms.touching(b, BATCH.walls, axis_weight=0.5),
    "relative_yaw": lambda b: terms.relative_yaw(b, b, BATCH.touching),
    "on_floor": lambda b: terms.on_floor(b, BATCH.floor_height),
    "under_ceiling": lambda b: terms.under_ceiling(b, BATCH.ceiling_height),
    "farther_than": lambda b: terms.farther_than(b.centre.norm(dim=-1)),
    "observation": lambda b: terms.observation(b.size, BATCH.boxes.size * 0.9),
    "reprojection": lambda b: terms.reprojection(
        terms.projected_rectangle(b, BATCH.bfov, BATCH.camera_height), BATCH.bfov
    ),
    "reprojection iou": lambda b: terms.reprojection(
        terms.projected_rectangle(b, BATCH.bfov, BATCH.camera_height), BATCH.bfov, kind="iou"
    ),
}


@pytest.mark.parametrize("name", TERMS)
def test_gradcheck(name: str):
    start = [BATCH.boxes.centre, BATCH.boxes.size, BATCH.boxes.yaw]
    inputs = [value.clone().requires_grad_() for value in start]

    def summed(centre: Tensor, size: Tensor, yaw: Tensor) -> Tensor:
        return TERMS[name](OrientedBoxes(centre, size, yaw)).flatten(1).sum(-1)

    assert torch.autograd.gradcheck(summed, inputs, eps=1e-7, atol=1e-5)


@pytest.mark.parametrize("name", TERMS)
def test_terms_are_errors(name: str):
    error = TERMS[name](BATCH.boxes)
    assert bool((error >= 0).all())
    assert bool(torch.isfinite(error).all())


@pytest.mark.parametrize("name", TERMS)
def test_gradient_is_finite_where_boxes_coincide(name: str):
    centre = torch.zeros_like(BATCH.boxes.centre) + torch.tensor([0.0, 1.0, 0.5])
    inputs = [
        value.clone().requires_grad_()
        for value in (centre, torch.ones_like(centre), torch.zeros_like(BATCH.boxes.yaw))
    ]
    TERMS[name](OrientedBoxes(*inputs)).sum().backward()
    for value in inputs:
        assert value.grad is None or bool(torch.isfinite(value.grad).all())
