"""The detector's stage: pasting, merging, and ground truth through it."""

import math
from pathlib import Path

import pytest
import torch

from panoscene.geometry import bfov_iou
from panoscene.models.detector import (
    DetectorConfig,
    DetectorNetwork,
    DetectorStage,
    RegionPredictions,
    detections_of,
    load_detector_stage,
    network_picture,
)
from panoscene.models.detector._paste import paste_masks
from panoscene.synth.dataset import open_dataset

ROOT = Path(__file__).parents[3]


def _found(boxes: list[list[float]], category: list[int] | None = None) -> RegionPredictions:
    count = len(boxes)
    return RegionPredictions(
        torch.tensor(boxes).reshape(-1, 4),
        torch.tensor(category or [0] * count, dtype=torch.long),
        torch.linspace(0.9, 0.5, count) if count else torch.zeros(0),
        torch.ones(count, 28, 28),
    )


def test_full_masks_fill_their_boxes_across_the_seam(small: DetectorConfig) -> None:
    found = _found([[250.0, 4.0, 262.0, 24.0]])
    masks = paste_masks(found.mask, found.boxes, small, 128)
    expected = torch.zeros(128, 256, dtype=torch.bool)
    expected[36:56, 250:] = expected[36:56, :6] = True
    assert torch.equal(masks[0], expected)
    double = paste_masks(found.mask, found.boxes, small, 256)
    assert torch.equal(double[0, ::2, ::2], expected)


def test_half_filled_masks_fill_half(small: DetectorConfig) -> None:
    found = _found([[100.0, 4.0, 128.0, 32.0]])
    found.mask[:, :, 14:] = 0
    masks = paste_masks(found.mask, found.boxes, small, 128)
    assert masks.sum().item() == 28 * 14
    assert bool(masks[0, 36:64, 100:114].all())


def test_nothing_found_is_no_detection(small: DetectorConfig) -> None:
    detections = detections_of(_found([]), small, 128)
    assert detections.bfov.shape == (0, 4)
    assert detections.mask is not None
    assert detections.mask.shape == (0, 128, 256)


def test_a_mask_below_a_pixel_becomes_its_box(small: DetectorConfig) -> None:
    found = _found([[100.0, 4.0, 120.0, 24.0]])
    found.mask.zero_()
    detections = detections_of(found, small, 128)
    assert detections.mask is not None
    assert detections.mask.sum().item() == 400


def test_doubles_fall_but_other_categories_stay(small: DetectorConfig) -> None:
    boxes = [[250.0, 4.0, 270.0, 24.0], [251.0, 4.0, 270.0, 24.0], [248.0, 8.0, 264.0, 28.0]]
    same = detections_of(_found(boxes, [0, 0, 1]), small, 128)
    assert same.category.tolist() == [0, 1]
    assert same.score.tolist() == pytest.approx([0.9, 0.5])


def test_halves_at_the_seam_become_one(small: DetectorConfig) -> None:
    halves = [[240.0, 4.0, 256.0, 24.0], [0.0, 4.0, 16.0, 24.0]]
    plain = small.model_copy(update={"seam": "none"})
    joined = detections_of(_found(halves), plain, 128)
    whole = detections_of(_found([[240.0, 4.0, 272.0, 24.0]]), small, 128)
    assert len(joined.bfov) == 1
    assert bfov_iou(joined.bfov, whole.bfov).item() > 0.99
    assert len(detections_of(_found(halves, [0, 1]), plain, 128).bfov) == 2
    assert len(detections_of(_found([*halves[:1], [0.0, 40, 16, 60]]), plain, 128).bfov) == 2


def test_what_the_extension_shows_twice_is_found_once(small: DetectorConfig) -> None:
    extend = small.model_copy(update={"seam": "extend"})
    twice = [
        [240.0, 4.0, 272.0, 24.0],
        [0.0, 4.0, 16.0, 24.0],
        [50.0, 0, 80, 30],
        [306.0, 0, 336, 30],
    ]
    found = detections_of(_found(twice), extend, 128)
    assert len(found.bfov) == 2
    assert found.bfov[:, 0].abs().max().item() == pytest.approx(math.pi, abs=0.02)


def test_pictures_are_cut_at_the_poles_and_extended(small: DetectorConfig) -> None:
    image = torch.rand(1, 3, 128, 256, generator=torch.Generator().manual_seed(0))
    picture = network_picture(image, small)
    assert torch.equal(picture, image[..., 32:96, :])
    longer = network_picture(image, small.model_copy(update={"seam": "extend"}))
    assert torch.equal(longer, torch.cat((picture, picture[..., :128]), -1))
    with pytest.raises(ValueError, match="twice as wide"):
        network_picture(image[..., :200], small)


def test_rolling_the_panorama_turns_the_detections(network: DetectorNetwork) -> None:
    stage = DetectorStage(network, score_threshold=0.0)
    image = torch.rand(3, 128, 256, generator=torch.Generator().manual_seed(1))
    found, rolled = stage(image), stage(image.roll(64, -1))
    assert len(found.score) > 5
    assert abs(len(found.score) - len(rolled.score)) <= 1
    turned = found.bfov + torch.tensor([math.pi / 2, 0.0, 0.0, 0.0])
    best = bfov_iou(turned, rolled.bfov).max(1).values
    assert (best > 0.95).float().mean() > 0.9


def test_masks_may_be_coarser_than_the_image(network: DetectorNetwork) -> None:
    image = torch.rand(3, 128, 256, generator=torch.Generator().manual_seed(1))
    found = DetectorStage(network, score_threshold=0.0, mask_height=64)(image)
    assert found.mask is not None
    assert found.mask.shape[1:] == (64, 128)


def test_shipped_weights_find_pictures_doors_and_windows() -> None:
    stage = load_detector_stage()
    item = open_dataset(ROOT / "samples" / "synth", "val")[0]
    image = item.image()
    found = stage(image)
    assert len(found.score) > 0
    assert found.mask is not None
    assert found.mask.shape[1:] == image.shape[1:]
    assert bool((found.score[:-1] >= found.score[1:]).all())
    assert bool((found.score >= stage.score_threshold).all())
