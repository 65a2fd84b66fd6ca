"""Intervals: against theory, against literal resampling, and in the corners."""

import math

import numpy as np
import pytest

from panoscene.eval._bootstrap import (
    bias_corrected_intervals,
    bootstrap_interval,
    bootstrap_ratio,
    bootstrap_weights,
    percentile_intervals,
)


def test_weights_are_draws_with_replacement() -> None:
    weights = bootstrap_weights(50, np.random.default_rng(0), replicates=4000)
    assert weights.shape == (4000, 50)
    assert (weights.sum(axis=1) == 50).all()
    # multinomial: mean 1, variance 1 - 1/50, covariance of two scenes -1/50
    np.testing.assert_allclose(weights.mean(axis=0), 1.0, atol=0.08)
    np.testing.assert_allclose(weights.var(axis=0).mean(), 1 - 1 / 50, atol=0.03)
    assert weights.mean(axis=0).std() < 0.03


def test_the_same_generator_gives_the_same_draws() -> None:
    first = bootstrap_weights(9, np.random.default_rng(5))
    np.testing.assert_array_equal(first, bootstrap_weights(9, np.random.default_rng(5)))
    assert (first != bootstrap_weights(9, np.random.default_rng(6))).any()


def test_the_interval_of_a_mean_is_that_of_theory() -> None:
    values = np.random.default_rng(0).normal(3.0, 2.0, 400)
    weights = bootstrap_weights(400, np.random.default_rng(1), replicates=4000)
    interval = bootstrap_interval(values, weights=weights)
    half = 1.96 * values.std() / math.sqrt(400)
    assert interval.estimate == pytest.approx(values.mean())
    assert interval.low == pytest.approx(values.mean() - half, abs=0.1 * half)
    assert interval.high == pytest.approx(values.mean() + half, abs=0.1 * half)
    narrow = bootstrap_interval(values, weights=weights, confidence=0.5)
    assert interval.low < narrow.low < narrow.high < interval.high


def test_intervals_cover_the_truth_as_often_as_they_say() -> None:
    rng = np.random.default_rng(2)
    covered = 0
    for _ in range(300):
        pairs = rng.poisson(20.0, 60).astype(float)
        colliding = rng.binomial(pairs.astype(int), 0.1).astype(float)
        weights = bootstrap_weights(60, rng, replicates=300)
        interval = bootstrap_interval(colliding, pairs, weights=weights)
        covered += interval.low <= 0.1 <= interval.high
    assert 0.89 <= covered / 300 <= 0.99


def test_a_ratio_is_one_of_sums() -> None:
    rng = np.random.default_rng(3)
    top, bottom = rng.uniform(0, 1, 8), rng.uniform(0, 2, 8)
    weights = bootstrap_weights(8, rng, replicates=20)
    for row, value in zip(weights, bootstrap_ratio(top, bottom, weights), strict=True):
        drawn = np.repeat(np.arange(8), row)
        assert value == pytest.approx(top[drawn].sum() / bottom[drawn].sum())
    assert bootstrap_interval(top, bottom, weights=weights).estimate == pytest.approx(
        top.sum() / bottom.sum()
    )


def test_replicates_without_a_value_are_left_out() -> None:
    # only the last scene has a denominator; it is missing from about a third of the replicates
    top, bottom = np.array([0.0, 0.0, 3.0]), np.array([0.0, 0.0, 4.0])
    weights = bootstrap_weights(3, np.random.default_rng(0))
    assert np.isnan(bootstrap_ratio(top, bottom, weights)).any()
    interval = bootstrap_interval(top, bottom, weights=weights)
    assert (interval.low, interval.estimate, interval.high) == (0.75, 0.75, 0.75)
    empty = bootstrap_interval(np.zeros(3), np.zeros(3), weights=weights)
    assert math.isnan(empty.estimate)
    assert math.isnan(empty.low)
    assert math.isnan(empty.high)


def test_one_scene_has_no_spread() -> None:
    weights = bootstrap_weights(1, np.random.default_rng(0))
    interval = bootstrap_interval(np.array([2.0]), weights=weights)
    assert (interval.low, interval.high) == (2.0, 2.0)


def test_each_metric_has_its_own_interval() -> None:
    replicates = np.stack([np.arange(101.0), np.arange(101.0) * 2], axis=1)
    first, second = percentile_intervals(np.array([50.0, 100.0]), replicates, confidence=0.5)
    assert (first.low, first.high) == (25.0, 75.0)
    assert (second.low, second.high) == (50.0, 150.0)


def test_bad_arguments_are_refused() -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match="must be positive, found 0 scenes"):
        bootstrap_weights(0, rng)
    with pytest.raises(ValueError, match="0 replicates"):
        bootstrap_weights(2, rng, replicates=0)
    weights = bootstrap_weights(2, rng)
    with pytest.raises(ValueError, match=r"numerator\[1\] is nan"):
        bootstrap_interval(np.array([0.0, math.nan]), weights=weights)
    with pytest.raises(ValueError, match="must not be negative, found -1"):
        bootstrap_interval(np.zeros(2), np.array([1.0, -1.0]), weights=weights)
    for confidence in (0.0, 1.0, 95.0):
        with pytest.raises(ValueError, match=r"confidence must be in \(0, 1\)"):
            bootstrap_interval(np.zeros(2), weights=weights, confidence=confidence)


def test_without_bias_the_correction_changes_nothing() -> None:
    values = np.arange(101.0)[:, None]
    for estimate in (50.0, math.nan):
        (plain,) = percentile_intervals(np.array([estimate]), values)
        (corrected,) = bias_corrected_intervals(np.array([estimate]), values)
        assert corrected.low == pytest.approx(plain.low)
        assert corrected.high == pytest.approx(plain.high)
    # ties count by half: a metric that never changes has no bias
    (same,) = bias_corrected_intervals(np.array([2.0]), np.full((10, 1), 2.0))
    assert (same.low, same.high) == (2.0, 2.0)


def test_the_correction_moves_against_the_bias() -> None:
    rng = np.random.default_rng(0)
    replicates = rng.normal(1.0, 1.0, (4000, 1))  # one standard deviation above the estimate 0
    (interval,) = bias_corrected_intervals(np.array([0.0]), replicates)
    assert interval.low == pytest.approx(-1.0 - 1.96, abs=0.35)
    assert interval.high == pytest.approx(-1.0 + 1.96, abs=0.15)
    # all replicates on one side: still an interval of them
    (beyond,) = bias_corrected_intervals(np.array([-9.0]), replicates)
    assert replicates.min() <= beyond.low <= beyond.high <= replicates.max()
    with pytest.raises(ValueError, match="confidence"):
        bias_corrected_intervals(np.array([0.0]), replicates, confidence=1.0)
