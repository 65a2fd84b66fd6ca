"""Renders what is left of a data set, with several processes."""

import time
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from panoscene._workers import in_processes, outcome
from panoscene.synth.dataset import (
    DatasetIndex,
    HomeJob,
    Recipe,
    begin_dataset,
    finish_index,
    next_jobs,
    write_data_card,
)
from panoscene.synth.render import Renderer

from ._models import Models
from ._photographs import Extra, photograph_home

Told = Callable[["RenderProgress"], None]
_LISTED_EVERY = 10
"""Homes after which dataset.json is brought up to date, in case the run is killed."""


@dataclass(frozen=True, slots=True)
class RenderProgress:
    """How far rendering is."""

    done: int
    """Panoramas that are there."""
    wanted: int
    seconds: float
    """Since this run started."""
    made: int
    """Panoramas of this run."""
    failed: tuple[tuple[str, str], ...] = ()
    """Homes that could not be made, and why."""

    @property
    def seconds_left(self) -> float | None:
        """Estimate from the panoramas of this run; None before the first."""
        if self.made == 0:
            return None
        return self.seconds / self.made * (self.wanted - self.done)


@dataclass(frozen=True, slots=True)
class RenderTask:
    """One home for a worker; everything that it needs to know."""

    job: HomeJob
    index: DatasetIndex
    root: Path
    cache: Path
    threads: int
    extra: Extra | None


def render_dataset(
    root: Path | str,
    recipe: Recipe,
    cache: Path | str,
    *,
    limit: int | None = None,
    processes: int = 2,
    extra: Extra | None = None,
    told: Told | None = None,
) -> RenderProgress:
    """Render the panoramas of a recipe that are not there yet.

    It may be stopped at any time and started again: panoramas are written as a whole or not at
    all, and what they show does not depend on when they are made.

    Args:
        root: Folder of the set; made if it is not there.
        recipe: What it will be.
        cache: Folder of the models.
        limit: Panoramas that shall be there in the end; all of the recipe's by default. The first
            ones have the splits in about their final proportions.
        processes: Side by side; each takes up to 2 GiB. 1 stays in this process.
        extra: Writes further files of a panorama; a function of a module.
        told: Told of every home that is done.

    Raises:
        DatasetError: The folder holds another set.
        AssetError: There is no cache of models.
        MissingRendererError: Mitsuba, its denoiser or LLVM is not installed.
    """
    tasks, progress = begin_run(root, recipe, cache, limit=limit, extra=extra, threads=1)
    if processes == 1:
        alone = ((task, outcome(lambda task=task: render_home(task))) for task in tasks)
        return follow(Path(root), alone, progress, told)
    with closing(in_processes(render_home, tasks, processes)) as finished:
        return follow(Path(root), finished, progress, told)


def begin_run(
    root: Path | str,
    recipe: Recipe,
    cache: Path | str,
    *,
    limit: int | None,
    extra: Extra | None,
    threads: int,
) -> tuple[list[RenderTask], RenderProgress]:
    """Return what is left to do, one task for each home, and how far the set is."""
    models = Models(cache, 0)
    index = begin_dataset(root, recipe, unseen_bases=models.unseen_bases())
    jobs = next_jobs(root, limit=limit)
    wanted = index.planned if limit is None else min(limit, index.planned)
    left = sum(len(job.cameras) for job in jobs)
    folder = Path(root).resolve()
    tasks = [RenderTask(job, index, folder, models.cache.resolve(), threads, extra) for job in jobs]
    return tasks, RenderProgress(wanted - left, wanted, 0.0, 0)


def follow(
    root: Path,
    finished: Iterator[tuple[RenderTask, str | None]],
    progress: RenderProgress,
    told: Told | None,
) -> RenderProgress:
    """Return how far the set is when all tasks are done; write its index whatever happens."""
    start, before = time.monotonic(), progress.done
    finish_index(root)  # a run that was killed could not
    try:
        for number, (task, problem) in enumerate(finished, start=1):
            made = 0 if problem else len(task.job.cameras)
            failed = ((task.job.home, problem),) if problem else ()
            done = progress.done + made
            progress = RenderProgress(
                done, progress.wanted, time.monotonic() - start, done - before,
                progress.failed + failed,
            )  # fmt: skip
            if number % _LISTED_EVERY == 0:
                finish_index(root)
            if told is not None:
                told(progress)
    finally:
        finish_index(root)
    if progress.done:
        write_data_card(root)
    return progress


def render_home(task: RenderTask) -> None:
    """Render one home in this process; models and renderer are kept for the next one."""
    models = _models(task.cache, task.index.recipe.furniture_texture)
    renderer = _renderer(task.threads)
    photograph_home(task.job, task.index, models, renderer, task.root, extra=task.extra)


@lru_cache(maxsize=1)
def _models(cache: Path, texture_size: int) -> Models:
    return Models(cache, texture_size)


@lru_cache(maxsize=1)
def _renderer(threads: int) -> Renderer:
    return Renderer(threads)
