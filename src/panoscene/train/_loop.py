"""The one training loop: every stage is trained by it."""

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch
from torch import Tensor, nn
from torch.optim import Optimizer
from torch.utils.data import DataLoader, Dataset

import panoscene
from panoscene.data import SampleKey, StepSampler, generator_of, seed_of
from panoscene.models import WeightsHeader, write_weights

from ._average import WeightAverage
from ._batch import Batch, on_device
from ._checkpoint import Progress, read_checkpoint, write_checkpoint
from ._devices import seeded, start_fabric
from ._environment import data_hash, environment
from ._errors import TrainError
from ._log import RunLog
from ._optimiser import make_optimiser, set_learning_rate
from ._recipe import TrainRecipe
from ._run import LAST, begin_run
from ._task import SELECTION, Task

if TYPE_CHECKING:
    from lightning_fabric import Fabric

BEST, WEIGHTS = "best.safetensors", "weights.safetensors"
_SEED_OF_START, _SEED_OF_STEP, _SEED_OF_VALIDATION, _SEED_OF_WORKERS = 11, 12, 13, 14

Told = Callable[[int, int, str], None]
"""Is told the steps that are done, all steps, and how it goes."""


@dataclass(frozen=True, slots=True)
class TrainResult:
    """How a training ended."""

    steps: int
    """That are done."""
    best: float | None
    """Highest ``selection`` of a validation."""
    best_step: int
    early: bool
    """Whether it stopped because validations no longer got better."""


def train(
    recipe: TrainRecipe,
    run: Path,
    task_of: Callable[[TrainRecipe], Task],
    told: Told = lambda done, total, words: None,
) -> TrainResult:
    """Train a stage, or go on with a training that was stopped, and return how it ended.

    The folder of the run gets recipe.yaml, environment.json, metrics.csv, metrics.jsonl,
    tensorboard/, pictures/, last.safetensors (to go on from), best.safetensors and
    weights.safetensors (the same with 16 bits). A training that was killed at any moment goes on
    at its last checkpoint and gives the same losses as one that was not.

    Args:
        recipe: What to do.
        run: Folder of the run.
        task_of: Builds the stage's task; global random numbers are fixed meanwhile.
        told: Called after every step, on one device.

    Raises:
        TrainError: The run is of another recipe, or a loss is not finite.
    """
    fabric = start_fabric(recipe, run)
    return _Training(fabric, recipe, run, task_of, told).run()


class _Losses(nn.Module):
    """A task's losses as a module, so that all its parts are in one forward pass for DDP."""

    def __init__(self, task: Task) -> None:
        super().__init__()
        self.model = task.model
        self._losses = task.losses

    def forward(self, batch: Batch) -> dict[str, Tensor]:
        """Return the loss terms."""
        return self._losses(self.model, batch.content)


class _Samples(Dataset[Any]):
    def __init__(self, task: Task) -> None:
        self._task = task

    def __getitem__(self, key: SampleKey) -> Any:  # ty: ignore[lost-keyword-for-regular-parameter]
        return self._task.sample(key.sample, generator_of(key))


