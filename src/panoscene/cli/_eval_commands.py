# ruff: noqa: PLC0415
# The imports stand inside the functions: help and wrong options should not wait for torch.
"""The commands of evaluation: functions whose parameters are the options, docstrings the help."""

from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, arg

from panoscene._editions import Edition
from panoscene.cli._options import (
    Count,
    Flag,
    OptionalCount,
    OptionalFile,
    OptionalFolder,
    OptionalOutput,
    Output,
)

Targets = Annotated[str | None, arg(metavar="FOLDER", help_behavior_hint="")]
Names = Annotated[str | None, arg(metavar="NAME,NAME", help_behavior_hint="")]


def export(
    *,
    output: Output,
    targets: Targets = None,
    methods: Names = None,
    scenes: Count = 200,
    seed: Count = 7,
) -> int:
    """Write the true scenes and what each method predicts for them, as scene.json.

    Without networks, simulated estimates stand in for their output: objects missed, invented and
    confused, boxes, layout and relations with known errors. The methods are what is made of
    them: repaired by the presets, by trivial means, or with part of the truth (oracles). For
    example:

        panoscene eval export -o runs/rooms
        panoscene eval export -o runs/mine --targets my/true/rooms --methods estimates,default

    The folder gets targets/, predictions/METHOD/ and export.json.

    Args:
        output: Folder for everything.
        targets: Folder with true scenes; sampled furnished rooms without it.
        methods: Some of the methods, by name; all without it.
        scenes: How many rooms to sample.
        seed: Seed of the rooms and of the errors.
    """
    from panoscene.cli._eval import run_export

    return run_export(output, targets, methods, scenes=scenes, seed=seed)


def reconstruct(
    data: Annotated[Positional[Path], arg(metavar="DIR")],
    *,
    output: Output,
    split: Annotated[
        tuple[Literal["train", "val", "test-seen", "test-unseen"], ...], arg(metavar="SPLIT")
    ] = ("test-seen", "test-unseen"),
    weights: OptionalFolder = None,
    edition: Edition = "compact",
    shapes: bool = False,
) -> int:
    """Write the true scenes of a rendered set and what the pipeline predicts from its photos.

    Rows: the whole pipeline, the same without its later parts, a trivial baseline, and oracles
    that know the true room, BFoVs, boxes or relations. May be stopped at any time: the same command
    goes on. For example:

        panoscene eval reconstruct data -o runs/test
        panoscene eval score runs/test -o results

    The folder gets targets/, predictions/ROW/ and export.json.

    Args:
        data: Folder of the rendered set.
        output: Folder for everything.
        split: Parts of the set.
        weights: Folder with the networks' weights, instead of those that come with the package.
        edition: Of the networks.
        shapes: Give objects meshes, those of the set and predicted ones, for eval score --shapes.
    """
    from panoscene.cli._eval import run_reconstruct

    return run_reconstruct(data, output, split, weights, edition, shapes=shapes)


def score(
    predictions: Annotated[Positional[Path], arg(metavar="FOLDER")],
    *,
    targets: OptionalFolder = None,
    output: OptionalOutput = None,
    shapes: Flag = False,
    replicates: Count = 1000,
    workers: OptionalCount = None,
    json: Flag = False,
) -> int:
    """Score predictions against the truth: every metric, with 95 % intervals over scenes.

    Average precision (standard and the authors' definition), physical plausibility, relations,
    layout, semantic segmentation and, if asked for, shapes. Every target counts: one without a
    prediction of the same file name is an empty room. What is not valid in a prediction counts as
    not predicted, with a warning. For example:

        panoscene eval score runs/rooms -o results
        panoscene eval score my/predictions --targets my/truth --json

    Args:
        predictions: A folder made by eval export, or one of scene.json files.
        targets: Folder with the true scenes of the same names, for predictions alone.
        output: Folder that gets METHOD.json with all scores.
        shapes: Compare meshes too, where targets have them, of methods that predict some; slow.
        replicates: Bootstrap resamples behind the intervals; 0 for none.
        workers: Processes; one for each core without it.
        json: Print all scores instead of a short table.
    """
    from panoscene.cli._eval import run_score

    return run_score(
        predictions,
        targets,
        output,
        shapes=shapes,
        replicates=replicates,
        workers=workers,
        as_json=json,
    )


def report(
    results: Annotated[Positional[Path], arg(metavar="FOLDER")],
    *,
    output: Output = Path("RESULTS.md"),
    readme: OptionalFile = None,
    timings: OptionalFile = None,
    check: Flag = False,
) -> int:
    """Write the tables of the scores as a Markdown page.

    Oracles and trivial baselines stand beside the methods. For example:

        panoscene eval report results -o RESULTS.md --readme README.md
        panoscene eval report results -o RESULTS.md --readme README.md --check

    Args:
        results: Folder with the files of eval score, or one such file.
        output: The page.
        readme: Also put a short table into this file, between <!-- results:begin --> and
            <!-- results:end -->.
        timings: What panoscene bench pipeline --json printed, for a table of seconds.
        check: Write nothing; exit with code 2 if a page is not what the scores give.
    """
    from panoscene.cli._eval import run_report

    return run_report(results, output, readme, timings, check=check)
