"""Scores trained shape weights: writes benchmarks/shape_scores.json and prints tables.

    python benchmarks/shape_scores.py RECIPE WEIGHTS [--limit N] [--pictures FOLDER]

RECIPE is that of the training; its folder must have been prepared. Takes some seconds an object.
"""

import argparse
import json
from pathlib import Path

import torch
from PIL import Image

from panoscene.eval import machine_facts
from panoscene.models import read_weights
from panoscene.scene import write_atomically
from panoscene.train import read_train_recipe
from panoscene.train._shape import ShapeTask
from panoscene.train._shape_scores import METHODS, shape_scores


def main() -> None:
    """Score and write."""
    parser = argparse.ArgumentParser()
    parser.add_argument("recipe", type=Path)
    parser.add_argument("weights", type=Path)
    parser.add_argument("--limit", type=int)
    parser.add_argument("--points", type=int, default=2000)
    parser.add_argument("--pictures", type=Path)
    given = parser.parse_args()
    recipe = read_train_recipe(given.recipe)
    options = {**recipe.options, "prepare": False, "frozen_views": 0}
    task = ShapeTask(recipe.model_copy(update={"options": options, "imagenet": False}))
    header = read_weights(given.weights, task.model, stage="shape", edition=recipe.edition)
    task.model.eval()
    print(f"{len(task.seen)} training models, {task.sample_count()} pictures", flush=True)
    if given.pictures:
        for name, picture in task.pictures(task.model).items():
            Image.fromarray(picture).save(given.pictures / f"shape-{name}.png")
    with torch.inference_mode():
        scores = shape_scores(task, limit=given.limit, points=given.points)
    for kind, found in scores.items():
        print(kind, found["objects"], "objects")
        for method in METHODS:
            mean = found["mean"][method]
            print(f"  {method:10}", {k: v and round(v, 3) for k, v in mean.items()})
    facts = {"machine": machine_facts(), "metrics": header.metrics, "scores": scores}
    facts |= {"models": len(task.seen), "pictures": task.sample_count()}
    text = json.dumps(facts, indent=2, allow_nan=False) + "\n"
    write_atomically(Path(__file__).with_suffix(".json"), text)


if __name__ == "__main__":
    main()
