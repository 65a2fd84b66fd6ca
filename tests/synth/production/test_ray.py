"""Rendering on a cluster: two nodes on this computer, with copies instead of pictures."""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from panoscene.synth.dataset import Recipe, open_dataset
from panoscene.synth.production import RenderProgress, RenderTask, begin_run, render_with_ray
from panoscene.synth.production import _ray as ray_module

pytestmark = [
    # ray leaves sockets and log files of its processes to the interpreter
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::FutureWarning"),
]


def noting_nodes(render: Callable[[RenderTask], None]) -> Callable[[RenderTask], None]:
    """Return a task that also writes down which node it ran on."""

    def noted(task: RenderTask) -> None:
        import time  # noqa: PLC0415

        import ray  # noqa: PLC0415

        time.sleep(0.3)  # so that the second node gets its share
        render(task)
        nodes = task.root / "nodes"
        nodes.mkdir(exist_ok=True)
        (nodes / task.job.home).write_text(ray.get_runtime_context().get_node_id())

    return noted


@pytest.mark.slow
def test_two_nodes_share_the_homes_and_failures_are_told(
    cluster: Any,
    tmp_path: Path,
    recipe: Recipe,
    cache: Path,
    copy_sample: Callable[[RenderTask], None],
) -> None:
    root = tmp_path / "set"
    (root / "broken" / "home0002").mkdir(parents=True)
    told: list[RenderProgress] = []
    options: dict[str, Any] = {"address": cluster.address, "told": told.append}
    render = noting_nodes(copy_sample)
    done = render_with_ray(root, recipe, cache, render=render, **options)
    assert (done.done, done.wanted, done.made) == (6, 8, 6)
    assert done.failed == (("home0002", "home0002: found no room for 2 cameras"),)
    assert [progress.done for progress in told][-1] == 6
    nodes = {file.read_text() for file in (root / "nodes").iterdir()}
    assert len(nodes) == 2
    # the same call goes on with what is missing
    (root / "broken" / "home0002").rmdir()
    done = render_with_ray(root, recipe, cache, render=render, **options)
    assert (done.done, done.made, done.failed) == (8, 2, ())
    assert len(open_dataset(root)) == 8
    assert (root / "README.md").is_file()


def test_folders_that_are_not_shared_are_noticed(
    tmp_path: Path, recipe: Recipe, cache: Path, copy_sample: Callable[[RenderTask], None]
) -> None:
    ray: Any = ModuleType("ray")
    ray.get = lambda reference: None
    ray.exceptions = SimpleNamespace(RayTaskError=KeyError, RayError=LookupError)
    tasks, _ = begin_run(tmp_path / "set", recipe, cache, limit=None, extra=None, threads=1)
    copy_sample(tasks[0])
    assert ray_module._problem(ray, None, tasks[0]) is None
    problem = ray_module._problem(ray, None, tasks[1])
    assert problem is not None
    assert "home0001-0 is not in" in problem
    assert "must share that folder" in problem
    missing = replace(tasks[0], root=tmp_path / "elsewhere")
    assert "expected a shared folder" in (ray_module.outcome(copy_sample, missing) or "")


def test_a_missing_package_is_named(
    tmp_path: Path, recipe: Recipe, cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(ModuleNotFoundError, match=r"pip install 'panoscene\[ray\]'"):
        render_with_ray(tmp_path / "set", recipe, cache)
    assert not (tmp_path / "set").exists()
