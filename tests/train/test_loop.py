"""The loop: the same losses for the same seed, also after a kill; and what a run leaves behind."""

import csv
import json
import multiprocessing
import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from safetensors.torch import load_file

from panoscene.models import read_weights, read_weights_header
from panoscene.train import Task, TrainError, TrainRecipe, read_train_recipe, train

pytest.importorskip("lightning_fabric")

pytestmark = pytest.mark.train

Recipes = Callable[..., TrainRecipe]
Build = Callable[[TrainRecipe], Task]


def records(run: Path) -> list[dict]:
    """Return the log without what depends on the clock."""
    lines = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    return [{key: line[key] for key in line if key != "seconds"} for line in lines]


def losses(run: Path) -> list[float]:
    return [line["loss"] for line in records(run) if line["kind"] == "train"]


def test_one_seed_gives_the_same_first_100_losses(
    tmp_path: Path, tiny_recipe: Recipes, tiny_task: Build
) -> None:
    for name, seed, steps in (("one", 0, 100), ("two", 0, 100), ("other", 1, 5)):
        recipe = tiny_recipe(steps=steps, validate_every=100, save_every=100, seed=seed)
        train(recipe, tmp_path / name, tiny_task)
    assert len(losses(tmp_path / "one")) == 100
    assert losses(tmp_path / "one") == losses(tmp_path / "two")
    assert losses(tmp_path / "one")[:5] != losses(tmp_path / "other")
    assert losses(tmp_path / "one")[-1] < 0.7 * losses(tmp_path / "one")[0]


def test_global_random_numbers_go_on_as_before(
    tmp_path: Path, tiny_recipe: Recipes, tiny_task: Build
) -> None:
    before = torch.random.get_rng_state()
    train(tiny_recipe(steps=2), tmp_path / "run", tiny_task)
    assert torch.equal(before, torch.random.get_rng_state())


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
@pytest.mark.parametrize(
    ("killed_after", "optimiser"), [(3, "adamw"), (6, "adamw"), (9, "adamw"), (7, "sgd")]
)
def test_a_killed_training_goes_on_as_if_it_was_not(
    tmp_path: Path, tiny_recipe: Recipes, tiny_task: Build, killed_after: int, optimiser: str
) -> None:
    recipe = tiny_recipe(optimiser=optimiser)

    def kill(done: int, total: int, words: str) -> None:
        del total, words
        if done == killed_after:
            os.kill(os.getpid(), signal.SIGKILL)

    process = multiprocessing.get_context("fork").Process(
        target=train, args=(recipe, tmp_path / "killed", tiny_task, kill)
    )
    process.start()
    process.join(60)
    assert process.exitcode == -signal.SIGKILL
    result = train(recipe, tmp_path / "killed", tiny_task)
    assert train(recipe, tmp_path / "whole", tiny_task) == result
    assert records(tmp_path / "killed") == records(tmp_path / "whole")
    for name in ("last", "best", "weights"):
        one = load_file(tmp_path / "killed" / f"{name}.safetensors")
        other = load_file(tmp_path / "whole" / f"{name}.safetensors")
        assert one.keys() == other.keys()
        assert all(torch.equal(one[key], other[key]) for key in one)
    starts = json.loads((tmp_path / "killed" / "environment.json").read_text())["starts"]
    assert len(starts) == (2 if killed_after > recipe.save_every else 1)
    tables = [(tmp_path / name / "metrics.csv").read_text() for name in ("killed", "whole")]
    steps = [[row["step"] for row in csv.DictReader(table.splitlines())] for table in tables]
    assert steps[0] == steps[1] == ["5", "6", "10", "12"]


def test_samples_from_workers_are_the_same(
    tmp_path: Path, tiny_recipe: Recipes, tiny_task: Build
) -> None:
    for workers in (0, 2):
        train(tiny_recipe(steps=5, workers=workers), tmp_path / str(workers), tiny_task)
    assert losses(tmp_path / "0") == losses(tmp_path / "2")


def test_what_a_run_leaves_behind(tmp_path: Path, tiny_recipe: Recipes, tiny_task: Build) -> None:
    run = tmp_path / "runs" / "a"
    recipe = tiny_recipe()
    result = train(recipe, run, tiny_task)
    assert {path.name for path in run.iterdir()} == {
        "recipe.yaml", "environment.json", "metrics.csv", "metrics.jsonl", "tensorboard",
        "pictures", "last.safetensors", "best.safetensors", "weights.safetensors",
    }  # fmt: skip
    assert [path.name for path in sorted((run / "pictures").iterdir())] == [
        "0000006-grey.png", "0000012-grey.png",
    ]  # fmt: skip
    assert read_train_recipe(run / "recipe.yaml") == recipe
    (start,) = json.loads((run / "environment.json").read_text())["starts"]
    assert start["threads"] == 1
    assert start["precision"] in {"32-true", "bf16-mixed"}
    assert start["packages"]["torch"]
    header = read_weights_header(run / "weights.safetensors")
    assert (header.stage, header.edition, header.config) == ("layout", "compact", {"width": 4})
    assert header.metrics["selection"] == result.best
    assert "absent" not in header.metrics
    task = tiny_task(recipe)
    read_weights(run / "best.safetensors", task.model, stage="layout", edition="compact")
    task.model.eval()
    with torch.no_grad():
        again = task.validate(task.model, None)["selection"]
    assert again == pytest.approx(result.best, rel=1e-5)
    validations = [line for line in records(run) if line["kind"] == "validation"]
    assert [line["step"] for line in validations] == [6, 12]
    assert validations[0]["absent"] is None


