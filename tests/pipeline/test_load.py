"""Loading: light to import, each network once and when it is needed."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Event

import pytest
import torch

import panoscene
from panoscene.models import CheckpointError
from panoscene.pipeline import Pipeline, Stages, load, load_stages, load_steps
from panoscene.pipeline._load import AtFirstUse


def test_the_package_loads_pipelines_and_is_light_to_import() -> None:
    assert panoscene.load is load
    with pytest.raises(AttributeError, match="no attribute 'unload'"):
        _ = panoscene.unload  # ty: ignore[missing-attribute]
    code = "import panoscene, sys; print('torch' in sys.modules, 'numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]


def test_the_command_waits_for_no_library_that_it_does_not_need() -> None:
    heavy = (
        "ezdxf", "matplotlib", "networkx", "sympy", "timm", "torch._dynamo", "torchvision",
        "trimesh",
    )  # fmt: skip
    code = f"""
import sys
import panoscene.cli._reconstruct
import panoscene.cli._results
from panoscene.pipeline import load_stages, load_steps
for step in load_steps(load_stages()):
    step()
print(*sorted(set(sys.modules) & {set(heavy)!r}))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_a_stage_is_made_at_its_first_use_and_once() -> None:
    made: list[int] = []

    def make() -> object:
        made.append(1)
        return torch.add

    stage = AtFirstUse(make)  # ty: ignore[invalid-argument-type]
    assert made == []
    assert [int(stage(torch.tensor(1), 2)), int(stage(torch.tensor(1), 3))] == [3, 4]
    assert made == [1]


def test_threads_that_need_a_stage_wait_for_each_other() -> None:
    made: list[int] = []
    begun, go = Event(), Event()

    def make() -> object:
        begun.set()
        go.wait(10)
        made.append(1)
        return torch.add

    stage = AtFirstUse(make)  # ty: ignore[invalid-argument-type]
    with ThreadPoolExecutor(2) as pool:
        first = pool.submit(stage.ready)
        assert begun.wait(10)
        second = pool.submit(stage.ready)
        assert not second.done()
        go.set()
        assert first.result(10) is second.result(10)
    assert made == [1]


def test_steps_load_all_stages_in_the_order_of_their_use() -> None:
    stages = load_stages()
    steps = load_steps(stages)
    assert [getattr(step, "__self__", None) for step in steps] == [
        stages.leveller, stages.detector, stages.layout, stages.context, stages.shape
    ]  # fmt: skip
    lean = load_stages(shapes=False, context=False, level=False)
    assert [getattr(step, "__self__", None) for step in load_steps(lean)] == [
        lean.detector, lean.layout, lean.pose
    ]  # fmt: skip
    assert load_steps(Stages(torch.add, torch.add, torch.add)) == []  # ty: ignore[invalid-argument-type]


def test_weights_of_ones_own_are_checked_at_once(tmp_path: Path) -> None:
    with pytest.raises(CheckpointError, match=r"detector\.safetensors"):
        load(weights=tmp_path)
    assert isinstance(load(), Pipeline)
