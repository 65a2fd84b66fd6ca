"""Samples of the pose network: what is changed goes together."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from panoscene.data import (
    PoseAugmentation,
    PoseScene,
    StageRecord,
    code_of,
    collate_pose,
    match_detections,
    mean_sizes,
    pose_sample,
    read_pose_scenes,
)
from panoscene.geometry import (
    OrientedBoxes,
    decode_box_code,
    perspective_crop,
    rotate_panorama,
    wrap_angle,
)
from panoscene.scene import CATEGORIES, MEAN_SIZE, Detections, objects_from_boxes
from panoscene.synth.dataset import open_dataset

SAMPLES = Path(__file__).parents[2] / "samples" / "synth"
EXACT = PoseAugmentation(
    centre=0.0, extent=0.0, tilt_deg=0.0, wall=0.0, no_layout=0.0, photometric=0.0
)


def generator(seed: int = 0) -> torch.Generator:
    return torch.Generator().manual_seed(seed)


@pytest.fixture(scope="module")
def scenes() -> list[PoseScene]:
    return read_pose_scenes(open_dataset(SAMPLES, "train")[:2])


@pytest.mark.parametrize("seed", range(6))
def test_code_gives_the_turned_or_mirrored_boxes(scenes: list[PoseScene], seed: int) -> None:
    source = scenes[0]
    sample = pose_sample(source, MEAN_SIZE, 8, generator(seed), augmentation=EXACT)
    height, objects = source.scene.panorama.camera_height, source.scene.objects
    boxes = decode_box_code(sample.code, sample.bfov, MEAN_SIZE[sample.category], height)
    # which of the true boxes: the same size and height, and the same distance across the floor
    gap = (boxes.size[:, None] - objects.boxes.size[None]).abs().sum(-1)
    across = boxes.centre[:, None, :2].norm(dim=-1) - objects.boxes.centre[None, :, :2].norm(dim=-1)
    match = (gap + across.abs()).argmin(dim=1)
    true = objects.boxes[match]
    assert torch.allclose(boxes.size, true.size, atol=1e-4)
    assert torch.allclose(boxes.centre[:, 2], true.centre[:, 2], atol=1e-3)
    # one motion moves all: either all pairwise turns agree, or those of the mirror image do
    found, wanted = (torch.atan2(c[:, 0], c[:, 1]) for c in (boxes.centre, true.centre))
    results = []
    for flip in (1.0, -1.0):
        turn = wrap_angle(found - flip * wanted)
        spread = wrap_angle(turn - turn[0]).abs().max()
        yaw = wrap_angle(boxes.yaw - flip * true.yaw + turn).abs().max()
        results.append(max(float(spread), float(yaw)))
    assert min(results) < 1e-3
    # the crops show what the BFoVs see: those of the photo made upright, turned or mirrored
    image = rotate_panorama(
        source.item.image(), torch.tensor(source.scene.panorama.upright_from_photo)
    )
    true_crops = perspective_crop(image, objects.bfov[match], (8, 8))
    if results[1] < results[0]:
        true_crops = true_crops.flip(-1)
    assert float((sample.crops - true_crops).abs().mean()) < 0.03


def test_samples_are_a_function_of_the_generator(scenes: list[PoseScene]) -> None:
    first, again = (pose_sample(scenes[0], MEAN_SIZE, 16, generator(3)) for _ in range(2))
    other = pose_sample(scenes[0], MEAN_SIZE, 16, generator(4))
    assert torch.equal(first.crops, again.crops)
    assert torch.equal(first.code.delta, again.code.delta)
    assert not torch.equal(first.code.delta, other.code.delta)


def test_jitter_moves_the_bfov_and_the_code_with_it(scenes: list[PoseScene]) -> None:
    change = EXACT.model_copy(update={"centre": 0.2, "extent": 0.2})
    sample = pose_sample(scenes[0], MEAN_SIZE, 8, generator(5), augmentation=change)
    height = scenes[0].scene.panorama.camera_height
    boxes = decode_box_code(sample.code, sample.bfov, MEAN_SIZE[sample.category], height)
    true = scenes[0].scene.objects.boxes
    assert torch.allclose(boxes.size.sum(-1).sort()[0], true.size.sum(-1).sort()[0], atol=1e-3)
    assert torch.allclose(
        boxes.centre.norm(dim=-1).sort()[0], true.centre.norm(dim=-1).sort()[0], atol=1e-3
    )


def test_blind_samples_have_no_crops_and_large_scenes_are_cut(scenes: list[PoseScene]) -> None:
    change = EXACT.model_copy(update={"blind": 1.0, "most_objects": 3})
    blind = pose_sample(scenes[0], MEAN_SIZE, 8, generator(), augmentation=change)
    assert len(blind.crops) == 0
    assert len(blind.category) == 3
    seeing = pose_sample(scenes[1], MEAN_SIZE, 8, generator(), augmentation=EXACT)
    batch = collate_pose([blind, seeing])
    count = len(seeing.category)
    assert batch["valid"].sum(dim=1).tolist() == [3, count]
    assert batch["pictured"].sum(dim=1).tolist() == [0, count]
    assert len(batch["crops"]) == count
    assert batch["bfov"].shape == (2, count, 4)
    assert torch.equal(code_of(batch).size_residual[1], seeing.code.size_residual)
    assert bool((batch["bfov"][..., 2:] > 0).all())


def test_detections_take_the_place_of_true_bfovs(scenes: list[PoseScene]) -> None:
    objects = scenes[0].scene.objects
    bfov = torch.cat([objects.bfov[:2], torch.tensor([[0.0, 1.3, 0.05, 0.05]])])
    found = Detections(bfov, torch.cat([objects.category[:2], torch.tensor([3])]), torch.ones(3))
    source = replace(scenes[0], found=StageRecord(found))
    change = EXACT.model_copy(update={"detections": 1.0, "blind": 1.0})
    sample = pose_sample(source, MEAN_SIZE, 8, generator(), augmentation=change)
    assert len(sample.category) == 3
    assert sample.matched.sum() == 2
    assert not bool(sample.matched[sample.category == 3].any())


def test_matching_takes_the_best_of_the_category_then_the_best_of_any() -> None:
    boxes = OrientedBoxes(
        torch.tensor([[0.0, 2.0, 1.6], [2.0, 0.0, 1.6]]), torch.ones(2, 3), torch.zeros(2)
    )
    objects = objects_from_boxes(boxes, ["chair", "sofa"])
    chair, sofa = (CATEGORIES.index(name) for name in ("chair", "sofa"))
    seen = objects.bfov[[0, 0, 1]].clone()
    seen[1, 0] += 0.1  # a chair that is off, beside a sofa that is right; and a chair for the sofa
    found = Detections(seen, torch.tensor([sofa, chair, chair]), torch.ones(3))
    assert match_detections(found, objects).tolist() == [-1, 0, 1]
    none = Detections(seen[:0], torch.zeros(0, dtype=torch.int64), torch.zeros(0))
    assert match_detections(none, objects).tolist() == []


def test_mean_sizes_are_those_of_the_set(scenes: list[PoseScene]) -> None:
    found = mean_sizes([scene.scene for scene in scenes])
    objects = scenes[0].scene.objects
    both = [scene.scene.objects for scene in scenes]
    index = int(objects.category[0])
    size = torch.cat([part.boxes.size[part.category == index] for part in both])
    assert torch.allclose(found[index], size.mean(0), atol=1e-5)
    absent = next(k for k in range(57) if all(k not in part.category for part in both))
    assert torch.equal(found[absent], MEAN_SIZE[absent])
    assert math.isfinite(float(found.sum()))
