"""What the training loop needs to know about a stage."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from jaxtyping import UInt8
from torch import Tensor, nn

SELECTION = "selection"
"""Key of ``Task.validate`` by which the best weights are chosen: higher is better."""


class Task(ABC):
    """The training of one stage: its network, samples, losses and validation.

    Only ``sample`` and ``collate`` run in worker processes. ``losses`` runs inside the step that
    the loop makes reproducible: dropout and other global random numbers are set by the loop.

    Attributes:
        model: The network that is trained.
    """

    model: nn.Module

    @abstractmethod
    def sample_count(self) -> int:
        """Return how many training samples there are."""

    @abstractmethod
    def sample(self, index: int, generator: torch.Generator) -> Any:
        """Return one augmented training sample: a pure function of index and generator."""

    @abstractmethod
    def collate(self, samples: Sequence[Any]) -> Any:
        """Return a batch of samples: tensors in tuples, lists, dicts or dataclasses."""

    @abstractmethod
    def losses(self, model: nn.Module, batch: Any) -> dict[str, Tensor]:
        """Return the weighted loss terms of a batch, always the same ones; the loop adds them up.

        They are means over the samples, so that parts of a batch can be averaged.
        """

    @abstractmethod
    def validate(self, model: nn.Module, limit: int | None) -> dict[str, float]:
        """Return scores on the validation part; ``selection`` chooses the best weights.

        Args:
            model: The network, in evaluation mode, without gradients.
            limit: At most this many panoramas; None for all.
        """

    def pictures(self, model: nn.Module) -> dict[str, UInt8[np.ndarray, "height width 3"]]:
        """Return pictures of predictions by name; by default none."""
        del model
        return {}

    def config(self) -> dict[str, Any]:
        """Return what the network was built from, for the header of its weights."""
        return {}

    def parts(self) -> dict[str, tuple[nn.Module, dict[str, Any]]]:
        """Return the networks of stages that the model consists of, with their ``config``.

        By stage, where the model is no network of a stage itself; they get files with weights of
        their own: weights.safetensors for the recipe's stage, STAGE.safetensors for others.
        """
        return {}

    def rate(self, parameter: str) -> float:
        """Return the factor of a parameter's learning rate; 0 keeps the parameter as it is."""
        del parameter
        return 1.0
