"""Confidence intervals by resampling scenes: one set of draws serves every metric.

A replicate of the bootstrap draws as many scenes as there are, with replacement. It is kept as a
weight for each scene, the number of times it was drawn. Metrics that are computed with the same
weights can be compared scene by scene: the interval of a difference between two methods is that
of the differences of their replicates.
"""

from collections.abc import Callable
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from jaxtyping import Float, Int64


@dataclass(frozen=True, slots=True)
class Interval:
    """A measured value and the interval in which it lies with the stated confidence."""

    estimate: float
    """The value on the scenes as they are."""
    low: float
    """Lower end; NaN when no replicate has a value."""
    high: float
    """Upper end; NaN when no replicate has a value."""
    confidence: float = 0.95


REPLICATES = 1000
"""Resamples behind the intervals, unless another number is asked for."""


def bootstrap_weights(
    scenes: int, rng: np.random.Generator, *, replicates: int = REPLICATES
) -> Int64[np.ndarray, "replicates scenes"]:
    """Return how often each scene is drawn in each replicate; every row sums to ``scenes``.

    Args:
        scenes: number of scenes, also of those without objects.
        rng: source of the draws.
        replicates: number of replicates.

    Raises:
        ValueError: No scene, or no replicate.

    Source: Efron, "Bootstrap methods: another look at the jackknife", 1979.

    Examples:
        >>> bootstrap_weights(4, np.random.default_rng(0), replicates=2).sum(axis=1).tolist()
        [4, 4]
    """
    if scenes < 1 or replicates < 1:
        raise ValueError(
            f"scenes and replicates must be positive, found {scenes} scenes and "
            f"{replicates} replicates"
        )
    return rng.multinomial(scenes, np.full(scenes, 1.0 / scenes), size=replicates).astype(np.int64)


def bootstrap_ratio(
    numerator: Float[np.ndarray, " scenes"],
    denominator: Float[np.ndarray, " scenes"],
    weights: Int64[np.ndarray, "replicates scenes"],
) -> Float[np.ndarray, " replicates"]:
    """Return sum(numerator) / sum(denominator) of each replicate; NaN where that is 0 / 0.

    Args:
        numerator: one number for each scene, for example colliding pairs.
        denominator: one number for each scene, not negative, for example pairs of objects.
        weights: from ``bootstrap_weights``.

    Raises:
        ValueError: A number that is not finite, or a denominator below 0. A scene in which a
            metric does not exist takes part with numerator and denominator 0.

    Examples:
        >>> weights = np.array([[1, 1], [2, 0]])
        >>> bootstrap_ratio(np.array([1.0, 3.0]), np.array([2.0, 2.0]), weights).tolist()
        [1.0, 0.5]
    """
    for name, values in (("numerator", numerator), ("denominator", denominator)):
        if not np.isfinite(values).all():
            bad = int(np.flatnonzero(~np.isfinite(values))[0])
            raise ValueError(f"{name}[{bad}] is {values[bad]}; expected a finite number")
    if (denominator < 0).any():
        raise ValueError(f"denominators must not be negative, found {denominator.min()}")
    top, bottom = weights @ numerator, weights @ denominator
    return np.divide(top, bottom, out=np.full_like(top, np.nan), where=bottom > 0)


def bootstrap_interval(
    numerator: Float[np.ndarray, " scenes"],
    denominator: Float[np.ndarray, " scenes"] | None = None,
    *,
    weights: Int64[np.ndarray, "replicates scenes"],
    confidence: float = 0.95,
) -> Interval:
    """Return a ratio of sums over scenes, or a mean over scenes, with its confidence interval.

    Args:
        numerator: one number for each scene.
        denominator: one number for each scene; 1 when omitted, which makes the ratio a mean.
        weights: from ``bootstrap_weights``.
        confidence: share of the replicates inside the interval, in (0, 1).

    Raises:
        ValueError: As ``bootstrap_ratio``; or a confidence that is not in (0, 1).

    Examples:
        >>> weights = bootstrap_weights(4, np.random.default_rng(0))
        >>> bootstrap_interval(np.array([0.0, 1.0, 1.0, 2.0]), weights=weights).estimate
        1.0
    """
    if denominator is None:
        denominator = np.ones_like(numerator)
    whole = np.ones((1, len(numerator)), dtype=np.int64)
    (estimate,) = bootstrap_ratio(numerator, denominator, whole)
    replicates = bootstrap_ratio(numerator, denominator, weights)
    return percentile_intervals(np.array([estimate]), replicates[:, None], confidence=confidence)[0]


