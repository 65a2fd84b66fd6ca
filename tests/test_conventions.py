"""One test for each line of docs/conventions.md, under the name that stands in its last column."""

import inspect
import json
import math
import re
from pathlib import Path

import jaxtyping
import numpy as np
import pytest
import torch
from torch import Tensor
from torch.testing import assert_close

from panoscene import geometry
from panoscene.geometry import (
    OrientedBoxes,
    bfov_contains,
    bfov_from_boxes,
    bfov_from_directions,
    box_contains,
    box_corners,
    camera_from_turned,
    direction_from_lonlat,
    direction_from_pixel,
    lonlat_from_direction,
    lonlat_from_pixel,
    object_from_world,
    perspective_crop,
    pixel_from_direction,
    pixel_from_lonlat,
    polygon_area,
    polygon_problem,
    sample_panorama,
    signed_distance_to_polygon,
    view_relative_yaw,
    wall_boxes,
    wall_normals,
    world_from_object,
    wrap_angle,
    yaw_from_view_relative,
)
from panoscene.scene import Detections, scene_json_schema, scene_to_json
from panoscene.synth import sample_room

PI = math.pi
HEIGHT, WIDTH = 512, 1024
RIGHT, AHEAD, UP = torch.eye(3).unbind()
SQUARE = torch.tensor([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])


def box(centre: list[float], size: list[float], yaw: float = 0.0) -> OrientedBoxes:
    """Return one box."""
    return OrientedBoxes(torch.tensor(centre), torch.tensor(size), torch.tensor(yaw))


def front(yaw: float) -> Tensor:
    """Return where a box with this yaw looks, from its transform to the world."""
    return world_from_object(box([0.0, 0.0, 0.0], [1.0, 1.0, 1.0], yaw))[:3, 1]


def numbered_panorama(height: int = 4, width: int = 8) -> Tensor:
    """Return a panorama with one channel that counts its pixels row by row."""
    return torch.arange(float(height * width)).reshape(1, height, width)


def sampled(image: Tensor, u: float, v: float) -> Tensor:
    """Return the image's value at one continuous pixel."""
    return sample_panorama(image, torch.tensor([[[u, v]]])).squeeze()


# The page


def test_every_line_of_the_page_has_its_test(root: Path) -> None:
    page = (root / "docs" / "conventions.md").read_text()
    lines = [line for line in page.splitlines() if line.startswith("| ")]
    promised = [re.search(r"\| `(\w+)` \|$", line) for line in lines]
    names = {f"test_{match[1]}" for match in promised if match}
    headers = sum(line.endswith("| test |") or set(line) <= set("|- ") for line in lines)
    assert len(names) == len(lines) - headers
    written = {name for name in globals() if name.startswith("test_")}
    assert written - {"test_every_line_of_the_page_has_its_test"} == names


# Units


def test_units_are_metres_and_radians() -> None:
    quarter_turn = torch.tensor([PI / 2, 0.0])
    assert_close(direction_from_lonlat(quarter_turn), RIGHT)
    assert scene_json_schema()["properties"]["units"]["const"] == "metres, radians"


def test_degrees_carry_their_name() -> None:
    schema = json.dumps(scene_json_schema())
    with_degrees = [name for name in re.findall(r'"(\w+)":', schema) if "deg" in name.lower()]
    assert with_degrees
    for name in with_degrees:
        assert name.endswith("_deg")
    for name, function in inspect.getmembers(geometry, inspect.isfunction):
        for parameter in inspect.signature(function).parameters:
            assert "deg" not in parameter, f"{name}({parameter})"


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_dtype_follows_the_input(dtype: torch.dtype) -> None:
    pixel = torch.tensor([3.0, 1.0], dtype=dtype)
    assert direction_from_pixel(pixel, 4, 8).dtype == dtype
    ones = torch.ones(2, 3, dtype=dtype)
    boxes = OrientedBoxes(ones, ones, pixel)
    assert box_corners(boxes).dtype == dtype
    assert wall_normals(SQUARE.to(dtype)).dtype == dtype


# World and camera


def test_world_is_right_handed() -> None:
    assert_close(torch.linalg.cross(RIGHT, AHEAD), UP)
    zenith = direction_from_pixel(torch.tensor([WIDTH / 2, 0.0]), HEIGHT, WIDTH)
    assert_close(zenith, UP)


