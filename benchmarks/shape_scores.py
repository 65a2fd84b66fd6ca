"""Scores trained shape weights: writes benchmarks/shape_scores.json and prints tables.

    python benchmarks/shape_scores.py RECIPE WEIGHTS [--limit N] [--pictures FOLDER]

RECIPE is that of the training; its folder must have been prepared. Takes about a second of
processor time an object.
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
from panoscene.train._shape_scores import shape_scores

OUTPUT = Path(__file__).with_suffix(".json")


def main() -> None:
    """Score and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recipe", type=Path)
    parser.add_argument("weights", type=Path)
    parser.add_argument("--limit", type=int, default=100, help="objects of each kind, at most")
    parser.add_argument("--points", type=int, default=1000, help="samples of each surface")
    parser.add_argument("--pictures", type=Path, help="folder for pictures")
    parser.add_argument("--output", type=Path, default=OUTPUT)
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
        for method, mean in found["mean"].items():
            print(f"  {method:26}", {k: v and round(v, 3) for k, v in mean.items()})
    facts = {"machine": machine_facts(), "metrics": header.metrics, "scores": scores}
    facts |= {"models": len(task.seen), "pictures": task.sample_count()}
    facts |= {"points": given.points, "limit": given.limit}
    text = json.dumps(facts, indent=2, allow_nan=False) + "\n"
    write_atomically(given.output, text)


if __name__ == "__main__":
    main()
