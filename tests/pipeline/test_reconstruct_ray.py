"""panoscene reconstruct --ray: two nodes on this computer, with stages that know the truth."""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import torch
from PIL import Image as Pillow

from panoscene.cli import main
from panoscene.cli._reconstruct import Choice, Task, reconstruct_files, reconstruct_there
from panoscene.pipeline import Pipeline, Stages
from panoscene.sample import sample_photo_path, sample_room_path
from panoscene.scene import read_scene

pytestmark = [
    # ray leaves sockets and log files of its processes to the interpreter
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::FutureWarning"),
]
CHOICE = Choice(1.6, 64, True)


def knowing_maker(notes: Path) -> Callable[[], Pipeline]:
    """Return what makes a pipeline that finds the sample room, and notes where it was made."""

    def make() -> Pipeline:
        import ray  # noqa: PLC0415

        from panoscene.models.layout import LayoutPrediction  # noqa: PLC0415
        from panoscene.scene import Detections  # noqa: PLC0415

        context = ray.get_runtime_context()
        (notes / f"{context.get_node_id()}-{context.get_worker_id()}").touch()
        truth = read_scene(sample_room_path())
        seen = truth.objects
        found = Detections(seen.bfov, seen.category, seen.score)

        def layout(image: Any, *, camera_height: float | None = None) -> LayoutPrediction:
            import time  # noqa: PLC0415

            time.sleep(0.5)  # so that the second node gets its share
            return LayoutPrediction(truth.layout, False, torch.zeros(2, 1024), torch.zeros(1024))

        stages = Stages(
            lambda image: found, layout, lambda image, detections, layout, camera_height: seen
        )
        return Pipeline(stages, settings=None)

    return make


@pytest.fixture
def photos(tmp_path: Path) -> list[Path]:
    folder = tmp_path / "photos"
    folder.mkdir()
    with Pillow.open(sample_photo_path()) as picture:
        small = picture.resize((128, 64))
    files = [folder / f"photo{k}.jpg" for k in range(4)]
    for file in files:
        small.save(file)
    files[2].write_bytes(b"none")
    return files


@pytest.mark.slow
def test_two_nodes_share_the_photos_and_one_that_fails_is_told(
    cluster: Any, photos: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    notes = tmp_path / "notes"
    notes.mkdir()
    output, make = tmp_path / "rooms", knowing_maker(notes)
    code = reconstruct_files(make, photos, output, CHOICE, as_json=True, ray=cluster.address)
    out, err = capsys.readouterr()
    told = json.loads(out)
    assert code == 2
    assert [entry["ok"] for entry in told] == [True, True, False, True]
    assert [entry["photo"] for entry in told] == [str(photo) for photo in photos]
    assert f"error: {photos[2]}" in err
    assert len({file.name.split("-")[0] for file in notes.iterdir()}) == 2
    assert read_scene(output / "photo3" / "scene.json").name == "photo3"
    # the same again: only what is missing
    assert reconstruct_files(make, photos, output, CHOICE, as_json=True, ray=cluster.address) == 2
    told = json.loads(capsys.readouterr().out)
    assert [entry.get("new") for entry in told] == [False, False, None, False]


def test_folders_that_are_not_shared_are_noticed(tmp_path: Path) -> None:
    task = Task(tmp_path / "absent.jpg", tmp_path / "room", CHOICE)
    entry = reconstruct_there("run", knowing_maker(tmp_path), task).entry
    assert not entry["ok"]
    assert "expected a shared folder" in entry["error"]


def test_a_missing_package_is_named(
    photos: list[Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    code = main(["reconstruct", str(photos[0]), "-o", str(tmp_path / "room"), "--ray"])
    assert code == 2
    assert "pip install 'panoscene[ray]'" in capsys.readouterr().err
    assert not (tmp_path / "room").exists()
