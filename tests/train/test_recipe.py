"""Recipes: the shipped ones are valid, and mistakes are named."""

from collections.abc import Callable
from pathlib import Path

import pytest
from pydantic import BaseModel

from panoscene.train import STAGES, TrainError, TrainRecipe, options_of, read_train_recipe

MINIMAL = "stage: pose\nedition: compact\nsteps: 10\nbatch_size: 2\nlearning_rate: 0.1\n"


def test_every_stage_has_a_recipe_of_both_editions(shipped: list[Path]) -> None:
    found = {(path.parent.name, read_train_recipe(path).stage) for path in shipped}
    assert found >= {(edition, stage) for edition in ("compact", "paper") for stage in STAGES}


def test_shipped_recipes_are_valid(shipped: list[Path]) -> None:
    for path in shipped:
        recipe = read_train_recipe(path)
        assert recipe.edition == path.parent.name
        assert path.stem.startswith(recipe.stage)
        recipe.stage_options(options_of(recipe.stage))


def test_settings_of_the_command_go_before(tmp_path: Path) -> None:
    file = tmp_path / "r.yaml"
    file.write_text(MINIMAL)
    assert read_train_recipe(file, {"steps": 3}).steps == 3
    assert read_train_recipe(file).steps == 10


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (MINIMAL.replace("pose", "posture"), "stage: Input should be"),
        (MINIMAL + "colour: red\n", "colour: Extra inputs"),
        (MINIMAL + "batch_size: 0\n", "batch_size"),
        (MINIMAL + "accumulate: 3\n", "found 3, expected a divisor of batch_size 2"),
        (MINIMAL + "milestones: [5]\n", "milestones"),
        (MINIMAL + "schedule: steps\nmilestones: [5, 3]\n", "expected rising steps"),
        ("- a\n- b\n", "expected settings by name"),
        ("a: [", "expected YAML"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "r.yaml"
    file.write_text(text)
    with pytest.raises(TrainError, match=message) as error:
        read_train_recipe(file)
    assert str(error.value).startswith(str(file))


def test_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(TrainError, match="No such file"):
        read_train_recipe(tmp_path / "none.yaml")


def test_options_are_the_stage_s_own(tiny_recipe: Callable[..., TrainRecipe]) -> None:
    class Options(BaseModel, extra="forbid"):
        size: int = 3

    assert tiny_recipe(options={"size": 4}).stage_options(Options).size == 4
    with pytest.raises(TrainError, match="options of the layout: sise: Extra inputs"):
        tiny_recipe(options={"sise": 4}).stage_options(Options)


def test_schedules(tiny_recipe: Callable[..., TrainRecipe]) -> None:
    steps = tiny_recipe(
        steps=100, schedule="steps", milestones=[10, 20], learning_rate=1.0, warmup=2, decay=0.1
    )
    rates = [steps.learning_rate_at(step) for step in (0, 1, 2, 9, 10, 19, 20, 99)]
    assert rates == pytest.approx([0.5, 1, 1, 1, 0.1, 0.1, 0.01, 0.01])
    plateau = tiny_recipe(schedule="plateau", learning_rate=1.0, warmup=0, decay=0.5)
    assert plateau.learning_rate_at(3, falls=2) == 0.25
    constant = tiny_recipe(schedule="constant", learning_rate=0.3, warmup=0)
    assert {constant.learning_rate_at(step) for step in range(12)} == {0.3}
    cosine = tiny_recipe(steps=1000, learning_rate=1.0, warmup=10)
    falling = [cosine.learning_rate_at(step) for step in range(10, 1000)]
    assert falling == sorted(falling, reverse=True)
    assert falling[-1] < 1e-4
