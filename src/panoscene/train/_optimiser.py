"""Optimisers as recipes name them."""

import torch
from torch.optim import Optimizer

from ._recipe import TrainRecipe
from ._task import Task

_FACTOR = "factor"
"""Of a group's learning rate."""


def make_optimiser(task: Task, recipe: TrainRecipe) -> Optimizer:
    """Return the optimiser of a task; parameters with the rate 0 are frozen.

    Vectors (biases, norms) have no weight decay.

    Raises:
        ValueError: Every parameter is frozen.
    """
    groups: dict[tuple[float, bool], list[torch.nn.Parameter]] = {}
    for name, parameter in task.model.named_parameters():
        factor = task.rate(name)
        if factor == 0.0:
            parameter.requires_grad_(False)
        if parameter.requires_grad:
            groups.setdefault((factor, parameter.dim() > 1), []).append(parameter)
    if not groups:
        raise ValueError("task: found no parameter that is to be trained, expected at least one")
    listed = [
        {
            "params": parameters,
            _FACTOR: factor,
            "weight_decay": recipe.weight_decay if decays else 0.0,
        }
        for (factor, decays), parameters in groups.items()
    ]
    if recipe.optimiser == "sgd":
        return torch.optim.SGD(listed, lr=recipe.learning_rate, momentum=recipe.momentum)
    kind = torch.optim.AdamW if recipe.optimiser == "adamw" else torch.optim.Adam
    return kind(listed, lr=recipe.learning_rate, betas=(recipe.momentum, 0.999))


def set_learning_rate(optimiser: Optimizer, rate: float) -> None:
    """Give every group of parameters its share of a learning rate."""
    for group in optimiser.param_groups:
        group["lr"] = rate * group[_FACTOR]
