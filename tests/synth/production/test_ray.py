"""Rendering on a cluster: what is refused; ``test_two_nodes.py`` starts one."""

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from panoscene.synth.dataset import Recipe
from panoscene.synth.production import RenderTask, begin_run, render_with_ray
from panoscene.synth.production import _ray as ray_module


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
