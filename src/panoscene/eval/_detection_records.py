"""What each scene says about a detector: hits, misses and errors, ready to be pooled."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, Int64

from panoscene.eval._matching import boxes_in_a_row, greedy_matches, object_ious, scores_of
from panoscene.geometry import wrap_angle
from panoscene.scene import CATEGORIES, Objects, Scene

IOU_THRESHOLDS = (0.15, 0.25, 0.5)
"""Oriented 3D IoUs that a true positive must exceed; the first is the paper's."""
_SCENES_AT_ONCE = 256


@dataclass(frozen=True, slots=True)
class MatchErrors:
    """How far k matched boxes are from their targets."""

    category: Int64[np.ndarray, " k"]
    """Index into ``CATEGORIES``, of the target."""
    iou: Float[np.ndarray, " k"]
    """Oriented 3D IoU."""
    centre_error: Float[np.ndarray, " k"]
    """Distance between the centres in metres."""
    yaw_error: Float[np.ndarray, " k"]
    """Absolute difference of the yaws in radians, in [0, pi]."""
    size_error: Float[np.ndarray, " k"]
    """Mean over width, depth and height of |predicted - true| / true."""


@dataclass(frozen=True, slots=True)
class DetectionRecord:
    """What one scene with n predicted objects says about a detector; scores are pooled from these.

    A scene without predicted objects still brings its targets, and one without targets its false
    positives.
    """

    iou_thresholds: tuple[float, ...]
    category: Int64[np.ndarray, " n"]
    """Predicted category of each predicted object."""
    score: Float[np.ndarray, " n"]
    hit: Bool[np.ndarray, "thresholds n"]
    """Whether each predicted object is a true positive at each threshold."""
    targets: Int64[np.ndarray, " categories"]
    """Number of targets of each category."""
    errors: MatchErrors
    """Of the true positives at the first threshold."""


def detection_record(
    prediction: Scene, target: Scene, *, iou_thresholds: tuple[float, ...] = IOU_THRESHOLDS
) -> DetectionRecord:
    """Return what a scene says about the detector that predicted it.

    Matching is that of ``match_objects``, for each threshold on its own.

    Args:
        prediction: the predicted scene; all its objects count, whatever their score.
        target: the true scene.
        iou_thresholds: IoUs that a true positive must exceed, in [0, 1).

    Raises:
        ValueError: No threshold, one outside [0, 1), or a predicted score that is not finite.
    """
    return detection_records([prediction], [target], iou_thresholds=iou_thresholds)[0]


def detection_records(
    predictions: Sequence[Scene],
    targets: Sequence[Scene],
    *,
    iou_thresholds: tuple[float, ...] = IOU_THRESHOLDS,
) -> list[DetectionRecord]:
    """Return ``detection_record`` of every scene; much faster than one by one.

    Args:
        predictions: the predicted scenes.
        targets: the true scenes, in the same order.
        iou_thresholds: IoUs that a true positive must exceed, in [0, 1).

    Raises:
        ValueError: As ``detection_record``, or lists of different lengths.
    """
    if not iou_thresholds:
        raise ValueError("iou_thresholds is empty; expected at least one IoU in [0, 1)")
    if len(predictions) != len(targets):
        raise ValueError(f"found {len(predictions)} predictions for {len(targets)} targets")
    records: list[DetectionRecord] = []
    for first in range(0, len(targets), _SCENES_AT_ONCE):
        part = slice(first, first + _SCENES_AT_ONCE)
        predicted = [scene.objects for scene in predictions[part]]
        true = [scene.objects for scene in targets[part]]
        ious = object_ious(predicted, true)
        matches = [
            greedy_matches(iou, scores_of(objects), iou_thresholds)
            for iou, objects in zip(ious, predicted, strict=True)
        ]
        errors = _match_errors(predicted, true, ious, [match[0] for match in matches])
        records += [
            DetectionRecord(
                iou_thresholds=iou_thresholds,
                category=p.category.cpu().numpy(),
                score=scores_of(p),
                hit=match >= 0,
                targets=np.bincount(t.category.cpu().numpy(), minlength=len(CATEGORIES)),
                errors=error,
            )
            for p, t, match, error in zip(predicted, true, matches, errors, strict=True)
        ]
    return records


def pool_match_errors(records: Sequence[DetectionRecord]) -> MatchErrors:
    """Return the errors of the matched boxes of all scenes, one after the other.

    Only matched boxes have errors: a detector that keeps nothing but its easiest objects looks
    precise here. Always read them next to the recall.
    """
    errors = [record.errors for record in records]
    return MatchErrors(
        category=np.concatenate([np.zeros(0, np.int64), *(part.category for part in errors)]),
        iou=np.concatenate([np.zeros(0), *(part.iou for part in errors)]),
        centre_error=np.concatenate([np.zeros(0), *(part.centre_error for part in errors)]),
        yaw_error=np.concatenate([np.zeros(0), *(part.yaw_error for part in errors)]),
        size_error=np.concatenate([np.zeros(0), *(part.size_error for part in errors)]),
    )


def _match_errors(
    predicted: Sequence[Objects],
    true: Sequence[Objects],
    ious: Sequence[np.ndarray],
    matches: Sequence[np.ndarray],
) -> list[MatchErrors]:
    """Return the errors of the matched boxes of each scene."""
    rows = [np.flatnonzero(match >= 0) for match in matches]
    columns = [match[row] for match, row in zip(matches, rows, strict=True)]
    with torch.no_grad():
        found = boxes_in_a_row(
            [p.boxes[torch.from_numpy(r)] for p, r in zip(predicted, rows, strict=True)]
        )
        truth = boxes_in_a_row(
            [t.boxes[torch.from_numpy(c)] for t, c in zip(true, columns, strict=True)]
        )
        values = torch.stack(
            [
                torch.linalg.vector_norm(found.centre - truth.centre, dim=-1),
                wrap_angle(found.yaw - truth.yaw).abs(),
                ((found.size - truth.size).abs() / truth.size).mean(dim=-1),
            ]
        )
    parts = np.split(values.numpy(), np.cumsum([len(row) for row in rows])[:-1], axis=1)
    return [
        MatchErrors(t.category.cpu().numpy()[column], iou[row, column], *part)
        for t, iou, row, column, part in zip(true, ious, rows, columns, parts, strict=True)
    ]
