"""Renders what is left of a data set on the computers of a Ray cluster."""

from collections.abc import Callable, Generator
from contextlib import closing
from pathlib import Path
from types import ModuleType
from typing import Any

from panoscene._ray import ray_cluster, ray_package, ray_result, spread
from panoscene.synth.dataset import Recipe

from ._photographs import Extra
from ._run import RenderProgress, RenderTask, Told, begin_run, follow, render_home


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
    ray = ray_package()
    tasks, progress = begin_run(root, recipe, cache, limit=limit, extra=extra, threads=1)
    if not tasks:
        return follow(Path(root), iter(()), progress, told)
    with ray_cluster(ray, address), closing(_finished(ray, tasks, render)) as finished:
        return follow(Path(root), finished, progress, told)


def outcome(render: Callable[[RenderTask], None], task: RenderTask) -> str | None:
    """Return why a home could not be made, or None when it was; runs on the cluster."""
    try:
        if not (task.root / "dataset.json").is_file():
            return f"{task.root}: not on every computer of the cluster, expected a shared folder"
        render(task)
    except ValueError as error:
        return str(error)
    return None


def _finished(
    ray: ModuleType, tasks: list[RenderTask], render: Callable[[RenderTask], None]
) -> Generator[tuple[RenderTask, str | None], None, None]:
    """Return tasks as they finish, with the reason of those that failed."""
    for task, reference in spread(ray, outcome, (render,), tasks):
        yield task, _problem(ray, reference, task)


def _problem(ray: ModuleType, reference: Any, task: RenderTask) -> str | None:
    """Return why a home could not be made, or None when it was."""
    try:
        problem = ray_result(ray, reference)
    except ray.exceptions.RayTaskError:
        raise
    except ray.exceptions.RayError as error:
        return f"the computer that rendered it went away: {' '.join(str(error).split())}"
    missing = [c.name for c in task.job.cameras if not _is_here(task.root, c.name)]
    if problem is None and missing:
        return f"{missing[0]} is not in {task.root} here: the computers must share that folder"
    return problem


def _is_here(root: Path, name: str) -> bool:
    # listing the folder makes network file systems look again
    return any(path.name == name for path in (root / "panoramas").iterdir())