def test_centre_column_looks_along_y() -> None:
    horizon = torch.tensor([[512.0, 256.0], [768.0, 256.0]])
    assert_close(direction_from_pixel(horizon, HEIGHT, WIDTH), torch.stack([AHEAD, RIGHT]))


def test_origin_is_on_the_floor_under_the_camera() -> None:
    speck = box([0.0, 2.0, 0.0], [1e-3, 1e-3, 1e-3])
    lon, lat = bfov_from_boxes(speck, 2.0)[:2]
    assert_close(torch.stack([lon, lat]), torch.tensor([0.0, -PI / 4]), atol=1e-3, rtol=0)


def test_camera_is_at_its_height() -> None:
    speck = box([0.0, 3.0, 1.6], [1e-3, 1e-3, 1e-3])
    assert_close(bfov_from_boxes(speck, 1.6)[:2], torch.zeros(2), atol=1e-4, rtol=0)


# Pixels


def test_pixel_axes_run_right_and_down() -> None:
    corners = torch.tensor([[0.0, 0.0], [WIDTH / 2, HEIGHT]])
    upper_left, bottom = lonlat_from_pixel(corners, HEIGHT, WIDTH)
    assert_close(upper_left, torch.tensor([-PI, PI / 2]))
    assert_close(bottom, torch.tensor([0.0, -PI / 2]))


def test_pixel_centres_are_at_one_half() -> None:
    image = numbered_panorama()
    assert_close(sampled(image, 5.5, 2.5), image[0, 2, 5])
    assert_close(sampled(image, 5.0, 2.5), (image[0, 2, 4] + image[0, 2, 5]) / 2)


def test_images_are_channels_height_width() -> None:
    image = torch.zeros(3, 32, 64)
    image[0] = 1.0
    crop = perspective_crop(image, torch.tensor([0.0, 0.0, 0.8, 1.0]), (64, 48))
    assert crop.shape == (3, 64, 48)
    assert_close(crop.mean((1, 2)), torch.tensor([1.0, 0.0, 0.0]))


# Sphere


def test_lon_grows_to_the_right() -> None:
    u = torch.tensor([0.0, 256.0, 512.0, 768.0])
    lon = lonlat_from_pixel(torch.stack([u, torch.full_like(u, 256.0)], -1), HEIGHT, WIDTH)[:, 0]
    assert_close(lon, torch.tensor([-PI, -PI / 2, 0.0, PI / 2]))


def test_lat_grows_upwards() -> None:
    v = torch.tensor([0.0, 128.0, 256.0, 512.0])
    lat = lonlat_from_pixel(torch.stack([torch.full_like(v, 512.0), v], -1), HEIGHT, WIDTH)[:, 1]
    assert_close(lat, torch.tensor([PI / 2, PI / 4, 0.0, -PI / 2]))


def test_direction_formula() -> None:
    assert_close(
        direction_from_lonlat(torch.tensor([[PI / 6, 0.0], [0.4, -0.7]])),
        torch.tensor(
            [
                [0.5, math.sqrt(0.75), 0.0],
                [
                    math.cos(-0.7) * math.sin(0.4),
                    math.cos(-0.7) * math.cos(0.4),
                    math.sin(-0.7),
                ],
            ]
        ),
    )


def test_image_is_circular_at_the_seam() -> None:
    image = numbered_panorama()
    assert_close(sampled(image, -1.0, 2.5), sampled(image, 7.0, 2.5))
    # half way between the last and the first column
    assert_close(sampled(image, 0.0, 2.5), (image[0, 2, 0] + image[0, 2, 7]) / 2)
    turns = torch.tensor([[1.0 - 2 * PI, 0.0], [1.0, 0.0], [1.0 + 2 * PI, 0.0]])
    pixels = pixel_from_lonlat(turns, HEIGHT, WIDTH)
    assert_close(pixels, pixels[1].expand(3, 2), atol=1e-3, rtol=0)


def test_bfov_is_centre_and_extent() -> None:
    width, height = math.radians(90), math.radians(60)
    edges = direction_from_lonlat(
        torch.tensor([[width / 2, 0.0], [-width / 2, 0.0], [0.0, height / 2], [0.0, -height / 2]])
    )
    expected = torch.tensor([0.0, 0.0, width, height])
    assert_close(bfov_from_directions(edges), expected, atol=1e-3, rtol=0)


