"""Signed distance, area, validity and box-in-room fraction, against shapely."""

import math

import pytest
import shapely
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor
from torch.autograd import gradcheck, gradgradcheck

from panoscene.geometry._oriented_boxes import OrientedBoxes
from panoscene.geometry._polygon import (
    box_in_room_fraction,
    footprint_area_in_polygon,
    polygon_area,
    polygon_contains,
    signed_distance_to_polygon,
)
from panoscene.geometry._polygon_validity import (
    is_manhattan,
    polygon_intersection_area,
    polygon_iou,
    polygon_problem,
    polygon_turn,
)

SQUARE = torch.tensor([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]], dtype=torch.float64)
L_ROOM = torch.tensor([[0, 0], [4, 0], [4, 2], [2, 2], [2, 5], [0, 5]], dtype=torch.float64)
COMB = torch.tensor(
    [[0, 0], [7, 0], [7, 4], [6, 4], [5, 1], [4.5, 4], [3, 4], [2.5, 1], [2, 1], [1, 5]],
    dtype=torch.float64,
)
POLYGONS = pytest.mark.parametrize("polygon", [SQUARE, L_ROOM, COMB], ids=["square", "l", "comb"])


def star(seed: int, corners: int) -> Tensor:
    """Return a random star-shaped, usually not convex, counter-clockwise polygon."""
    generator = torch.Generator().manual_seed(seed)
    step = torch.rand(corners, generator=generator, dtype=torch.float64) + 0.3
    angle = (2 * math.pi * step / step.sum()).cumsum(0)
    distance = 0.7 + 4 * torch.rand(corners, generator=generator, dtype=torch.float64)
    return torch.stack((distance * torch.cos(angle), distance * torch.sin(angle)), dim=-1)


def padded(polygon: Tensor, extra: int = 3) -> Tensor:
    return torch.cat((polygon, polygon[-1:].expand(extra, 2)))


def shapely_distance(points: Tensor, polygon: Tensor) -> Tensor:
    shape = shapely.Polygon(polygon.numpy())
    places = shapely.points(points.numpy())
    distance = torch.from_numpy(shapely.distance(shape.exterior, places))
    return torch.where(torch.from_numpy(shapely.contains(shape, places)), -distance, distance)


def random_boxes(count: int, generator: torch.Generator, spread: float = 6.0) -> OrientedBoxes:
    def draw(*shape: int) -> Tensor:
        return torch.rand(*shape, generator=generator, dtype=torch.float64)

    return OrientedBoxes(draw(count, 3) * spread - 0.5, 0.01 + 3 * draw(count, 3), 7 * draw(count))


