"""Recipes of trainings: every setting, in one YAML file."""

from collections.abc import Mapping
from math import cos, pi
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from panoscene.models import Edition

from ._errors import TrainError

Stage = Literal["detector", "layout", "pose", "shape", "context"]
STAGES: tuple[Stage, ...] = get_args(Stage)
"""The stages that are trained, in the order in which they need each other."""
Precision = Literal["auto", "32-true", "bf16-mixed"]
Options = TypeVar("Options", bound=BaseModel)

Positive = Annotated[int, Field(ge=1)]
NotNegative = Annotated[int, Field(ge=0)]


class TrainRecipe(BaseModel):
    """A training; a file in configs/paper or configs/compact."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    stage: Stage
    edition: Edition
    data: Path | None = None
    """Folder of the data set; ``--data`` of the command goes before."""
    panoramas: Positive | None = None
    """Panoramas of the training part that are learned from, home after home; None for all."""
    steps: Positive
    """Of the optimiser."""
    batch_size: Positive
    """Samples of one step, over all devices and parts."""
    accumulate: Positive = 1
    """Parts in which a device works through its share of a batch, to need less memory."""
    learning_rate: Annotated[float, Field(gt=0.0)]
    schedule: Literal["cosine", "constant", "steps", "plateau"] = "cosine"
    warmup: NotNegative = 0
    """Steps in which the learning rate rises to its value."""
    milestones: tuple[Positive, ...] = ()
    """Schedule ``steps``: where the learning rate falls to ``decay`` of what it was."""
    decay: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.1
    """Of the learning rate, at a milestone or on a plateau."""
    plateau_patience: NotNegative = 10
    """Schedule ``plateau``: the learning rate falls after more validations without a better one."""
    plateau_threshold: Annotated[float, Field(ge=0.0)] = 0.01
    """Better means by more than this part of the best so far."""
    optimiser: Literal["adamw", "adam", "sgd"] = "adamw"
    momentum: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.9
    """Of ``sgd``; the first beta of the others."""
    weight_decay: Annotated[float, Field(ge=0.0)] = 0.0
    """Not of vectors: biases and norms."""
    clip_norm: Annotated[float, Field(gt=0.0)] | None = None
    """Longest gradient."""
    ema: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    """Decay of the moving average of the weights, which is then what is validated and kept."""
    imagenet: bool = False
    """Start the backbone from ImageNet weights."""
    start: Path | None = None
    """Start from the weights in this file: written by panoscene, for the same network."""
    seed: NotNegative = 0
    validate_every: Positive = 500
    validate_limit: Positive | None = None
    """Panoramas that are validated on; None for all."""
    patience: Positive | None = None
    """Stop after this many validations without a better one."""
    save_every: Positive = 100
    """Steps that are lost at most when the computer fails."""
    log_every: Positive = 20
    precision: Precision = "auto"
    devices: Positive | Literal["auto"] = "auto"
    """GPUs of each machine; without any, processes."""
    num_nodes: Positive = 1
    """Machines."""
    workers: NotNegative = 1
    """Processes of each device that make samples; 0 makes them in between."""
    threads: Positive | None = None
    """Of PyTorch; None leaves them as they are."""
    channels_last: bool = True
    options: dict[str, Any] = {}
    """Of the stage."""

    @model_validator(mode="after")
    def _agrees(self) -> "TrainRecipe":
        if self.batch_size % self.accumulate:
            raise ValueError(
                f"accumulate: found {self.accumulate}, expected a divisor of batch_size "
                f"{self.batch_size}"
            )
        if list(self.milestones) != sorted(set(self.milestones)):
            raise ValueError(f"milestones: found {self.milestones}, expected rising steps")
        if bool(self.milestones) != (self.schedule == "steps"):
            raise ValueError("milestones: expected some with schedule 'steps', else none")
        return self

    def stage_options(self, model: type[Options]) -> Options:
        """Return the options as the stage's own model of them.

        Raises:
            TrainError: They are not what the stage expects.
        """
        try:
            return model.model_validate(self.options)
        except ValidationError as error:
            raise TrainError(f"options of the {self.stage}", problems_of(error)) from None

    def learning_rate_at(self, step: int, falls: int = 0) -> float:
        """Return the learning rate of a step, the first being 0.

        Args:
            step: Steps that are done.
            falls: Schedule ``plateau``: how often the learning rate fell.

        Examples:
            >>> recipe = TrainRecipe(stage="layout", edition="compact", steps=110, batch_size=1,
            ...                      learning_rate=1.0, warmup=10)
            >>> [round(recipe.learning_rate_at(step), 2) for step in (0, 9, 10, 60, 110)]
            [0.1, 1.0, 1.0, 0.5, 0.0]
        """
        if step < self.warmup:
            return self.learning_rate * (step + 1) / self.warmup
        if self.schedule == "cosine":
            done = (step - self.warmup) / max(1, self.steps - self.warmup)
            return self.learning_rate * 0.5 * (1 + cos(pi * min(1.0, done)))
        passed = sum(step >= milestone for milestone in self.milestones)
        return self.learning_rate * self.decay ** (passed + falls)


def read_train_recipe(path: Path | str, changes: Mapping[str, Any] | None = None) -> TrainRecipe:
    """Return the recipe in a YAML file.

    Args:
        path: The file.
        changes: Settings that go before those of the file.

    Raises:
        TrainError: The file cannot be read or is not a recipe; the message names every field.
    """
    import yaml  # noqa: PLC0415

    file = Path(path)
    try:
        document: Any = yaml.safe_load(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise TrainError(file, f"expected a recipe, found: {error.strerror}") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise TrainError(file, f"expected YAML, found: {' '.join(str(error).split())}") from None
    if not isinstance(document, dict):
        raise TrainError(file, f"expected settings by name, found {document!r:.60}")
    try:
        return TrainRecipe.model_validate({**document, **(changes or {})})
    except ValidationError as error:
        raise TrainError(file, problems_of(error)) from None


def recipe_text(recipe: TrainRecipe) -> str:
    """Return a recipe as YAML with every setting."""
    import yaml  # noqa: PLC0415

    return yaml.safe_dump(recipe.model_dump(mode="json"), sort_keys=False)


def problems_of(error: ValidationError) -> str:
    """Return what pydantic found, on one line."""
    return "; ".join(
        f"{'.'.join(map(str, problem['loc'])) or 'the file'}: {problem['msg']}"
        for problem in error.errors()[:10]
    )
