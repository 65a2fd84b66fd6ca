import dataclasses
from collections import Counter

import numpy as np
import pytest
import shapely
import shapely.affinity
import torch

from panoscene.geometry import (
    bfov_from_boxes,
    box_contains,
    box_footprint,
    is_manhattan,
    paired_intersection_volume,
    penetration_depth,
    polygon_area,
    signed_distance_to_polygon,
)
from panoscene.scene import CATEGORIES, Scene, relations_from_boxes, relative_yaw_bins
from panoscene.synth import sample_room
from panoscene.synth._floor_plan import sample_corner_count, sample_floor_plan
from panoscene.synth._furnishing import NOMINAL_SIZE

WALL_PIECES = {"bed", "sofa", "shelf", "bottom_cabinet", "fridge", "stove", "door", "window",
               "picture", "wall_mounted_tv", "mirror", "wall_clock", "top_cabinet", "piano",
               "toilet", "bathtub", "washer", "heater", "range_hood"}  # fmt: skip


@pytest.fixture(scope="module")
def rooms() -> list[Scene]:
    return [
        sample_room(np.random.default_rng(seed), objects=objects, corners=corners)
        for seed, (objects, corners) in enumerate(
            [(20, 8)] * 6 + [(20, None)] * 8 + [(6, 4), (6, 10), (10, 12), (50, None), (80, 6)]
        )
    ]


def names_of(room: Scene) -> list[str]:
    return [CATEGORIES[index] for index in room.objects.category.tolist()]


def bottom_and_top(room: Scene) -> tuple[torch.Tensor, torch.Tensor]:
    boxes = room.objects.boxes
    half = boxes.size[:, 2] / 2
    return boxes.centre[:, 2] - half, boxes.centre[:, 2] + half


def wall_of_back(room: Scene, index: int) -> tuple[float, float]:
    """Distance of the farther end of a box's back to the nearest wall line, angle to its normal."""
    boxes = room.objects.boxes
    polygon = room.layout.floor_polygon.numpy()
    back = box_footprint(boxes[index])[:2].numpy()
    walls = np.roll(polygon, -1, axis=0) - polygon
    along = walls / np.linalg.norm(walls, axis=1, keepdims=True)
    inward = np.stack([-along[:, 1], along[:, 0]], axis=1)
    gaps = np.abs(((back[:, None] - polygon) * inward).sum(axis=2)).max(axis=0)
    on_wall = [
        shapely.LineString([polygon[i], polygon[(i + 1) % len(polygon)]]).distance(
            shapely.LineString(back)
        )
        for i in range(len(polygon))
    ]
    wall = int((gaps + on_wall).argmin())
    yaw = float(boxes.yaw[index])
    front = np.array([-np.sin(yaw), np.cos(yaw)])
    return float(gaps[wall]) + on_wall[wall], float(np.arccos(min(1.0, front @ inward[wall])))


@pytest.mark.parametrize(("objects", "corners"), [(20, 8), (35, None), (0, 4)])
def test_same_seed_gives_the_same_room(objects: int, corners: int | None) -> None:
    first, again = (
        sample_room(np.random.default_rng(5), objects=objects, corners=corners) for _ in range(2)
    )
    other = sample_room(np.random.default_rng(6), objects=objects, corners=corners)
    for name in ("centre", "size", "yaw"):
        assert torch.equal(getattr(first.objects.boxes, name), getattr(again.objects.boxes, name))
    assert torch.equal(first.layout.floor_polygon, again.layout.floor_polygon)
    assert first.objects.id == again.objects.id
    assert not torch.equal(first.layout.floor_polygon[0], other.layout.floor_polygon[0])


@pytest.mark.parametrize("objects", [0, 1, 2, 3, 7, 20, 64, 200])
def test_has_exactly_the_objects_asked_for(objects: int) -> None:
    room = sample_room(np.random.default_rng(objects), objects=objects)
    assert len(room.objects.boxes) == objects
    assert len(set(room.objects.id)) == objects
    assert room.objects.bfov.shape == (objects, 4)
    assert room.relations is not None
    assert room.relations.touching.shape == (objects, objects)
    assert room.relations.touching_wall.shape == (objects, len(room.layout.floor_polygon))


