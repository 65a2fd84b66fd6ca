"""Samples for the detector: targets against labels, motions, the seam, ignored objects."""

import math
from pathlib import Path

import pytest
import torch

from panoscene.data._detector_samples import (
    DetectorAugmentation,
    DetectorSamples,
    LabelledObjects,
    LabelRules,
    circular_boxes,
    collate_detector,
    window_targets,
)
from panoscene.data._detector_truth import repeated_items, seen_objects
from panoscene.geometry import bfov_iou
from panoscene.models.detector import CONFIGS, DetectorConfig, DetectorTargets
from panoscene.scene import CATEGORIES
from panoscene.synth.dataset import PanoramaItem, open_dataset

SAMPLES = Path(__file__).parents[2] / "samples" / "synth"
SMALL = CONFIGS["compact"].model_copy(update={"width": 256, "first_row": 0, "rows": 128})


@pytest.fixture(scope="module")
def items() -> tuple[PanoramaItem, ...]:
    return tuple(open_dataset(SAMPLES, "train")[:])


def _one(targets: DetectorTargets | list[DetectorTargets]) -> DetectorTargets:
    assert isinstance(targets, DetectorTargets)
    return targets


def _rectangles(*boxes: tuple[int, int, int, int]) -> tuple[torch.Tensor, LabelledObjects]:
    instances = torch.zeros(32, 64, dtype=torch.int32)
    for k, (left, top, right, bottom) in enumerate(boxes):
        instances[top:bottom, torch.arange(left, right) % 64] = k + 1
    count = len(boxes)
    counts = torch.ones(count, dtype=torch.bool)
    ids = torch.arange(1, count + 1, dtype=torch.int32)
    return instances, LabelledObjects(ids, torch.arange(count), counts, torch.zeros(count))


def _config(seam: str) -> DetectorConfig:
    update = {"width": 64, "first_row": 0, "rows": 32, "seam": seam}
    return CONFIGS["compact"].model_copy(update=update)


def test_boxes_agree_with_the_labels(items: tuple[PanoramaItem, ...]) -> None:
    upright = [k for k, x in enumerate(items) if x.labels().camera.pitch == 0][:2]
    whole = CONFIGS["compact"].model_copy(update={"width": 512, "first_row": 0, "rows": 256})
    samples = DetectorSamples(items, whole)
    for k in upright:
        labels = {x.instance: x for x in items[k].labels().objects}
        targets = _one(samples.plain(k).targets)
        assert len(targets.boxes)
        for box, category, instance in zip(
            targets.boxes.tolist(),
            targets.category.tolist(),
            targets.instance.tolist(),
            strict=True,
        ):
            label = labels[instance]
            left, top, columns, rows = label.box_2d
            assert box == [left, top, left + columns, top + rows]
            assert CATEGORIES[category] == label.category
            assert label.in_scene


def test_rolled_and_mirrored_samples_have_the_same_objects(
    items: tuple[PanoramaItem, ...],
) -> None:
    samples = DetectorSamples(items, SMALL)
    plain = _one(samples.plain(0).targets)
    settings = DetectorAugmentation(tilt_deg=0.0, photometric=None)
    for seed in range(3):
        moved = _one(samples.augmented(0, torch.Generator().manual_seed(seed), settings).targets)
        common = sorted(set(plain.instance.tolist()) & set(moved.instance.tolist()))
        # tiny ones may fall below the limit when pixels move
        assert len(common) >= 0.8 * len(plain.instance)
        sizes = []
        for targets in (plain, moved):
            index = [targets.instance.tolist().index(k) for k in common]
            boxes = targets.boxes[index]
            sizes.append(boxes[:, 2:] - boxes[:, :2])
        assert (sizes[0] - sizes[1]).abs().max().item() <= 2