def test_bfov_is_measured_in_the_turned_camera() -> None:
    lonlat = torch.tensor([0.9, math.radians(80)])
    bfov = torch.cat([lonlat, torch.tensor([math.radians(20), math.radians(20)])])
    turned = torch.tensor([[0.0, 0.0], [0.17, 0.0], [0.18, 0.0], [0.0, 0.17], [0.0, -0.18]])
    direction = direction_from_lonlat(turned) @ camera_from_turned(lonlat).T
    assert_close(lonlat_from_direction(direction[0]), lonlat)
    assert bfov_contains(bfov.expand(5, 4), direction).tolist() == [True, True, False, True, False]
    # no roll: what is beside the centre in the turned camera is not higher or lower than it
    assert_close(camera_from_turned(lonlat)[2, 0], torch.tensor(0.0))
    assert (wrap_angle(lonlat_from_direction(direction[1])[0] - lonlat[0])) > 0.5


# Objects


def test_box_axes_are_right_front_up() -> None:
    sofa = box([1.0, 2.0, 0.4], [2.0, 0.9, 0.8], yaw=0.0)
    axes = world_from_object(sofa)
    assert_close(axes[:3, :3], torch.stack([RIGHT, AHEAD, UP], -1))
    assert_close(axes[:3, 3], sofa.centre)


def test_size_is_the_full_extent() -> None:
    sofa = box([0.0, 0.0, 0.0], [2.0, 0.9, 0.8])
    faces = torch.tensor([[0.99, 0.0, 0.0], [1.01, 0.0, 0.0], [0.0, 0.46, 0.0], [0.0, 0.0, 0.39]])
    assert box_contains(sofa, faces).tolist() == [True, False, False, True]


def test_corner_bits_are_x_y_z() -> None:
    corners = box_corners(box([0.0, 0.0, 0.0], [2.0, 4.0, 6.0]))
    assert_close(corners[5], torch.tensor([1.0, -2.0, 3.0]))
    for k, corner in enumerate(corners):
        assert [bool(value > 0) for value in corner] == [bool(k & bit) for bit in (1, 2, 4)]


def test_canonical_box_is_the_unit_cube() -> None:
    sofa = box([1.0, 2.0, 0.4], [2.0, 0.9, 0.8], yaw=0.7)
    ends = torch.cat([box_corners(sofa)[[0, 7]], torch.ones(2, 1)], -1)
    canonical = (ends @ object_from_world(sofa).T)[:, :3] / sofa.size
    assert_close(canonical, torch.tensor([[-0.5] * 3, [0.5] * 3]))


# Yaw


def test_yaw_is_counter_clockwise_from_y() -> None:
    assert_close(front(0.0), AHEAD)
    assert_close(front(PI / 2), -RIGHT)


def test_front_and_right_of_a_yaw() -> None:
    axes = world_from_object(box([0.0, 0.0, 0.0], [1.0, 1.0, 1.0], yaw=0.7))
    assert_close(axes[:3, 1], torch.tensor([-math.sin(0.7), math.cos(0.7), 0.0]))
    assert_close(axes[:3, 0], torch.tensor([math.cos(0.7), math.sin(0.7), 0.0]))


def test_angles_are_wrapped_half_open() -> None:
    angles = torch.tensor([PI, -PI, 3 * PI / 2, 0.5 - 4 * PI], dtype=torch.float64)
    expected = torch.tensor([-PI, -PI, -PI / 2, 0.5], dtype=torch.float64)
    assert_close(wrap_angle(angles), expected)


@pytest.mark.parametrize("lon", [-3.0, 0.0, 0.3, 2.0])
def test_facing_away_is_minus_lon(lon: float) -> None:
    line_of_sight = direction_from_lonlat(torch.tensor([lon, 0.0]))
    assert_close(front(-lon), line_of_sight)


@pytest.mark.parametrize("lon", [-3.0, 0.0, 0.3, 2.0])
def test_facing_the_camera_is_pi_minus_lon(lon: float) -> None:
    line_of_sight = direction_from_lonlat(torch.tensor([lon, 0.0]))
    yaw = float(wrap_angle(torch.tensor(PI - lon, dtype=torch.float64)))
    assert -PI <= yaw < PI
    assert_close(front(yaw), -line_of_sight)


