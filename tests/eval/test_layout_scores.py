import dataclasses
import math

import numpy as np
import pytest
import torch
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.eval._layout_scores import layout_record, score_layout
from panoscene.eval._layout_view import WORST_CORNER_ERROR, distance_map, layout_view
from panoscene.geometry import OrientedBoxes, panorama_directions
from panoscene.scene import Layout, Panorama, Scene, objects_from_boxes, room_surfaces
from panoscene.synth import sample_room

DIAGONAL = math.hypot(1024, 512)


def room(
    corners: list[tuple[float, float]] | torch.Tensor,
    *,
    ceiling: float = 2.6,
    camera: float = 1.6,
    raw: torch.Tensor | None = None,
) -> Scene:
    """Return a bare room."""
    polygon = torch.as_tensor(corners, dtype=torch.float32)
    none = OrientedBoxes(torch.zeros(0, 3), torch.zeros(0, 3), torch.zeros(0))
    layout = Layout(polygon, ceiling_height=ceiling, raw_polygon=raw)
    return Scene(Panorama(1024, 512, camera), layout, objects_from_boxes(none, []), name="room")


def square(half: float, *, turn: float = 0.0) -> torch.Tensor:
    angle = torch.arange(4) * (math.pi / 2) + math.pi / 4 + turn
    return torch.stack((angle.cos(), angle.sin()), -1) * (half * math.sqrt(2))


@settings(max_examples=8)
@given(seed=st.integers(0, 10**6), corners=st.sampled_from([4, 6, 8, 10, 12]))
def test_the_truth_is_perfect(seed: int, corners: int) -> None:
    scene = sample_room(np.random.default_rng(seed), objects=0, corners=corners)
    record = layout_record(scene, scene)
    assert record.corners == corners
    assert record.scale == 1
    assert record.raw is None
    errors = dataclasses.asdict(record.regularised.errors)
    for name, value in errors.items():
        perfect = 1.0 if "iou" in name or "delta" in name else 0.0
        assert value == pytest.approx(perfect, abs=1e-9), name


def test_ious_by_hand() -> None:
    target = room([(-2, -2), (2, -2), (2, 2), (-2, 2)], ceiling=2.5)
    prediction = room([(-2, -2), (1, -2), (1, 2), (-2, 2)], ceiling=3.0)
    errors = layout_record(prediction, target).regularised.errors
    assert errors.iou_2d == pytest.approx(12 / 16)
    assert errors.iou_3d == pytest.approx(12 * 2.5 / (16 * 2.5 + 12 * 3 - 12 * 2.5))


