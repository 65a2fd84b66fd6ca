"""Predictions to disk, scores from disk, tables from scores."""

import os
from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

from panoscene.cli._errors import InputError
from panoscene.cli._files import blaming, read_json_object, write_text
from panoscene.cli._folders import check_folder
from panoscene.cli._progress import progress_bar, progress_words
from panoscene.cli._scene_files import scene_files
from panoscene.cli._terminal import note, say, say_json
from panoscene.cli._weight_files import STAGES
from panoscene.eval import (
    MANIFEST,
    METHODS,
    PREDICTIONS,
    RENDERED,
    ROWS,
    SUMMARY,
    TARGETS,
    ExportedMethod,
    FolderRecords,
    Manifest,
    ScoreFile,
    export_predictions,
    export_reconstructions,
    in_order,
    measure_folder,
    read_manifest,
    read_scores,
    results_page,
    sample_targets,
    score_records,
    score_table,
    summary_note,
    summary_table,
    write_scores,
)
from panoscene.eval import replace_between as between
from panoscene.exports import read_glb
from panoscene.models import Edition, shipped_weights
from panoscene.pipeline import load
from panoscene.scene import Scene, object_names, read_scene
from panoscene.synth.dataset import PanoramaItem, open_dataset

Job = tuple[Path, ExportedMethod, Path]
"""A folder of predictions, what is known of it, and the folder of its targets."""


def run_export(
    output: Path, targets: str | None, methods: str | None, *, scenes: int, seed: int
) -> int:
    """Write targets and predictions and return the exit code."""
    if scenes < 1 or seed < 0:
        raise InputError(f"--scenes {scenes} --seed {seed}: expected at least 1 and 0")
    check_folder(output)
    names = list(METHODS) if methods is None else methods.split(",")
    for name in names:
        if name not in METHODS:
            raise InputError(f"--methods: found {name!r}, expected some of {', '.join(METHODS)}")
    rooms = sample_targets(scenes, seed) if targets is None else _named(scene_files([targets]))
    with progress_words() as progress, blaming("--output"):
        done = export_predictions(
            output,
            rooms,
            seed=seed,
            data=f"sampled rooms, seed {seed}" if targets is None else targets,
            methods={name: METHODS[name] for name in names},
            progress=progress,
        )
    note(f"wrote {output}: {len(rooms)} targets and the predictions of {', '.join(done)}")
    return 0


def run_reconstruct(
    data: Path,
    output: Path,
    splits: Sequence[str],
    weights: Path | None,
    edition: Edition,
    *,
    shapes: bool,
) -> int:
    """Write what the pipeline and its parts predict for a rendered set; return the exit code."""
    if weights is not None and not weights.is_dir():
        raise InputError(f"--weights {weights}: found no folder there")
    check_folder(output)
    version = open_dataset(data).info.homes_version
    items = [item for split in splits for item in open_dataset(data, split)]
    if not items:
        raise InputError(f"{data}: found no panoramas of {' and '.join(splits)}")
    pipeline = load(edition, weights=weights, shapes=shapes)
    # the relation graph network is told of shapes in any case
    files = {
        name: shipped_weights(name) if weights is None else weights / f"{name}.safetensors"
        for name in STAGES
    }
    sources = {name: sha256(file.read_bytes()).hexdigest() for name, file in files.items()}
    with progress_words() as progress, blaming("--output"):
        export_reconstructions(
            output,
            items,
            pipeline,
            data=f"{RENDERED} of version {version}, {' and '.join(splits)}",
            sources=sources | ({"meshes": "with"} if shapes else {}),
            true_scene=_scene_with_meshes if shapes else PanoramaItem.scene,
            told=lambda done, total: progress(f"reconstructing: {done} of {total}"),
        )
    note(f"wrote {output}: {len(items)} targets and the predictions of {', '.join(ROWS)}")
    return 0


def _scene_with_meshes(item: PanoramaItem) -> Scene:
    """Return the true scene of a panorama with the meshes of its scene.glb."""
    file = item.folder / "scene.glb"
    scene, shown = item.scene(), read_glb(file)
    if object_names(scene.objects) != object_names(shown.objects):
        raise InputError(f"{file}: found other objects than in scene.json")
    return replace(scene, objects=replace(scene.objects, shapes=shown.objects.shapes))


