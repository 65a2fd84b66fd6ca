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
    read_train_recipe,
    recipe_text,
    train,
)
from panoscene.train._devices import chosen_devices


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


@pytest.mark.parametrize(
    ("asked", "gpus", "expected"),
    [
        (("auto", 8, 1), 0, 1),
        (("auto", 8, 1), 8, 8),
        (("auto", 8, 1), 3, 2),  # three do not share eight samples
        (("auto", 6, 1), 16, 6),
        (("auto", 1, 1), 4, 1),
        (("auto", 8, 2), 8, 4),
        ((4, 8, 2), 8, 4),
        ((2, 8, 1), 0, 2),
        ((3, 8, 1), 8, "batch_size: found 8.*3 devices"),
        ((8, 8, 2), 8, "batch_size: found 8.*8 devices times 2 machines"),
        (("auto", 1, 2), 1, "batch_size: found 1.*1 devices times 2 machines"),
        ((4, 8, 1), 2, "devices: found 4, expected at most the 2 GPUs"),
    ],
)
def test_devices_share_a_batch_evenly(
    tiny_recipe: Callable[..., TrainRecipe],
    asked: tuple[int | str, int, int],
    gpus: int,
    expected: int | str,
) -> None:
    """Asked for: devices, samples of a batch, machines."""
    devices, batch, machines = asked
    recipe = tiny_recipe(devices=devices, batch_size=batch, num_nodes=machines, accumulate=1)
    if isinstance(expected, int):
        assert chosen_devices(recipe, gpus, {"TORCHELASTIC_RUN_ID": "a"}) == expected
        return
    with pytest.raises(TrainError, match=expected):
        chosen_devices(recipe, gpus, {"TORCHELASTIC_RUN_ID": "a"})


def test_machines_must_know_of_each_other(tiny_recipe: Callable[..., TrainRecipe]) -> None:
    recipe = tiny_recipe(batch_size=8, num_nodes=2, accumulate=1)
    assert chosen_devices(recipe, 0, {"SLURM_NTASKS": "2"}) == 1
    with pytest.raises(TrainError, match=r"num_nodes: found 2.*torchrun or SLURM"):
        chosen_devices(recipe, 0, {})


def test_the_documented_commands_share_their_batches(root: Path) -> None:
    """Of the section on many GPUs: devices times machines divide the batch of the recipe."""
    text = (root / "docs" / "train.md").read_text()
    part = text.split("## Many GPUs, many machines")[1].split("##")[0].replace("\\\n", " ")
    commands = [line for line in part.splitlines() if "panoscene train" in line]
    assert len(commands) == 2
    for line in commands:
        words = line.split()
        values = {word: words[k + 1] for k, word in enumerate(words[:-1]) if word.startswith("--")}
        recipe = read_train_recipe(root / values["--recipe"])
        devices, machines = int(values["--devices"]), int(values.get("--nodes", 1))
        changes = {"devices": devices, "num_nodes": machines}
        found = chosen_devices(recipe.model_copy(update=changes), devices, {"SLURM_NTASKS": "2"})
        assert found == devices


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
