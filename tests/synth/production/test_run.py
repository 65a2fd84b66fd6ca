"""What a run of rendering keeps, tells and leaves behind; homes are copies of a sample."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from panoscene.synth.assets import AssetError, add_models
from panoscene.synth.dataset import DatasetError, Recipe, read_index
from panoscene.synth.models import make_model
from panoscene.synth.production import (
    Models,
    RenderProgress,
    RenderTask,
    begin_run,
    follow,
    render_dataset,
)
from panoscene.synth.production import _photographs as photographs_module
from panoscene.synth.production import _run as run_module
from panoscene.synth.render import Renderer

Copy = Callable[[RenderTask], None]


@pytest.fixture
def copying(monkeypatch: pytest.MonkeyPatch, copy_sample: Copy) -> None:
    """Let homes be copied instead of rendered."""
    monkeypatch.setattr(run_module, "render_home", copy_sample)


@pytest.mark.usefixtures("copying")
def test_all_homes_are_made_and_told(tmp_path: Path, recipe: Recipe, cache: Path) -> None:
    told: list[RenderProgress] = []
    done = render_dataset(tmp_path / "set", recipe, cache, processes=1, told=told.append)
    assert [progress.done for progress in told] == [2, 4, 6, 8]
    assert (done.done, done.wanted, done.made, done.failed) == (8, 8, 8, ())
    assert done.seconds_left == 0
    index = read_index(tmp_path / "set")
    assert len(index.panoramas) == 8
    assert {split: len(names) for split, names in index.split_names.items()} == {
        "train": 4, "val": 2, "test-seen": 2,
    }  # fmt: skip
    assert (tmp_path / "set" / "README.md").is_file()
    assert (tmp_path / "set" / "ATTRIBUTION").is_file()


@pytest.mark.usefixtures("copying")
def test_a_limit_may_be_raised_later(tmp_path: Path, recipe: Recipe, cache: Path) -> None:
    root = tmp_path / "set"
    first = render_dataset(root, recipe, cache, processes=1, limit=3)
    assert (first.done, first.wanted) == (3, 3)
    before = {path.name: path.stat().st_mtime_ns for path in (root / "panoramas").iterdir()}
    same = render_dataset(root, recipe, cache, processes=1, limit=3)
    assert (same.done, same.made, same.seconds_left) == (3, 0, None)
    rest = render_dataset(root, recipe, cache, processes=1)
    assert (rest.done, rest.made) == (8, 5)
    after = {path.name: path.stat().st_mtime_ns for path in (root / "panoramas").iterdir()}
    assert before.items() <= after.items()


@pytest.mark.usefixtures("copying")
def test_a_home_that_fails_does_not_stop_the_others(
    tmp_path: Path, recipe: Recipe, cache: Path
) -> None:
    root = tmp_path / "set"
    (root / "broken" / "home0001").mkdir(parents=True)
    done = render_dataset(root, recipe, cache, processes=1)
    assert done.done == 6
    assert done.failed == (("home0001", "home0001: found no room for 2 cameras"),)
    (root / "broken" / "home0001").rmdir()
    assert render_dataset(root, recipe, cache, processes=1).done == 8


def test_an_interrupted_run_leaves_a_whole_index(
    tmp_path: Path, recipe: Recipe, cache: Path, copy_sample: Copy
) -> None:
    root = tmp_path / "set"
    tasks, progress = begin_run(root, recipe, cache, limit=None, extra=None, threads=1)
    assert [len(task.job.cameras) for task in tasks] == [2, 2, 2, 2]

    def stopped() -> Iterator[tuple[RenderTask, str | None]]:
        copy_sample(tasks[0])
        yield tasks[0], None
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        follow(root, stopped(), progress, None)
    assert [entry.name for entry in read_index(root).panoramas] == ["home0000-0", "home0000-1"]
    left, progress = begin_run(root, recipe, cache, limit=None, extra=None, threads=1)
    assert [task.job.home for task in left] == ["home0001", "home0002", "home0003"]
    assert (progress.done, progress.wanted) == (2, 8)


def test_a_killed_run_is_listed_by_the_next_one(
    tmp_path: Path, recipe: Recipe, cache: Path, copy_sample: Copy, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = tmp_path / "set"
    tasks, progress = begin_run(root, recipe, cache, limit=None, extra=None, threads=1)
    copy_sample(tasks[0])  # and the process is gone
    assert read_index(root).panoramas == ()

    def listed() -> list[str]:
        return sorted({entry.home for entry in read_index(root).panoramas})

    def finishing() -> Iterator[tuple[RenderTask, str | None]]:
        assert listed() == ["home0000"]
        copy_sample(tasks[1])
        yield tasks[1], None
        assert listed() == ["home0000", "home0001"]

    monkeypatch.setattr(run_module, "_LISTED_EVERY", 1)
    follow(root, finishing(), progress, None)


def test_another_recipe_or_no_models_are_refused(
    tmp_path: Path, recipe: Recipe, cache: Path
) -> None:
    begin_run(tmp_path / "set", recipe, cache, limit=None, extra=None, threads=1)
    other = recipe.model_copy(update={"seed": 1})
    with pytest.raises(DatasetError, match="another recipe"):
        begin_run(tmp_path / "set", other, cache, limit=None, extra=None, threads=1)
    with pytest.raises(AssetError):
        begin_run(tmp_path / "new", recipe, tmp_path / "none", limit=None, extra=None, threads=1)
    assert not (tmp_path / "new").exists()


def test_furniture_has_textures_of_the_size_that_the_recipe_wants(
    tmp_path: Path, recipe: Recipe, monkeypatch: pytest.MonkeyPatch
) -> None:
    add_models(tmp_path / "cache", [make_model("cushion", 0, 0)])
    found: list[int] = []

    def furnished(seed: int, models: Models, *_: object, texture_size: int, **__: object) -> None:
        textures = [material.texture for material in models["parametric/cushion/0"].materials]
        edges = {picture.shape[0] for picture in textures if picture is not None}
        assert edges == {texture_size}
        found.append(texture_size)
        raise ValueError("enough")

    monkeypatch.setattr(photographs_module, "furnished_home", furnished)
    blind = Renderer.__new__(Renderer)  # needs no engine
    monkeypatch.setattr(run_module, "_renderer", lambda _: blind)
    for size in (64, 128):
        wanted = recipe.model_copy(update={"furniture_texture": size})
        done = render_dataset(tmp_path / str(size), wanted, tmp_path / "cache", processes=1)
        assert done.failed[0] == ("home0000", "enough")
    assert found == [64] * 4 + [128] * 4


def test_time_left_follows_this_run() -> None:
    assert RenderProgress(10, 20, 0.0, 0).seconds_left is None
    assert RenderProgress(15, 20, 50.0, 5).seconds_left == pytest.approx(50.0)
