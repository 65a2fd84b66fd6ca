import dataclasses

import numpy as np
import pytest
import torch

from panoscene.geometry import (
    lonlat_from_direction,
    polygon_problem,
    view_relative_yaw,
    wall_normals,
    wrap_angle,
)
from panoscene.scene import Scene
from panoscene.synth import PerturbNoise, perturb_scene, sample_room

NONE = PerturbNoise(direction=0.0, distance=0.0, size=0.0, yaw=0.0, flip=0.0, layout=0.0, bfov=0.0)


@pytest.fixture(scope="module")
def room() -> Scene:
    return sample_room(np.random.default_rng(0), objects=200)


def view(scene: Scene) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Return direction, distance and view-relative yaw of the objects."""
    boxes = scene.objects.boxes
    sight = boxes.centre - torch.tensor([0.0, 0.0, scene.panorama.camera_height])
    distance = torch.linalg.vector_norm(sight, dim=-1)
    direction = sight / distance[:, None]
    return direction, distance, view_relative_yaw(boxes.yaw, lonlat_from_direction(direction)[:, 0])


def correlation(a: torch.Tensor, b: torch.Tensor) -> float:
    return float(torch.corrcoef(torch.stack([a, b]))[0, 1])


def test_same_seed_gives_the_same_estimate(room: Scene) -> None:
    first, again, other = (perturb_scene(room, np.random.default_rng(s)) for s in (1, 1, 2))
    for field in ("score", "bfov", "distance_score", "yaw_score"):
        assert torch.equal(getattr(first.objects, field), getattr(again.objects, field))
    assert torch.equal(first.objects.boxes.centre, again.objects.boxes.centre)
    assert not torch.equal(first.objects.boxes.centre, other.objects.boxes.centre)


def test_no_noise_changes_nothing_but_scores(room: Scene) -> None:
    same = perturb_scene(room, np.random.default_rng(1), NONE)
    before, after = room.objects, same.objects
    assert torch.allclose(after.boxes.centre, before.boxes.centre, atol=1e-5)
    assert torch.equal(after.boxes.size, before.boxes.size)
    assert wrap_angle(after.boxes.yaw - before.boxes.yaw).abs().max() < 1e-4
    assert torch.allclose(after.bfov[:, 2:], before.bfov[:, 2:])
    assert wrap_angle(after.bfov[:, :2] - before.bfov[:, :2]).abs().max() < 1e-4
    assert same.layout is room.layout
    assert after.score.mean() > 0.9


def test_keeps_what_is_not_estimated_here(room: Scene) -> None:
    noisy = perturb_scene(room, np.random.default_rng(1))
    assert noisy.relations is room.relations
    assert noisy.objects.id == room.objects.id
    assert torch.equal(noisy.objects.category, room.objects.category)
    assert noisy.panorama == room.panorama


def test_errors_have_the_documented_spread(room: Scene) -> None:
    noise = PerturbNoise(flip=0.0)
    noisy = perturb_scene(room, np.random.default_rng(3), noise)
    direction, distance, yaw = view(room)
    new_direction, new_distance, new_yaw = view(noisy)
    off = torch.linalg.vector_norm(torch.linalg.cross(direction, new_direction), dim=-1)
    # 200 draws: the standard deviation is known to about 5 %
    assert float((off**2).mean().sqrt()) == pytest.approx(noise.direction * 2**0.5, rel=0.2)
    assert float((new_distance / distance).log().std()) == pytest.approx(noise.distance, rel=0.2)
    sizes = (noisy.objects.boxes.size / room.objects.boxes.size).log()
    assert float(sizes.std()) == pytest.approx(noise.size, rel=0.15)
    assert float(wrap_angle(new_yaw - yaw).std()) == pytest.approx(noise.yaw, rel=0.2)


def test_an_error_in_the_direction_turns_the_box_with_the_line_of_sight(room: Scene) -> None:
    noisy = perturb_scene(room, np.random.default_rng(3), dataclasses.replace(NONE, direction=0.05))
    _, distance, yaw = view(room)
    _, new_distance, new_yaw = view(noisy)
    assert wrap_angle(new_yaw - yaw).abs().max() < 1e-3
    assert torch.allclose(distance, new_distance, atol=1e-4)
    assert wrap_angle(noisy.objects.boxes.yaw - room.objects.boxes.yaw).abs().mean() > 0.01


def test_flips_are_quarter_turns(room: Scene) -> None:
    noisy = perturb_scene(room, np.random.default_rng(3), dataclasses.replace(NONE, flip=1.0))
    turn = wrap_angle(noisy.objects.boxes.yaw - room.objects.boxes.yaw)
    assert torch.allclose(turn.abs(), torch.full_like(turn, torch.pi / 2), atol=1e-4)
    assert 0.35 < float((turn > 0).float().mean()) < 0.65
    some = perturb_scene(room, np.random.default_rng(3), dataclasses.replace(NONE, flip=0.1))
    turned = wrap_angle(some.objects.boxes.yaw - room.objects.boxes.yaw).abs() > 1.0
    assert 0.04 < float(turned.float().mean()) < 0.18
    assert some.objects.yaw_score[turned].mean() < 0.35 < some.objects.yaw_score[~turned].mean()


def test_scores_fall_with_the_errors(room: Scene) -> None:
    noisy = perturb_scene(room, np.random.default_rng(4))
    objects = noisy.objects
    _, distance, yaw = view(room)
    _, new_distance, new_yaw = view(noisy)
    size_error = (objects.boxes.size / room.objects.boxes.size).log().abs().amax(-1)
    pairs = {
        "distance": ((new_distance / distance).log().abs(), objects.distance_score),
        "yaw": (wrap_angle(new_yaw - yaw).abs(), objects.yaw_score),
        "size": (size_error, objects.score),
    }
    for name, (error, score) in pairs.items():
        assert bool(((score > 0.0) & (score < 1.0)).all()), name
        assert correlation(error, score) < -0.3, name
        assert correlation(error, score) > -0.98, name
    # each score is about its own error
    assert abs(correlation(pairs["yaw"][0], objects.distance_score)) < 0.25


def test_scores_have_the_documented_means(room: Scene) -> None:
    exact = perturb_scene(room, np.random.default_rng(6), NONE).objects
    for score in (exact.score, exact.distance_score, exact.yaw_score):
        assert float(score.mean()) == pytest.approx(0.94, abs=0.02)
    flipped = perturb_scene(room, np.random.default_rng(6), dataclasses.replace(NONE, flip=1.0))
    assert float(flipped.objects.yaw_score.mean()) == pytest.approx(0.17, abs=0.04)


def test_bfov_stays_near_the_true_one(room: Scene) -> None:
    noisy = perturb_scene(room, np.random.default_rng(5))
    before, after = room.objects.bfov, noisy.objects.bfov
    assert not torch.equal(before, after)
    low = before[:, 1].abs() < 1.0
    centre = wrap_angle(after[:, :2] - before[:, :2]).abs()[low]
    assert bool((centre <= 0.15 * before[low][:, 2:].amax(-1, keepdim=True)).all())
    assert bool(((after[:, 2:] / before[:, 2:]).log().abs() < 0.2).all())
    assert bool((after[:, 2:] > 0.0).all())


def test_layout_noise_moves_walls_along_their_normals() -> None:
    for seed in range(10):
        room = sample_room(np.random.default_rng(seed), objects=0)
        noisy = perturb_scene(room, np.random.default_rng(seed), PerturbNoise(layout=0.05))
        before, after = room.layout.floor_polygon, noisy.layout.floor_polygon
        assert polygon_problem(after) is None
        assert torch.allclose(wall_normals(after), wall_normals(before), atol=1e-4)
        moves = ((after - before) * wall_normals(before)).sum(-1)
        assert 0.001 < moves.abs().max() < 0.25
        assert noisy.layout.ceiling_height != room.layout.ceiling_height


def test_wild_layout_noise_still_gives_a_room_around_the_camera() -> None:
    for seed in range(6):
        room = sample_room(np.random.default_rng(seed), objects=0, corners=10)
        noisy = perturb_scene(room, np.random.default_rng(seed), PerturbNoise(layout=3.0))
        assert polygon_problem(noisy.layout.floor_polygon) is None
        assert noisy.layout.ceiling_height > 1.0


def test_float64_and_empty_scenes(room: Scene) -> None:
    empty = sample_room(np.random.default_rng(0), objects=0)
    assert len(perturb_scene(empty, np.random.default_rng(0)).objects.boxes) == 0
    boxes = room.objects.boxes
    double = dataclasses.replace(
        room,
        objects=dataclasses.replace(
            room.objects,
            boxes=dataclasses.replace(
                boxes,
                centre=boxes.centre.double(), size=boxes.size.double(), yaw=boxes.yaw.double(),
            ),
            bfov=room.objects.bfov.double(),
        ),
    )  # fmt: skip
    noisy = perturb_scene(double, np.random.default_rng(0))
    assert noisy.objects.boxes.centre.dtype == torch.float64
    assert noisy.objects.bfov.dtype == torch.float64


@pytest.mark.parametrize("name", ["direction", "distance", "size", "yaw", "layout", "bfov"])
@pytest.mark.parametrize("value", [-0.1, float("nan"), float("inf")])
def test_bad_noise_is_refused(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=name):
        PerturbNoise(**{name: value})


def test_flip_is_a_probability() -> None:
    with pytest.raises(ValueError, match="flip"):
        PerturbNoise(flip=1.5)
