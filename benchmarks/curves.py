"""Reads how validation scores rose while networks were trained: writes benchmarks/curves.json.

    python benchmarks/curves.py NAME=RUN_FOLDER [NAME=RUN_FOLDER ...] [--data FOLDER]

The runs that are named come in, again if they are there already; the others stay. ``tables.py``
makes tables of them.
"""

import argparse
import csv
import json
from pathlib import Path
from typing import Any

from panoscene.data import shaped_models
from panoscene.data._shape_data import MODELS
from panoscene.data._shape_store import store_file
from panoscene.scene import write_atomically
from panoscene.synth.assets import load_library
from panoscene.synth.dataset import open_dataset
from panoscene.train import SELECTION, Stage, TrainError, TrainRecipe, read_train_recipe
from panoscene.train._panoramas import training_panoramas
from panoscene.train._shape import ShapeOptions

FILE = Path(__file__).with_suffix(".json")
SELECTIONS: dict[Stage, str] = {
    "detector": "mask AP50",
    "layout": "3D IoU of regularised and raw polygon, mean",
    "pose": "3D AP at 15, 25 and 50 percent with true BFoVs, mean",
    "shape": "IoU of crops and unseen models, mean",
    "context": "3D AP and IoU of boxes, after step pose quality of relations too, mean",
}
"""What the best weights of each stage are chosen by."""
SCORES: dict[Stage, tuple[str, ...]] = {
    "detector": ("mask_ap50", "box_ap50", "bfov_recall", "bfov_recall_any"),
    "layout": ("iou_3d", "raw_iou_3d"),
    "pose": ("ap_15", "ap_25", "ap_50"),
    "shape": ("crops_iou", "unseen_iou"),
    "context": ("ap_15", "iou", "found_ap_15", "found_iou"),
}
"""What is kept of each stage beside it."""


def main() -> None:
    """Read the runs and write."""
    parser = argparse.ArgumentParser()
    parser.add_argument("runs", nargs="+", metavar="NAME=RUN_FOLDER")
    parser.add_argument("--data", type=Path, help="the data set, if it is elsewhere now")
    given = parser.parse_args()
    curves = json.loads(FILE.read_text()) if FILE.is_file() else {}
    for pair in given.runs:
        name, equals, folder = pair.partition("=")
        if not (name and equals and folder):
            parser.error(f"found {pair}, expected NAME=RUN_FOLDER")
        curves[name] = curve(Path(folder), given.data)
    write_atomically(FILE, json.dumps(curves, indent=2) + "\n")
    for name, run in curves.items():
        print(name, *(f"{point['step']}: {point[SELECTION]:.3f}" for point in run["points"]))


def curve(run: Path, data: Path | None) -> dict[str, Any]:
    """Return what a run learned from and its scores after so many steps.

    Raises:
        TrainError: The folder holds no validation, or its data set is not there.
    """
    recipe = read_train_recipe(run / "recipe.yaml")
    kept = (SELECTION, *SCORES[recipe.stage])
    with (run / "metrics.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["kind"] == "validation"]
    if not rows:
        raise TrainError(run, "found no validation in metrics.csv, expected some")
    points = [
        {"step": int(row["step"])} | {name: float(row[name]) for name in kept if row.get(name)}
        for row in rows
    ]
    return {
        "stage": recipe.stage,
        "edition": recipe.edition,
        "panoramas": panoramas_of(recipe, data or recipe.data),
        "homes_version": homes_version_of(data or recipe.data),
        "models": models_of(recipe),
        "steps": recipe.steps,
        "batch_size": recipe.batch_size,
        "started": recipe.start is not None,
        "selection": SELECTIONS[recipe.stage],
        "points": points,
    }


def panoramas_of(recipe: TrainRecipe, data: Path | None) -> int:
    """Return how many panoramas a training learned from."""
    if recipe.panoramas is not None:
        return recipe.panoramas
    if data is None:
        raise TrainError("recipe", "data: found none, expected --data with the data set")
    return len(training_panoramas(data, recipe))


def models_of(recipe: TrainRecipe) -> int | None:
    """Return how many models a training of shapes learned from; None for other stages."""
    if recipe.stage != "shape":
        return None
    options = recipe.stage_options(ShapeOptions)
    library = load_library(options.assets.expanduser())
    seen = sum(
        library.split[library.entries[name].base] == "seen"
        and store_file(options.folder / MODELS, name).is_file()
        for name in shaped_models(options.assets.expanduser())
    )
    return seen if options.models is None else min(options.models, seen)


def homes_version_of(data: Path | None) -> int:
    """Return the version of the homes that a training learned from."""
    if data is None:
        raise TrainError("recipe", "data: found none, expected --data with the data set")
    return open_dataset(data).info.homes_version


if __name__ == "__main__":
    main()