class _Training:
    """One run of the loop."""

    def __init__(
        self,
        fabric: "Fabric",
        recipe: TrainRecipe,
        run: Path,
        task_of: Callable[[TrainRecipe], Task],
        told: Told,
    ) -> None:
        self.fabric, self.recipe, self.folder, self.told = fabric, recipe, run, told
        with seeded(fabric.device, recipe.seed, _SEED_OF_START):
            self.task = task_of(recipe)
        model = self.task.model
        if recipe.channels_last:
            model.to(memory_format=torch.channels_last)
        self.optimiser: Optimizer = make_optimiser(self.task, recipe)
        self.losses, self.steps = fabric.setup(_Losses(self.task), self.optimiser)
        self.average = WeightAverage(model, recipe.ema) if recipe.ema else None
        self.progress = Progress()
        if fabric.is_global_zero:
            begin_run(run, recipe, self._environment())
        fabric.barrier()
        if (run / LAST).is_file():
            self.progress = read_checkpoint(run / LAST, model, self.optimiser, self.average)
        self.log = (
            RunLog(run, self.progress.step, recipe.log_every) if fabric.is_global_zero else None
        )

    def run(self) -> TrainResult:
        """Do the steps that are left and return how it ended."""
        recipe, progress = self.recipe, self.progress
        try:
            if not progress.ended:
                batches = iter(self._loader())
                while progress.step < recipe.steps and not progress.ended:
                    self._step(batches)
                    self._after_step()
        finally:
            if self.log is not None:
                self.log.close()
        return TrainResult(progress.step, progress.best, progress.best_step, progress.ended)

    def _loader(self) -> "DataLoader[Any]":
        recipe, fabric = self.recipe, self.fabric
        sampler = StepSampler(
            self.task.sample_count(), recipe.seed, recipe.batch_size, parts=recipe.accumulate,
            start=self.progress.step, steps=recipe.steps, rank=fabric.global_rank,
            devices=fabric.world_size,
        )  # fmt: skip
        generator = torch.Generator().manual_seed(seed_of(recipe.seed, _SEED_OF_WORKERS))
        return DataLoader(
            _Samples(self.task),
            batch_sampler=sampler,
            collate_fn=self.task.collate,
            num_workers=recipe.workers,
            pin_memory=fabric.device.type == "cuda",
            generator=generator,
        )

    def _step(self, batches: Iterator[Any]) -> None:
        """Do one step of the optimiser and log it."""
        recipe, fabric, step = self.recipe, self.fabric, self.progress.step
        start = time.perf_counter()
        rate = recipe.learning_rate_at(step, self.progress.falls)
        set_learning_rate(self.optimiser, rate)
        self.losses.train()
        parts = []
        for part in range(recipe.accumulate):
            batch = Batch(on_device(next(batches), fabric.device))
            waiting = part + 1 < recipe.accumulate
            numbers = (recipe.seed, _SEED_OF_STEP, step, part, fabric.global_rank)
            with (
                fabric.no_backward_sync(self.losses, enabled=waiting),
                seeded(fabric.device, *numbers),
            ):
                terms = self.losses(batch)
                total = torch.stack(list(terms.values())).sum()
                fabric.backward(total / recipe.accumulate)
            parts.append({name: term.detach() for name, term in terms.items()})
        norm = fabric.clip_gradients(
            self.losses,
            self.steps,
            max_norm=recipe.clip_norm or math.inf,
            error_if_nonfinite=False,
        )
        values = self._means(parts) | {"gradient_norm": float(norm or 0.0)}
        self._check_finite(values)
        self.steps.step()
        self.steps.zero_grad(set_to_none=True)
        self.progress.step += 1
        if self.average is not None:
            self.average.update(self.task.model, self.progress.step)
        if self.log is not None:
            seconds = time.perf_counter() - start
            values |= {"learning_rate": rate, "seconds": seconds}
            self.log.record("train", self.progress.step, values)
            self.told(self.progress.step, recipe.steps, f"loss {values['loss']:.4g}")

    def _after_step(self) -> None:
        """Validate and save when it is time."""
        step, recipe = self.progress.step, self.recipe
        last = step == recipe.steps
        if step % recipe.validate_every == 0 or last:
            self._validate()
        elif step % recipe.save_every != 0:
            return
        if self.log is not None:
            self.log.save()
            model = self.task.model
            path = self.folder / LAST
            write_checkpoint(path, model, self.optimiser, self.average, self.progress)
        self.fabric.barrier()

    def _validate(self) -> None:
        """Validate on one device, keep the weights if they are the best, and tell all devices."""
        found = 0.0
        if self.log is not None:
            if self.average is None:
                found = self._validated(self.log)
            else:
                with self.average.applied(self.task.model):
                    found = self._validated(self.log)
        found = self.fabric.broadcast(found)
        _take_in(self.progress, found, self.recipe)

    def _validated(self, log: RunLog) -> float:
        """Return the selection score, after writing the best weights, scores and pictures."""
        recipe, task, step = self.recipe, self.task, self.progress.step
        start = time.perf_counter()
        task.model.eval()
        numbers = (recipe.seed, _SEED_OF_VALIDATION, step)
        with torch.no_grad(), seeded(self.fabric.device, *numbers):
            scores = task.validate(task.model, recipe.validate_limit)
            pictures = task.pictures(task.model)
        if SELECTION not in scores or not math.isfinite(scores[SELECTION]):
            raise TrainError(
                self.folder,
                f"step {step}: the validation of the {recipe.stage} found no finite "
                f"{SELECTION!r}, by which the best weights are chosen",
            )
        log.record("validation", step, scores | {"seconds": time.perf_counter() - start})
        log.pictures(step, pictures)
        best = self.progress.best
        if best is None or scores[SELECTION] > best:
            header = self._header(scores)
            write_weights(self.folder / BEST, task.model, header, half=False)
            for stage, (part, config) in (task.parts() or {recipe.stage: (task.model, {})}).items():
                path = self.folder / (WEIGHTS if stage == recipe.stage else f"{stage}.safetensors")
                changes = {"stage": stage, "config": config or header.config}
                write_weights(path, part, header.model_copy(update=changes))
        return float(scores[SELECTION])

    def _header(self, scores: Mapping[str, float]) -> WeightsHeader:
        recipe = self.recipe
        return WeightsHeader(
            stage=recipe.stage,
            edition=recipe.edition,
            config=self.task.config(),
            metrics={name: float(value) for name, value in scores.items() if math.isfinite(value)}
            | {"step": float(self.progress.step)},
            recipe=recipe.model_dump(mode="json"),
            data_hash=data_hash(recipe.data),
            seed=recipe.seed,
            created_by=f"panoscene {panoscene.__version__}",
        )

    def _means(self, parts: Sequence[Mapping[str, Tensor]]) -> dict[str, float]:
        """Return the terms of a step, averaged over parts and devices, and their sum."""
        names = list(parts[0])
        table = torch.stack([torch.stack([part[name].float() for name in names]) for part in parts])
        means = table.mean(dim=0)
        if self.fabric.world_size > 1:
            means = self.fabric.all_reduce(means, reduce_op="mean")
        assert isinstance(means, Tensor)  # noqa: S101 (a tensor stays one)
        numbers = means.double().tolist()
        terms = {f"loss_{name}": value for name, value in zip(names, numbers, strict=True)}
        return {"loss": sum(numbers), **terms}

    def _check_finite(self, values: Mapping[str, float]) -> None:
        wrong = [name for name, value in values.items() if not math.isfinite(value)]
        if wrong:
            raise TrainError(
                self.folder,
                f"step {self.progress.step + 1}: {', '.join(wrong)} not finite; expected numbers: "
                "try a lower learning_rate, a longer warmup or a smaller clip_norm",
            )

    def _environment(self) -> dict[str, Any]:
        fabric = self.fabric
        return environment(
            precision=str(fabric._precision.precision),
            device=str(fabric.device),
            devices=fabric.world_size,
            data=self.recipe.data,
        )


def _take_in(progress: Progress, found: float, recipe: TrainRecipe) -> None:
    """Bring best score, patience and plateau up to date after a validation."""
    if progress.best is None or found > progress.best:
        progress.best, progress.best_step, progress.waited = found, progress.step, 0
    else:
        progress.waited += 1
    progress.ended = recipe.patience is not None and progress.waited >= recipe.patience
    if recipe.schedule != "plateau":
        return
    margin = recipe.plateau_threshold * abs(progress.level or 0.0)
    if progress.level is None or found > progress.level + margin:
        progress.level, progress.level_waited = found, 0
        return
    progress.level_waited += 1
    if progress.level_waited > recipe.plateau_patience:
        progress.falls += 1
        progress.level_waited = 0
