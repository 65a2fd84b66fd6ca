"""Greedy matching: hand-worked cases, and a plain loop as an oracle."""

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from panoscene.eval._matching import greedy_matches, match_objects, object_ious
from panoscene.geometry import OrientedBoxes, box_iou
from panoscene.scene import Objects


def cubes(x: list[float], category: list[int], score: list[float] | None = None) -> Objects:
    """Return unit cubes in a row along x; two of them s apart have IoU (1 - s) / (1 + s)."""
    n = len(x)
    centre = torch.zeros(n, 3)
    centre[:, 0] = torch.tensor(x)
    boxes = OrientedBoxes(centre, torch.ones(n, 3), torch.zeros(n))
    ones = torch.ones(n)
    scores = ones if score is None else torch.tensor(score)
    kinds = torch.tensor(category, dtype=torch.int64)
    return Objects(boxes, kinds, scores, torch.zeros(n, 4), ones, ones)


def some_objects(seed: int, n: int, kinds: int) -> Objects:
    rng = np.random.default_rng(seed)
    boxes = OrientedBoxes(
        torch.from_numpy(rng.uniform(-1, 1, (n, 3))),
        torch.from_numpy(rng.uniform(0.5, 2, (n, 3))),
        torch.from_numpy(rng.uniform(-3, 3, n)),
    )
    score = torch.from_numpy(rng.integers(0, 4, n) / 4)  # with ties
    kinds_of = torch.from_numpy(rng.integers(0, kinds, n))
    ones = torch.ones(n, dtype=torch.float64)
    return Objects(boxes, kinds_of, score, torch.zeros(n, 4, dtype=torch.float64), ones, ones)


def slow_matches(
    prediction: Objects, target: Objects, threshold: float, same_category: bool
) -> list[int]:
    iou = box_iou(prediction.boxes, target.boxes)
    match, taken = [-1] * len(prediction.boxes), set()
    ranked = sorted(range(len(match)), key=lambda k: (-float(prediction.score[k]), k))
    for k in ranked:
        best, best_iou = -1, threshold
        for j in range(len(target.boxes)):
            allowed = not same_category or prediction.category[k] == target.category[j]
            if j not in taken and allowed and float(iou[k, j]) > best_iou:
                best, best_iou = j, float(iou[k, j])
        if best >= 0:
            taken.add(best)
            match[k] = best
    return match


@given(
    seed=st.integers(0, 10_000),
    n=st.integers(0, 8),
    m=st.integers(0, 8),
    threshold=st.sampled_from([0.0, 0.05, 0.15, 0.3]),
    same_category=st.booleans(),
)
def test_agrees_with_plain_loops(
    seed: int, n: int, m: int, threshold: float, same_category: bool
) -> None:
    prediction, target = some_objects(seed, n, 2), some_objects(seed + 1, m, 2)
    match = match_objects(prediction, target, iou_threshold=threshold, same_category=same_category)
    assert match.dtype == torch.int64
    assert match.tolist() == slow_matches(prediction, target, threshold, same_category)


def test_the_surer_object_chooses_first() -> None:
    target = cubes([0.0], [7])
    # IoU 1/3 and 2/3: the worse box is the surer one
    prediction = cubes([0.5, 0.2], [7, 7], [0.9, 0.8])
    assert match_objects(prediction, target).tolist() == [0, -1]
    assert match_objects(prediction, target, iou_threshold=0.5).tolist() == [-1, 0]


def test_second_choice_when_the_best_target_is_taken() -> None:
    target = cubes([0.0, 0.6], [7, 7])
    prediction = cubes([0.0, 0.1], [7, 7], [0.9, 0.8])
    assert match_objects(prediction, target).tolist() == [0, 1]


def test_the_threshold_must_be_exceeded() -> None:
    target, prediction = cubes([0.0], [7]), cubes([0.5], [7])
    # the IoU is 1/3; halves are exact in floating point
    third = float(object_ious([prediction], [target])[0][0, 0])
    assert match_objects(prediction, target, iou_threshold=third).tolist() == [-1]
    assert match_objects(prediction, target, iou_threshold=third - 1e-9).tolist() == [0]


def test_other_categories_only_when_asked() -> None:
    target, prediction = cubes([0.0], [7]), cubes([0.0], [8])
    assert match_objects(prediction, target).tolist() == [-1]
    assert match_objects(prediction, target, same_category=False).tolist() == [0]


def test_ties_go_to_the_first() -> None:
    target = cubes([0.0, 0.0], [7, 7])
    prediction = cubes([0.0, 0.0, 0.0], [7, 7, 7])
    assert match_objects(prediction, target).tolist() == [0, 1, -1]


def test_empty_sides() -> None:
    none, one = cubes([], []), cubes([0.0], [7])
    assert match_objects(none, one).shape == (0,)
    assert match_objects(one, none).tolist() == [-1]


def test_a_box_that_is_not_finite_overlaps_nothing() -> None:
    target = cubes([0.0], [7])
    prediction = cubes([float("nan"), float("inf"), 0.0], [7, 7, 7], [0.9, 0.8, 0.7])
    assert match_objects(prediction, target, iou_threshold=0.0).tolist() == [-1, -1, 0]
    huge = cubes([0.0], [7])
    huge.boxes.size[:] = float("inf")
    assert match_objects(huge, target).tolist() == [-1]
    assert match_objects(huge, huge).tolist() == [-1]


def test_scenes_together_are_as_scenes_alone() -> None:
    predictions = [some_objects(seed, n, 3) for seed, n in enumerate((4, 0, 7, 2))]
    targets = [some_objects(seed + 50, n, 3) for seed, n in enumerate((3, 5, 0, 6))]
    together = object_ious(predictions, targets)
    for iou, prediction, target in zip(together, predictions, targets, strict=True):
        same = prediction.category[:, None] == target.category[None, :]
        expected = torch.where(same, box_iou(prediction.boxes, target.boxes), 0.0)
        np.testing.assert_allclose(iou, expected.numpy(), atol=1e-12)
    assert object_ious([], []) == []


def test_bad_arguments_are_refused() -> None:
    one = cubes([0.0], [7])
    for threshold in (-0.1, 1.0, float("nan")):
        with pytest.raises(ValueError, match="IoU thresholds must be in"):
            match_objects(one, one, iou_threshold=threshold)
    with pytest.raises(ValueError, match="scores of predicted objects must be finite, found nan"):
        match_objects(cubes([0.0], [7], [float("nan")]), one)


def test_thresholds_do_not_disturb_each_other() -> None:
    rng = np.random.default_rng(0)
    iou, score = rng.uniform(0, 1, (9, 6)), rng.uniform(0, 1, 9)
    together = greedy_matches(iou, score, (0.15, 0.5, 0.9))
    alone = [greedy_matches(iou, score, (threshold,))[0] for threshold in (0.15, 0.5, 0.9)]
    np.testing.assert_array_equal(together, np.stack(alone))
