"""From records of scenes to named numbers with intervals."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict

import numpy as np
from jaxtyping import Float, Int64

from panoscene.eval._bootstrap import bias_corrected_intervals, bootstrap_weights
from panoscene.eval._detection import DetectionScores, score_detection
from panoscene.eval._detection_records import DetectionRecord, pool_match_errors
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
)
from panoscene.eval._relation_records import relation_sums, relations_of_sums
from panoscene.eval._results import Measured
from panoscene.eval._scene_records import SceneRecords
from panoscene.eval._semantic import SemanticRecord, label_ious, mean_ious
from panoscene.eval._shape_scores import score_shapes
from panoscene.scene import CATEGORIES, COMMON_11, PANOCONTEXT_12

RECALL_LEVELS = (0.2, 0.4, 0.6)
"""Recalls at which methods are compared as equals."""

Values = dict[str, float | None]
Table = Float[np.ndarray, "scenes columns"]
"""Numbers of each scene; the scores of a set of scenes follow from their sums."""
Score = Callable[[Float[np.ndarray, " columns"]], Values]
"""From sums over scenes to named scores."""


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
    boxes = [record.plausibility for record in records]
    parts: dict[str, tuple[Table, Score]] = {
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
    weights = (
        bootstrap_weights(len(records), np.random.default_rng(seed), replicates=replicates)
        if replicates
        else np.zeros((0, len(records)), dtype=np.int64)
    )
    measured = _detection_metrics([record.detection for record in records], weights)
    for name, (table, score) in parts.items():
        measured |= _with_intervals(name, table, score, weights)
    if "penetration" in parts:
        worst = score_penetration(depths)["worst_penetration"]
        measured["penetration.worst_penetration"] = Measured(value=finite(worst))
    shapes = [record.shape for record in records if record.shape is not None]
    if shapes:
        values = {"shape." + key: value for key, value in _flat(asdict(score_shapes(shapes)))}
        measured |= {key: Measured(value=value) for key, value in values.items()}
    return measured


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


def _detection_metrics(
    records: Sequence[DetectionRecord], weights: Int64[np.ndarray, "replicates scenes"]
) -> dict[str, Measured]:
    whole = score_detection(records)
    drawn: dict[str, np.ndarray] = {}
    if len(weights):
        resampled = score_detection(records, weights=weights)
        drawn = detection_values(resampled.with_missing_areas_of(whole))
    values = {name: float(value) for name, value in detection_values(whole).items()}
    measured = _measured(values, drawn)
    errors = pool_match_errors(records)
    for name in ("iou", "centre_error", "yaw_error", "size_error"):
        column = getattr(errors, name)
        measured[f"matched_{name}"] = Measured(value=finite(column.mean() if len(column) else None))
    return {f"detection.{name}": value for name, value in measured.items()}


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


def _with_intervals(
    group: str, table: Table, score: Score, weights: Int64[np.ndarray, "replicates scenes"]
) -> dict[str, Measured]:
    """Return scores of added rows of a table, with intervals from resampled rows."""
    values = score(table.sum(axis=0))
    again = [score(sums) for sums in weights @ table]
    columns = {
        name: np.array([_number(draw.get(name)) for draw in again], dtype=np.float64)
        for name in (values if again else ())
    }
    return {f"{group}.{name}": value for name, value in _measured(values, columns).items()}


def _measured(
    values: Mapping[str, float | None], replicates: Mapping[str, np.ndarray]
) -> dict[str, Measured]:
    result: dict[str, Measured] = {}
    for name, value in values.items():
        low = high = None
        if name in replicates:
            column = np.asarray(replicates[name], dtype=np.float64)[:, None]
            (interval,) = bias_corrected_intervals(np.array([_number(value)]), column)
            low, high = interval.low, interval.high
        result[name] = Measured(value=finite(value), low=finite(low), high=finite(high))
    return result


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