@pytest.mark.parametrize("corners", [4, 6, 8, 10, 12])
def test_floor_is_a_simple_manhattan_polygon_of_so_many_corners(corners: int) -> None:
    for seed in range(20):
        plan = sample_floor_plan(np.random.default_rng(seed), 20.0, corners)
        polygon = shapely.Polygon(plan.polygon)
        assert len(plan.polygon) == corners
        assert polygon.is_valid
        assert polygon.exterior.is_ccw
        assert is_manhattan(torch.from_numpy(plan.polygon))
        assert plan.wall_length.min() > 0.1
        notches = [
            shapely.box(*low, *high)
            for low, high in zip(plan.notch_low, plan.notch_high, strict=True)
        ]
        room = shapely.box(0.0, 0.0, *plan.extent).difference(shapely.union_all(notches))
        assert polygon.symmetric_difference(room).area < 1e-9


def test_corner_counts_have_their_shares() -> None:
    rng = np.random.default_rng(0)
    counts = Counter(sample_corner_count(rng) for _ in range(2000))
    assert set(counts) == {4, 6, 8, 10}
    assert abs(counts[4] / 2000 - 0.60) < 0.05
    assert abs(counts[6] / 2000 - 0.22) < 0.04


def test_clearance_is_the_distance_to_the_polygon() -> None:
    rng = np.random.default_rng(3)
    plan = sample_floor_plan(rng, 30.0, 10)
    points = rng.uniform(0.0, 1.0, (50, 2)) * plan.extent
    polygon = shapely.Polygon(plan.polygon)
    expected = [
        polygon.exterior.distance(point) if polygon.contains(point) else 0.0
        for point in map(shapely.Point, points)
    ]
    assert np.allclose(plan.clearance(points), expected, atol=1e-9)


def test_no_two_objects_overlap(rooms: list[Scene]) -> None:
    for room in rooms:
        boxes = room.objects.boxes
        first, second = torch.triu_indices(len(boxes), len(boxes), 1)
        assert penetration_depth(boxes[first], boxes[second]).max() < 1e-4
        assert paired_intersection_volume(boxes[first], boxes[second]).max() < 1e-4


def test_footprints_agree_with_shapely(rooms: list[Scene]) -> None:
    for room in rooms[:8]:
        bottom, top = bottom_and_top(room)
        shapes = [shapely.Polygon(f) for f in box_footprint(room.objects.boxes).double().numpy()]
        hull = shapely.Polygon(room.layout.floor_polygon.double().numpy()).buffer(1e-4)
        assert all(hull.contains(shape) for shape in shapes)
        for a, shape in enumerate(shapes):
            for b in range(a):
                height = float(torch.minimum(top[a], top[b]) - torch.maximum(bottom[a], bottom[b]))
                if height > 1e-4:
                    assert shape.intersection(shapes[b]).area < 1e-4


def test_everything_is_in_the_room_and_on_the_floor_exactly(rooms: list[Scene]) -> None:
    for room in rooms:
        bottom, top = bottom_and_top(room)
        points = box_footprint(room.objects.boxes).flatten(0, 1)
        assert signed_distance_to_polygon(points, room.layout.floor_polygon).max() < 1e-4
        assert bottom.min() > -1e-6
        assert top.max() < room.layout.ceiling_height + 1e-5
        assert 2.3 <= room.layout.ceiling_height <= 3.4
        for name, low in zip(names_of(room), bottom.tolist(), strict=True):
            if name in {"bed", "sofa", "chair", "table", "door", "carpet", "fridge", "plant"}:
                assert abs(low) < 1e-6


def test_camera_has_clearance(rooms: list[Scene]) -> None:
    for room in rooms:
        polygon = room.layout.floor_polygon
        assert signed_distance_to_polygon(torch.zeros(1, 2), polygon)[0] < -0.45
        heights = torch.linspace(0.0, room.layout.ceiling_height, 20)
        points = torch.stack([torch.zeros(20), torch.zeros(20), heights], dim=1)
        wide = dataclasses.replace(
            room.objects.boxes, size=room.objects.boxes.size + torch.tensor([0.8, 0.8, 0.0])
        )
        assert not box_contains(wide, points.expand(len(wide), 20, 3)).any()


def test_furniture_has_its_back_exactly_at_a_wall_and_faces_the_room(rooms: list[Scene]) -> None:
    tested = 0
    for room in rooms:
        for index, name in enumerate(names_of(room)):
            if name in WALL_PIECES:
                gap, angle = wall_of_back(room, index)
                assert gap < 1e-4, (room.name, name)
                assert angle < 1e-3, (room.name, name)
                tested += 1
    assert tested > 150


def test_chairs_face_a_table(rooms: list[Scene]) -> None:
    facing, chairs = 0, 0
    for room in rooms:
        boxes, names = room.objects.boxes, names_of(room)
        tables = [index for index, name in enumerate(names) if name == "table"]
        for index, name in enumerate(names):
            if name != "chair":
                continue
            chairs += 1
            yaw = boxes.yaw[index]
            ahead = boxes.centre[index, :2] + torch.stack([-yaw.sin(), yaw.cos()]) * 0.6
            point = torch.cat([ahead, torch.tensor([0.3])])
            facing += any(bool(box_contains(boxes[table], point[None])[0]) for table in tables)
    assert chairs > 20
    assert facing == chairs


