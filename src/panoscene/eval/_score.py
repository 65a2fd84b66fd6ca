"""Scores of predictions on disk: every target counts, and each scene is measured once."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from pathlib import Path
from types import MappingProxyType

import torch

from panoscene import __version__
from panoscene.eval._bootstrap import REPLICATES
from panoscene.eval._layout_scores import layout_record
from panoscene.eval._pooling import (
    RECALL_LEVELS,
    pooled_categories,
    pooled_differences,
    pooled_metrics,
)
from panoscene.eval._predictions import Prediction, read_prediction
from panoscene.eval._results import Measured, ScoreFile
from panoscene.eval._scene_records import SceneRecords, records_at_recall, scene_records
from panoscene.scene import Problem, Scene, SceneFormatError, read_scene

_CHUNK = 32
"""Scenes that a process measures at a time."""
_WORTH_PROCESSES = 128
"""Fewer scenes are done before another process has loaded the libraries, but meshes take long."""


@dataclass(frozen=True, slots=True)
class FolderRecords:
    """What was measured on a folder of predictions, scene by scene."""

    predictions: Path
    targets: Path
    names: tuple[str, ...]
    """File names of the scenes."""
    records: list[SceneRecords]
    invalid: int
    """Predictions with something that is not valid."""


@dataclass(frozen=True, slots=True)
class _Scored:
    """What some of the scenes gave."""

    records: list[SceneRecords]
    warnings: list[str]
    invalid: int


def score_folder(
    predictions: Path,
    targets: Path,
    *,
    method: str = "",
    kind: str = "prediction",
    description: str = "",
    fov_deg: int = 360,
    data: str = "",
    parts: Mapping[str, str] = MappingProxyType({}),
    shapes: bool = False,
    replicates: int = REPLICATES,
    seed: int = 0,
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
    warn: Callable[[str], None] | None = None,
) -> ScoreFile:
    """Return the scores of a folder of predictions against a folder of targets.

    ``measure_folder`` and ``score_records`` in one; the arguments are explained there.

    Raises:
        SceneFormatError: a target is not a scene, or a prediction has no target.
        OSError: a folder or file cannot be read.
    """
    measured = measure_folder(
        predictions, targets, shapes=shapes, workers=workers, progress=progress, warn=warn
    )
    return score_records(
        measured,
        method=method,
        kind=kind,
        description=description,
        fov_deg=fov_deg,
        data=data,
        parts=parts,
        replicates=replicates,
        seed=seed,
    )


def measure_folder(
    predictions: Path,
    targets: Path,
    *,
    shapes: bool = False,
    workers: int = 1,
    progress: Callable[[int], None] | None = None,
    warn: Callable[[str], None] | None = None,
) -> FolderRecords:
    """Return what there is to measure on each scene of a folder of predictions.

    A prediction belongs to the target with the same file name. A target without a prediction
    counts as an empty room with the worst layout; a prediction without a target is an error.
    What is not valid in a prediction counts as not predicted: the raw polygon, the layout, an
    object or the relations, or else all of it. Targets have to be valid.

    Args:
        predictions: folder of scene.json files.
        targets: folder of scene.json files.
        shapes: also compare meshes, where the targets have them; slower.
        workers: processes that measure scenes.
        progress: called with the number of scenes done.
        warn: called with one line for each prediction that is missing or not valid.

    Raises:
        SceneFormatError: a target is not a scene, or a prediction has no target.
        OSError: a folder or file cannot be read.
    """
    names = _names(predictions, targets)
    jobs = [
        (predictions, targets, names[first : first + _CHUNK], shapes)
        for first in range(0, len(names), _CHUNK)
    ]
    measured: list[_Scored] = []

    def keep(some: _Scored) -> None:
        measured.append(some)
        for warning in some.warnings:
            if warn is not None:
                warn(warning)
        if progress is not None:
            progress(len(some.records))

    if workers > 1 and len(jobs) > 1 and (shapes or len(names) >= _WORTH_PROCESSES):
        context = get_context("spawn")
        with ProcessPoolExecutor(min(workers, len(jobs)), mp_context=context) as pool:
            for some in pool.map(_measure, jobs):
                keep(some)
    else:
        for some in map(_measure, jobs):
            keep(some)
    return FolderRecords(
        predictions=predictions,
        targets=targets,
        names=tuple(names),
        records=[record for some in measured for record in some.records],
        invalid=sum(some.invalid for some in measured),
    )


def score_records(
    measured: FolderRecords,
    *,
    method: str = "",
    kind: str = "prediction",
    description: str = "",
    fov_deg: int = 360,
    data: str = "",
    parts: Mapping[str, str] = MappingProxyType({}),
    others: Mapping[str, FolderRecords] = MappingProxyType({}),
    replicates: int = REPLICATES,
    seed: int = 0,
) -> ScoreFile:
    """Return the scores of what was measured on a folder of predictions.

    Args:
        measured: from ``measure_folder``.
        method: name of the row in tables; that of the folder when empty.
        kind: as in ``METHODS``.
        description: one line about the method.
        fov_deg: horizontal degrees that the method saw at a time.
        data: what the targets are.
        parts: part of the data set that each target is from, by its name; if there are several,
            each is scored by itself, too.
        others: what was measured on the same targets for methods to compare with, by their names.
        replicates: bootstrap resamples of the scenes for the 95 % intervals.
        seed: of the resampling.

    Raises:
        ValueError: another method was measured on other targets.
        OSError: a file cannot be read.
    """
    records, names = measured.records, measured.names
    for name, other in others.items():
        if other.names != names or _hash(other.targets, names) != _hash(measured.targets, names):
            raise ValueError(f"{name}: was measured on other targets")

    def metrics(chosen: Sequence[SceneRecords]) -> dict[str, Measured]:
        at_recall = {level: records_at_recall(chosen, level) for level in RECALL_LEVELS}
        return pooled_metrics(chosen, at_recall, replicates=replicates, seed=seed)

    return ScoreFile(
        panoscene=__version__,
        method=method or measured.predictions.name,
        kind=kind,
        description=description,
        fov_deg=fov_deg,
        data=data,
        scenes=len(records),
        objects=sum(record.targets for record in records),
        missing=sum(record.missing for record in records),
        invalid=measured.invalid,
        targets_hash=_hash(measured.targets, names),
        predictions_hash=_hash(measured.predictions, names),
        replicates=replicates,
        seed=seed,
        metrics=metrics(records),
        categories=pooled_categories(records),
        parts={name: metrics(some) for name, some in _by_part(records, names, parts).items()},
        differences={
            name: pooled_differences(records, other.records, replicates=replicates, seed=seed)
            for name, other in others.items()
        },
    )


def _names(predictions: Path, targets: Path) -> list[str]:
    wanted = sorted(path.name for path in targets.glob("*.json"))
    found = {path.name for path in predictions.glob("*.json")}
    problems = []
    if not wanted:
        problems.append(Problem(str(targets), "no scene files", "targets as scene.json files"))
    if extra := sorted(found - set(wanted)):
        expected = f"only names of targets in {targets}"
        problems.append(Problem("files", ", ".join(extra[:5]), expected))
    if problems:
        raise SceneFormatError(predictions, problems)
    return wanted


def _by_part(
    records: Sequence[SceneRecords], names: Sequence[str], parts: Mapping[str, str]
) -> dict[str, list[SceneRecords]]:
    """Return the records of each part; nothing if there is one part only."""
    found: dict[str, list[SceneRecords]] = {}
    for record, name in zip(records, names, strict=True):
        found.setdefault(parts.get(Path(name).stem, ""), []).append(record)
    return {part: found[part] for part in sorted(found)} if len(found) > 1 else {}


def _measure(job: tuple[Path, Path, list[str], bool]) -> _Scored:
    predictions, targets, names, shapes = job
    threads = torch.get_num_threads()
    # tensors this small are slower with more threads, and processes already share the cores
    torch.set_num_threads(1)
    try:
        true = [read_scene(targets / name) for name in names]
        found = [
            read_prediction(predictions / name, target)
            for name, target in zip(names, true, strict=True)
        ]
        records = scene_records([prediction.scene for prediction in found], true, shapes=shapes)
        return _Scored(
            records=list(map(_with_layout_of, records, found, true)),
            warnings=[prediction.warning for prediction in found if prediction.warning],
            invalid=sum(prediction.invalid for prediction in found),
        )
    finally:
        torch.set_num_threads(threads)


def _with_layout_of(record: SceneRecords, prediction: Prediction, target: Scene) -> SceneRecords:
    """Return the record in which a layout that was not valid counts as degenerate."""
    if not (prediction.no_layout or prediction.no_raw):
        return record
    worst = layout_record(None, target)
    if prediction.no_layout:
        return replace(record, layout=worst)
    return replace(record, layout=replace(record.layout, raw=worst.regularised))


def _hash(folder: Path, names: Sequence[str]) -> str:
    digest = hashlib.sha256()
    for name in names:
        path = folder / name
        digest.update(f"{name}\0".encode())
        digest.update(path.read_bytes() if path.is_file() else b"")
    return digest.hexdigest()[:16]
