"""Where a training runs: precision by hardware, several processes, missing packages."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import torch

from panoscene.train import (
    Task,
    TrainError,
    TrainRecipe,
    chosen_precision,
    fast_bfloat16,
    on_device,
    recipe_text,
    train,
)


@pytest.mark.skipif(torch.cuda.is_available(), reason="the GPU decides")
def test_16_bits_only_where_they_are_fast(tmp_path: Path) -> None:
    info = tmp_path / "cpuinfo"
    assert not fast_bfloat16(info)
    info.write_text("flags : fpu avx512f avx512_bf16\n")
    assert not fast_bfloat16(info)
    info.write_text("flags : fpu amx_bf16 avx512_fp16\n")
    assert fast_bfloat16(info)


def test_a_wanted_precision_is_kept() -> None:
    assert chosen_precision("bf16-mixed") == "bf16-mixed"
    assert chosen_precision("auto") in {"32-true", "bf16-mixed"}


def test_without_the_packages_of_training(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    tiny_recipe: Callable[..., TrainRecipe],
    tiny_task: Callable[[TrainRecipe], Task],
) -> None:
    monkeypatch.setitem(sys.modules, "lightning_fabric", None)
    with pytest.raises(TrainError, match=r"lightning_fabric is missing.*panoscene\[train\]"):
        train(tiny_recipe(), tmp_path, tiny_task)


def test_batches_of_any_shape_are_moved() -> None:
    batch = {"a": [torch.zeros(1), "x"], "b": (torch.ones(2), None)}
    moved = on_device(batch, torch.device("meta"))
    assert moved["a"][0].device.type == "meta"
    assert moved["b"][0].device.type == "meta"
    assert (moved["a"][1], moved["b"][1]) == ("x", None)


TWO_PROCESSES = """
import sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from conftest import PlainTask
from panoscene.train import read_train_recipe, train

train(read_train_recipe(sys.argv[2]), Path(sys.argv[3]), PlainTask)
"""


@pytest.mark.slow
@pytest.mark.train
@pytest.mark.skipif(torch.cuda.is_available(), reason="would need two GPUs")
def test_two_processes_train_as_one_does(
    tmp_path: Path,
    tiny_recipe: Callable[..., TrainRecipe],
    plain_task: Callable[[TrainRecipe], Task],
) -> None:
    pytest.importorskip("lightning_fabric")
    recipe = tiny_recipe(precision="32-true", steps=6)
    train(recipe, tmp_path / "one", plain_task)
    script, file = tmp_path / "script.py", tmp_path / "recipe.yaml"
    script.write_text(TWO_PROCESSES)
    file.write_text(recipe_text(recipe.model_copy(update={"devices": 2})))
    folder = str(Path(__file__).parent)
    command = [sys.executable, str(script), folder, str(file), str(tmp_path / "two")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    losses = [
        [json.loads(line).get("loss") for line in (run / "metrics.jsonl").read_text().splitlines()]
        for run in (tmp_path / "one", tmp_path / "two")
    ]
    assert losses[0][:6] == pytest.approx(losses[1][:6], rel=1e-5)
