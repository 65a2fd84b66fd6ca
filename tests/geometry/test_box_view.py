"""The BFoV of a projected box contains the whole box and nothing that could be spared."""

import math

import pytest
import torch
from torch import Tensor

from panoscene.geometry._angles import wrap_angle
from panoscene.geometry._bfov import bfov_area, bfov_contains
from panoscene.geometry._box_view import _exact_extents, bfov_from_boxes
from panoscene.geometry._boxes import box_contains, box_corners, world_from_object
from panoscene.geometry._oriented_boxes import OrientedBoxes
from panoscene.geometry._sphere import camera_from_turned, lonlat_from_direction

HEIGHT = 1.6


def one_box(*numbers: float) -> OrientedBoxes:
    values = torch.tensor(numbers, dtype=torch.float64)
    return OrientedBoxes(values[:3], values[3:6], values[6])


def random_boxes(
    count: int, generator: torch.Generator, reach: float, dtype: torch.dtype = torch.float64
) -> OrientedBoxes:
    numbers = torch.rand(count, 7, generator=generator, dtype=torch.float64).to(dtype)
    scale = torch.tensor([2 * reach, 2 * reach, 3.0], dtype=dtype)
    centre = (numbers[:, :3] - torch.tensor([0.5, 0.5, 0.0], dtype=dtype)) * scale
    return OrientedBoxes(centre, numbers[:, 3:6] * 2 + 0.02, numbers[:, 6] * 6 - 3)


def surface_directions(boxes: OrientedBoxes, steps: int = 31) -> Tensor:
    """Return directions from the camera to points all over the surface, "n points 3"."""
    line = torch.linspace(-0.5, 0.5, steps, dtype=boxes.yaw.dtype)
    first, second = (grid.flatten() for grid in torch.meshgrid(line, line, indexing="ij"))
    faces = [
        torch.stack([first, second, torch.full_like(first, side)], dim=-1).roll(axis, dims=-1)
        for axis in range(3)
        for side in (-0.5, 0.5)
    ]
    local = torch.cat(faces) * boxes.size.unsqueeze(-2)
    world = world_from_object(boxes)
    points = local @ world[..., :3, :3].transpose(-1, -2) + world[..., None, :3, 3]
    return points - torch.tensor([0.0, 0.0, HEIGHT], dtype=boxes.yaw.dtype)


def outside_camera(boxes: OrientedBoxes) -> OrientedBoxes:
    camera = torch.tensor([0.0, 0.0, HEIGHT], dtype=boxes.yaw.dtype)
    return boxes[~box_contains(boxes, camera.expand(len(boxes), 1, 3))[:, 0]]


@pytest.mark.parametrize("reach", [0.8, 1.5, 5.0])
@pytest.mark.parametrize(("dtype", "tolerance"), [(torch.float32, 2e-5), (torch.float64, 1e-9)])
def test_the_whole_box_is_inside(
    generator: torch.Generator, reach: float, dtype: torch.dtype, tolerance: float
) -> None:
    boxes = outside_camera(random_boxes(40, generator, reach, dtype))
    bfov = bfov_from_boxes(boxes, HEIGHT)
    assert bfov.dtype == dtype
    directions = surface_directions(boxes)
    repeated = bfov[:, None].expand(-1, directions.shape[1], -1)
    assert bfov_contains(repeated, directions, tolerance).all()


@pytest.mark.parametrize("reach", [0.8, 5.0])
def test_the_extents_are_tight(generator: torch.Generator, reach: float) -> None:
    boxes = outside_camera(random_boxes(40, generator, reach))
    bfov = bfov_from_boxes(boxes, HEIGHT)
    turned = surface_directions(boxes, 61) @ camera_from_turned(bfov[:, :2])
    seen = 2 * lonlat_from_direction(turned).abs().amax(dim=-2)
    assert (seen <= bfov[:, 2:] + 1e-9).all()
    assert (bfov[:, 2:] - seen).max() < 0.02
    assert (bfov[:, 2:] - seen).median() < 1e-4
    # a box that does not contain the camera is all on one side of it
    assert (bfov_area(bfov) <= 2 * math.pi).all()


def test_an_edge_that_bulges_between_its_corners() -> None:
    # a wide flat box close by, above the camera: its near edge is highest in the middle
    box = one_box(0.0, 1.0, HEIGHT + 0.75, 6.0, 0.2, 0.5, 0.0)
    bfov = bfov_from_boxes(box, HEIGHT)
    top = torch.tensor([0.0, 0.9, 1.0], dtype=torch.float64)
    assert bfov_contains(bfov, top, 1e-12)
    lat = bfov[1] + bfov[3] / 2
    assert lat >= math.atan2(1.0, 1.1) - 1e-12


def test_a_centre_that_looks_away_sees_the_box_behind_it() -> None:
    box = one_box(0.2, 3.0, 0.1, 1.0, 1.0, 1.0, 0.4)  # relative to the camera
    ahead, away = torch.tensor([[0.0, 0.0], [math.pi, 0.0]], dtype=torch.float64)
    first = _exact_extents(box, box_corners(box), ahead)
    behind = _exact_extents(box, box_corners(box), away)
    assert first[0] < 0.7
    assert behind[0] == 2 * math.pi
    torch.testing.assert_close(first[1], behind[1])


