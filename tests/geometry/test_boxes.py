"""Corners, frames, containment and volume of upright boxes."""

import math

import pytest
import shapely
import torch
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor

from panoscene.geometry._boxes import (
    box_contains,
    box_corners,
    box_footprint,
    box_volume,
    boxes_from_corners,
    object_from_world,
    world_from_object,
)
from panoscene.geometry._oriented_boxes import OrientedBoxes

DTYPES = pytest.mark.parametrize("dtype", [torch.float32, torch.float64])


def random_boxes(
    *batch: int, generator: torch.Generator, dtype: torch.dtype = torch.float64
) -> OrientedBoxes:
    numbers = torch.rand(*batch, 7, generator=generator, dtype=torch.float64).to(dtype)
    return OrientedBoxes(
        numbers[..., :3] * 6 - 3, numbers[..., 3:6] * 3 + 0.05, numbers[..., 6] * 6 - 3
    )


def test_corners_follow_the_bits_of_their_index() -> None:
    yaw = torch.tensor(0.5, dtype=torch.float64)
    size = torch.tensor([0.6, 1.0, 2.0], dtype=torch.float64)
    centre = torch.tensor([1.0, -2.0, 0.5], dtype=torch.float64)
    right = torch.tensor([math.cos(0.5), math.sin(0.5), 0.0], dtype=torch.float64)
    front = torch.tensor([-math.sin(0.5), math.cos(0.5), 0.0], dtype=torch.float64)
    up = torch.tensor([0.0, 0.0, 1.0], dtype=torch.float64)
    corners = box_corners(OrientedBoxes(centre, size, yaw))
    for index in range(8):
        x, y, z = (1 if index >> bit & 1 else -1 for bit in range(3))
        expected = centre + x * 0.3 * right + y * 0.5 * front + z * 1.0 * up
        torch.testing.assert_close(corners[index], expected)


@DTYPES
def test_corners_and_boxes_are_inverse(generator: torch.Generator, dtype: torch.dtype) -> None:
    boxes = random_boxes(5, 40, generator=generator, dtype=dtype)
    corners = box_corners(boxes)
    assert corners.shape == (5, 40, 8, 3)
    again = boxes_from_corners(corners)
    tolerance = 2e-6 if dtype == torch.float32 else 1e-14
    torch.testing.assert_close(again.centre, boxes.centre, atol=tolerance, rtol=0)
    torch.testing.assert_close(again.size, boxes.size, atol=tolerance, rtol=0)
    torch.testing.assert_close(again.yaw, boxes.yaw, atol=20 * tolerance, rtol=0)


def test_a_box_without_width_keeps_its_yaw() -> None:
    for size in ([0.0, 1.0, 1.0], [1.0, 0.0, 1.0]):
        sheet = OrientedBoxes(torch.zeros(3), torch.tensor(size), torch.tensor(-1.2))
        again = boxes_from_corners(box_corners(sheet))
        torch.testing.assert_close(again.yaw, sheet.yaw)
        torch.testing.assert_close(again.size, sheet.size)


def test_footprint_is_counter_clockwise(generator: torch.Generator) -> None:
    boxes = random_boxes(30, generator=generator)
    footprint = box_footprint(boxes)
    rings = shapely.linearrings(footprint.numpy())
    assert shapely.is_ccw(rings).all()
    areas = torch.as_tensor(shapely.area(shapely.polygons(footprint.numpy())))
    torch.testing.assert_close(areas, boxes.size[:, 0] * boxes.size[:, 1])
    corners = box_corners(boxes)
    assert torch.equal(corners[:, [0, 1, 3, 2], :2], footprint)
    assert torch.equal(corners[:, [4, 5, 7, 6], :2], footprint)


def test_frames_are_inverse_rigid_transforms(generator: torch.Generator) -> None:
    boxes = random_boxes(2, 10, generator=generator)
    world, local = world_from_object(boxes), object_from_world(boxes)
    identity = torch.eye(4, dtype=torch.float64).expand(2, 10, 4, 4)
    torch.testing.assert_close(world @ local, identity)
    torch.testing.assert_close(local @ world, identity)
    rotation = world[..., :3, :3]
    torch.testing.assert_close(rotation @ rotation.transpose(-1, -2), identity[..., :3, :3])
    torch.testing.assert_close(torch.linalg.det(rotation), torch.ones(2, 10, dtype=torch.float64))
    homogeneous = torch.cat([boxes.size / 2, torch.ones(2, 10, 1, dtype=torch.float64)], dim=-1)
    corner = (world @ homogeneous.unsqueeze(-1)).squeeze(-1)[..., :3]
    torch.testing.assert_close(corner, box_corners(boxes)[..., 7, :])


def test_containment_agrees_with_trimesh(generator: torch.Generator) -> None:
    boxes = random_boxes(3, generator=generator)
    points = torch.rand(3, 400, 3, generator=generator, dtype=torch.float64) - 0.5
    points = points * 1.6 * boxes.size.amax(-1)[:, None, None] + boxes.centre.unsqueeze(-2)
    found = box_contains(boxes, points)
    for index in range(3):
        mesh = trimesh.convex.convex_hull(box_corners(boxes[index]).numpy())
        distance = trimesh.proximity.signed_distance(mesh, points[index].numpy())
        assert (found[index].numpy() == (distance >= 0)).all()
        assert 5 < found[index].sum() < 300
        assert box_volume(boxes[index]) == pytest.approx(mesh.volume)


def test_the_surface_belongs_to_the_box() -> None:
    box = OrientedBoxes(torch.ones(3), torch.ones(3), torch.tensor(0.0))
    assert box_contains(box, box_corners(box)).all()
    assert not box_contains(box, box.centre + (box_corners(box) - box.centre) * 1.001).any()


@given(yaw=st.floats(-6, 6), turns=st.integers(1, 3))
def test_quarter_turns_swap_the_sides(yaw: float, turns: int) -> None:
    size = torch.tensor([0.5, 2.0, 1.0], dtype=torch.float64)
    swapped = size[[1, 0, 2]] if turns % 2 else size
    centre = torch.tensor([1.0, 2.0, 3.0], dtype=torch.float64)
    first = OrientedBoxes(centre, size, torch.tensor(yaw, dtype=torch.float64))
    second = OrientedBoxes(centre, swapped, first.yaw + turns * math.pi / 2)
    near = torch.cdist(box_corners(first), box_corners(second)).amin(dim=-1)
    assert near.max() < 1e-6


def test_gradients(generator: torch.Generator) -> None:
    boxes = random_boxes(2, generator=generator)

    def there_and_back(centre: Tensor, size: Tensor, yaw: Tensor) -> tuple[Tensor, ...]:
        corners = box_corners(OrientedBoxes(centre, size, yaw))
        again = boxes_from_corners(corners)
        return corners, again.centre, again.size, again.yaw

    fields = (boxes.centre, boxes.size, boxes.yaw)
    torch.autograd.gradcheck(there_and_back, tuple(f.clone().requires_grad_() for f in fields))


def test_no_boxes() -> None:
    none = OrientedBoxes(torch.zeros(0, 3), torch.zeros(0, 3), torch.zeros(0))
    assert box_corners(none).shape == (0, 8, 3)
    assert len(boxes_from_corners(box_corners(none))) == 0
    assert box_contains(none, torch.zeros(0, 5, 3)).shape == (0, 5)
