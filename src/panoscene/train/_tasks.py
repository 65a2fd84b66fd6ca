"""The task of each stage; its module is imported when it is asked for."""

import importlib
from collections.abc import Callable
from typing import Any

from pydantic import BaseModel

from ._recipe import STAGES, Stage, TrainRecipe
from ._task import Task


def _task_of(stage: Stage) -> Callable[[TrainRecipe], Task]:
    def build(recipe: TrainRecipe) -> Task:
        task: Callable[[TrainRecipe], Task] = getattr(_module(stage), f"{stage}_task")
        return task(recipe)

    return build


TASKS: dict[Stage, Callable[[TrainRecipe], Task]] = {stage: _task_of(stage) for stage in STAGES}
"""What builds the task of each stage from its recipe, whose ``data`` names the data set."""


def options_of(stage: Stage) -> type[BaseModel]:
    """Return the model of a stage's ``options`` in a recipe."""
    return getattr(_module(stage), f"{stage.capitalize()}Options")


def _module(stage: Stage) -> Any:
    return importlib.import_module(f"panoscene.train._{stage}")
