"""From records of scenes to named numbers with intervals."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import TypeVar

import numpy as np
from jaxtyping import Float, Int64

from panoscene.eval._bootstrap import bootstrap_weights, percentile_intervals
from panoscene.eval._detection import DetectionScores, score_detection
from panoscene.eval._detection_records import DetectionRecord, pool_match_errors
from panoscene.eval._layout_scores import LayoutRecord, score_layout
from panoscene.eval._mesh_penetration import score_penetration
from panoscene.eval._plausibility import PlausibilityRecord, score_plausibility
from panoscene.eval._relation_records import score_relations
from panoscene.eval._results import Measured
from panoscene.eval._scene_records import SceneRecords
from panoscene.eval._semantic import SemanticRecord, score_semantic
from panoscene.eval._shape_scores import score_shapes
from panoscene.scene import CATEGORIES, COMMON_11, PANOCONTEXT_12

RECALL_LEVELS = (0.2, 0.4, 0.6)
"""Recalls at which methods are compared as equals."""

Values = dict[str, float | None]
Record = TypeVar("Record")


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
    parts: list[tuple[str, Callable[[list[int]], Values]]] = [
        ("plausibility", _pool([r.plausibility for r in records], score_plausibility)),
        ("fidelity", _pool([r.fidelity for r in records], score_relations)),
        ("layout", _pool([r.layout for r in records], layout_values)),
        ("semantic", _pool([r.semantic for r in records], semantic_values)),
    ]
    answered = [record.relations for record in records]
    if all(record is not None for record in answered):
        known = [record for record in answered if record is not None]
        parts.append(("relations", _pool(known, score_relations)))
    for level, kept in at_recall.items():
        if kept is not None:
            name = f"plausibility_at_recall_{round(100 * level)}"
            parts.append((name, _pool(list(kept), score_plausibility)))
    shapes = [record.shape for record in records if record.shape is not None]
    weights = (
        bootstrap_weights(len(records), np.random.default_rng(seed), replicates=replicates)
        if replicates
        else np.zeros((0, len(records)), dtype=np.int64)
    )
    measured = _detection_metrics([record.detection for record in records], weights)
    for name, pool in parts:
        measured |= _with_intervals(name, pool, weights)
    depths = [record.penetration for record in records if record.penetration is not None]
    if depths:
        measured |= _with_intervals("penetration", _pool(depths, score_penetration), weights)
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


def layout_values(records: Sequence[LayoutRecord]) -> Values:
    """Return the layout scores by reading, number of corners and measure."""
    values: Values = {}
    for row in score_layout(records):
        start = f"{row.reading}.{row.corners}"
        values[f"{start}.scenes"] = float(row.scenes)
        values[f"{start}.degenerate"] = float(row.degenerate)
        values[f"{start}.scale_error"] = row.scale_error
        if row.scenes:
            values |= {f"{start}.{key}": value for key, value in asdict(row.mean).items()}
    return values


def semantic_values(records: Sequence[SemanticRecord]) -> Values:
    """Return the IoU of each of the 12 labels, and their means."""
    scores = score_semantic(records)
    values: Values = dict(zip(PANOCONTEXT_12, scores.iou.tolist(), strict=True))
    return values | {"mean": scores.mean_iou, "mean_objects": scores.mean_iou_objects}


def finite(value: float | None) -> float | None:
    """Return the number, or None for one that is missing or not finite: JSON has no NaN."""
    return None if value is None or not math.isfinite(value) else float(value)


def _detection_metrics(
    records: Sequence[DetectionRecord], weights: Int64[np.ndarray, "replicates scenes"]
) -> dict[str, Measured]:
    values = detection_values(score_detection(records))
    measured = _measured(
        {name: float(value) for name, value in values.items()},
        detection_values(score_detection(records, weights=weights)) if len(weights) else {},
    )
    errors = pool_match_errors(records)
    for name in ("iou", "centre_error", "yaw_error", "size_error"):
        column = getattr(errors, name)
        measured[f"matched_{name}"] = Measured(value=finite(column.mean() if len(column) else None))
    return {f"detection.{name}": value for name, value in measured.items()}


def _pool(
    records: Sequence[Record], score: Callable[[Sequence[Record]], Mapping[str, float | None]]
) -> Callable[[list[int]], Values]:
    def chosen(scenes: list[int]) -> Values:
        return dict(score([records[scene] for scene in scenes]))

    return chosen


def _with_intervals(
    group: str,
    pool: Callable[[list[int]], Values],
    weights: Int64[np.ndarray, "replicates scenes"],
) -> dict[str, Measured]:
    scenes = np.arange(weights.shape[1])
    values = pool(scenes.tolist())
    again = [pool(np.repeat(scenes, row).tolist()) for row in weights]
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
            (interval,) = percentile_intervals(np.array([_number(value)]), column)
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
        elif value is None or isinstance(value, int | float):
            flat.append((start + name, finite(value)))
    return flat