def test_supported_objects_touch_what_they_stand_on(rooms: list[Scene]) -> None:
    seen = 0
    for room in rooms:
        bottom, top = bottom_and_top(room)
        boxes = room.objects.boxes
        for index, name in enumerate(names_of(room)):
            if name in {"table_lamp", "laptop", "monitor", "microwave", "standing_tv"}:
                centre = boxes.centre[index]
                below = torch.stack([centre[0], centre[1], bottom[index] - 0.005])
                support = box_contains(boxes, below.expand(len(boxes), 1, 3))[:, 0]
                assert support.sum() == 1, name
                assert abs(float(top[support][0] - bottom[index])) < 1e-5
                assert room.relations is not None
                assert room.relations.touching[index, support].item() == 1.0
                seen += 1
            if name == "top_cabinet":
                assert abs(float(top[index]) - room.layout.ceiling_height) < 1e-5
    assert seen > 10


def test_sizes_are_near_the_nominal_ones(rooms: list[Scene]) -> None:
    for room in rooms:
        for name, size in zip(names_of(room), room.objects.boxes.size.tolist(), strict=True):
            ratio = np.array(size) / NOMINAL_SIZE[name]
            assert (ratio > 0.5).all(), name
            assert (ratio < 1.4).all() or name in {"top_cabinet"}, name


def test_ground_truth_is_consistent(rooms: list[Scene]) -> None:
    for room in rooms:
        objects, height = room.objects, room.panorama.camera_height
        assert torch.equal(objects.bfov, bfov_from_boxes(objects.boxes, height))
        assert bool((objects.score == 1).all() & (objects.yaw_score == 1).all())
        assert bool((objects.distance_score == 1).all())
        expected = relations_from_boxes(objects.boxes, room.layout, height)
        assert room.relations is not None
        for field in dataclasses.fields(expected):
            assert torch.equal(getattr(room.relations, field.name), getattr(expected, field.name))
        assert bool((room.relations.inside_room == 1).all())


def test_most_relative_yaws_to_walls_are_quarter_turns(rooms: list[Scene]) -> None:
    quarter = relative_yaw_bins(torch.arange(-2, 2) * (torch.pi / 2)).sum(dim=0)
    shares = [
        float((room.relations.relative_yaw_wall * quarter).sum(-1).mean())
        for room in rooms
        if room.relations is not None
    ]
    assert np.mean(shares) > 0.9


def test_objects_are_spread_over_the_room() -> None:
    # were everything in one corner, the hull of the centres would be a small part of the floor
    shares = []
    for seed in range(8):
        room = sample_room(np.random.default_rng(seed), objects=20, corners=4)
        hull = shapely.MultiPoint(room.objects.boxes.centre[:, :2].double().numpy()).convex_hull
        shares.append(hull.area / float(polygon_area(room.layout.floor_polygon)))
    assert min(shares) > 0.3
    assert np.mean(shares) > 0.6


def test_rooms_grow_with_the_number_of_objects() -> None:
    areas = [
        float(polygon_area(sample_room(np.random.default_rng(1), objects=n).layout.floor_polygon))
        for n in (2, 20, 100)
    ]
    assert areas[0] < areas[1] < areas[2]
    assert areas[2] < 400.0


def test_yaw_of_the_room_is_arbitrary(rooms: list[Scene]) -> None:
    sides = torch.stack(
        [room.layout.floor_polygon[1] - room.layout.floor_polygon[0] for room in rooms]
    )
    angles = torch.atan2(sides[:, 1], sides[:, 0]).remainder(torch.pi / 2)
    assert angles.std() > 0.2


@pytest.mark.parametrize("corners", [5, 2, 14])
def test_odd_numbers_of_corners_are_refused(corners: int) -> None:
    with pytest.raises(ValueError, match="corners"):
        sample_room(np.random.default_rng(0), corners=corners)


@pytest.mark.parametrize("height", [0.0, 2.5, float("nan")])
def test_a_camera_outside_the_room_is_refused(height: float) -> None:
    with pytest.raises(ValueError, match="camera_height"):
        sample_room(np.random.default_rng(0), camera_height=height)


def test_a_negative_number_of_objects_is_refused() -> None:
    with pytest.raises(ValueError, match="objects"):
        sample_room(np.random.default_rng(0), objects=-1)
