"""How well objects are detected: average precision, recall and precision of pooled scenes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int64

from panoscene.eval._average_precision import envelope_area, step_ends
from panoscene.eval._detection_records import DetectionRecord
from panoscene.scene import CATEGORIES, category_index

_NUMBERS_AT_ONCE = 2_000_000


@dataclass(frozen=True, slots=True)
class DetectionScores:
    """Detection scores of a set of scenes, or of each replicate of a bootstrap.

    Categories are all 57 in index order. Everything is in [0, 1]; NaN where it does not exist.
    """

    iou_thresholds: tuple[float, ...]
    score_threshold: float
    """Objects with at least this score are kept for recall and precision; not for the areas."""
    average_precision: Float[np.ndarray, "*replicates thresholds categories"]
    """Standard definition: 0 for a category with targets and no detection, NaN for one without
    targets."""
    released_average_precision: Float[np.ndarray, "*replicates thresholds categories"]
    """Definition of the authors' release: 0 for a category with detections and no targets, NaN for
    one without detections, even if all its targets are missed."""
    targets: Float[np.ndarray, "*replicates categories"]
    """Number of targets."""
    detections: Float[np.ndarray, "*replicates categories"]
    """Number of predicted objects, whatever their score."""
    kept: Float[np.ndarray, "*replicates categories"]
    """Number of predicted objects at the operating point."""
    hits: Float[np.ndarray, "*replicates thresholds categories"]
    """Number of true positives at the operating point."""

    def with_missing_areas_of(self, whole: "DetectionScores") -> "DetectionScores":
        """Return these scores with the areas that do not exist taken from those of all scenes.

        A category that is in few scenes is not in every resample of them. Left out there, it
        would leave the mean, and means of different categories would be compared: rare ones have
        low areas, so the resamples would look better than the data.
        """
        return replace(
            self,
            average_precision=_filled(self.average_precision, whole.average_precision),
            released_average_precision=_filled(
                self.released_average_precision, whole.released_average_precision
            ),
        )

    def mean_average_precision(
        self, categories: Sequence[str] = CATEGORIES
    ) -> Float[np.ndarray, "*replicates thresholds"]:
        """Return the standard mean over those of the categories that have targets.

        A category with targets that is never detected counts as 0. A category without targets is
        left out, so its false positives cost nothing here; they do in ``precision``. NaN when no
        category has targets.
        """
        return _mean_of_known(self.average_precision[..., _indices(categories)])

    def mean_released_average_precision(
        self, categories: Sequence[str] = CATEGORIES
    ) -> Float[np.ndarray, "*replicates thresholds"]:
        """Return the authors' mean: over those of the categories that have detections.

        Only for comparison with the paper's tables. A category that is never detected is left
        out; one that is detected although it has no targets counts as 0.
        """
        return _mean_of_known(self.released_average_precision[..., _indices(categories)])

    def recall(
        self, categories: Sequence[str] = CATEGORIES
    ) -> Float[np.ndarray, "*replicates thresholds"]:
        """Return the share of all targets that are found at the operating point."""
        chosen = _indices(categories)
        return _ratio(self.hits[..., chosen].sum(-1), self.targets[..., None, chosen].sum(-1))

    def precision(
        self, categories: Sequence[str] = CATEGORIES
    ) -> Float[np.ndarray, "*replicates thresholds"]:
        """Return the share of the kept objects that are true positives."""
        chosen = _indices(categories)
        return _ratio(self.hits[..., chosen].sum(-1), self.kept[..., None, chosen].sum(-1))


def score_detection(
    records: Sequence[DetectionRecord],
    *,
    score_threshold: float = 0.0,
    weights: Int64[np.ndarray, "replicates scenes"] | None = None,
) -> DetectionScores:
    """Return the detection scores of all scenes together.

    Every scene counts: those without predicted objects bring missed targets, those without targets
    bring false positives. (The authors' release skips the latter, and scores another scene twice
    in place of each of the former.)

    Args:
        records: one for each scene, from ``detection_record``.
        score_threshold: the operating point of ``recall`` and ``precision``: objects with at least
            this score are kept. The default keeps everything that was predicted, which is the
            predictor's own operating point. The areas always use every object.
        weights: how often each scene counts, from ``bootstrap_weights``; the result then has a
            leading axis of replicates. Every scene counts once when omitted.

    Raises:
        ValueError: Records of different thresholds, or weights for another number of scenes.
    """
    if not records:
        raise ValueError("records is empty; expected one record for each scene")
    if len({record.iou_thresholds for record in records}) > 1:
        raise ValueError("the records have different iou_thresholds")
    if weights is not None and weights.shape[1] != len(records):
        raise ValueError(f"weights are for {weights.shape[1]} scenes, found {len(records)} records")
    rows = np.ones((1, len(records))) if weights is None else weights.astype(np.float64)
    targets = rows @ np.stack([record.targets for record in records]).astype(np.float64)
    area, detections, kept, hits = _pooled(records, rows, score_threshold)
    lead = 0 if weights is None else slice(None)
    return DetectionScores(
        iou_thresholds=records[0].iou_thresholds,
        score_threshold=score_threshold,
        average_precision=_ratio(area, targets[:, None])[lead],
        released_average_precision=_ratio(area, detections[:, None])[lead],
        targets=targets[lead],
        detections=detections[lead],
        kept=kept[lead],
        hits=hits[lead],
    )


def _pooled(
    records: Sequence[DetectionRecord],
    weights: Float[np.ndarray, "replicates scenes"],
    score_threshold: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return envelope areas, detections, kept detections and hits of each category."""
    scene = np.repeat(np.arange(len(records)), [len(record.score) for record in records])
    category = np.concatenate([record.category for record in records])
    score = np.concatenate([record.score for record in records])
    hit = np.concatenate([record.hit for record in records], axis=1)
    order = np.lexsort((-score, category))
    limits = np.searchsorted(category[order], np.arange(len(CATEGORIES) + 1))
    replicates, thresholds = len(weights), len(hit)
    area = np.zeros((replicates, thresholds, len(CATEGORIES)))
    hits = np.zeros_like(area)
    detections, kept = np.zeros((2, replicates, len(CATEGORIES)))
    for index in np.flatnonzero(np.diff(limits)):
        chosen = order[limits[index] : limits[index + 1]]
        ends = step_ends(score[chosen])
        keep = score[chosen] >= score_threshold
        step = max(1, _NUMBERS_AT_ONCE // len(chosen))
        for first in range(0, replicates, step):
            part = slice(first, first + step)
            weight = weights[part, scene[chosen]]
            detected = np.cumsum(weight, axis=1)
            detections[part, index] = detected[:, -1]
            kept[part, index] = weight @ keep
            for threshold in range(thresholds):
                found = weight * hit[threshold, chosen]
                hits[part, threshold, index] = found @ keep
                found = np.cumsum(found, axis=1)
                area[part, threshold, index] = envelope_area(found[:, ends], detected[:, ends])
    return area, detections, kept, hits


def _indices(categories: Sequence[str]) -> Int64[np.ndarray, " chosen"]:
    return np.array([category_index(name) for name in categories], dtype=np.int64)


def _filled(values: np.ndarray, instead: np.ndarray) -> np.ndarray:
    return np.where(np.isnan(values), instead, values)


def _ratio(top: np.ndarray, bottom: np.ndarray) -> np.ndarray:
    """Return top / bottom; NaN where there is nothing to divide by."""
    bottom = np.broadcast_to(bottom, top.shape)
    return np.divide(top, bottom, out=np.full(top.shape, np.nan), where=bottom > 0)


def _mean_of_known(values: np.ndarray) -> np.ndarray:
    known = ~np.isnan(values)
    return _ratio(np.where(known, values, 0.0).sum(-1), known.sum(-1).astype(np.float64))