def shapely_footprint(box: OrientedBoxes) -> shapely.Polygon:
    half = box.size[:2] / 2
    cos, sin = torch.cos(box.yaw), torch.sin(box.yaw)
    corners = [
        (
            float(box.centre[0] + cos * i * half[0] - sin * j * half[1]),
            float(box.centre[1] + sin * i * half[0] + cos * j * half[1]),
        )
        for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    return shapely.Polygon(corners)


@POLYGONS
def test_signed_distance_is_shapelys(polygon: Tensor, generator: torch.Generator) -> None:
    points = torch.rand(500, 2, generator=generator, dtype=torch.float64) * 9 - 1
    expected = shapely_distance(points, polygon)
    for same in (polygon, padded(polygon), polygon.flip(0)):
        torch.testing.assert_close(signed_distance_to_polygon(points, same), expected)
        assert torch.equal(polygon_contains(points, same), expected < 0)


@given(st.integers(0, 10**6), st.integers(3, 12))
def test_signed_distance_of_stars(seed: int, corners: int) -> None:
    polygon = star(seed, corners)
    if not shapely.Polygon(polygon.numpy()).is_valid:
        return
    generator = torch.Generator().manual_seed(seed)
    points = (torch.rand(40, 2, generator=generator, dtype=torch.float64) - 0.5) * 12
    distance = signed_distance_to_polygon(points, polygon)
    torch.testing.assert_close(distance, shapely_distance(points, polygon))


def test_points_level_with_corners() -> None:
    # a notch whose corners all lie on the height of the points
    polygon = torch.tensor([[0, 0], [1, 1], [2, 0], [3, 1], [4, 0], [4, 2], [0, 2.0]])
    points = torch.tensor([[-1, 1], [0.5, 1], [2, 1], [3.5, 1], [5, 1], [-1, 0], [5, 2], [2, 0.5]])
    expected = torch.tensor([False, True, True, True, False, False, False, True])
    assert torch.equal(polygon_contains(points, polygon), expected)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_batches_equal_single_rooms(dtype: torch.dtype, generator: torch.Generator) -> None:
    rooms = torch.stack((padded(SQUARE, 6), padded(L_ROOM, 4), COMB)).to(dtype)
    points = torch.rand(3, 20, 2, generator=generator, dtype=dtype) * 5
    together = signed_distance_to_polygon(points, rooms)
    assert together.dtype == dtype
    for index, room in enumerate((SQUARE, L_ROOM, COMB)):
        alone = signed_distance_to_polygon(points[index], room.to(dtype))
        torch.testing.assert_close(together[index], alone)


@POLYGONS
def test_gradient_has_length_one(polygon: Tensor, generator: torch.Generator) -> None:
    points = torch.rand(300, 2, generator=generator, dtype=torch.float64) * 9 - 1
    middles = (polygon + polygon.roll(-1, 0)) / 2
    points = torch.cat((points, middles)).requires_grad_()
    distance = signed_distance_to_polygon(points, padded(polygon))
    (gradient,) = torch.autograd.grad(distance.sum(), points)
    torch.testing.assert_close(gradient.norm(dim=-1), torch.ones_like(distance))
    # on the walls it is the outward normal
    stepped = signed_distance_to_polygon(middles + 1e-3 * gradient[300:], polygon)
    torch.testing.assert_close(stepped, torch.full_like(stepped, 1e-3))


def test_gradient_beside_a_wall_points_outwards_on_both_sides() -> None:
    for gap in (-1e-3, -1e-7, 0.0, 1e-7, 1e-3):
        points = torch.tensor([[2.0 + gap, 1.0]], requires_grad=True)
        signed_distance_to_polygon(points, SQUARE.float()).sum().backward()
        assert points.grad is not None
        torch.testing.assert_close(points.grad, torch.tensor([[1.0, 0.0]]))


def test_gradient_on_corners_is_finite() -> None:
    points = padded(L_ROOM).clone().requires_grad_()
    polygon = padded(L_ROOM).clone().requires_grad_()
    distance = signed_distance_to_polygon(points, polygon)
    torch.testing.assert_close(distance, torch.zeros_like(distance))
    distance.sum().backward()
    for leaf in (points, polygon):
        assert leaf.grad is not None
        assert bool(leaf.grad.isfinite().all())


def test_signed_distance_gradcheck(generator: torch.Generator) -> None:
    points = (torch.rand(12, 2, generator=generator, dtype=torch.float64) * 6 - 1).requires_grad_()
    polygon = L_ROOM.clone().requires_grad_()
    assert gradcheck(signed_distance_to_polygon, (points, polygon))
    assert gradgradcheck(signed_distance_to_polygon, (points, polygon), fast_mode=True)


def test_area() -> None:
    assert polygon_area(L_ROOM) == 14
    assert polygon_area(L_ROOM.flip(0)) == -14
    assert polygon_area(padded(L_ROOM) + 1000) == 14
    assert gradcheck(polygon_area, (COMB.clone().requires_grad_(),))


PROBLEMS = [
    (SQUARE[:2], "2 corners"),
    (torch.tensor([[0.0, 0.0], [math.nan, 0.0], [1.0, 1.0]]), "corner 1 is not finite"),
    (torch.tensor([[0.0, 0.0], [1.0, 0.0], [math.inf, 1.0]]), "corner 2 is not finite"),
    (padded(SQUARE, 1), "corners 3 and 4 are the same point"),
    (SQUARE[[0, 2, 1, 3]], "Self-intersection"),
    (torch.tensor([[0.0, 0.0], [1.0, 1.0], [3.0, 3.0]]), "area is zero"),
    (SQUARE.flip(0), "clockwise"),
    # a corner that lies on another wall
    (torch.tensor([[0, 0], [4, 0], [4, 3], [2, 0], [0, 3.0]]), "cross or touch"),
]


@pytest.mark.parametrize(("polygon", "words"), PROBLEMS, ids=[words for _, words in PROBLEMS])
def test_problems_are_named(polygon: Tensor, words: str) -> None:
    problem = polygon_problem(polygon)
    assert problem is not None
    assert words in problem


@POLYGONS
def test_no_problem(polygon: Tensor) -> None:
    assert polygon_problem(polygon) is None
    assert polygon_problem(polygon.float() + 100) is None


@given(st.floats(-4, 4))
def test_manhattan_rooms_may_be_turned(angle: float) -> None:
    cos, sin = math.cos(angle), math.sin(angle)
    turn = torch.tensor([[cos, sin], [-sin, cos]], dtype=torch.float64)
    assert is_manhattan(L_ROOM @ turn)
    assert is_manhattan(padded(L_ROOM) @ turn)
    assert not is_manhattan(COMB @ turn)


@given(st.floats(-4, 4))
def test_the_turn_of_a_polygon_lays_its_walls_along_the_axes(angle: float) -> None:
    cos, sin = math.cos(angle), math.sin(angle)
    turned = L_ROOM @ torch.tensor([[cos, sin], [-sin, cos]], dtype=torch.float64)
    found = polygon_turn(turned)
    assert abs(found) <= math.pi / 4 + 1e-9
    assert polygon_turn(padded(turned)) == pytest.approx(found, abs=1e-9)
    # turned back, up to quarter turns
    assert math.remainder(angle + found, math.pi / 2) == pytest.approx(0, abs=1e-9)


def test_the_turn_of_a_polygon_follows_most_of_the_wall() -> None:
    # one skewed wall of four, by 0.1 rad: the others outweigh it
    skewed = SQUARE.clone()
    skewed[2, 0] += 2 * math.tan(0.1)
    assert 0 < abs(polygon_turn(skewed)) < 0.05
    assert polygon_turn(SQUARE.float()) == pytest.approx(0, abs=1e-7)


def test_manhattan_tolerance() -> None:
    skewed = SQUARE.clone()
    skewed[2, 0] += 2 * math.tan(0.05)
    assert not is_manhattan(skewed, tolerance=0.01)
    assert is_manhattan(skewed, tolerance=0.06)


def test_polygon_overlap() -> None:
    assert polygon_intersection_area(SQUARE, L_ROOM) == pytest.approx(4)
    assert polygon_iou(SQUARE, L_ROOM) == pytest.approx(4 / 14)
    assert polygon_iou(L_ROOM, L_ROOM.flip(0)) == 1
    assert polygon_iou(SQUARE, SQUARE + 5) == 0


@pytest.mark.parametrize("wrong", [SQUARE[:2], SQUARE * math.nan, SQUARE[[0, 2, 1, 3]]])
def test_polygon_overlap_refuses(wrong: Tensor) -> None:
    with pytest.raises(ValueError, match="other"):
        polygon_iou(SQUARE, wrong)


@POLYGONS
def test_footprint_area_is_shapelys(polygon: Tensor, generator: torch.Generator) -> None:
    boxes = random_boxes(200, generator)
    room = shapely.Polygon(polygon.numpy())
    expected = [shapely_footprint(boxes[i]).intersection(room).area for i in range(len(boxes))]
    for same in (polygon, padded(polygon), polygon.flip(0)):
        area = footprint_area_in_polygon(boxes, same)
        torch.testing.assert_close(area, torch.tensor(expected, dtype=torch.float64))


def test_footprints_aligned_with_the_walls() -> None:
    centre = torch.tensor([[1, 1, 0], [2, 1, 0], [2, 2, 0], [3, 1, 0], [1, 1, 0], [2.5, 1, 0.0]])
    size = torch.tensor([[1, 1, 1], [1, 1, 1], [1, 1, 1], [2, 2, 1], [9, 9, 1], [1, 4, 1.0]])
    boxes = OrientedBoxes(centre, size, torch.zeros(6))
    area = footprint_area_in_polygon(boxes, SQUARE.float())
    torch.testing.assert_close(area, torch.tensor([1, 0.5, 0.25, 0, 4, 0.0]))


def test_box_in_room_fraction_by_hand() -> None:
    centre = torch.tensor([[1, 1, 0.5], [2, 1, 0.5], [1, 1, 0], [1, 1, 2.75], [1, 1, 5], [9, 9, 1]])
    boxes = OrientedBoxes(centre, torch.ones(6, 3), torch.zeros(6))
    fraction = box_in_room_fraction(boxes, SQUARE.float(), 0.0, 2.5)
    torch.testing.assert_close(fraction, torch.tensor([1, 0.5, 0.5, 0.25, 0, 0]))


def test_small_box_inside_is_fully_inside() -> None:
    boxes = OrientedBoxes(
        torch.tensor([[3.7, 0.3, 1.0]]), torch.full((1, 3), 0.01), torch.tensor([0.7])
    )
    assert float(box_in_room_fraction(boxes, L_ROOM.float(), 0.0, 2.5)[0]) == pytest.approx(1, 1e-5)


def test_box_without_volume_has_no_fraction() -> None:
    boxes = OrientedBoxes(torch.ones(2, 3), torch.tensor([[1, 1, 0], [0, 0, 0.0]]), torch.zeros(2))
    size = boxes.size.requires_grad_()
    fraction = box_in_room_fraction(boxes, SQUARE.float(), 0.0, 2.5)
    assert torch.equal(fraction, torch.zeros(2))
    fraction.sum().backward()
    assert size.grad is not None
    assert bool(size.grad.isfinite().all())


def test_box_in_room_fraction_of_batches(generator: torch.Generator) -> None:
    flat = random_boxes(40, generator)
    boxes = OrientedBoxes(
        flat.centre.reshape(2, 20, 3), flat.size.reshape(2, 20, 3), flat.yaw.reshape(2, 20)
    )
    rooms, ceilings = torch.stack((padded(SQUARE, 2), L_ROOM)), torch.tensor([2.0, 3.0])
    together = box_in_room_fraction(boxes, rooms, 0.0, ceilings)
    assert bool(((together >= 0) & (together <= 1)).all())
    for index, room in enumerate((SQUARE, L_ROOM)):
        alone = box_in_room_fraction(boxes[index], room, 0.0, float(ceilings[index]))
        torch.testing.assert_close(together[index], alone)


def test_box_in_room_fraction_gradcheck(generator: torch.Generator) -> None:
    boxes = random_boxes(4, generator, spread=4.0)

    def fraction(centre: Tensor, size: Tensor, yaw: Tensor, polygon: Tensor) -> Tensor:
        return box_in_room_fraction(OrientedBoxes(centre, size, yaw), polygon, 0.0, 2.5)

    leaves = [part.clone().requires_grad_() for part in (boxes.centre, boxes.size, boxes.yaw)]
    leaves.append(L_ROOM.clone().requires_grad_())
    assert gradcheck(fraction, leaves)
    assert gradgradcheck(fraction, leaves, fast_mode=True)


def test_no_boxes_and_no_points() -> None:
    none = OrientedBoxes(torch.zeros(0, 3), torch.zeros(0, 3), torch.zeros(0))
    assert box_in_room_fraction(none, SQUARE.float(), 0.0, 2.5).shape == (0,)
    assert signed_distance_to_polygon(torch.zeros(0, 2), SQUARE.float()).shape == (0,)
