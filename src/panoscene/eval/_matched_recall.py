"""Plausibility where methods are comparable: at the score threshold of a common recall."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float

from panoscene.eval._matching import IOU_THRESHOLD, match_objects
from panoscene.eval._plausibility import PlausibilityRecord, records_of_boxes
from panoscene.geometry import OrientedBoxes
from panoscene.scene import Layout, Objects, Scene


@dataclass(frozen=True, slots=True)
class PlausibilityAtRecall:
    """The records of a data set when only objects above a score threshold are kept."""

    threshold: float
    """The highest score threshold that reaches the wanted recall; objects with this score stay."""
    recall: float
    """Pooled recall there: at least the wanted one, more only where scores tie."""
    records: tuple[PlausibilityRecord, ...]
    """One for each scene, also for scenes that keep no object."""


def highest_recall(
    predictions: Sequence[Objects],
    targets: Sequence[Objects],
    *,
    iou_threshold: float = IOU_THRESHOLD,
    same_category: bool = True,
) -> float:
    """Return the pooled recall of all predicted objects: found targets of all targets, in [0, 1].

    The smallest of this over the methods of a table is their common recall: all of them reach it.
    Without any target the recall is 1, there is nothing to miss.

    Args:
        predictions: the predicted objects of each scene.
        targets: the true objects of the same scenes.
        iou_threshold: as in ``match_objects``.
        same_category: as in ``match_objects``.

    Raises:
        ValueError: the two lists differ in length.
    """
    found, _, count = _found_scores(predictions, targets, iou_threshold, same_category)
    return len(found) / count if count else 1.0


def score_threshold_at_recall(
    predictions: Sequence[Objects],
    targets: Sequence[Objects],
    recall: float,
    *,
    iou_threshold: float = IOU_THRESHOLD,
    same_category: bool = True,
) -> float | None:
    """Return the highest score threshold at which the pooled recall is at least ``recall``.

    Objects with a score of at least the threshold are kept. Matching is greedy by descending
    score, so dropping the lower scores does not change the matches of the others, and one
    matching of everything gives the recall at every threshold.

    Args:
        predictions: the predicted objects of each scene.
        targets: the true objects of the same scenes.
        recall: wanted share of all targets of the data set, in [0, 1].
        iou_threshold: as in ``match_objects``.
        same_category: as in ``match_objects``.

    Returns:
        The threshold; infinity when nothing needs to be found (keep nothing); None when even all
        objects do not reach the recall.

    Raises:
        ValueError: the two lists differ in length, or ``recall`` is not in [0, 1].
    """
    if not 0.0 <= recall <= 1.0:
        raise ValueError(f"recall: expected a share in [0, 1], found {recall}")
    found, _, count = _found_scores(predictions, targets, iou_threshold, same_category)
    return _threshold(found, count, recall)


def plausibility_at_recall(
    predictions: Sequence[Scene],
    targets: Sequence[Scene],
    recall: float,
    *,
    iou_threshold: float = IOU_THRESHOLD,
    same_category: bool = True,
) -> PlausibilityAtRecall | None:
    """Return the plausibility records of a method at the score threshold of a common recall.

    A method that reports fewer objects has fewer collisions. Here every method keeps just as many
    of its best objects as it needs to find the same share of the data set's targets, and
    duplicates and inventions above the threshold count as they should. Boxes are judged by the
    prediction's own layout.

    Args:
        predictions: one scene for each target.
        targets: the true scenes.
        recall: wanted share of all targets, in [0, 1]; for a table the smallest
            ``highest_recall`` of its methods.
        iou_threshold: as in ``match_objects``.
        same_category: as in ``match_objects``.

    Returns:
        The records, or None when the method never reaches the recall.

    Raises:
        ValueError: the two lists differ in length, or ``recall`` is not in [0, 1].
    """
    if not 0.0 <= recall <= 1.0:
        raise ValueError(f"recall: expected a share in [0, 1], found {recall}")
    found, scores, count = _found_scores(
        [scene.objects for scene in predictions],
        [scene.objects for scene in targets],
        iou_threshold,
        same_category,
    )
    return kept_at_recall(
        [scene.objects.boxes for scene in predictions],
        [scene.layout for scene in predictions],
        scores,
        found,
        count,
        recall,
    )


def kept_at_recall(  # noqa: PLR0917 - one table has six columns
    boxes: Sequence[OrientedBoxes],
    layouts: Sequence[Layout],
    scores: Sequence[Float[np.ndarray, " _"]],
    found: Float[np.ndarray, " matched"],
    count: int,
    recall: float,
) -> PlausibilityAtRecall | None:
    """Return ``plausibility_at_recall`` from the boxes and scores of each scene.

    Args:
        boxes: predicted boxes of each scene.
        layouts: predicted room of each scene.
        scores: of the boxes.
        found: scores of all matched objects of all scenes, descending.
        count: number of targets.
        recall: wanted share of them.
    """
    threshold = _threshold(found, count, recall)
    if threshold is None:
        return None
    kept = [box[torch.from_numpy(s >= threshold)] for box, s in zip(boxes, scores, strict=True)]
    reached = float((found >= threshold).sum()) / count if count else 1.0
    return PlausibilityAtRecall(threshold, reached, records_of_boxes(kept, layouts))


def _found_scores(
    predictions: Sequence[Objects],
    targets: Sequence[Objects],
    iou_threshold: float,
    same_category: bool,
) -> tuple[np.ndarray, list[np.ndarray], int]:
    """Return scores of matched objects, descending; those of all, by scene; number of targets."""
    if len(predictions) != len(targets):
        raise ValueError(
            f"targets: expected one for each of the {len(predictions)} predictions, "
            f"found {len(targets)}"
        )
    scores = [objects.score.detach().cpu().double().numpy() for objects in predictions]
    found = [
        score[
            match_objects(
                prediction, target, iou_threshold=iou_threshold, same_category=same_category
            ).numpy()
            >= 0
        ]
        for score, prediction, target in zip(scores, predictions, targets, strict=True)
    ]
    joined = np.sort(np.concatenate([np.zeros(0), *found]))[::-1]
    return joined, scores, sum(len(target.boxes) for target in targets)


def _threshold(found: np.ndarray, count: int, recall: float) -> float | None:
    # a share computed as k / count must ask for k again, in spite of rounding
    needed = int(np.ceil(recall * count - 1e-9 * max(count, 1)))
    if needed > len(found):
        return None
    return float(found[needed - 1]) if needed else float("inf")
