"""From records of scenes to named numbers with intervals."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict

import numpy as np
from jaxtyping import Float, Int64

from panoscene.eval._bootstrap import bias_corrected_intervals, bootstrap_weights
from panoscene.eval._detection import DetectionScores, score_detection
from panoscene.eval._detection_records import DetectionRecord
from panoscene.eval._layout_scores import layout_of_sums, layout_sums
from panoscene.eval._mesh_penetration import (
    penetration_of_sums,
    penetration_sums,
    score_penetration,
)
from panoscene.eval._plausibility import (
    PlausibilityRecord,
    plausibility_of_sums,
    plausibility_sums,
    ratio,
)
from panoscene.eval._relation_records import relation_sums, relations_of_sums
from panoscene.eval._results import Measured
from panoscene.eval._scene_records import SceneRecords
from panoscene.eval._semantic import SemanticRecord, label_ious, mean_ious
from panoscene.eval._shape_scores import shape_sums, shapes_of_sums
from panoscene.scene import CATEGORIES, COMMON_11, PANOCONTEXT_12

RECALL_LEVELS = (0.2, 0.4, 0.6)
"""Recalls at which methods are compared as equals."""
_ERRORS = ("iou", "centre_error", "yaw_error", "size_error")
"""Of matched boxes."""
_OF_FOUND = ("detection.matched_", "shape.canonical.", "shape.world.")
"""What the names of metrics of found objects begin with."""

Values = dict[str, float | None]
Table = Float[np.ndarray, "scenes columns"]
"""Numbers of each scene; the scores of a set of scenes follow from their sums."""
Score = Callable[[Float[np.ndarray, " columns"]], Values]
"""From sums over scenes to named scores."""
Drawn = tuple[float | None, Float[np.ndarray, " replicates"]]
"""A score on all scenes, and on each resample of them; NaN where it does not exist."""


def pooled_metrics(
    records: Sequence[SceneRecords],
    at_recall: Mapping[float, Sequence[PlausibilityRecord] | None],
    *,
    replicates: int,
    seed: int,
) -> dict[str, Measured]:
    """Return every metric by its dotted name, with the 95 % interval over scenes.

    Args:
        records: one for each scene.
        at_recall: plausibility records at each common recall; None where it is not reached.
        replicates: bootstrap resamples; 0 for no intervals.
        seed: of the resampling.

    Raises:
        ValueError: there are no records.
    """
    if not records:
        raise ValueError("records: expected those of at least one scene, found none")
    drawn = _drawn(records, at_recall, _weights(len(records), replicates, seed))
    measured = {name: _measured(*both) for name, both in drawn.items()}
    depths = [record.penetration for record in records if record.penetration is not None]
    if len(depths) == len(records):
        worst = score_penetration(depths)["worst_penetration"]
        measured["penetration.worst_penetration"] = Measured(value=finite(worst))
    return measured


def pooled_differences(
    records: Sequence[SceneRecords],
    others: Sequence[SceneRecords],
    *,
    replicates: int,
    seed: int,
) -> dict[str, Measured]:
    """Return by how much the metrics of one method are above those of another, by their names.

    Both are measured on the same resamples, scene by scene, so what makes a scene hard for both
    cancels out: such an interval is narrower than those of the two metrics suggest. Left out are
    metrics at a common recall, those of objects that a method has found (each finds others), and
    those that only one of the methods has.

    Args:
        records: one for each scene.
        others: those of the other method, of the same scenes in the same order.
        replicates: bootstrap resamples; 0 for no intervals.
        seed: of the resampling.

    Raises:
        ValueError: there are no records, or not as many of both.
    """
    if not records or len(records) != len(others):
        raise ValueError(f"records: found {len(records)} and {len(others)}, expected as many")
    weights = _weights(len(records), replicates, seed)
    ours, theirs = (_drawn(some, {}, weights) for some in (records, others))
    differences: dict[str, Measured] = {}
    for name in ours:
        if name in theirs and not name.startswith(_OF_FOUND):
            (value, column), (other, beside) = ours[name], theirs[name]
            both = None if value is None or other is None else value - other
            differences[name] = _measured(both, column - beside)
    return differences


def _weights(scenes: int, replicates: int, seed: int) -> Int64[np.ndarray, "replicates scenes"]:
    if not replicates:
        return np.zeros((0, scenes), dtype=np.int64)
    return bootstrap_weights(scenes, np.random.default_rng(seed), replicates=replicates)


def _drawn(
    records: Sequence[SceneRecords],
    at_recall: Mapping[float, Sequence[PlausibilityRecord] | None],
    weights: Int64[np.ndarray, "replicates scenes"],
) -> dict[str, Drawn]:
    """Return every metric by its dotted name."""
    boxes = [record.plausibility for record in records]
    parts: dict[str, tuple[Table, Score]] = {
        "detection": _matched_part([record.detection for record in records]),
        "plausibility": (plausibility_sums(boxes), plausibility_of_sums),
        "fidelity": (relation_sums([r.fidelity for r in records]), relations_of_sums),
        "layout": (layout_sums([r.layout for r in records]), layout_values),
        "semantic": _semantic_part([r.semantic for r in records]),
    }
    relations = [record.relations for record in records if record.relations is not None]
    if len(relations) == len(records):
        parts["relations"] = (relation_sums(relations), relations_of_sums)
    for level, kept in at_recall.items():
        if kept is not None:
            name = f"plausibility_at_recall_{round(100 * level)}"
            parts[name] = (plausibility_sums(kept), plausibility_of_sums)
    depths = [record.penetration for record in records if record.penetration is not None]
    if len(depths) == len(records):
        parts["penetration"] = (penetration_sums(depths), penetration_of_sums)
    shapes = [record.shape for record in records]
    if any(shape is not None for shape in shapes):
        parts["shape"] = (shape_sums(shapes), _shape_values)
    drawn = _drawn_detection([record.detection for record in records], weights)
    for group, (table, score) in parts.items():
        values = score(table.sum(axis=0))
        again = [score(sums) for sums in weights @ table]
        drawn |= {
            f"{group}.{name}": (value, np.array([_number(draw.get(name)) for draw in again]))
            for name, value in values.items()
        }
    return drawn


def pooled_categories(records: Sequence[SceneRecords]) -> dict[str, dict[str, Measured]]:
    """Return average precision and counts of every category that is predicted or a target."""
    scores = score_detection([record.detection for record in records])
    rows: dict[str, dict[str, Measured]] = {}
    for k, name in enumerate(CATEGORIES):
        if not scores.targets[k] and not scores.detections[k]:
            continue
        row: Values = {"targets": scores.targets[k], "detections": scores.detections[k]}
        for t, threshold in enumerate(scores.iou_thresholds):
            percent = round(100 * threshold)
            row[f"ap_{percent}"] = scores.average_precision[t, k]
            row[f"released_ap_{percent}"] = scores.released_average_precision[t, k]
        rows[name] = {key: Measured(value=finite(value)) for key, value in row.items()}
    return rows


def detection_values(scores: DetectionScores) -> dict[str, Float[np.ndarray, "*replicates"]]:
    """Return the detection scores by name; NaN where one does not exist."""
    values: dict[str, np.ndarray] = {}
    for t, threshold in enumerate(scores.iou_thresholds):
        percent = round(100 * threshold)
        for chosen, suffix in ((COMMON_11, "11"), (CATEGORIES, "57")):
            mean = scores.mean_average_precision(chosen)[..., t]
            released = scores.mean_released_average_precision(chosen)[..., t]
            values[f"ap_{percent}_mean_{suffix}"] = mean
            values[f"released_ap_{percent}_mean_{suffix}"] = released
        values[f"recall_{percent}"] = scores.recall()[..., t]
        values[f"precision_{percent}"] = scores.precision()[..., t]
    return values


def layout_values(sums: Float[np.ndarray, " columns"]) -> Values:
    """Return the layout scores by reading, number of corners and measure."""
    values: Values = {}
    for row in layout_of_sums(sums):
        start = f"{row.reading}.{row.corners}"
        values[f"{start}.scenes"] = float(row.scenes)
        values[f"{start}.degenerate"] = float(row.degenerate)
        values[f"{start}.scale_error"] = row.scale_error
        values |= {f"{start}.{key}": value for key, value in asdict(row.mean).items()}
    return values


def finite(value: float | None) -> float | None:
    """Return the number, or None for one that is missing or not finite: JSON has no NaN."""
    return None if value is None or not math.isfinite(value) else float(value)


def _drawn_detection(
    records: Sequence[DetectionRecord], weights: Int64[np.ndarray, "replicates scenes"]
) -> dict[str, Drawn]:
    whole = score_detection(records)
    values, again = detection_values(whole), {}
    if len(weights):
        resampled = score_detection(records, weights=weights)
        again = detection_values(resampled.with_missing_areas_of(whole))
    return {
        f"detection.{name}": (finite(float(value)), again.get(name, np.zeros(0)))
        for name, value in values.items()
    }


def _matched_part(records: Sequence[DetectionRecord]) -> tuple[Table, Score]:
    """Return how many objects of each scene are matched with the sums of their errors."""
    rows = [
        (len(record.errors.iou), *(getattr(record.errors, name).sum() for name in _ERRORS))
        for record in records
    ]

    def score(sums: Float[np.ndarray, " columns"]) -> Values:
        count, *errors = sums.tolist()
        means = [ratio(error, count) for error in errors]
        return {f"matched_{name}": mean for name, mean in zip(_ERRORS, means, strict=True)}

    return np.array(rows, dtype=np.float64), score


def _shape_values(sums: Float[np.ndarray, " columns"]) -> Values:
    return dict(_flat(asdict(shapes_of_sums(sums))))


def _semantic_part(records: Sequence[SemanticRecord]) -> tuple[Table, Score]:
    """Return the counts of each scene, and the IoU of each of the 12 labels with their means.

    A label that a resample does not have keeps its IoU over all scenes, as in detection.
    """
    counts = np.stack([record.confusion for record in records]).astype(np.float64)
    whole = label_ious(counts.sum(axis=0))

    def score(sums: Float[np.ndarray, " columns"]) -> Values:
        iou = label_ious(sums.reshape(counts.shape[1:]))
        iou = np.where(np.isnan(iou), whole, iou)
        mean, of_objects = mean_ious(iou)
        values: Values = dict(zip(PANOCONTEXT_12, iou.tolist(), strict=True))
        return values | {"mean": mean, "mean_objects": of_objects}

    return counts.reshape(len(records), -1), score


def _measured(value: float | None, replicates: Float[np.ndarray, " replicates"]) -> Measured:
    if not len(replicates):
        return Measured(value=finite(value))
    (interval,) = bias_corrected_intervals(np.array([_number(value)]), replicates[:, None])
    return Measured(value=finite(value), low=finite(interval.low), high=finite(interval.high))


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _flat(values: Mapping[str, object], start: str = "") -> list[tuple[str, float | None]]:
    flat: list[tuple[str, float | None]] = []
    for name, value in values.items():
        if isinstance(value, Mapping):
            flat += _flat(value, f"{start}{name}.")
        elif value is None:
            flat.append((start + name, None))
        elif isinstance(value, int | float):
            flat.append((start + name, finite(float(value))))
    return flat