def percentile_intervals(
    estimate: Float[np.ndarray, " metrics"],
    replicates: Float[np.ndarray, "replicates metrics"],
    *,
    confidence: float = 0.95,
) -> tuple[Interval, ...]:
    """Return for each metric the interval between two percentiles of its replicates.

    Replicates in which a metric does not exist (NaN) are left out.

    Args:
        estimate: the metrics on all scenes.
        replicates: the metrics on each resampled set of scenes.
        confidence: share of the replicates inside the interval, in (0, 1).

    Raises:
        ValueError: A confidence that is not in (0, 1).

    Examples:
        >>> values = np.arange(101.0)[:, None]
        >>> percentile_intervals(np.array([50.0]), values, confidence=0.5)
        (Interval(estimate=50.0, low=25.0, high=75.0, confidence=0.5),)
    """
    tails = _tails(confidence)
    return _intervals(estimate, replicates, confidence, lambda _value, _known: tails)


def bias_corrected_intervals(
    estimate: Float[np.ndarray, " metrics"],
    replicates: Float[np.ndarray, "replicates metrics"],
    *,
    confidence: float = 0.95,
) -> tuple[Interval, ...]:
    """Return ``percentile_intervals`` with percentiles moved against the bias of the replicates.

    Average precision of a resample tends to be higher than that of the data, because a resample
    holds fewer different scenes. Where a share p of the replicates is below the estimate, ties by
    half, the percentiles a become Phi(2 Phi^-1(p) + Phi^-1(a)); with p = 1/2 nothing changes.

    Args:
        estimate: the metrics on all scenes.
        replicates: the metrics on each resampled set of scenes; NaN is left out.
        confidence: share of the replicates inside the interval if they have no bias, in (0, 1).

    Raises:
        ValueError: A confidence that is not in (0, 1).

    Source: Efron, "Nonparametric standard errors and confidence intervals", 1981.

    Examples:
        >>> values = np.arange(101.0)[:, None]
        >>> (plain,) = bias_corrected_intervals(np.array([50.0]), values, confidence=0.5)
        >>> (moved,) = bias_corrected_intervals(np.array([40.0]), values, confidence=0.5)
        >>> round(plain.low), round(plain.high), round(moved.low), round(moved.high)
        (25, 75, 12, 57)
    """
    normal, (lower, upper) = NormalDist(), _tails(confidence)

    def tails(value: float, known: Float[np.ndarray, " known"]) -> tuple[float, float]:
        if np.isnan(value):
            return lower, upper
        below = float((known < value).mean() + (known == value).mean() / 2)
        edge = 0.5 / len(known)
        shift = 2 * normal.inv_cdf(min(max(below, edge), 1 - edge))
        low, high = (normal.cdf(shift + normal.inv_cdf(tail)) for tail in (lower, upper))
        return low, high

    return _intervals(estimate, replicates, confidence, tails)


def _tails(confidence: float) -> tuple[float, float]:
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence must be in (0, 1), found {confidence}")
    return (1.0 - confidence) / 2, (1.0 + confidence) / 2


def _intervals(
    estimate: Float[np.ndarray, " metrics"],
    replicates: Float[np.ndarray, "replicates metrics"],
    confidence: float,
    tails: Callable[[float, Float[np.ndarray, " known"]], tuple[float, float]],
) -> tuple[Interval, ...]:
    """Return the intervals between those percentiles that ``tails`` chooses for each metric."""
    intervals: list[Interval] = []
    for value, column in zip(estimate, replicates.T, strict=True):
        known = column[~np.isnan(column)]
        low = high = np.nan
        if len(known):
            low, high = np.quantile(known, tails(float(value), known))
        intervals.append(Interval(float(value), float(low), float(high), confidence))
    return tuple(intervals)
