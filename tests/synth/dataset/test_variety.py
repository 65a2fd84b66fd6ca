"""Homes differ in every statistic, and a set whose homes do not is caught."""

import shutil
from pathlib import Path

import pytest

from panoscene.synth.dataset import check_dataset, dataset_statistics, open_dataset
from panoscene.synth.dataset._variety import variety_problems

SAMPLES = Path(__file__).parents[3] / "samples" / "synth"
NOT_OF_HOMES = {"panoramas", "planned", "homes", "splits", "homes_in_splits",
                "bases_only_in_test_unseen", "relations"}  # fmt: skip
RELATIONS = {"touching", "touching_wall", "on_floor", "inside_room", "relative_yaw_deg_share"}


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    return Path(shutil.copytree(SAMPLES, tmp_path / "set"))


def test_homes_of_the_samples_differ_in_every_statistic():
    assert variety_problems(open_dataset(SAMPLES)) == []


def test_every_statistic_of_equal_homes_is_named(copied: Path):
    first, *others = open_dataset(copied)
    for item in others:
        for name in ("scene.json", "labels.json"):
            shutil.copy(first.folder / name, item.folder / name)
    problems = variety_problems(open_dataset(copied))
    assert {problem.split(" is the same in all 10 homes")[0] for problem in problems} == (
        dataset_statistics(copied).keys() - NOT_OF_HOMES | RELATIONS
    )
    found = check_dataset(copied, names=[first.name])
    assert found["variety"] == len(problems)


def test_cameras_may_stand_alike_when_the_recipe_wants_it(copied: Path):
    first, *others = open_dataset(copied)
    for item in others:
        shutil.copy(first.folder / "scene.json", item.folder / "scene.json")
    path = copied / "dataset.json"
    text = path.read_text()
    fixed = text.replace('"varied_cameras": 0.5', '"varied_cameras": 0.0')
    assert fixed != text
    path.write_text(fixed)
    told = {problem.split()[0] for problem in variety_problems(open_dataset(copied))}
    assert "room_area" in told
    assert not told & {"camera_height", "tilt_deg"}


def test_few_homes_and_damaged_files_are_not_judged(copied: Path):
    item = open_dataset(copied)[0]
    (item.folder / "scene.json").write_text("{")
    assert variety_problems(open_dataset(copied)) == []
    assert check_dataset(copied, names=[item.name])["variety"] == 0