def test_parts_of_a_batch_are_averaged(
    tmp_path: Path, tiny_recipe: Recipes, plain_task: Build
) -> None:
    for parts in (1, 2):
        train(tiny_recipe(accumulate=parts), tmp_path / str(parts), plain_task)
    assert losses(tmp_path / "1") == pytest.approx(losses(tmp_path / "2"), rel=1e-5)


def test_frozen_parameters_stay(tmp_path: Path, tiny_recipe: Recipes, tiny_task: Build) -> None:
    train(tiny_recipe(steps=1), tmp_path / "one", tiny_task)
    train(tiny_recipe(steps=8), tmp_path / "many", tiny_task)
    one, many = (load_file(tmp_path / name / "best.safetensors") for name in ("one", "many"))
    assert torch.equal(one["4.bias"], many["4.bias"])
    assert not torch.equal(one["4.weight"], many["4.weight"])


def test_it_stops_when_nothing_gets_better(
    tmp_path: Path, tiny_recipe: Recipes, scored: Callable[[list[float]], Build]
) -> None:
    task = scored([0.1, 0.5, 0.4, 0.5, 0.9])
    recipe = tiny_recipe(validate_every=2, patience=2)
    result = train(recipe, tmp_path, task)
    assert (result.steps, result.best, result.best_step, result.early) == (8, 0.5, 4, True)
    assert train(recipe, tmp_path, task) == result
    assert read_weights_header(tmp_path / "best.safetensors").metrics["step"] == 4


def test_the_learning_rate_falls_on_a_plateau(
    tmp_path: Path, tiny_recipe: Recipes, scored: Callable[[list[float]], Build]
) -> None:
    task = scored([0.5, 0.501, 0.502, 0.9, 0.9, 0.9])
    recipe = tiny_recipe(
        validate_every=2, schedule="plateau", decay=0.5, plateau_patience=1, warmup=0
    )
    train(recipe, tmp_path, task)
    rates = [line["learning_rate"] for line in records(tmp_path) if line["kind"] == "train"]
    assert rates == [0.01] * 6 + [0.005] * 6


def test_another_recipe_needs_another_folder(
    tmp_path: Path, tiny_recipe: Recipes, tiny_task: Build
) -> None:
    train(tiny_recipe(steps=2), tmp_path, tiny_task)
    with pytest.raises(TrainError, match=r"another recipe \(batch_size 4, now 8\)"):
        train(tiny_recipe(steps=2, batch_size=8), tmp_path, tiny_task)
    assert train(tiny_recipe(steps=4, workers=1), tmp_path, tiny_task).steps == 4


def test_another_data_set_needs_another_folder(
    tmp_path: Path, tiny_recipe: Recipes, tiny_task: Build
) -> None:
    for name, index in (("one", "{}"), ("moved", "{}"), ("other", '{"homes": 3}')):
        (tmp_path / name).mkdir()
        (tmp_path / name / "dataset.json").write_text(index)
    run = tmp_path / "run"
    train(tiny_recipe(steps=2, data=tmp_path / "one"), run, tiny_task)
    before = {file: file.read_bytes() for file in run.iterdir() if file.is_file()}
    with pytest.raises(TrainError, match=r"run: found a training on the data set .*one.*other"):
        train(tiny_recipe(steps=4, data=tmp_path / "other"), run, tiny_task)
    assert {file: file.read_bytes() for file in run.iterdir() if file.is_file()} == before
    assert train(tiny_recipe(steps=4, data=tmp_path / "moved"), run, tiny_task).steps == 4


def test_a_damaged_checkpoint_is_named(
    tmp_path: Path, tiny_recipe: Recipes, tiny_task: Build
) -> None:
    train(tiny_recipe(steps=2), tmp_path, tiny_task)
    (tmp_path / "last.safetensors").write_bytes(b"0123456789")
    with pytest.raises(TrainError, match=r"last\.safetensors: cannot be read"):
        train(tiny_recipe(steps=4), tmp_path, tiny_task)


def test_a_loss_that_is_not_finite(
    tmp_path: Path, tiny_recipe: Recipes, broken_task: Build
) -> None:
    with pytest.raises(TrainError, match="step 1: loss, loss_huge, gradient_norm not finite"):
        train(tiny_recipe(), tmp_path, broken_task)


def test_a_validation_without_selection(
    tmp_path: Path, tiny_recipe: Recipes, scored: Callable[[list[float]], Build]
) -> None:
    task = scored([float("nan")])
    with pytest.raises(TrainError, match=r"step 6: .* no finite 'selection'"):
        train(tiny_recipe(), tmp_path, task)
