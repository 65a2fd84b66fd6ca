"""Detection scores: hand-worked scenes, degenerate ones, and the standard area as an oracle."""

import time
from dataclasses import replace

import numpy as np
import pytest
import torch

from panoscene.eval._average_precision import average_precision, released_average_precision
from panoscene.eval._bootstrap import bootstrap_weights
from panoscene.eval._detection import DetectionScores, score_detection
from panoscene.eval._detection_records import (
    DetectionRecord,
    detection_record,
    detection_records,
    pool_match_errors,
)
from panoscene.geometry import OrientedBoxes
from panoscene.scene import CATEGORIES, COMMON_11, Layout, Objects, Panorama, Scene, category_index
from panoscene.synth import perturb_scene, sample_room

CHAIR, SOFA, BED = (category_index(name) for name in ("chair", "sofa", "bed"))


def cubes(*rows: tuple[int, float, float]) -> Scene:
    """Return a room with unit cubes: category, x and score of each.

    Two cubes s apart have IoU (1 - s) / (1 + s): 0.9 at 0.05, 0.54 at 0.3, 0.33 at 0.5.
    """
    n = len(rows)
    centre = torch.zeros(n, 3)
    centre[:, 0] = torch.tensor([x for _, x, _ in rows], dtype=torch.float32)
    ones = torch.ones(n)
    objects = Objects(
        boxes=OrientedBoxes(centre, torch.ones(n, 3), torch.zeros(n)),
        category=torch.tensor([category for category, _, _ in rows], dtype=torch.int64),
        score=torch.tensor([score for _, _, score in rows], dtype=torch.float32),
        bfov=torch.zeros(n, 4),
        distance_score=ones,
        yaw_score=ones,
    )
    corners = torch.tensor([[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]])
    return Scene(Panorama(1024, 512), Layout(corners), objects)


def score(*pairs: tuple[Scene, Scene], score_threshold: float = 0.0) -> DetectionScores:
    records = [detection_record(prediction, target) for prediction, target in pairs]
    return score_detection(records, score_threshold=score_threshold)


@pytest.fixture(scope="module")
def rooms() -> tuple[list[Scene], list[Scene]]:
    """Return estimates and truth of 12 rooms, of which one has no estimate and one is empty."""
    rng = np.random.default_rng(3)
    true = [sample_room(rng, objects=int(rng.integers(3, 15))) for _ in range(12)]
    guess = [perturb_scene(room, rng) for room in true]
    guess = [  # scores in steps, so that there are ties
        replace(g, objects=replace(g.objects, score=(g.objects.score * 5).round() / 5))
        for g in guess
    ]
    guess[4] = replace(guess[4], relations=None, objects=cubes().objects)
    true[7] = replace(true[7], relations=None, objects=cubes().objects)
    return guess, true


def test_a_hand_worked_table() -> None:
    target = cubes((CHAIR, 0, 1), (CHAIR, 3, 1), (SOFA, 6, 1), (BED, 9, 1))
    prediction = cubes(
        (CHAIR, 0.05, 0.9),  # right at every threshold
        (CHAIR, 1.5, 0.8),  # nothing there
        (CHAIR, 3.3, 0.7),  # IoU 0.54
        (SOFA, 6.5, 0.6),  # IoU 0.33
        (SOFA, 0.0, 0.5),  # a chair
    )
    result = score((prediction, target))
    chair = (1 + 2 / 3) / 2
    np.testing.assert_allclose(result.average_precision[:, CHAIR], [chair, chair, chair])
    np.testing.assert_allclose(result.average_precision[:, SOFA], [1, 1, 0])
    np.testing.assert_allclose(result.average_precision[:, BED], 0)
    np.testing.assert_allclose(result.released_average_precision[:, CHAIR], chair * 2 / 3)
    np.testing.assert_allclose(result.released_average_precision[:, SOFA], [0.5, 0.5, 0])
    assert np.isnan(result.released_average_precision[:, BED]).all()  # never detected
    np.testing.assert_allclose(
        result.mean_average_precision(), [(chair + 1 + 0) / 3, (chair + 1 + 0) / 3, chair / 3]
    )
    common = [(chair + 1) / 2, (chair + 1) / 2, chair / 2]
    np.testing.assert_allclose(result.mean_average_precision(COMMON_11), common)
    released = [(chair * 2 / 3 + 0.5) / 2] * 2 + [chair / 3]
    np.testing.assert_allclose(result.mean_released_average_precision(), released)
    np.testing.assert_allclose(result.recall(), [3 / 4, 3 / 4, 2 / 4])
    np.testing.assert_allclose(result.precision(), [3 / 5, 3 / 5, 2 / 5])
    np.testing.assert_allclose(result.recall(["sofa"]), [1, 1, 0])


