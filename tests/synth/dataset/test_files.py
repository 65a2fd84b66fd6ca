"""Folders on disk: whole or not there, resumed, read back."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from panoscene.scene import Scene
from panoscene.synth.dataset import (
    DatasetError,
    FileChoice,
    HomesOfSplits,
    Recipe,
    begin_dataset,
    finish_index,
    label_panorama,
    next_jobs,
    open_dataset,
    read_index,
    write_panorama,
)


@pytest.fixture(scope="module")
def small(photograph, taken):
    camera = replace(taken.rendered.camera, width=256, height=128)
    rendered = photograph(taken.scene, camera)
    return label_panorama(taken.scene, rendered, name="home0000-0", home="home0000", seed=1)


def recipe_of(homes: int = 2, cameras: int = 2) -> Recipe:
    counts = {"train": homes, "val": 0, "test-seen": 0, "test-unseen": 0}
    return Recipe(homes=HomesOfSplits.model_validate(counts), cameras=cameras)


def test_everything_is_read_back(small, tmp_path: Path):
    begin_dataset(tmp_path, recipe_of())
    write_panorama(small, tmp_path, split="train", files=FileChoice(jpeg_quality=None))
    finish_index(tmp_path)
    dataset = open_dataset(tmp_path)
    assert len(dataset) == 1
    item = dataset[0]
    rendered = small.rendered
    np.testing.assert_array_equal(item.image().permute(1, 2, 0) * 255, rendered.rgb)
    np.testing.assert_allclose(item.distance(), rendered.distance, atol=5.1e-4)
    np.testing.assert_array_equal(item.instance(), rendered.instance)
    np.testing.assert_array_equal(item.semantic(), small.semantic)
    scene = item.scene()
    assert scene.panorama.file == "rgb.png"
    assert torch.equal(scene.objects.boxes.centre, small.scene.objects.boxes.centre)
    assert scene.relations is not None
    assert torch.equal(scene.relations.touching, small.scene.relations.touching)
    labels = item.labels()
    assert labels.split == "train"
    assert labels.objects == small.labels.objects
    assert set(labels.files) == {
        "rgb.png", "scene.json", "distance.png", "instance.png", "semantic.png",
    }  # fmt: skip


def test_normals_and_albedo_are_there_when_asked_for(small, tmp_path: Path):
    folder = write_panorama(small, tmp_path, files=FileChoice(normals=True, albedo=True))
    assert {"normal.png", "albedo.jpg"} <= {path.name for path in folder.iterdir()}


def test_label_hashes_do_not_depend_on_the_picture_format(small, tmp_path: Path):
    hashes = set()
    for quality in (None, 80):
        folder = write_panorama(small, tmp_path, files=FileChoice(jpeg_quality=quality))
        hashes.add(json.loads((folder / "labels.json").read_text())["label_hash"])
    assert len(hashes) == 1


def test_the_hook_gets_the_meshes_and_its_files_are_hashed(small, tmp_path: Path):
    seen: list[Scene] = []

    def write_glb(scene: Scene, folder: Path) -> None:
        seen.append(scene)
        (folder / "scene.glb").write_bytes(b"glTF")

    folder = write_panorama(small, tmp_path, extra=write_glb)
    assert len(seen[0].objects.shapes.mesh) == len(small.scene.objects.category)
    assert "scene.glb" in json.loads((folder / "labels.json").read_text())["files"]


def test_a_failure_leaves_nothing_and_an_older_folder_stays(small, tmp_path: Path):
    def fails(scene: Scene, folder: Path) -> None:
        raise RuntimeError("disk full")

    with pytest.raises(RuntimeError, match="disk full"):
        write_panorama(small, tmp_path, extra=fails)
    assert list((tmp_path / "panoramas").iterdir()) == []
    folder = write_panorama(small, tmp_path)
    before = (folder / "labels.json").read_bytes()
    with pytest.raises(RuntimeError, match="disk full"):
        write_panorama(small, tmp_path, extra=fails)
    assert (folder / "labels.json").read_bytes() == before
    write_panorama(small, tmp_path)
    assert [path.name for path in (tmp_path / "panoramas").iterdir()] == ["home0000-0"]


def test_a_killed_run_goes_on_where_it_was(small, tmp_path: Path):
    begin_dataset(tmp_path, recipe_of())
    assert sum(len(job.cameras) for job in next_jobs(tmp_path)) == 4
    write_panorama(small, tmp_path)
    half = tmp_path / "panoramas" / ".part-home0000-1-0a"
    half.mkdir()
    (half / "rgb.jpg").write_bytes(b"")
    begin_dataset(tmp_path, recipe_of())
    assert not half.exists()
    left = next_jobs(tmp_path)
    assert [[c.name for c in job.cameras] for job in left] == [
        ["home0000-1"], ["home0001-0", "home0001-1"],
    ]  # fmt: skip
    assert [c.name for job in next_jobs(tmp_path, limit=2) for c in job.cameras] == ["home0000-1"]
    assert next_jobs(tmp_path, limit=1) == ()


def test_a_set_goes_on_with_the_models_that_it_was_begun_with(tmp_path: Path):
    begun = begin_dataset(tmp_path, recipe_of(), unseen_bases=["b", "a", "b"])
    assert begun.unseen_bases == ("a", "b")
    assert begin_dataset(tmp_path, recipe_of(), unseen_bases=("a", "b")) == begun
    assert begin_dataset(tmp_path, recipe_of()) == begun
    for others in ((), ("a", "c")):
        with pytest.raises(DatasetError, match="other models"):
            begin_dataset(tmp_path, recipe_of(), unseen_bases=others)


def test_another_recipe_needs_another_folder(tmp_path: Path):
    begin_dataset(tmp_path, recipe_of())
    with pytest.raises(DatasetError, match="another recipe"):
        begin_dataset(tmp_path, recipe_of(homes=3))
    other = tmp_path / "other"
    (other / "panoramas").mkdir(parents=True)
    with pytest.raises(DatasetError, match="empty folder"):
        begin_dataset(other, recipe_of())


def test_a_set_of_other_homes_is_not_continued(tmp_path: Path):
    index = begin_dataset(tmp_path, recipe_of())
    assert index.homes_version > 1
    file = tmp_path / "dataset.json"
    begun = f'"homes_version": {index.homes_version}'
    text = file.read_text()
    assert begun in text
    file.write_text(text.replace(begun, '"homes_version": 1'))
    with pytest.raises(DatasetError, match="homes of version 1"):
        begin_dataset(tmp_path, recipe_of())
    file.write_text(text.replace(f"{begun},", ""))  # as sets were written before
    assert read_index(tmp_path).homes_version == 1


def test_the_split_is_frozen(small_set: Path):
    index = read_index(small_set)
    assert {entry.home: entry.split for entry in index.homes} == {
        entry.home: entry.split for entry in index.panoramas
    }
    assert sorted(index.split_names) == ["test-seen", "test-unseen", "train", "val"]
    assert finish_index(small_set) == index
    for split, names in index.split_names.items():
        assert [item.name for item in open_dataset(small_set, split)] == list(names)


def test_the_makers_are_named(small_set: Path):
    assert "A. Maker" in (small_set / "ATTRIBUTION").read_text()


def test_missing_and_damaged_files_are_named(small_set: Path, tmp_path: Path):
    with pytest.raises(DatasetError, match=r"dataset\.json"):
        open_dataset(tmp_path)
    with pytest.raises(ValueError, match="training"):
        open_dataset(small_set, "training")
    copy = tmp_path / "copy"
    shutil.copytree(small_set, copy)
    item = open_dataset(copy)[0]
    (item.folder / "distance.png").write_bytes(b"no picture")
    with pytest.raises(DatasetError, match=r"distance\.png"):
        item.distance()
    (item.folder / "labels.json").write_text("{}")
    with pytest.raises(DatasetError, match=r"labels\.json"):
        item.labels()
    shutil.rmtree(item.folder)
    with pytest.raises(DatasetError, match=item.name):
        open_dataset(copy)
    (copy / "dataset.json").write_text("{")
    with pytest.raises(DatasetError, match=r"dataset\.json"):
        open_dataset(copy)


def test_names_cannot_leave_the_folder(small):
    with pytest.raises(ValueError, match="name"):
        small.labels.__class__.model_validate(
            small.labels.model_dump(by_alias=True) | {"name": "../x"}
        )