def cast(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Return by ray casting what each pixel shows (0 floor, 1 ceiling, 2 wall) and how far."""
    surfaces = room_surfaces(scene.layout)
    corners = np.concatenate([s.vertices[s.faces].numpy() for s in surfaces]).astype(float)
    owner = np.repeat(np.arange(len(surfaces)), [len(s.faces) for s in surfaces])
    joined = trimesh.Trimesh(**trimesh.triangles.to_kwargs(corners), process=False)
    rays = panorama_directions(512, 1024, torch.zeros(1).double()).reshape(-1, 3).numpy()
    camera = np.array([0.0, 0.0, scene.panorama.camera_height])
    index = joined.ray.intersects_first(np.broadcast_to(camera, rays.shape), rays)
    normal, point = joined.face_normals[index], joined.triangles[index, 0]
    distance = ((point - camera) * normal).sum(1) / (rays * normal).sum(1)
    return np.minimum(owner[index], 2), np.where(index >= 0, distance, np.nan)


@pytest.mark.render
@pytest.mark.parametrize("corners", [4, 10])
def test_view_measures_agree_with_ray_casting(corners: int) -> None:
    target = sample_room(np.random.default_rng(corners), objects=0, corners=corners)
    noise = np.random.default_rng(1).normal(0, 0.1, (corners, 2))
    polygon = target.layout.floor_polygon + torch.from_numpy(noise).float()
    layout = dataclasses.replace(target.layout, floor_polygon=polygon, ceiling_height=3.1)
    prediction = dataclasses.replace(target, layout=layout)
    errors = layout_record(prediction, target).regularised.errors

    label, distance = cast(prediction)
    true_label, true_distance = cast(target)
    wrong = label != true_label
    assert errors.pixel_error == pytest.approx(100 * wrong.mean(), abs=0.01)
    assert errors.pixel_error > 0.3
    lat = math.pi * (0.5 - (np.arange(512) + 0.5) / 512)
    weight = np.repeat(np.cos(lat), 1024)
    weighted = 100 * (wrong * weight).sum() / weight.sum()
    # one is exact in height and the other in rows
    assert errors.solid_angle_error == pytest.approx(weighted, abs=0.02)
    assert errors.depth_rmse == pytest.approx(
        math.sqrt(np.nanmean((distance - true_distance) ** 2)), rel=2e-3
    )
    ratio = np.maximum(distance / true_distance, true_distance / distance)
    assert errors.depth_delta_1 == pytest.approx(np.nanmean(ratio < 1.25), abs=2e-3)


def test_solid_angle_error_of_a_lower_ceiling() -> None:
    """A square of half side a, h above the camera, covers 4 asin(a^2 / (a^2 + h^2))."""
    half, true, found = 2.0, 1.0, 1.4
    target = room(square(half), ceiling=1.6 + true)
    prediction = room(square(half), ceiling=1.6 + found)
    errors = layout_record(prediction, target).regularised.errors
    lost = [4 * math.asin(half**2 / (half**2 + h**2)) for h in (true, found)]
    wanted = 100 * (lost[0] - lost[1]) / (4 * math.pi)
    assert errors.solid_angle_error == pytest.approx(wanted, rel=1e-4)


@pytest.mark.parametrize("turn", [0.0, math.pi / 4])
def test_corner_error_of_a_turned_room(turn: float) -> None:
    """Turned by 0.1, every corner moves 16.3 columns; at pi / 4 one of them through the seam."""
    target = room(square(2.0, turn=turn - 0.05))
    prediction = room(square(2.0, turn=turn + 0.05).roll(1, 0))
    errors = layout_record(prediction, target).regularised.errors
    assert errors.corner_error == pytest.approx(100 * 1024 * 0.1 / (2 * math.pi) / DIAGONAL)


def test_a_corner_too_many_is_not_free() -> None:
    """A fifth corner in the middle of the east wall is 128 columns from its neighbours."""
    target = room(square(2.0))
    prediction = room([(-2, -2), (2, -2), (2, 0), (2, 2), (-2, 2)])
    errors = layout_record(prediction, target).regularised.errors
    rows = [
        abs(math.atan(h / 2) - math.atan(h / math.sqrt(8))) * 512 / math.pi for h in (1.0, -1.6)
    ]
    extra = sum(math.hypot(128, row) for row in rows) / 2
    assert errors.corner_error == pytest.approx(100 * extra / 5 / DIAGONAL)
    swapped = layout_record(target, prediction).regularised.errors
    assert swapped.corner_error == pytest.approx(errors.corner_error)
    assert errors.pixel_error == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(("factor", "agree"), [(1.1, 1.0), (0.7, 0.0)])
def test_an_error_of_scale_shows_only_in_metres(factor: float, agree: float) -> None:
    target = sample_room(np.random.default_rng(3), objects=0, corners=8)
    layout = dataclasses.replace(
        target.layout,
        floor_polygon=target.layout.floor_polygon * factor,
        ceiling_height=target.layout.ceiling_height * factor,
    )
    camera = target.panorama.camera_height * factor
    panorama = dataclasses.replace(target.panorama, camera_height=camera)
    record = layout_record(dataclasses.replace(target, layout=layout, panorama=panorama), target)
    errors = record.regularised.errors
    smaller = min(factor, 1 / factor)
    assert record.scale == pytest.approx(factor)
    # the camera is inside, but the room need not be star-shaped: the IoU has only a bound
    assert errors.iou_2d <= smaller**2 + 1e-6
    assert errors.iou_3d <= smaller**3 + 1e-6
    assert errors.scaled_iou_2d == pytest.approx(1, abs=1e-5)
    assert errors.scaled_iou_3d == pytest.approx(1, abs=1e-5)
    assert errors.corner_error == pytest.approx(0, abs=1e-4)
    assert errors.pixel_error == pytest.approx(0, abs=1e-2)
    assert errors.depth_delta_1 == agree
    assert errors.scaled_depth_delta_1 > 0.9999
    true = target.layout
    height = target.panorama.camera_height
    distance = distance_map(layout_view(true.floor_polygon, true.ceiling_height - height, height))
    wanted = abs(factor - 1) * float(distance.square().mean().sqrt())
    assert errors.depth_rmse == pytest.approx(wanted, rel=1e-3)
    assert errors.scaled_depth_rmse < 0.01


WORST = {
    "bow tie": room([(-2, -2), (2, 2), (2, -2), (-2, 2)]),
    "two corners": room([(-2, -2), (2, 2)]),
    "not finite": room([(-2, -2), (2, -2), (math.nan, 2), (-2, 2)]),
    "on a line": room([(-2, 0), (2, 0), (0, 0)]),
    "inside out": room(square(2.0), ceiling=-1.0),
    "endless": room(square(2.0), ceiling=math.inf),
    "missing": None,
}


@pytest.mark.parametrize("name", WORST)
def test_degenerate_predictions_count_at_their_worst(name: str) -> None:
    target = room(square(2.0))
    reading = layout_record(WORST[name], target).regularised
    assert reading.problem
    errors = reading.errors
    assert (errors.iou_2d, errors.iou_3d, errors.scaled_iou_2d, errors.scaled_iou_3d) == (0,) * 4
    assert errors.corner_error == WORST_CORNER_ERROR
    assert errors.pixel_error == errors.solid_angle_error == 100
    assert errors.depth_delta_1 == errors.scaled_depth_delta_1 == 0
    view = layout_view(square(2.0), 1.0, 1.6)
    assert errors.depth_rmse == pytest.approx(float(distance_map(view).square().mean().sqrt()))


@pytest.mark.parametrize("camera", [1.6, 2.8, -0.1])
def test_a_room_around_nobody_keeps_its_iou(camera: float) -> None:
    target = room(square(2.0))
    corners = square(2.0) + (3.0 if camera == 1.6 else 0.0)
    reading = layout_record(room(corners, camera=camera), target).regularised
    assert reading.problem is not None
    assert "camera" in reading.problem
    assert reading.errors.iou_2d == pytest.approx(1 / 31 if camera == 1.6 else 1)
    assert reading.errors.scaled_iou_2d == 0
    assert reading.errors.pixel_error == 100


def test_clockwise_corners_are_the_same_room() -> None:
    target = room(square(2.0))
    assert layout_record(room(square(2.0).flip(0)), target).regularised.errors.iou_3d == 1


@pytest.mark.parametrize(
    "bad",
    [WORST["bow tie"], WORST["inside out"], room(square(1.0) + 4), room(square(1), camera=3.0)],
)
def test_a_bad_target_is_an_error(bad: Scene) -> None:
    with pytest.raises(ValueError, match="target 'room': expected a room with the camera inside"):
        layout_record(room(square(2.0)), bad)


def test_scores_by_number_of_corners() -> None:
    rng = np.random.default_rng(0)
    targets = [sample_room(rng, objects=0, corners=n) for n in (4, 4, 10, 12)]
    five = room([(-2, -2), (2, -2), (3, 0), (2, 2), (-2, 2)])
    crossed = torch.tensor([[-2.0, -2.0], [2.0, 2.0], [2.0, -2.0], [-2.0, 2.0]])
    records = [
        layout_record(targets[0], targets[0]),
        layout_record(WORST["bow tie"], targets[1]),
        layout_record(targets[2], targets[2]),
        layout_record(None, targets[3]),
        layout_record(room(five.layout.floor_polygon, raw=crossed), five),
    ]
    rows = {(row.reading, row.corners): row for row in score_layout(records)}
    assert [key[1] for key in rows] == ["4", "10+", "odd", "overall", "10+", "odd", "overall"]
    assert rows["regularised", "4"].scenes == 2
    assert rows["regularised", "4"].degenerate == 1
    assert rows["regularised", "4"].mean.iou_3d == pytest.approx(0.5)
    assert rows["regularised", "10+"].mean.iou_2d == pytest.approx(0.5)
    assert rows["regularised", "odd"].mean.iou_2d == pytest.approx(1)
    assert rows["regularised", "overall"].mean.iou_2d == pytest.approx(3 / 5)
    # the raw reading: one crosses itself, and the missing scene is missing here too
    assert rows["raw", "overall"].scenes == rows["raw", "overall"].degenerate == 2
    assert rows["raw", "odd"].mean.iou_2d == 0
    assert rows["regularised", "overall"].scale_error == 0
    assert rows["raw", "10+"].scale_error is None
