"""Features of nodes: hand-worked numbers, and the same however the world turns."""

import math
from dataclasses import replace

import pytest
import torch

from panoscene.geometry import OrientedBoxes
from panoscene.models.context import CONFIGS, Estimates, room_distances, walls_of
from panoscene.models.context._features import METRES, object_features, object_width
from panoscene.models.context._pairs import (
    BOX_PAIR_NUMBERS,
    PAIR_NUMBERS,
    pair_features,
    pair_width,
)

from .conftest import TINY, padded, random_estimates, turned

EYE = torch.tensor([1.6])


def square_room(width: float = 4.0, depth: float = 2.0) -> Estimates:
    estimates = random_estimates(scenes=1, n=2)
    x, y = width / 2, depth / 2
    corners = torch.tensor([[[-x, -y], [x, -y], [x, y], [-x, y]]], dtype=torch.float64)
    return replace(estimates, polygon=corners, wall_valid=torch.ones(1, 4, dtype=torch.bool))


def test_walls_as_the_camera_sees_them() -> None:
    for walls in (0, 2):
        estimates = padded(square_room(), 0, walls)
        boxes, bfov = walls_of(estimates)
        assert boxes.size[0, :4, 0].tolist() == [4, 2, 4, 2]
        assert torch.allclose(
            bfov[0, :4, 0].abs(), torch.tensor([1, 0.5, 0, 0.5]).double() * math.pi
        )
        wide, narrow = 2 * math.atan(2), 2 * math.atan(0.5)
        assert torch.allclose(bfov[0, :4, 2], torch.tensor([wide, narrow, wide, narrow]).double())
        high = math.atan(1.6 / 1) + math.atan((2.7 - 1.6) / 1)
        assert float(bfov[0, 0, 3]) == pytest.approx(high)
        assert bool(bfov.isfinite().all())


def test_corners_to_the_room_by_hand() -> None:
    boxes = OrientedBoxes(
        torch.tensor([[[1.0, 0.0, 0.5], [0.0, 1.5, 2.5]]]).double(),
        torch.tensor([[[1.0, 1.0, 1.0], [1.0, 1.0, 1.0]]]).double(),
        torch.zeros(1, 2).double(),
    )
    away = room_distances(boxes, padded(square_room(), 0, 3))
    assert away[0, 0].tolist() == pytest.approx([-0.5] * 4 + [0, -1, -2.7, -1.7])
    assert away[0, 1].tolist() == pytest.approx([0, 0, 1, 1, -2, -3, -0.7, 0.3])


def pair_of(yaw: float, x: float) -> tuple[OrientedBoxes, torch.Tensor]:
    boxes = OrientedBoxes(
        torch.tensor([[[0.0, 2.0, 1.6], [x, 2.0, 1.6]]]),
        torch.ones(1, 2, 3),
        torch.tensor([[yaw, yaw + math.pi / 2 + 0.1]]),
    )
    return boxes, torch.tensor([[[0.0, 0.0, 0.5, 0.5], [math.atan2(x, 2), 0.0, 0.5, 0.5]]])


def test_relation_features_by_hand() -> None:
    config = CONFIGS["compact"]
    boxes, bfov = pair_of(0.0, x=3.0)
    found = pair_features(boxes, bfov, EYE, config)
    assert found.shape == (1, 2, 2, pair_width(config))
    assert pair_width(config) == PAIR_NUMBERS + BOX_PAIR_NUMBERS
    of_boxes = found[0, 0, 1, PAIR_NUMBERS:]
    assert of_boxes[:2].tolist() == [0.0, 0.0]
    assert float(of_boxes[2]) > 0
    assert of_boxes[5:8].tolist() == pytest.approx([3 / METRES, 0, 0], abs=1e-6)
    farther = math.hypot(3, 2) - 2
    assert float(of_boxes[8]) == pytest.approx(-farther / METRES, abs=1e-6)
    assert of_boxes[10:18].argmax().item() == 6
    assert of_boxes[18:].tolist() == pytest.approx(
        [0.1 / (math.pi / 4), math.cos(0.1), -math.sin(0.1)], abs=1e-5
    )
    reverse = found[0, 1, 0, PAIR_NUMBERS:]
    assert reverse[10:18].argmax().item() == 2
    close = pair_features(*pair_of(0.0, x=0.5), EYE, config)[0, 0, 1, PAIR_NUMBERS:]
    assert float(close[0]) == 1
    assert float(close[1]) > 0
    assert float(close[2]) == 0


def test_the_seam_is_nowhere_special() -> None:
    boxes, bfov = pair_of(0.3, x=1.0)
    moved = bfov.clone()
    moved[0, 1, 0] += 2 * math.pi
    first, second = (pair_features(boxes, b, EYE, CONFIGS["compact"]) for b in (bfov, moved))
    assert torch.allclose(first, second, atol=1e-4)


def test_object_features_are_of_moderate_size_and_do_not_turn() -> None:
    estimates = random_estimates(scenes=4, n=8)
    for config in (TINY, TINY.model_copy(update={"object_features": False, "codes": 0})):
        found = object_features(estimates, estimates.boxes(), config)
        assert found.shape == (4, 8, object_width(config))
        assert float(found.abs().max()) < 8
        other = turned(estimates, 2.0)
        assert torch.allclose(found, object_features(other, other.boxes(), config), atol=1e-9)


def test_gaussians_are_placed_in_their_box() -> None:
    config = TINY.model_copy(update={"codes": 0, "object_features": False})
    estimates = random_estimates(scenes=1, n=1)
    centre = torch.zeros(1, 1, 3, 3).double()
    centre[0, 0, 1] = torch.tensor([0.0, 0.5, 0.0])
    estimates = replace(estimates, blob_centre=centre)
    boxes = OrientedBoxes(
        torch.tensor([[[3.0, 0.0, 1.0]]]).double(),
        torch.tensor([[[1.0, 2.0, 1.0]]]).double(),
        torch.tensor([[math.pi / 2]], dtype=torch.float64),
    )
    # it stands to the right of the camera and faces it: its front is one metre nearer
    placed = object_features(estimates, boxes, config)[0, 0, -9:].view(3, 3) * METRES
    assert placed[0].tolist() == pytest.approx([0, 3, -0.6], abs=1e-9)
    assert placed[1].tolist() == pytest.approx([0, 2, -0.6], abs=1e-9)
