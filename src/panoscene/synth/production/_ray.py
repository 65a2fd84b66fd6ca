"""Renders what is left of a data set on the computers of a Ray cluster."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

from panoscene.synth.dataset import Recipe

from ._photographs import Extra
from ._run import RenderProgress, RenderTask, Told, begin_run, follow, render_home

_AGAIN = 3
"""Times that a home is tried again when its computer goes away."""


def render_with_ray(
    root: Path | str,
    recipe: Recipe,
    cache: Path | str,
    *,
    address: str | None = None,
    limit: int | None = None,
    extra: Extra | None = None,
    told: Told | None = None,
    render: Callable[[RenderTask], None] = render_home,
) -> RenderProgress:
    """Render the panoramas of a recipe that are not there yet, one home a task of Ray.

    The computers of the cluster share the folder of the set and that of the models, under the
    same names, and have panoscene with its ``synth`` and ``ray`` extras installed. Every task
    takes one core. What is rendered is the same as with ``render_dataset``, which may go on with
    the set, and the other way round.

    Args:
        root: Folder of the set; made if it is not there.
        recipe: What it will be.
        cache: Folder of the models.
        address: Of the cluster, such as ``auto`` or ``ray://head:10001``; None takes the one that
            is running here, or else the cores of this computer.
        limit: Panoramas that shall be there in the end; all of the recipe's by default.
        extra: Writes further files of a panorama; a function of a module.
        told: Told of every home that is done.
        render: Makes the panoramas of a task; for tests.

    Raises:
        DatasetError: The folder holds another set.
        AssetError: There is no cache of models.
        MissingRendererError: Mitsuba, its denoiser or LLVM is not installed.
        ModuleNotFoundError: The optional package ray is missing.
        ConnectionError: There is no cluster at the address.
    """
    ray = _ray()
    tasks, progress = begin_run(root, recipe, cache, limit=limit, extra=extra, threads=1)
    if not tasks:
        return follow(Path(root), iter(()), progress, told)
    started = not ray.is_initialized()
    if started:
        _connect(ray, address)
    try:
        return follow(Path(root), _finished(ray, tasks, render), progress, told)
    finally:
        if started:
            ray.shutdown()


def outcome(render: Callable[[RenderTask], None], task: RenderTask) -> str | None:
    """Return why a home could not be made, or None when it was; runs on the cluster."""
    try:
        if not (task.root / "dataset.json").is_file():
            return f"{task.root}: not on every computer of the cluster, expected a shared folder"
        render(task)
    except ValueError as error:
        return str(error)
    return None


def _ray() -> ModuleType:
    # it reports how it is used to its makers unless told otherwise
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        import ray  # noqa: PLC0415 - optional
    except ModuleNotFoundError as error:
        hint = "rendering on several computers needs ray: pip install 'panoscene[ray]'"
        raise ModuleNotFoundError(hint, name="ray") from error
    return ray


def _connect(ray: ModuleType, address: str | None) -> None:
    try:
        ray.init(address=address, log_to_driver=False, logging_level="ERROR")
    except ConnectionError as error:
        raise ConnectionError(f"{address}: found no Ray cluster there") from error


def _finished(
    ray: ModuleType, tasks: list[RenderTask], render: Callable[[RenderTask], None]
) -> Iterator[tuple[RenderTask, str | None]]:
    """Return tasks as they finish, with the reason of those that failed."""
    remote: Any = ray.remote(outcome).options(
        num_cpus=1, max_retries=_AGAIN, scheduling_strategy="SPREAD"
    )
    given = ray.put(render)
    running = {remote.remote(given, task): task for task in tasks}
    try:
        while running:
            done, _ = ray.wait(list(running), num_returns=1)
            task = running.pop(done[0])
            yield task, _result(ray, done[0], task)
    finally:
        for reference in running:
            ray.cancel(reference, force=True)


def _result(ray: ModuleType, reference: Any, task: RenderTask) -> str | None:
    try:
        problem = ray.get(reference)
    except ray.exceptions.RayTaskError as error:
        if error.cause is None:
            raise
        raise error.cause from None
    except ray.exceptions.RayError as error:
        return f"the computer that rendered it went away: {' '.join(str(error).split())}"
    missing = [c.name for c in task.job.cameras if not _is_here(task.root, c.name)]
    if problem is None and missing:
        return f"{missing[0]} is not in {task.root} here: the computers must share that folder"
    return problem


def _is_here(root: Path, name: str) -> bool:
    # listing the folder makes network file systems look again
    return any(path.name == name for path in (root / "panoramas").iterdir())
