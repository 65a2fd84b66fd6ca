"""The moving average of a network's weights."""

from collections.abc import Iterator
from contextlib import contextmanager

import torch
from torch import Tensor, nn


class WeightAverage:
    """An exponential moving average of the parameters and statistics of a network.

    Early in the training the average forgets faster, so that it does not keep the start weights.

    Attributes:
        tensors: The average, by the names of the state dict.
    """

    def __init__(self, module: nn.Module, decay: float) -> None:
        self.decay = decay
        self.tensors: dict[str, Tensor] = {
            name: tensor.detach().clone() for name, tensor in _floating(module).items()
        }

    @torch.no_grad()
    def update(self, module: nn.Module, step: int) -> None:
        """Take in the weights after a step, the first being 1."""
        decay = min(self.decay, (1 + step) / (10 + step))
        for name, tensor in _floating(module).items():
            self.tensors[name].lerp_(tensor, 1.0 - decay)

    @contextmanager
    def applied(self, module: nn.Module) -> Iterator[None]:
        """Let the network have the average as its weights for a while."""
        own = {name: tensor.detach().clone() for name, tensor in _floating(module).items()}
        _copy(self.tensors, module)
        try:
            yield
        finally:
            _copy(own, module)


def _floating(module: nn.Module) -> dict[str, Tensor]:
    return {
        name: tensor for name, tensor in module.state_dict().items() if tensor.is_floating_point()
    }


@torch.no_grad()
def _copy(tensors: dict[str, Tensor], module: nn.Module) -> None:
    for name, tensor in _floating(module).items():
        tensor.copy_(tensors[name])