def run_score(
    source: Path,
    targets: Path | None,
    output: Path | None,
    *,
    shapes: bool,
    replicates: int,
    workers: int | None,
    as_json: bool,
) -> int:
    """Score an export, or one folder of predictions, and return the exit code."""
    if replicates < 0 or (workers is not None and workers < 1):
        raise InputError("--replicates, --workers: expected at least 0 and 1")
    if not source.is_dir():
        raise InputError(f"{source}: found no folder there, expected predictions or an export")
    if output is not None:
        check_folder(output)
    jobs, known = _jobs(source, targets)
    results: list[ScoreFile] = []
    count = sum(len(list(job[2].glob("*.json"))) for job in jobs)
    folders = {folder.name: (folder, facts, truth) for folder, facts, truth in jobs}
    wanted = {name for _, facts, _ in jobs for name in facts.compared_with}
    measured: dict[str, FolderRecords] = {}
    with progress_bar("scoring", count) as advance:

        def records_of(name: str) -> FolderRecords:
            if name not in measured:
                folder, facts, truth = folders[name]
                measured[name] = measure_folder(
                    folder,
                    truth,
                    shapes=shapes and facts.shapes,
                    workers=workers or os.cpu_count() or 1,
                    progress=advance,
                    warn=_warn,
                )
            return measured[name] if name in wanted else measured.pop(name)

        for folder, facts, _ in jobs:
            others = [name for name in facts.compared_with if name in folders]
            score = score_records(
                records_of(folder.name),
                method=folder.name,
                kind=facts.kind,
                description=facts.description,
                fov_deg=facts.fov_deg,
                data=known.data,
                parts=known.parts,
                others={name: records_of(name) for name in others},
                replicates=replicates,
            )
            results.append(score)
            if output is not None:
                output.mkdir(parents=True, exist_ok=True)
                write_scores(score, output / f"{score.method}.json")
    if output is not None:
        note(f"wrote {output}: the scores of {', '.join(score.method for score in results)}")
    if as_json:
        say_json([score.model_dump(by_alias=True) for score in results])
    else:
        say(score_table(results, SUMMARY))
    return 0


def _warn(text: str) -> None:
    note(f"warning: {text}")


def run_report(
    source: Path, output: Path, readme: Path | None, timings: Path | None, *, check: bool
) -> int:
    """Write or check the pages of results and return the exit code."""
    files = sorted(source.glob("*.json")) if source.is_dir() else [source]
    if not files:
        raise InputError(f"{source}: found no files of scores, expected those of eval score")
    scores = in_order([read_scores(file) for file in files])
    seconds = None if timings is None else read_json_object(timings, "timings")
    with blaming(source if timings is None else f"{source} or {timings}"):
        texts = {output: results_page(scores, seconds)}
        if readme is not None:
            short = f"{summary_table(scores)}\n\n{summary_note(scores)}"
            texts[readme] = between(readme.read_text(), "results", short)
    stale = [path for path, text in texts.items() if not path.exists() or path.read_text() != text]
    if check:
        if stale:
            names = ", ".join(map(str, stale))
            raise InputError(
                f"{names}: found other tables than {source} gives; run without --check"
            )
        note(f"{', '.join(map(str, texts))}: up to date")
        return 0
    for path in stale:
        write_text(path, texts[path])
    note(f"wrote {', '.join(map(str, stale))}" if stale else "nothing has changed")
    return 0


def _jobs(source: Path, targets: Path | None) -> tuple[list[Job], Manifest]:
    """Return each folder of predictions with what is known of it, and of all targets."""
    manifest = source / MANIFEST
    if targets is not None or not manifest.exists():
        if targets is None:
            expected = "--targets FOLDER with the true scenes, or a folder made by eval export"
            raise InputError(f"{source}: found predictions alone, expected {expected}")
        known = Manifest(data=str(targets), methods={})
        return [(source, ExportedMethod("prediction", ""), targets)], known
    known = read_manifest(manifest)
    jobs = [
        (source / PREDICTIONS / name, method, source / TARGETS)
        for name, method in known.methods.items()
    ]
    return jobs, known


def _named(files: list[Path]) -> list[Scene]:
    """Return scenes under the names of their files."""
    return [replace(read_scene(file), name=file.stem) for file in files]
