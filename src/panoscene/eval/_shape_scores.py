"""Shape scores: means over the objects of scenes, misses not forgiven."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from panoscene.eval._plausibility import ratio
from panoscene.eval._shape_errors import ShapeErrors
from panoscene.eval._shape_records import ShapeRecord


@dataclass(frozen=True, slots=True)
class ShapeMeans:
    """Mean errors over shapes; None where there is nothing to average."""

    shapes: int
    infinite: int
    """Shapes without any predicted surface; they are in all means but those of distances."""
    chamfer: float | None
    mean_distance: float | None
    f_score: float | None
    normal_consistency: float | None
    volume_iou: float | None
    volumes: int
    """Shapes whose true mesh is closed: those that ``volume_iou`` is the mean of."""


@dataclass(frozen=True, slots=True)
class ShapeScores:
    """Mean shape errors over scenes, over matched objects and with misses."""

    targets: int
    """Targets with a mesh."""
    matched: int
    boxes_stand_in: int
    """Matched objects that were predicted without a mesh."""
    targets_without_mesh: int
    canonical: ShapeMeans
    canonical_with_misses: ShapeMeans
    """A target that was not found counts with F-score, normal consistency and IoU 0."""
    world: ShapeMeans
    world_with_misses: ShapeMeans
    scene: ShapeMeans


def score_shapes(records: Sequence[ShapeRecord]) -> ShapeScores:
    """Return mean shape errors over all objects of all scenes.

    Examples:
        >>> score_shapes([]).targets
        0
    """
    return shapes_of_sums(shape_sums(records).sum(axis=0))


def shape_sums(records: Sequence[ShapeRecord | None]) -> Float[np.ndarray, "scenes columns"]:
    """Return for each scene what adds up to the scores; zeros where nothing was measured."""
    rows = [np.zeros(_COLUMNS) if record is None else _sums(record) for record in records]
    return np.array(rows, dtype=np.float64).reshape(-1, _COLUMNS)


def shapes_of_sums(sums: Float[np.ndarray, " columns"]) -> ShapeScores:
    """Return ``score_shapes`` for added rows of ``shape_sums``."""
    counts, means = sums[: len(_COUNTS)].tolist(), sums[len(_COUNTS) :].reshape(len(_MEANS), -1)
    return ShapeScores(
        **{name: round(count) for name, count in zip(_COUNTS, counts, strict=True)},
        **{name: _mean(row) for name, row in zip(_MEANS, means, strict=True)},
    )


_COUNTS = ("targets", "matched", "boxes_stand_in", "targets_without_mesh")
_MEANS = ("canonical", "canonical_with_misses", "world", "world_with_misses", "scene")
_SUMS = 8
"""Of one mean: shapes, those at a distance that is finite, five errors, closed targets."""
_COLUMNS = len(_COUNTS) + _SUMS * len(_MEANS)


def _sums(record: ShapeRecord) -> Float[np.ndarray, " columns"]:
    pairs, missed = record.pairs, list(record.missed)
    canonical, world = [pair.canonical for pair in pairs], [pair.world for pair in pairs]
    counts = (
        len(pairs) + len(missed),
        len(pairs),
        sum(pair.box_stands_in for pair in pairs),
        record.targets_without_mesh,
    )
    scene = [record.scene] if record.scene else []
    groups = (canonical, canonical + missed, world, world + missed, scene)
    return np.concatenate([counts, *map(_error_sums, groups)])


def _error_sums(errors: Sequence[ShapeErrors]) -> tuple[float, ...]:
    finite = [one for one in errors if math.isfinite(one.chamfer)]
    volumes = [one.volume_iou for one in errors if one.volume_iou is not None]
    return (
        float(len(errors)),
        float(len(finite)),
        math.fsum(one.chamfer for one in finite),
        math.fsum(one.mean_distance for one in finite),
        math.fsum(one.f_score for one in errors),
        math.fsum(one.normal_consistency for one in errors),
        math.fsum(volumes),
        float(len(volumes)),
    )


def _mean(sums: Float[np.ndarray, " sums"]) -> ShapeMeans:
    shapes, finite, chamfer, distance, f_score, normals, volume, volumes = sums.tolist()
    return ShapeMeans(
        shapes=round(shapes),
        infinite=round(shapes - finite),
        chamfer=ratio(chamfer, finite),
        mean_distance=ratio(distance, finite),
        f_score=ratio(f_score, shapes),
        normal_consistency=ratio(normals, shapes),
        volume_iou=ratio(volume, volumes),
        volumes=round(volumes),
    )
