"""Everything a training needs to go on where it was, in one file: tensors and JSON, no code."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import torch
from torch import Tensor, nn
from torch.optim import Optimizer

from panoscene.scene import write_atomically

from ._average import WeightAverage
from ._errors import TrainError

SCHEMA = 1
_KEY = "panoscene_training"


@dataclass(slots=True)
class Progress:
    """How far a training is."""

    step: int = 0
    """Steps that are done."""
    best: float | None = None
    """Highest ``selection`` so far."""
    best_step: int = 0
    waited: int = 0
    """Validations since then."""
    falls: int = 0
    """How often the learning rate fell on a plateau."""
    level: float | None = None
    """What a validation must beat, for the plateau."""
    level_waited: int = 0
    ended: bool = False
    """Whether it stopped early."""


def write_checkpoint(
    path: Path,
    model: nn.Module,
    optimiser: Optimizer,
    average: WeightAverage | None,
    progress: Progress,
) -> None:
    """Write a training's state in one step; a file that was there stays whole until then."""
    from safetensors.torch import save  # noqa: PLC0415

    tensors = {f"model.{name}": tensor for name, tensor in model.state_dict().items()}
    if average is not None:
        tensors |= {f"average.{name}": tensor for name, tensor in average.tensors.items()}
    for number, state in optimiser.state_dict()["state"].items():
        tensors |= {
            f"optimiser.{number}.{key}": torch.as_tensor(value)
            for key, value in state.items()
            if value is not None
        }
    stored = {
        name: tensor.detach().to("cpu").clone(memory_format=torch.contiguous_format)
        for name, tensor in tensors.items()
    }
    document = json.dumps({"schema": SCHEMA, **asdict(progress)})
    write_atomically(path, save(stored, {_KEY: document}))


def read_checkpoint(
    path: Path, model: nn.Module, optimiser: Optimizer, average: WeightAverage | None
) -> Progress:
    """Put a training into the state in a file and return how far it is.

    Raises:
        TrainError: The file is damaged, or from another training.
    """
    from safetensors import SafetensorError, safe_open  # noqa: PLC0415

    try:
        with safe_open(path, framework="pt", device="cpu") as file:
            document = json.loads((file.metadata() or {}).get(_KEY, "{}"))
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    except (OSError, SafetensorError, json.JSONDecodeError) as error:
        raise TrainError(path, f"cannot be read: {' '.join(str(error).split())}") from None
    if document.pop("schema", None) != SCHEMA:
        raise TrainError(path, f"found no state of a training of schema {SCHEMA}")
    try:
        progress = Progress(**document)
        model.load_state_dict(_under("model.", tensors))
        if average is not None:
            for name, tensor in average.tensors.items():
                tensor.copy_(tensors[f"average.{name}"])
        _fill_optimiser(optimiser, _under("optimiser.", tensors))
    except (KeyError, TypeError, RuntimeError) as error:
        raise TrainError(
            path, f"is from another training: {' '.join(str(error).split())[:300]}"
        ) from None
    return progress


def _under(prefix: str, tensors: dict[str, Tensor]) -> dict[str, Tensor]:
    return {
        name.removeprefix(prefix): tensor
        for name, tensor in tensors.items()
        if name.startswith(prefix)
    }


def _fill_optimiser(optimiser: Optimizer, tensors: dict[str, Tensor]) -> None:
    document = optimiser.state_dict()
    parameters = [p for group in optimiser.param_groups for p in group["params"]]
    state: dict[int, dict[str, Tensor]] = {}
    for name, tensor in tensors.items():
        number, _, key = name.partition(".")
        like = parameters[int(number)]
        if tensor.shape == like.shape and tensor.dim() > 0:
            # in the parameter's own memory order, which fused optimisers rely on
            tensor = torch.empty_like(like, dtype=tensor.dtype).copy_(tensor)  # noqa: PLW2901
        state.setdefault(int(number), {})[key] = tensor
    optimiser.load_state_dict({**document, "state": state})
