"""Trainings, and the first stages run over a data set."""

import os
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Literal

from panoscene.cli._errors import InputError
from panoscene.cli._reconstruct_command import checked_device
from panoscene.cli._synth_progress import steps_told, told_in_words
from panoscene.cli._terminal import note, say, say_json
from panoscene.models import Edition, shipped_weights
from panoscene.train import (
    TASKS,
    Stage,
    chosen_precision,
    file_hash,
    precompute,
    precompute_estimates,
    read_train_recipe,
    train,
)


def run_training(
    stage: Stage, recipe_file: Path, run: Path, changes: Mapping[str, Any], *, as_json: bool
) -> int:
    """Train, or go on with a training, and return the exit code."""
    given = {name: value for name, value in changes.items() if value is not None}
    recipe = read_train_recipe(recipe_file, given)
    if recipe.stage != stage:
        raise InputError(f"{recipe_file}: found a recipe of the stage {recipe.stage}, not {stage}")
    if recipe.data is None:
        raise InputError("--data: found nothing, expected the folder of a data set")
    first = int(os.environ.get("RANK", os.environ.get("LOCAL_RANK", "0"))) == 0
    if not first:
        train(recipe, run, TASKS[stage])
        return 0
    note(f"training the {recipe.edition} {stage}, {chosen_precision(recipe.precision)}")
    try:
        with told_in_words(f"training {stage}") as tell:
            result = train(recipe, run, TASKS[stage], tell)
    except KeyboardInterrupt:
        note(f"stopped; the same command goes on with {run}")
        raise
    if as_json:
        say_json({"run": str(run), **asdict(result)})
        return 0
    why = "no validation was better for a while" if result.early else "all steps are done"
    say(f"{result.steps} steps, {why}")
    if result.best is not None:
        say(f"best selection {result.best:.4g} at step {result.best_step}")
        say(f"weights: {run / 'weights.safetensors'}")
    return 0


def run_precompute(
    data: Path,
    output: Path,
    edition: Edition,
    detector: Path | None,
    layout: Path | None,
    *,
    only: Literal["detector", "layout"] | None,
    splits: tuple[str, ...],
    device: str,
) -> int:
    """Write what is missing of the records, and return the exit code."""
    if not splits:
        raise InputError("--split: found none, expected at least one part of the data set")
    device = checked_device(device)
    finder = reader = None
    sources: dict[str, str] = {"edition": edition}
    if only != "layout":
        from panoscene.models.detector import load_detector_stage  # noqa: PLC0415

        finder = load_detector_stage(edition, detector, device)
        sources["detector"] = file_hash(detector or shipped_weights("detector"))
    if only != "detector":
        from panoscene.models.layout import load_layout_stage  # noqa: PLC0415

        reader = load_layout_stage(edition, layout, device)
        sources["layout"] = file_hash(layout or shipped_weights("layout"))
    with steps_told("detecting") as step:
        new = precompute(
            data, output, detector=finder, layout=reader, sources=sources, splits=splits,
            told=lambda done, total: step(done, total) if done else None,
        )  # fmt: skip
    note(f"wrote {output}: {new} new records")
    return 0


def run_precompute_estimates(
    data: Path,
    records: Path,
    output: Path,
    edition: Edition,
    *,
    pose: Path | None,
    shape: Path | None,
    splits: tuple[str, ...],
    device: str,
) -> int:
    """Write what is missing of the estimates, and return the exit code."""
    from panoscene.models.pose import load_pose_stage  # noqa: PLC0415
    from panoscene.models.shape import load_shape_stage  # noqa: PLC0415

    if not splits:
        raise InputError("--split: found none, expected at least one part of the data set")
    device = checked_device(device)
    sources = {
        "edition": edition,
        "pose": file_hash(pose or shipped_weights("pose")),
        "shape": file_hash(shape or shipped_weights("shape")),
    }
    with steps_told("looking at objects") as step:
        new = precompute_estimates(
            data, records, output, pose=load_pose_stage(edition, pose, device),
            shape=load_shape_stage(edition, shape, device), sources=sources, splits=splits,
            told=lambda done, total: step(done, total) if done else None,
        )  # fmt: skip
    note(f"wrote {output}: {new} new estimates")
    return 0