def test_the_operating_point_does_not_touch_the_areas() -> None:
    target = cubes((CHAIR, 0, 1), (CHAIR, 3, 1))
    prediction = cubes((CHAIR, 0, 0.75), (CHAIR, 5, 0.5), (CHAIR, 3, 0.25))
    everything = score((prediction, target))
    sure = score((prediction, target), score_threshold=0.5)  # a score of 0.5 is kept
    np.testing.assert_array_equal(sure.recall(), 0.5)
    np.testing.assert_array_equal(sure.precision(), 0.5)
    np.testing.assert_allclose(everything.recall(), 1.0)
    np.testing.assert_array_equal(sure.average_precision, everything.average_precision)
    nothing = score((prediction, target), score_threshold=0.9)
    np.testing.assert_array_equal(nothing.recall(), 0.0)
    assert np.isnan(nothing.precision()).all()


def test_an_object_not_good_enough_leaves_its_target_to_the_next() -> None:
    target = cubes((CHAIR, 0, 1))
    record = detection_record(cubes((CHAIR, 0.5, 0.9), (CHAIR, 0.2, 0.8)), target)
    assert record.hit.tolist() == [[True, False], [True, False], [False, True]]


def test_a_scene_without_detections_still_brings_its_targets() -> None:
    good = (cubes((CHAIR, 0, 1)), cubes((CHAIR, 0, 1)))
    missed = (cubes(), cubes((CHAIR, 0, 1), (CHAIR, 3, 1), (BED, 6, 1)))
    result = score(good, missed)
    np.testing.assert_allclose(result.average_precision[:, CHAIR], 1 / 3)
    np.testing.assert_allclose(result.mean_average_precision(), 1 / 6)
    np.testing.assert_allclose(result.recall(), 1 / 4)
    # in the released definition the missed scene leaves no trace
    np.testing.assert_allclose(result.mean_released_average_precision(), 1.0)


def test_a_scene_without_targets_still_brings_its_false_positives() -> None:
    good = (cubes((CHAIR, 0, 0.5)), cubes((CHAIR, 0, 1)))
    invented = (cubes((CHAIR, 0, 0.9), (BED, 3, 0.9)), cubes())
    result = score(good, invented)
    np.testing.assert_allclose(result.average_precision[:, CHAIR], 1 / 2)
    np.testing.assert_allclose(result.precision(), 1 / 3)
    # a bed exists nowhere: no standard value, and zero in the released definition
    assert np.isnan(result.average_precision[:, BED]).all()
    np.testing.assert_allclose(result.mean_average_precision(), 1 / 2)
    np.testing.assert_allclose(result.released_average_precision[:, BED], 0.0)
    np.testing.assert_allclose(result.mean_released_average_precision(), (1 / 4 + 0) / 2)


def test_no_object_at_all() -> None:
    result = score((cubes(), cubes()))
    for value in (result.mean_average_precision(), result.recall(), result.precision()):
        assert value.shape == (3,)
        assert np.isnan(value).all()
    with pytest.raises(ValueError, match="records is empty"):
        score_detection([])


def test_the_truth_scores_one(rooms: tuple[list[Scene], list[Scene]]) -> None:
    _, true = rooms
    result = score_detection(detection_records(true, true))
    for value in (result.mean_average_precision(), result.recall(), result.precision()):
        np.testing.assert_allclose(value, 1.0)
    np.testing.assert_allclose(result.mean_released_average_precision(COMMON_11), 1.0)
    errors = pool_match_errors(detection_records(true, true))
    assert len(errors.iou) == sum(len(room.objects.boxes) for room in true)
    np.testing.assert_allclose(errors.iou, 1.0, atol=1e-5)
    for value in (errors.centre_error, errors.yaw_error, errors.size_error):
        np.testing.assert_allclose(value, 0.0, atol=1e-6)


def test_areas_agree_with_one_ranked_list(rooms: tuple[list[Scene], list[Scene]]) -> None:
    records = detection_records(*rooms)
    result = score_detection(records)
    assert (np.nan_to_num(result.average_precision, nan=0.0) > 0).sum() > 20
    for index in range(len(CATEGORIES)):
        ranked = np.concatenate([record.score[record.category == index] for record in records])
        targets = sum(int(record.targets[index]) for record in records)
        for threshold in range(3):
            hit = [record.hit[threshold, record.category == index] for record in records]
            expected = average_precision(ranked, np.concatenate(hit), targets)
            released = released_average_precision(ranked, np.concatenate(hit))
            np.testing.assert_allclose(result.average_precision[threshold, index], expected)
            np.testing.assert_allclose(
                result.released_average_precision[threshold, index], released
            )


