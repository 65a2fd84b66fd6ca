"""A stage that is trained in a second."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from panoscene.train import Task, TrainRecipe


class TinyTask(Task):
    """Learns the mean of three colours; dropout and batch norm make it depend on chance."""

    def __init__(self, recipe: TrainRecipe) -> None:
        del recipe
        self.model = nn.Sequential(
            nn.Conv2d(3, 4, 3, padding=1),
            nn.BatchNorm2d(4),
            nn.ReLU(),
            nn.Dropout(0.2),
            nn.Conv2d(4, 1, 1),
        )
        self.validations = 0

    def sample_count(self) -> int:
        return 7

    def sample(self, index: int, generator: torch.Generator) -> tuple[Tensor, Tensor]:
        image = torch.rand(3, 8, 8, generator=generator) + index / 7
        return image, image.mean(0, keepdim=True)

    def collate(self, samples: Sequence[Any]) -> tuple[Tensor, Tensor]:
        return torch.stack([s[0] for s in samples]), torch.stack([s[1] for s in samples])

    def losses(self, model: nn.Module, batch: tuple[Tensor, Tensor]) -> dict[str, Tensor]:
        error = model(batch[0]) - batch[1]
        return {"square": error.square().mean(), "flat": 0.1 * error.abs().mean()}

    def validate(self, model: nn.Module, limit: int | None) -> dict[str, float]:
        assert not model.training
        assert not torch.is_grad_enabled()
        image = torch.rand(4, 3, 8, 8, generator=torch.Generator().manual_seed(0))[:limit]
        error = (model(image) - image.mean(1, keepdim=True)).square().mean()
        return {"selection": -float(error), "absent": float("nan")}

    def pictures(self, model: nn.Module) -> dict[str, np.ndarray]:
        del model
        return {"grey": np.full((8, 12, 3), 128, np.uint8)}

    def config(self) -> dict[str, Any]:
        return {"width": 4}

    def rate(self, parameter: str) -> float:
        return 0.0 if parameter == "4.bias" else 1.0


class PlainTask(TinyTask):
    """The same with a network that does not depend on how a batch is split."""

    def __init__(self, recipe: TrainRecipe) -> None:
        super().__init__(recipe)
        self.model = nn.Conv2d(3, 1, 1)


class BrokenTask(TinyTask):
    """A stage whose loss is infinite."""

    def losses(self, model: nn.Module, batch: tuple[Tensor, Tensor]) -> dict[str, Tensor]:
        return {"huge": super().losses(model, batch)["square"] * float("inf")}


@pytest.fixture
def broken_task() -> Callable[[TrainRecipe], Task]:
    """Return what builds the broken stage."""
    return BrokenTask


@pytest.fixture
def scored() -> Callable[[list[float]], Callable[[TrainRecipe], Task]]:
    """Return what makes tasks whose validations give these scores, one after the other."""

    def make(scores: list[float]) -> Callable[[TrainRecipe], Task]:
        class Scored(TinyTask):
            def validate(self, model: nn.Module, limit: int | None) -> dict[str, float]:
                del model, limit
                self.validations += 1
                return {"selection": scores[self.validations - 1]}

        return Scored

    return make


@pytest.fixture
def tiny_recipe() -> Callable[..., TrainRecipe]:
    """Return what makes recipes of the tiny stage."""

    def make(**changes: Any) -> TrainRecipe:
        settings = {
            "stage": "layout", "edition": "compact", "steps": 12, "batch_size": 4,
            "learning_rate": 0.01, "warmup": 3, "weight_decay": 0.01, "clip_norm": 1.0,
            "ema": 0.9, "validate_every": 6, "save_every": 4, "log_every": 5, "workers": 0,
            "threads": 1,
        }  # fmt: skip
        return TrainRecipe.model_validate(settings | changes)

    return make


@pytest.fixture
def tiny_task() -> Callable[[TrainRecipe], Task]:
    """Return what builds the tiny stage."""
    return TinyTask


@pytest.fixture
def plain_task() -> Callable[[TrainRecipe], Task]:
    """Return what builds the plain stage."""
    return PlainTask


@pytest.fixture
def shipped(root: Path) -> list[Path]:
    """Return the recipes that come with the package's sources."""
    return sorted((root / "configs").glob("compact/*.yaml")) + sorted(
        (root / "configs").glob("paper/*.yaml")
    )
