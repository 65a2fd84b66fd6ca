"""Simulated estimates: as wrong as they say, and reproducible."""

from dataclasses import fields, replace

import numpy as np
import pytest
import torch

from panoscene.geometry import polygon_iou, polygon_problem
from panoscene.scene import Scene, object_names, read_scene, write_scene
from panoscene.synth import EstimateNoise, PerturbNoise, estimate_scene, sample_room

NONE = PerturbNoise(**dict.fromkeys((f.name for f in fields(PerturbNoise)), 0.0))
PERFECT = EstimateNoise(
    NONE, miss=0.0, invent=0.0, confuse=0.0, boundary=0.0, relation_flip=0.0, false_alarm=0.0
)


def room(seed: int, objects: int = 12) -> Scene:
    return sample_room(np.random.default_rng(seed), objects=objects)


def test_without_noise_the_truth_comes_back() -> None:
    truth = room(0)
    estimate = estimate_scene(truth, np.random.default_rng(1), PERFECT)
    torch.testing.assert_close(
        estimate.objects.boxes.centre, truth.objects.boxes.centre, atol=1e-4, rtol=0
    )
    assert estimate.objects.category.equal(truth.objects.category)
    iou = polygon_iou(estimate.layout.floor_polygon, truth.layout.floor_polygon)
    assert float(iou) > 0.99
    assert estimate.relations is not None
    assert truth.relations is not None
    touching = estimate.relations.touching > 0.5
    assert touching.equal(truth.relations.touching > 0.5)


def test_the_same_seed_gives_the_same_estimate_and_a_valid_file(tmp_path) -> None:
    truth = room(2)
    first, second = (estimate_scene(truth, np.random.default_rng(5)) for _ in range(2))
    write_scene(first, tmp_path / "a.json")
    write_scene(second, tmp_path / "b.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    again = read_scene(tmp_path / "a.json")
    assert again.layout.raw_polygon is not None
    assert polygon_problem(again.layout.raw_polygon) is None


def test_misses_inventions_and_confusions_have_their_rates() -> None:
    rng = np.random.default_rng(0)
    noise = replace(PERFECT, miss=0.3, invent=0.2, confuse=0.25)
    truths = [room(k, objects=24) for k in range(12)]
    kept = invented = confused = 0
    for truth in truths:
        estimate = estimate_scene(truth, rng, noise)
        true_category = dict(zip(object_names(truth.objects), truth.objects.category, strict=True))
        for name, category in zip(estimate.objects.id, estimate.objects.category, strict=True):
            if name in true_category:
                kept += 1
                confused += int(category != true_category[name])
            else:
                invented += 1
    total = 24 * len(truths)
    assert kept / total == pytest.approx(0.7, abs=0.1)
    assert invented / total == pytest.approx(0.2, abs=0.1)
    # a confusion may draw the right category again
    assert confused / kept == pytest.approx(0.25, abs=0.1)


def test_an_empty_room_stays_empty_without_inventions() -> None:
    estimate = estimate_scene(room(4, objects=0), np.random.default_rng(0))
    assert len(estimate.objects.boxes) == 0


def test_rates_out_of_range_are_refused() -> None:
    with pytest.raises(ValueError, match="miss"):
        EstimateNoise(miss=1.5)


def test_another_layout_leaves_the_objects_as_they_are() -> None:
    truth = room(6)
    usual, told = (
        estimate_scene(truth, np.random.default_rng(3), layout=layout)
        for layout in (None, truth.layout)
    )
    assert told.layout is truth.layout
    assert told.objects.boxes.centre.equal(usual.objects.boxes.centre)
    assert told.objects.score.equal(usual.objects.score)
    assert told.relations is not None
    assert told.relations.touching_wall.shape[1] == len(truth.layout.floor_polygon)
