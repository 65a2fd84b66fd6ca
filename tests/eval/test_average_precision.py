"""Average precision against hand-worked curves and an independent area in plain loops."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from panoscene.eval._average_precision import average_precision, released_average_precision


def slow_area(score: list[float], hit: list[bool], possible: int) -> float:
    """Return the area from the definition: for each recall, the best precision from there on."""
    curve = []
    for limit in sorted(set(score), reverse=True):
        kept = [h for s, h in zip(score, hit, strict=True) if s >= limit]
        curve.append((sum(kept) / possible, sum(kept) / len(kept)))
    area, last = 0.0, 0.0
    for recall in sorted({recall for recall, _ in curve}):
        best = max(precision for other, precision in curve if other >= recall)
        area += (recall - last) * best
        last = recall
    return area


detections = st.lists(st.tuples(st.integers(0, 12), st.booleans()), min_size=1, max_size=25)


@given(detections, st.integers(0, 30))
def test_agrees_with_the_definition(ranked: list[tuple[int, bool]], missed: int) -> None:
    score = np.array([s / 12 for s, _ in ranked])
    hit = np.array([h for _, h in ranked])
    targets = int(hit.sum()) + missed
    if targets:
        expected = slow_area(score.tolist(), hit.tolist(), targets)
        assert average_precision(score, hit, targets) == pytest.approx(expected, abs=1e-12)
    released = slow_area(score.tolist(), hit.tolist(), len(hit))
    assert released_average_precision(score, hit) == pytest.approx(released, abs=1e-12)


@given(detections, st.integers(0, 30))
def test_the_two_differ_by_what_recall_is_divided_by(
    ranked: list[tuple[int, bool]], missed: int
) -> None:
    score = np.array([float(s) for s, _ in ranked])
    hit = np.array([h for _, h in ranked])
    targets = int(hit.sum()) + missed
    if targets:
        standard = average_precision(score, hit, targets)
        released = released_average_precision(score, hit)
        assert standard * targets == pytest.approx(released * len(hit))


@pytest.mark.parametrize(
    ("hits", "targets", "standard", "released"),
    [
        ("+++", 3, 1.0, 1.0),
        ("+++", 100, 0.03, 1.0),  # missing 97 of 100 costs nothing in the authors' release
        ("+-+-", 4, (1 + 2 / 3) / 4, (1 + 2 / 3) / 4),
        ("+-+-", 2, (1 + 2 / 3) / 2, (1 + 2 / 3) / 4),
        ("-+", 1, 0.5, 0.25),
        # the envelope: the precision 3/4 at the third hit covers the 1/2 at the first one
        ("-+++", 3, 0.75, 9 / 16),
        ("----", 5, 0.0, 0.0),
        # the toy check: 100 targets and 20 good detections, 18 of them right
        ("+" * 17 + "-+-", 100, (17 + 18 / 19) / 100, (17 + 18 / 19) / 20),
    ],
)
def test_hand_worked_curves(hits: str, targets: int, standard: float, released: float) -> None:
    hit = np.array([letter == "+" for letter in hits])
    score = np.linspace(0.9, 0.1, len(hits))
    assert average_precision(score, hit, targets) == pytest.approx(standard)
    assert released_average_precision(score, hit) == pytest.approx(released)
    turned = np.random.default_rng(0).permutation(len(hits))
    assert average_precision(score[turned], hit[turned], targets) == pytest.approx(standard)


def test_the_toy_check_in_figures() -> None:
    hit = np.array([True] * 17 + [False, True, False])
    score = np.linspace(1, 0, 20)
    assert round(average_precision(score, hit, 100), 3) == 0.179
    assert round(released_average_precision(score, hit), 3) == 0.897


def test_equal_scores_are_one_step() -> None:
    score, hit = np.full(4, 0.5), np.array([True, False, True, False])
    assert average_precision(score, hit, 4) == pytest.approx(0.5 * 0.5)
    assert average_precision(score, hit[::-1].copy(), 4) == pytest.approx(0.5 * 0.5)


def test_nothing_to_detect_and_nothing_detected() -> None:
    none, nothing = np.zeros(0), np.zeros(0, dtype=bool)
    assert average_precision(none, nothing, 3) == 0.0
    assert math.isnan(average_precision(np.ones(1), np.zeros(1, dtype=bool), 0))
    assert math.isnan(released_average_precision(none, nothing))


def test_more_hits_than_targets_are_refused() -> None:
    with pytest.raises(ValueError, match="2 hits among only 1 targets"):
        average_precision(np.ones(2), np.ones(2, dtype=bool), 1)