def test_samples_are_a_function_of_the_generator(items: tuple[PanoramaItem, ...]) -> None:
    samples = DetectorSamples(items, SMALL)
    first, second, other = (
        samples.augmented(1, torch.Generator().manual_seed(seed), DetectorAugmentation())
        for seed in (7, 7, 8)
    )
    assert torch.equal(first.image, second.image)
    assert torch.equal(_one(first.targets).boxes, _one(second.targets).boxes)
    assert not torch.equal(first.image, other.image)
    batch = collate_detector([first, other])
    assert batch.image.shape == (2, 3, 128, 256)
    assert isinstance(batch.targets, list)
    assert len(batch.targets) == 2


def test_the_seam_is_seen_as_the_network_sees_it() -> None:
    instances, objects = _rectangles((56, 4, 72, 20), (20, 8, 40, 24))
    rules = LabelRules()
    around = window_targets(instances, objects, _config("circular"), rules, 0)
    assert around.boxes.tolist() == [[56, 4, 72, 20], [20, 8, 40, 24]]
    assert len(around.ignored) == 0
    longer = window_targets(instances, objects, _config("extend"), rules, 0)
    assert longer.boxes.tolist() == [[56, 4, 72, 20], [20, 8, 40, 24]]
    # the cut half at the left, and the second object again, cut by the extension's end
    assert longer.ignored.tolist() == [[0, 4, 8, 20], [84, 8, 96, 24]]
    cut = window_targets(instances, objects, _config("none"), rules, 0)
    assert sorted(cut.boxes.tolist()) == [[0, 4, 8, 20], [20, 8, 40, 24], [56, 4, 64, 20]]


def test_tiny_and_hidden_objects_are_ignored() -> None:
    instances, objects = _rectangles((4, 4, 20, 20), (30, 4, 34, 20), (40, 4, 56, 20))
    objects.counts[2] = False
    targets = window_targets(instances, objects, _config("circular"), LabelRules(), 0)
    assert targets.boxes.tolist() == [[4, 4, 20, 20]]
    assert targets.ignored.tolist() == [[30, 4, 34, 20], [40, 4, 56, 20]]
    nothing = window_targets(instances * 0, objects, _config("circular"), LabelRules(), 0)
    assert nothing.boxes.shape == (0, 4)


def test_boxes_of_masks_on_the_cylinder() -> None:
    masks = torch.zeros(3, 4, 16, dtype=torch.bool)
    masks[0, 1, [14, 15, 0]] = True
    masks[1] = True
    masks[2, 3, 5] = True
    left, top, right, bottom = circular_boxes(masks).unbind(1)
    assert (right - left).tolist() == [3, 16, 1]
    assert left.tolist()[::2] == [14, 5]
    assert top.tolist() == [1, 0, 3]
    assert bottom.tolist() == [2, 4, 4]
    assert circular_boxes(masks[:0]).shape == (0, 4)


def test_truth_has_the_bfovs_of_the_labels(items: tuple[PanoramaItem, ...]) -> None:
    item = next(x for x in items if x.labels().camera.pitch == 0)
    seen = seen_objects(item)
    labels = [x for x in item.labels().objects if x.pixels]
    wanted = torch.tensor([x.bfov_visible for x in labels])
    assert bfov_iou(seen.bfov, wanted).diagonal().min().item() > 0.95
    assert [CATEGORIES[c] for c in seen.category.tolist()] == [x.category for x in labels]
    assert bool(seen.ignored.any()) == any(not x.in_scene or x.occlusion > 0.9 for x in labels)


def test_panoramas_with_rare_categories_come_more_often(items: tuple[PanoramaItem, ...]) -> None:
    assert repeated_items(items, 0.0) == list(range(len(items)))
    order = repeated_items(items, 0.9)
    assert sorted(set(order)) == list(range(len(items)))
    # a category of one panorama in n is wanted sqrt(0.9 n) times as often
    most = max(order.count(k) for k in range(len(items)))
    assert most == round(math.sqrt(0.9 * len(items)))
