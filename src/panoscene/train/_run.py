"""The folder of a run: whose it is, and what it ran on."""

import json
from pathlib import Path
from typing import Any

from panoscene.scene import write_atomically

from ._errors import TrainError
from ._recipe import TrainRecipe, read_train_recipe, recipe_text

RECIPE, ENVIRONMENT, LAST = "recipe.yaml", "environment.json", "last.safetensors"
_FREE = {
    "data", "steps", "devices", "num_nodes", "workers", "threads", "save_every", "log_every",
    "patience",
}  # fmt: skip
"""Settings that may change when a training goes on."""


def begin_run(run: Path, recipe: TrainRecipe, environment: dict[str, Any]) -> None:
    """Make the folder of a run, or check that it is the folder of this recipe.

    Raises:
        TrainError: The folder belongs to another recipe or data set, or holds something else.
    """
    if run.exists() and not run.is_dir():
        raise TrainError(run, "found a file, expected a folder")
    run.mkdir(parents=True, exist_ok=True)
    started = (run / LAST).is_file()
    file = run / ENVIRONMENT
    starts = json.loads(file.read_text())["starts"] if started and file.is_file() else []
    if started:
        _check_same(run, recipe)
    if starts:
        _check_same_data(run, starts[-1], environment)
    write_atomically(run / RECIPE, recipe_text(recipe))
    write_atomically(file, json.dumps({"starts": [*starts, environment]}, indent=2) + "\n")


def _check_same(run: Path, recipe: TrainRecipe) -> None:
    before = read_train_recipe(run / RECIPE).model_dump(mode="json")
    now = recipe.model_dump(mode="json")
    changed = [name for name in now if name not in _FREE and now[name] != before[name]]
    if changed:
        listed = "; ".join(f"{name} {before[name]!r}, now {now[name]!r}" for name in changed)
        raise TrainError(run, f"found a training of another recipe ({listed}): take a new folder")


def _check_same_data(run: Path, before: dict[str, Any], now: dict[str, Any]) -> None:
    """Refuse another data set: best weights of one would be compared with scores on the other."""
    if before["data_hash"] != now["data_hash"]:
        raise TrainError(
            run,
            f"found a training on the data set {before['data']}, whose dataset.json was another "
            f"than that of {now['data']} is now: take a new folder",
        )
