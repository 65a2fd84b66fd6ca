"""Named scores and their intervals: against resampled records, and against a known truth."""

import numpy as np
import pytest

from panoscene.eval import (
    DetectionRecord,
    MatchErrors,
    bias_corrected_intervals,
    bootstrap_weights,
    percentile_intervals,
    sample_targets,
    score_detection,
    score_layout,
    score_plausibility,
    score_relations,
    score_semantic,
)
from panoscene.eval._layout_scores import layout_of_sums, layout_sums
from panoscene.eval._methods import mean_box_scene
from panoscene.eval._plausibility import plausibility_of_sums, plausibility_sums
from panoscene.eval._pooling import pooled_differences, pooled_metrics
from panoscene.eval._relation_records import relation_sums, relations_of_sums
from panoscene.eval._scene_records import SceneRecords, scene_records
from panoscene.scene import CATEGORIES

NO_ERRORS = MatchErrors(np.zeros(0, np.int64), *np.zeros((4, 0)))
RATES = np.array([1.0] * 4 + [0.08] * 8)
"""Targets in a scene: of four common and eight rare categories."""
FOUND = np.array([0.8] * 4 + [0.3] * 8)
"""Share of them that is found: rare ones are harder, as in real data."""
TRIALS = 40


@pytest.fixture(scope="module")
def records() -> list[SceneRecords]:
    targets = sample_targets(5, 3)
    predictions = [mean_box_scene(target) for target in targets]
    return scene_records([None, *predictions[1:]], targets)


def test_sums_of_scenes_are_worth_as_much_as_the_scenes(records: list[SceneRecords]) -> None:
    drawn = [0, 2, 2, 4, 4]
    weights = np.bincount(drawn, minlength=5)
    again = [records[k] for k in drawn]
    boxes = plausibility_sums([r.plausibility for r in records])
    assert plausibility_of_sums(weights @ boxes) == pytest.approx(
        score_plausibility([r.plausibility for r in again])
    )
    fidelity = relation_sums([r.fidelity for r in records])
    expected = score_relations([r.fidelity for r in again])
    found = relations_of_sums(weights @ fidelity)
    assert found.keys() == expected.keys()
    for name, value in expected.items():
        assert found[name] == (value if value is None else pytest.approx(value)), name
    rows = layout_of_sums(weights @ layout_sums([r.layout for r in records]))
    assert rows[-1].mean.iou_3d == pytest.approx(
        score_layout([r.layout for r in again])[-1].mean.iou_3d
    )
    assert [row.scenes for row in rows] == [
        row.scenes for row in score_layout([r.layout for r in again])
    ]


def test_labels_keep_their_iou_where_a_resample_lacks_them(records: list[SceneRecords]) -> None:
    metrics = pooled_metrics(records, {}, replicates=50, seed=0)
    whole = score_semantic([r.semantic for r in records])
    measured = metrics["semantic.mean"]
    assert measured.value == pytest.approx(whole.mean_iou)
    assert measured.low is not None
    assert measured.high is not None
    assert 0 < measured.low <= measured.high < 1


def simulated(rng: np.random.Generator, scenes: int) -> list[DetectionRecord]:
    """Return what scenes say about a detector whose errors are drawn."""
    records: list[DetectionRecord] = []
    for _ in range(scenes):
        targets = np.zeros(len(CATEGORIES), np.int64)
        targets[: len(RATES)] = rng.poisson(RATES)
        hits = rng.binomial(targets[: len(RATES)], FOUND)
        false = rng.poisson(0.3 * RATES)
        index = np.arange(len(RATES))
        category = np.concatenate([np.repeat(index, hits), np.repeat(index, false)])
        hit = np.arange(len(category)) < hits.sum()
        score = np.where(hit, rng.beta(4, 2, len(hit)), rng.beta(2, 3, len(hit)))
        records.append(DetectionRecord((0.15,), category, score, hit[None], targets, NO_ERRORS))
    return records


def test_a_category_that_is_not_drawn_keeps_its_area() -> None:
    rng = np.random.default_rng(0)
    records = simulated(rng, 12)
    weights = bootstrap_weights(12, rng, replicates=100)
    whole, drawn = score_detection(records), score_detection(records, weights=weights)
    filled = drawn.with_missing_areas_of(whole)
    for name in ("average_precision", "released_average_precision"):
        before, after, full = (getattr(s, name) for s in (drawn, filled, whole))
        gone = np.isnan(before) & ~np.isnan(full)
        assert gone.any()
        np.testing.assert_array_equal(after[~gone], before[~gone])
        np.testing.assert_array_equal(after[gone], np.broadcast_to(full, after.shape)[gone])
    # so every replicate is a mean over the same categories
    known = np.isnan(filled.average_precision).sum(axis=-1)
    assert (known == np.isnan(whole.average_precision).sum(axis=-1)).all()


@pytest.mark.usefixtures("unchecked")
def test_intervals_of_mean_ap_are_central_and_cover() -> None:
    truth = score_detection(simulated(np.random.default_rng(9), 4000)).mean_average_precision()[0]
    rng = np.random.default_rng(1)
    covered, place, plain_place = 0, [], []
    for _ in range(TRIALS):
        records = simulated(rng, 150)
        weights = bootstrap_weights(150, rng, replicates=150)
        whole = score_detection(records)
        drawn = score_detection(records, weights=weights)
        estimate = whole.mean_average_precision()
        fixed = drawn.with_missing_areas_of(whole).mean_average_precision()
        (interval,) = bias_corrected_intervals(estimate, fixed)
        (plain,) = percentile_intervals(estimate, drawn.mean_average_precision())
        covered += interval.low <= truth <= interval.high
        place.append((estimate[0] - interval.low) / (interval.high - interval.low))
        plain_place.append((estimate[0] - plain.low) / (plain.high - plain.low))
    assert 0.43 < np.mean(place) < 0.57
    assert abs(np.mean(place) - 0.5) < abs(np.mean(plain_place) - 0.5)
    assert covered / TRIALS >= 0.88


def test_differences_are_those_of_the_metrics_on_the_same_resamples(
    records: list[SceneRecords],
) -> None:
    targets = sample_targets(5, 3)
    true = scene_records(targets, targets)
    ours, theirs = (pooled_metrics(some, {}, replicates=0, seed=0) for some in (true, records))
    found = pooled_differences(true, records, replicates=60, seed=2)
    for name in ("detection.recall_15", "semantic.mean", "fidelity.on_floor_f1"):
        first, second = ours[name].value, theirs[name].value
        assert first is not None
        assert second is not None
        value, low, high = found[name].value, found[name].low, found[name].high
        assert value == pytest.approx(first - second), name
        assert low is not None
        assert high is not None
        assert low <= first - second <= high, name
    assert (found["detection.recall_15"].low or 0) > 0  # better in every scene
    assert "detection.matched_iou" in ours
    assert "detection.matched_iou" not in found
    same = pooled_differences(records, records, replicates=60, seed=2)
    assert {(row.value, row.low, row.high) for row in same.values() if row.value is not None} == {
        (0, 0, 0)
    }
    with pytest.raises(ValueError, match="found 5 and 4"):
        pooled_differences(records, records[1:], replicates=1, seed=0)
