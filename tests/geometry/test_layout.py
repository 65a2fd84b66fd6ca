"""Walls as cuboids, visibility and layout IoU."""

import math

import pytest
import shapely
import torch
from torch import Tensor
from torch.autograd import gradcheck

from panoscene.geometry._layout import (
    corner_visible,
    layout_iou_3d,
    wall_boxes,
    wall_distance,
    wall_normals,
)
from panoscene.geometry._polygon import signed_distance_to_polygon

ROOM = torch.tensor([[-2, -2], [2, -2], [2, 2], [-2, 2]], dtype=torch.float64)
U_ROOM = torch.tensor(
    [[-3, -1], [3, -1], [3, 4], [2, 4], [2, 1], [-2, 1], [-2, 4], [-3, 4]], dtype=torch.float64
)


def padded(polygon: Tensor, extra: int = 3) -> Tensor:
    return torch.cat((polygon, polygon[-1:].expand(extra, 2)))


def test_walls_of_a_square_room() -> None:
    # facts, conformance test 3: centroids at 2.1 m, size (4, 0.2, h), all facing the camera
    walls = wall_boxes(ROOM, 0.0, 2.6)
    expected = torch.tensor([[0, -2.1, 1.3], [2.1, 0, 1.3], [0, 2.1, 1.3], [-2.1, 0, 1.3]])
    torch.testing.assert_close(walls.centre, expected.double())
    torch.testing.assert_close(walls.size, torch.tensor([[4, 0.2, 2.6]]).double().expand(4, 3))
    lon = torch.atan2(walls.centre[:, 0], walls.centre[:, 1])
    facing = walls.yaw - (math.pi - lon)
    torch.testing.assert_close(torch.cos(facing), torch.ones_like(facing))


def test_front_faces_lie_on_the_walls_and_normals_point_inwards() -> None:
    walls = wall_boxes(U_ROOM, 0.0, 2.6, thickness=0.3)
    front = torch.stack((-torch.sin(walls.yaw), torch.cos(walls.yaw)), dim=-1)
    torch.testing.assert_close(front, wall_normals(U_ROOM))
    middle = (U_ROOM + U_ROOM.roll(-1, 0)) / 2
    torch.testing.assert_close(walls.centre[:, :2] + 0.15 * front, middle)
    assert bool((signed_distance_to_polygon(middle + 0.1 * front, U_ROOM) < 0).all())
    assert bool((walls.yaw >= -math.pi).all())
    assert bool((walls.yaw < math.pi).all())


def test_wall_boxes_of_batches_and_padding() -> None:
    rooms = torch.stack((padded(ROOM, 4), U_ROOM)).requires_grad_()
    walls = wall_boxes(rooms, torch.tensor([0.0, 0.1]), torch.tensor([2.0, 3.0]))
    assert walls.centre.shape == (2, 8, 3)
    torch.testing.assert_close(walls.size[0, :, 0], torch.tensor([4, 4, 4, 0, 0, 0, 0, 4]).double())
    torch.testing.assert_close(walls.size[1, :, 2], torch.full((8,), 2.9).double())
    (walls.centre.sum() + walls.size.sum() + walls.yaw.sum()).backward()
    assert rooms.grad is not None
    assert bool(rooms.grad.isfinite().all())


@pytest.mark.parametrize("camera", [(0.0, 0.0), (2.5, 3.0), (-2.9, -0.9), (2.5, 0.5)])
def test_visible_corners_are_shapelys(camera: tuple[float, float]) -> None:
    room = shapely.Polygon(U_ROOM.numpy()).buffer(1e-9)
    lines = [shapely.LineString([camera, corner]) for corner in U_ROOM.tolist()]
    expected = torch.tensor([room.contains(line) for line in lines])
    assert torch.equal(corner_visible(U_ROOM, camera), expected)
    assert torch.equal(corner_visible(padded(U_ROOM), camera)[:8], expected)


def test_all_corners_of_a_convex_room_are_visible() -> None:
    assert bool(corner_visible(torch.stack((ROOM, ROOM + 0.5))).all())


def test_wall_distance_is_shapelys(generator: torch.Generator) -> None:
    lon = (torch.rand(200, generator=generator, dtype=torch.float64) - 0.5) * 2 * math.pi
    camera = (2.5, 3.0)
    distance = wall_distance(U_ROOM, lon, camera)
    outline = shapely.Polygon(U_ROOM.numpy()).exterior
    for angle, found in zip(lon.tolist(), distance.tolist(), strict=True):
        end = (camera[0] + 20 * math.sin(angle), camera[1] + 20 * math.cos(angle))
        met = shapely.LineString([camera, end]).intersection(outline)
        assert found == pytest.approx(met.distance(shapely.Point(camera)), abs=1e-9)


def test_no_ray_slips_through_a_corner() -> None:
    lon = torch.atan2(ROOM[:, 0], ROOM[:, 1])
    for room in (ROOM, padded(ROOM)):
        torch.testing.assert_close(wall_distance(room, lon), torch.full_like(lon, math.sqrt(8)))


def test_wall_distance_from_outside() -> None:
    lon = torch.tensor([0.0, math.pi / 2, -math.pi / 2], dtype=torch.float64)
    found = wall_distance(ROOM, lon, (-5.0, 0.0))
    assert found.tolist() == [math.inf, pytest.approx(3), math.inf]


def test_wall_distance_gradcheck() -> None:
    lon = torch.linspace(-3, 3, 9, dtype=torch.float64).requires_grad_()
    assert gradcheck(wall_distance, (U_ROOM.clone().requires_grad_(), lon))
    room = ROOM.clone().requires_grad_()
    wall_distance(room, lon, (9.0, 9.0)).nan_to_num(posinf=0.0).sum().backward()
    assert room.grad is not None
    assert bool(room.grad.isfinite().all())


def test_layout_iou_3d() -> None:
    assert layout_iou_3d(ROOM, (0.0, 2.5), ROOM, (0.0, 2.5)) == 1
    assert layout_iou_3d(ROOM, (0.0, 2.0), ROOM, (0.0, 2.5)) == pytest.approx(0.8)
    # half the floor, half the height
    moved = ROOM + torch.tensor([2.0, 0.0])
    assert layout_iou_3d(ROOM, (0.0, 2.0), moved, (1.0, 3.0)) == pytest.approx(8 / (32 + 32 - 8))
    assert layout_iou_3d(ROOM, (0.0, 2.0), ROOM, (2.0, 4.0)) == 0


def test_layout_iou_3d_refuses_a_ceiling_below_the_floor() -> None:
    with pytest.raises(ValueError, match="other_floor_ceiling"):
        layout_iou_3d(ROOM, (0.0, 2.0), ROOM, (2.0, 2.0))
