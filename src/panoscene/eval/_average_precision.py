"""Average precision of a ranked list of detections: the standard one and the authors' released one.

Both are the area under the same precision envelope; they differ in what recall is divided by. The
standard one divides by the number of targets, so a missed target costs. The authors' release
divides by the number of detections, so a missed target costs nothing:
``standard * targets = released * detections``.
"""

import numpy as np
from jaxtyping import Bool, Float, Int64


def average_precision(
    score: Float[np.ndarray, " n"], hit: Bool[np.ndarray, " n"], targets: int
) -> float:
    """Return the standard average precision in [0, 1]: recall is hits over targets.

    All-point interpolated area under the precision envelope: the precision at a recall is the
    best one at that recall or any larger. Detections of equal score are one step of the curve, so
    the order in which scenes are pooled does not matter.

    Args:
        score: scores of the detections of one category in all scenes, in any order.
        hit: whether each is a true positive.
        targets: number of targets of that category. Without targets the result is NaN; with
            targets and no detection it is 0.

    Raises:
        ValueError: More hits than targets.

    Source: PASCAL VOC from 2010 on.

    Examples:
        >>> score, hit = np.array([0.9, 0.8, 0.7, 0.6]), np.array([True, False, True, False])
        >>> round(average_precision(score, hit, 4), 4)
        0.4167
        >>> round(average_precision(score, hit, 2), 4)
        0.8333
    """
    if targets < hit.sum():
        raise ValueError(f"{int(hit.sum())} hits among only {targets} targets")
    return _share(_ranked_area(score, hit), targets)


def released_average_precision(
    score: Float[np.ndarray, " n"], hit: Bool[np.ndarray, " n"]
) -> float:
    """Return the average precision of the authors' release: recall is hits over detections.

    Not a recall at all, and only for comparison with the paper's tables: a detector that returns
    one good box and misses a hundred scores 1. Without detections the result is NaN. The area is
    that of ``average_precision``.

    Source: authors' release, ``AveragePrecisionMeter``; the paper words the standard definition.

    Examples:
        >>> released_average_precision(np.array([0.9]), np.array([True]))
        1.0
    """
    return _share(_ranked_area(score, hit), len(score))


def envelope_area(
    found: Float[np.ndarray, "curves steps"], detected: Float[np.ndarray, "curves steps"]
) -> Float[np.ndarray, " curves"]:
    """Return the area under the precision envelope over the number of hits (not over recall).

    Divided by the number of targets it is the average precision. Steps at which nothing is
    detected yet have no precision; steps that detect nothing new change nothing.

    Args:
        found: hits among the detections up to each step, in the order of falling score.
        detected: detections up to each step.
    """
    precision = np.divide(found, detected, out=np.zeros_like(found), where=detected > 0)
    envelope = np.maximum.accumulate(precision[..., ::-1], axis=-1)[..., ::-1]
    return (np.diff(found, axis=-1, prepend=0.0) * envelope).sum(axis=-1)


def step_ends(falling_score: Float[np.ndarray, " n"]) -> Int64[np.ndarray, " steps"]:
    """Return the index of the last of each run of equal scores in a sorted list."""
    return np.flatnonzero(
        np.append(falling_score[1:] != falling_score[:-1], len(falling_score) > 0)
    )


def _ranked_area(score: Float[np.ndarray, " n"], hit: Bool[np.ndarray, " n"]) -> float:
    order = np.argsort(-score, kind="stable")
    ends = step_ends(score[order])
    found = np.cumsum(hit[order], dtype=np.float64)[ends]
    return float(envelope_area(found[None], ends[None] + 1.0)[0])


def _share(area: float, count: int) -> float:
    return area / count if count else float("nan")