def test_view_relative_yaw_is_clockwise() -> None:
    lon, theta = torch.tensor(0.3), torch.tensor(0.2)
    yaw = yaw_from_view_relative(theta, lon)
    assert_close(yaw, torch.tensor(-0.5))
    assert_close(view_relative_yaw(yaw, lon), theta)
    # the front is clockwise from the line of sight: to its right
    seen = lonlat_from_direction(front(float(yaw)))[0]
    assert_close(seen - lon, theta)


# Rooms


def test_floor_polygons_run_counter_clockwise() -> None:
    assert_close(polygon_area(SQUARE), torch.tensor(16.0))
    assert polygon_problem(SQUARE) is None
    assert "clockwise" in str(polygon_problem(SQUARE.flip(0)))


def test_floor_polygons_are_simple() -> None:
    assert polygon_problem(SQUARE[[0, 1, 3, 2]]) is not None


def test_wall_i_starts_at_corner_i() -> None:
    centres = wall_boxes(SQUARE, 0.0, 2.5, thickness=0.0).centre
    for i in range(4):
        middle = (SQUARE[i] + SQUARE[(i + 1) % 4]) / 2
        assert_close(centres[i, :2], middle)


def test_wall_normals_point_into_the_room() -> None:
    inwards = torch.tensor([[0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [1.0, 0.0]])
    assert_close(wall_normals(SQUARE), inwards)
    fronts = world_from_object(wall_boxes(SQUARE, 0.0, 2.5))[:, :2, 1]
    assert_close(fronts, inwards)


def test_signed_distance_is_negative_inside() -> None:
    points = torch.tensor([[1.5, 0.0], [2.0, 0.0], [2.5, 0.0]])
    assert_close(signed_distance_to_polygon(points, SQUARE), torch.tensor([-0.5, 0.0, 0.5]))


# Transforms and batches


def test_transforms_read_right_to_left() -> None:
    lamp = box([1.0, 2.0, 3.0], [0.3, 0.3, 1.5], yaw=0.4)
    assert_close((world_from_object(lamp) @ torch.tensor([0.0, 0.0, 0.0, 1.0]))[:3], lamp.centre)
    lonlat = torch.tensor([0.5, 0.2])
    assert_close(camera_from_turned(lonlat) @ AHEAD, direction_from_lonlat(lonlat))


def test_transforms_chain_by_name() -> None:
    lamp = box([1.0, 2.0, 3.0], [0.3, 0.3, 1.5], yaw=0.4)
    assert_close(object_from_world(lamp) @ world_from_object(lamp), torch.eye(4))


def test_leading_axes_are_a_batch() -> None:
    pixels = torch.rand(4, 5, 2, generator=torch.Generator().manual_seed(0)) * HEIGHT
    directions = direction_from_pixel(pixels, HEIGHT, WIDTH)
    assert directions.shape == (4, 5, 3)
    assert_close(directions[2, 3], direction_from_pixel(pixels[2, 3], HEIGHT, WIDTH))
    assert_close(pixel_from_direction(directions, HEIGHT, WIDTH), pixels, atol=1e-2, rtol=0)


def test_records_agree_on_their_length() -> None:
    with pytest.raises(jaxtyping.TypeCheckError):
        OrientedBoxes(torch.zeros(2, 3), torch.ones(3, 3), torch.zeros(2))
    with pytest.raises(jaxtyping.TypeCheckError):
        Detections(torch.zeros(2, 4), torch.zeros(3, dtype=torch.int64), torch.zeros(2))


# Files and randomness


def test_files_state_units_and_frame() -> None:
    document = scene_to_json(sample_room(np.random.default_rng(0), objects=2))
    assert document["schema"] == "panoscene/scene"
    assert isinstance(document["version"], int)
    assert document["units"] == "metres, radians"
    assert "+z up" in document["frame"]


def test_samplers_take_a_generator() -> None:
    # the standard library's random is left out: the shape checks of this test run draw from it
    torch_before = torch.get_rng_state()
    numpy_before = json.dumps(np.random.get_state(legacy=False), default=str)  # noqa: NPY002
    rooms = [sample_room(np.random.default_rng(7), objects=3) for _ in range(2)]
    assert_close(rooms[0].objects.boxes.centre, rooms[1].objects.boxes.centre, atol=0, rtol=0)
    assert torch.equal(torch.get_rng_state(), torch_before)
    assert json.dumps(np.random.get_state(legacy=False), default=str) == numpy_before  # noqa: NPY002