def test_the_order_of_scenes_does_not_matter(rooms: tuple[list[Scene], list[Scene]]) -> None:
    records = detection_records(*rooms)
    first, second = score_detection(records), score_detection(records[::-1])
    np.testing.assert_allclose(first.average_precision, second.average_precision)


def test_records_together_are_as_records_alone(rooms: tuple[list[Scene], list[Scene]]) -> None:
    for together, prediction, target in zip(detection_records(*rooms), *rooms, strict=True):
        alone = detection_record(prediction, target)
        np.testing.assert_array_equal(together.hit, alone.hit)
        np.testing.assert_array_equal(together.targets, alone.targets)
        np.testing.assert_allclose(together.errors.iou, alone.errors.iou, atol=1e-12)


def test_weights_are_repeated_scenes(rooms: tuple[list[Scene], list[Scene]]) -> None:
    records = detection_records(*rooms)
    weights = bootstrap_weights(len(records), np.random.default_rng(1), replicates=25)
    resampled = score_detection(records, weights=weights, score_threshold=0.5)
    assert resampled.mean_average_precision().shape == (25, 3)
    for replicate, row in enumerate(weights):
        drawn = [record for record, count in zip(records, row, strict=True) for _ in range(count)]
        literal = score_detection(drawn, score_threshold=0.5)
        for name in ("average_precision", "released_average_precision", "kept", "hits", "targets"):
            np.testing.assert_allclose(
                getattr(resampled, name)[replicate], getattr(literal, name), atol=1e-12
            )
        np.testing.assert_allclose(
            resampled.mean_average_precision(COMMON_11)[replicate],
            literal.mean_average_precision(COMMON_11),
        )
        np.testing.assert_allclose(resampled.recall()[replicate], literal.recall())
        np.testing.assert_allclose(resampled.precision()[replicate], literal.precision())


def test_errors_of_a_matched_box() -> None:
    target = cubes((CHAIR, 0, 1), (BED, 5, 1))
    prediction = cubes((CHAIR, 0.3, 0.4), (SOFA, 5, 0.9))
    prediction.objects.boxes.yaw[0] = -np.pi / 2
    prediction.objects.boxes.size[0] = torch.tensor([1.0, 1.0, 0.7])
    errors = detection_record(prediction, target).errors
    assert errors.category.tolist() == [CHAIR]
    np.testing.assert_allclose(errors.centre_error, 0.3, rtol=1e-6)
    np.testing.assert_allclose(errors.yaw_error, np.pi / 2, rtol=1e-6)
    np.testing.assert_allclose(errors.size_error, 0.1, rtol=1e-5)
    np.testing.assert_allclose(errors.iou, 0.49 / (1 + 0.7 - 0.49), rtol=1e-5)


def test_yaw_errors_are_wrapped() -> None:
    target, prediction = cubes((CHAIR, 0, 1)), cubes((CHAIR, 0, 1))
    target.objects.boxes.yaw[0], prediction.objects.boxes.yaw[0] = 3.0, -3.0
    record = detection_record(prediction, target)
    np.testing.assert_allclose(record.errors.yaw_error, 2 * np.pi - 6, rtol=1e-5)


def test_bad_arguments_are_refused() -> None:
    scene = cubes((CHAIR, 0, 1))
    with pytest.raises(ValueError, match="found 1 predictions for 2 targets"):
        detection_records([scene], [scene, scene])
    with pytest.raises(ValueError, match="iou_thresholds is empty"):
        detection_record(scene, scene, iou_thresholds=())
    records = [
        detection_record(scene, scene),
        detection_record(scene, scene, iou_thresholds=(0.5,)),
    ]
    with pytest.raises(ValueError, match="different iou_thresholds"):
        score_detection(records)
    with pytest.raises(ValueError, match="weights are for 2 scenes, found 1 records"):
        score_detection(records[:1], weights=np.ones((3, 2), dtype=np.int64))
    with pytest.raises(ValueError, match="unknown category 'couch'"):
        score_detection(records[:1]).recall(["couch"])


def test_500_scenes_of_20_objects_are_scored_in_seconds() -> None:
    rng = np.random.default_rng(0)
    true = [sample_room(rng, objects=20) for _ in range(5)] * 5
    guess = [perturb_scene(room, rng) for room in true] * 20
    true = true * 20
    start = time.perf_counter()
    records: list[DetectionRecord] = detection_records(guess, true)
    result = score_detection(records)
    weights = bootstrap_weights(500, rng)
    resampled = score_detection(records, weights=weights)
    assert time.perf_counter() - start < 20
    assert result.detections.sum() == 10_000
    spread = resampled.mean_average_precision().std(axis=0)
    assert ((spread > 0) & (spread < 0.05)).all()
