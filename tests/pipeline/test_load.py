"""Loading: light to import, each network once and when it is needed."""

import subprocess
import sys
from pathlib import Path

import pytest
import torch

import panoscene
from panoscene.models import CheckpointError
from panoscene.pipeline import Pipeline, load
from panoscene.pipeline._load import AtFirstUse


def test_the_package_loads_pipelines_and_is_light_to_import() -> None:
    assert panoscene.load is load
    with pytest.raises(AttributeError, match="no attribute 'unload'"):
        _ = panoscene.unload  # pyright: ignore[reportAttributeAccessIssue]
    code = "import panoscene, sys; print('torch' in sys.modules, 'numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]


def test_a_stage_is_made_at_its_first_use_and_once() -> None:
    made: list[int] = []

    def make() -> object:
        made.append(1)
        return torch.add

    stage = AtFirstUse(make)  # pyright: ignore[reportArgumentType]
    assert made == []
    assert [int(stage(torch.tensor(1), 2)), int(stage(torch.tensor(1), 3))] == [3, 4]
    assert made == [1]


def test_weights_of_ones_own_are_checked_at_once(tmp_path: Path) -> None:
    with pytest.raises(CheckpointError, match=r"detector\.safetensors"):
        load(weights=tmp_path)
    assert isinstance(load(), Pipeline)