def test_turning_the_scene_turns_the_bfov(generator: torch.Generator) -> None:
    boxes = outside_camera(random_boxes(40, generator, 4.0))
    bfov = bfov_from_boxes(boxes, HEIGHT)
    for turn in (0.7, 2.5, math.pi):  # counter-clockwise, so lon falls
        cos, sin = math.cos(turn), math.sin(turn)
        rotation = torch.tensor([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]], dtype=torch.float64)
        moved = OrientedBoxes(boxes.centre @ rotation.T, boxes.size, boxes.yaw + turn)
        found = bfov_from_boxes(moved, HEIGHT)
        torch.testing.assert_close(found[:, 1:], bfov[:, 1:], atol=1e-9, rtol=0)
        off_pole = bfov[:, 1].abs() < 1.5
        difference = wrap_angle(found[:, 0] - bfov[:, 0] + turn)[off_pole]
        torch.testing.assert_close(difference, torch.zeros_like(difference), atol=1e-9, rtol=0)


@pytest.mark.parametrize("offset", [0.0, 0.3, 0.5])
def test_a_box_around_the_camera_covers_the_sphere(offset: float) -> None:
    boxes = OrientedBoxes(
        torch.tensor([[0.0, offset, HEIGHT], [0.0, 5.0, HEIGHT]], dtype=torch.float64),
        torch.ones(2, 3, dtype=torch.float64),
        torch.zeros(2, dtype=torch.float64),
    )
    around, ahead = bfov_from_boxes(boxes, HEIGHT).tolist()
    assert around == [0.0, 0.0, 2 * math.pi, math.pi]
    assert max(ahead) < 0.3


@pytest.mark.parametrize("z", [0.0, 0.8, 2.6])
def test_a_box_over_or_under_the_camera(z: float) -> None:
    box = one_box(0.1, -0.2, z, 1.0, 1.5, 0.5, 0.4)
    bfov = bfov_from_boxes(box, HEIGHT)
    directions = surface_directions(box)
    assert bfov_contains(bfov.expand(len(directions), 4), directions, 1e-9).all()
    # less than a hemisphere is enough, and found
    assert (bfov[2:] < math.pi).all()


def test_a_ring_of_floor_around_the_camera() -> None:
    carpet = one_box(0.3, 0.2, 0.01, 12.0, 9.0, 0.02, 1.0)
    bfov = bfov_from_boxes(carpet, HEIGHT)
    directions = surface_directions(carpet, 101)
    assert bfov_contains(bfov.expand(len(directions), 4), directions, 1e-9).all()
    assert bfov_area(bfov) <= 2 * math.pi


def test_the_height_of_the_camera_matters_per_box() -> None:
    centre = torch.tensor([[0.0, 4.0, 1.0], [0.0, 4.0, 2.0]], dtype=torch.float64)
    boxes = OrientedBoxes(centre, torch.ones_like(centre), torch.zeros(2, dtype=torch.float64))
    level = bfov_from_boxes(boxes, torch.tensor([1.0, 2.0], dtype=torch.float64))
    torch.testing.assert_close(level[0], level[1])
    assert abs(float(level[0, 1])) < 1e-9


def test_gradients() -> None:
    def view(centre: Tensor, size: Tensor, yaw: Tensor) -> Tensor:
        return bfov_from_boxes(OrientedBoxes(centre, size, yaw), HEIGHT)

    boxes = OrientedBoxes(
        torch.tensor([[1.0, 3.0, 0.4], [-2.0, 1.0, 2.5]], dtype=torch.float64),
        torch.tensor([[0.7, 0.5, 0.8], [1.0, 0.4, 0.6]], dtype=torch.float64),
        torch.tensor([0.3, -1.1], dtype=torch.float64),
    )
    fields = (boxes.centre, boxes.size, boxes.yaw)
    torch.autograd.gradcheck(view, tuple(f.clone().requires_grad_() for f in fields))


def test_gradients_are_finite_around_the_camera() -> None:
    centre = torch.tensor([[0.0, 0.2, HEIGHT], [0.5, 0.5, 0.4], [0.0, 2.0, 1.0]])
    centre.requires_grad_()
    bfov_from_boxes(
        OrientedBoxes(centre, torch.ones(3, 3), torch.zeros(3)), HEIGHT
    ).sum().backward()
    assert centre.grad is not None
    assert centre.grad.isfinite().all()


def test_batch_shapes() -> None:
    none = OrientedBoxes(torch.zeros(0, 3), torch.zeros(0, 3), torch.zeros(0))
    assert bfov_from_boxes(none, HEIGHT).shape == (0, 4)
    many = OrientedBoxes(torch.full((2, 3, 3), 4.0), torch.ones(2, 3, 3), torch.zeros(2, 3))
    assert bfov_from_boxes(many, HEIGHT).shape == (2, 3, 4)
