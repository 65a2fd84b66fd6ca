"""The plan of a set: splits, order and seeds."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from panoscene.synth.dataset import (
    SPLITS,
    DatasetError,
    HomesOfSplits,
    Recipe,
    plan_homes,
    read_recipe,
)
from panoscene.synth.dataset._recipe import panoramas_to_homes


def test_the_full_recipe_is_that_of_the_issue(root):
    recipe = read_recipe(root / "configs" / "synth" / "full.yaml")
    jobs = plan_homes(recipe)
    assert [sum(job.split == split for job in jobs) for split in SPLITS] == [200, 20, 40, 40]
    assert sum(len(job.cameras) for job in jobs) == 1500
    assert sum(job.varied for job in jobs) == 100
    assert all(job.split == "train" for job in jobs if job.varied)


def test_every_recipe_in_the_configs_is_valid(root):
    files = sorted((root / "configs" / "synth").glob("*.yaml"))
    assert files
    for file in files:
        assert plan_homes(read_recipe(file))


@given(st.tuples(*[st.integers(0, 30)] * 4).filter(any))
def test_every_beginning_has_the_splits_in_proportion(counts):
    homes = HomesOfSplits.model_validate(dict(zip(SPLITS, counts, strict=True)))
    jobs = plan_homes(Recipe(homes=homes, cameras=1))
    total = sum(counts)
    assert len(jobs) == total
    for split, count in zip(SPLITS, counts, strict=True):
        taken = 0
        for number, job in enumerate(jobs, start=1):
            taken += job.split == split
            assert abs(taken - count * number / total) < 2
        assert taken == count


def test_seeds_are_distinct_and_do_not_depend_on_the_rest():
    jobs = plan_homes(Recipe(seed=3))
    seeds = [job.seed for job in jobs] + [c.seed for job in jobs for c in job.cameras]
    assert len(set(seeds)) == len(seeds)
    fewer = plan_homes(Recipe(seed=3, cameras=2))
    assert [job.seed for job in fewer] == [job.seed for job in jobs]
    assert fewer[7].cameras == jobs[7].cameras[:2]
    assert plan_homes(Recipe(seed=4))[0].seed != jobs[0].seed


def test_seeds_are_frozen():
    """Another seed for a home would be another home: sets could not be resumed."""
    job = plan_homes(Recipe(seed=0))[0]
    assert (job.home, job.split, job.seed, job.cameras[0].seed) == (
        "home0000", "train", 3964924996, 3141116543,
    )  # fmt: skip


def test_limits_cut_the_last_home():
    jobs = plan_homes(Recipe())
    assert sum(len(job.cameras) for job in panoramas_to_homes(jobs, 403)) == 403
    assert panoramas_to_homes(jobs, 0) == ()
    assert panoramas_to_homes(jobs, None) == jobs


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("cameras: 0", "cameras"),
        ("camera: 5", "camera: Extra"),
        ("furniture_texture: 300", "furniture_texture: Input should be 64, 128, 256"),
        ("homes: {train: 0, val: 0, test-seen: 0, test-unseen: 0}", "found none"),
        ("a: [", "expected YAML"),
        ("- 1", "the file"),
    ],
)
def test_wrong_recipes_say_what_is_wrong(tmp_path: Path, text, message):
    file = tmp_path / "recipe.yaml"
    file.write_text(text)
    with pytest.raises(DatasetError, match=message) as caught:
        read_recipe(file)
    assert str(file) in str(caught.value)


def test_a_missing_recipe_is_named(tmp_path: Path):
    with pytest.raises(DatasetError, match=r"nowhere\.yaml"):
        read_recipe(tmp_path / "nowhere.yaml")
