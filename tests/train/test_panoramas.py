"""How many panoramas a training learns from."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from panoscene.models.detector import CONFIGS
from panoscene.synth.dataset import open_dataset
from panoscene.train import TrainError, TrainRecipe
from panoscene.train._detector import DetectorTask
from panoscene.train._layout import LayoutTask
from panoscene.train._panoramas import training_panoramas
from panoscene.train._pose import PoseTask

SAMPLES = Path(__file__).parents[2] / "samples" / "synth"
TINY = CONFIGS["compact"].model_copy(
    update={"width": 256, "first_row": 32, "rows": 64, "channels": 16, "head_width": 32}
)


def test_the_first_of_the_training_part_in_order(tiny_recipe: Callable[..., TrainRecipe]) -> None:
    names = [item.name for item in open_dataset(SAMPLES, "train")]
    for count in (1, 3, len(names), None):
        found = training_panoramas(SAMPLES, tiny_recipe(panoramas=count))
        assert [item.name for item in found] == names[:count]


def test_more_than_there_are_is_refused(tiny_recipe: Callable[..., TrainRecipe]) -> None:
    with pytest.raises(TrainError, match="found 1000, expected at most the 5 of"):
        training_panoramas(SAMPLES, tiny_recipe(panoramas=1000))


def test_homes_are_whole_but_the_last(
    tmp_path: Path, tiny_recipe: Callable[..., TrainRecipe]
) -> None:
    index = json.loads((SAMPLES / "dataset.json").read_text())
    one = next(entry for entry in index["panoramas"] if entry["split"] == "train")
    index["panoramas"] = [
        one | {"name": f"home{home:04d}-{k}", "home": f"home{home:04d}"}
        for home in range(3)
        for k in range(2)
    ]
    (tmp_path / "dataset.json").write_text(json.dumps(index))
    for entry in index["panoramas"]:
        (tmp_path / "panoramas" / entry["name"]).mkdir(parents=True)
    found = training_panoramas(tmp_path, tiny_recipe(panoramas=3))
    assert [item.name for item in found] == ["home0000-0", "home0000-1", "home0001-0"]


def _recipe(stage: str) -> TrainRecipe:
    settings = {
        "stage": stage, "edition": "compact", "steps": 1, "batch_size": 1, "learning_rate": 0.1,
        "data": SAMPLES, "panoramas": 2,
    }  # fmt: skip
    return TrainRecipe.model_validate(settings)


def test_stages_learn_from_so_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("panoscene.train._detector.CONFIGS", {"compact": TINY})
    detector = DetectorTask(_recipe("detector"), SAMPLES)
    assert set(detector.order) == {0, 1}
    assert len(detector.validation) == 1
    assert LayoutTask(_recipe("layout"), SAMPLES).sample_count() == 2
    pose = PoseTask(_recipe("pose"))
    assert pose.sample_count() == 2
    assert len(pose.validation) == 1
