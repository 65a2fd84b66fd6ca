# ruff: noqa: PLC0415
# The imports stand inside the functions: help and wrong options should not wait for torch.
"""The commands of training: functions whose parameters are the options, docstrings the help."""

from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, arg

from panoscene._editions import Edition
from panoscene.cli._options import Flag, OptionalCount, OptionalFile, Output

StageName = Annotated[
    Positional[Literal["detector", "layout", "pose", "shape", "context"]],
    arg(metavar="{detector,layout,pose,shape,context}"),
]
DataFolder = Annotated[Path, arg(metavar="DIR")]
OptionalFolder = Annotated[Path | None, arg(metavar="DIR", help_behavior_hint="")]


def train(
    stage: StageName,
    *,
    recipe: Annotated[Path, arg(metavar="FILE")],
    run: Annotated[Path, arg(metavar="RUN")],
    data: OptionalFolder = None,
    steps: OptionalCount = None,
    devices: OptionalCount = None,
    nodes: OptionalCount = None,
    workers: OptionalCount = None,
    threads: OptionalCount = None,
    json: Flag = False,
) -> int:
    """Train the network of a stage on a data set.

    May be stopped at any time, also by a crash: the same command goes on at the last checkpoint
    and gives the same losses. Needs pip install 'panoscene[train]'. For example:

        panoscene train layout --recipe configs/compact/layout.yaml --data data --run runs/layout
        panoscene train layout --recipe layout.yaml --data data --run runs/big --devices 8

    RUN gets weights.safetensors (the best weights with 16 bits, for --weights), best.safetensors,
    last.safetensors (to go on from), metrics.csv, metrics.jsonl, tensorboard/, pictures/,
    recipe.yaml and environment.json.

    Args:
        stage: Which network.
        recipe: A .yaml file, such as those in configs/compact and configs/paper.
        run: Folder of the run.
        data: Folder of the data set, instead of the recipe's.
        steps: Steps of the optimiser, instead of the recipe's.
        devices: GPUs (without any: processes) of each machine, instead of all.
        nodes: Machines; the command is started on each of them with torchrun or SLURM.
        workers: Processes of each device that prepare samples.
        threads: Threads of PyTorch.
        json: Print how the training ended as JSON.
    """
    from panoscene.cli._train import run_training

    changes = {
        "data": data, "steps": steps, "devices": devices, "num_nodes": nodes, "workers": workers,
        "threads": threads,
    }  # fmt: skip
    return run_training(stage, recipe, run, changes, as_json=json)


def precompute(
    data: Annotated[Positional[Path], arg(metavar="DIR")],
    *,
    output: Output,
    edition: Edition = "compact",
    detector: OptionalFile = None,
    layout: OptionalFile = None,
    only: Annotated[
        Literal["detector", "layout"] | None,
        arg(metavar="{detector,layout}", help_behavior_hint=""),
    ] = None,
    records: OptionalFolder = None,
    pose: OptionalFile = None,
    shape: OptionalFile = None,
    split: Annotated[
        tuple[Literal["train", "val", "test-seen", "test-unseen"], ...], arg(metavar="SPLIT")
    ] = ("train", "val"),
    device: Annotated[str, arg(metavar="NAME")] = "cpu",
) -> int:
    """Run the first stages once over a data set, for the training of later stages.

    May be stopped at any time: the same command goes on where it was. For example:

        panoscene precompute data -o stage1
        panoscene precompute data -o stage1 --detector runs/detector/weights.safetensors
        panoscene precompute data -o stage2 --records stage1 --pose runs/pose/weights.safetensors

    Detector and layout network come first: OUT/records/NAME.json has what was found in each
    panorama, for recipes of the stage pose. With --records pose and shape network follow:
    OUT/estimates/NAME.safetensors has what they see, for recipes of the stage context.

    Args:
        data: Folder of the data set.
        output: Folder for the records.
        edition: Of the networks.
        detector: Weights of the detector; those of the package without it.
        layout: Weights of the layout network; those of the package without it.
        only: Leave out the other stage.
        records: What this command wrote before; then pose and shape network are run.
        pose: Weights of the pose network; those of the package without it.
        shape: Weights of the shape network; those of the package without it.
        split: Parts of the data set.
        device: Where the networks run: cpu, cuda, cuda:1 ...
    """
    from panoscene.cli._errors import InputError
    from panoscene.cli._train import run_precompute, run_precompute_estimates

    if records is not None:
        if detector or layout or only:
            raise InputError("--records: found --detector, --layout or --only, too; expected none")
        return run_precompute_estimates(
            data, records, output, edition, pose=pose, shape=shape, splits=split, device=device
        )
    if pose or shape:
        raise InputError("--pose and --shape: expected --records, for which they are")
    return run_precompute(
        data, output, edition, detector, layout, only=only, splits=split, device=device
    )
