"""panoscene reconstruct: what it writes, what it refuses, and how it goes on."""

import errno
import io
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import torch
from PIL import Image as Pillow

from panoscene import pipeline as pipeline_package
from panoscene.cli import _reconstruct_command as command_module
from panoscene.cli import main
from panoscene.models import shipped_weights
from panoscene.pipeline import Pipeline
from panoscene.sample import sample_photo_path
from panoscene.scene import Scene, read_scene

from .conftest import Knowing

FILES = {
    "scene.json",
    "scene.glb",
    "report.html",
    "overlay.png",
    "birds-eye.png",
    "render.png",
    "view.png",
    "floorplan.svg",
    "reconstruction.json",
}

Run = Callable[..., tuple[int, str, str]]


def put_in_place_of_networks(knowing: Knowing, patch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Let stages that know the truth be loaded; gives the options of the load."""
    options: dict[str, Any] = {}

    def load(edition: str, **others: Any) -> Pipeline:
        options.update(others, edition=edition)
        return Pipeline(knowing.stages(shape=None), settings=others["settings"])

    patch.setattr(pipeline_package, "load", load)
    return options


@pytest.fixture
def loaded(knowing: Knowing, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Put stages that know the truth in the place of networks; gives the options of the load."""
    return put_in_place_of_networks(knowing, monkeypatch)


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Run the command in this process; gives exit code, stdout and stderr."""

    def run_command(*arguments: object) -> tuple[int, str, str]:
        code = main(["reconstruct", *(str(argument) for argument in arguments)])
        out, err = capsys.readouterr()
        return code, out, err

    return run_command


@pytest.fixture
def drawn_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw in this process: another one would load the libraries again."""

    def artist(*_: str, fork: bool) -> ThreadPoolExecutor:
        del fork
        return ThreadPoolExecutor(max_workers=1)

    monkeypatch.setattr(command_module, "artist", artist)


def small_photo(file: Path) -> Path:
    """Write the sample photo, small."""
    with Pillow.open(sample_photo_path()) as picture:
        picture.resize((128, 64)).save(file)
    return file


@pytest.fixture
def photo(tmp_path: Path) -> Path:
    return small_photo(tmp_path / "flat.jpg")


@dataclass(frozen=True)
class Made:
    """What the command made of a photo, and said."""

    photo: Path
    folder: Path
    said: tuple[int, str, str]
    loaded: dict[str, Any]


@pytest.fixture(scope="module")
def made(truth: Scene, tmp_path_factory: pytest.TempPathFactory) -> Made:
    """The results of one photo, not to be changed."""
    folder = tmp_path_factory.mktemp("made")
    photo, room = small_photo(folder / "flat.jpg"), folder / "room"
    out, err = io.StringIO(), io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        options = put_in_place_of_networks(Knowing(truth), patch)
        arguments = ["reconstruct", str(photo), "-o", str(room)]
        code = main([*arguments, "--camera-height", "1.4", "--steps", "0"])
    return Made(photo, room, (code, out.getvalue(), err.getvalue()), options)


def test_one_photo_becomes_a_folder_of_results(made: Made) -> None:
    code, out, err = made.said
    assert code == 0
    assert err == f"{made.photo}: the photo is small: found 128 columns, expected 512 or more\n"
    assert {file.name for file in made.folder.iterdir()} == FILES
    scene = read_scene(made.folder / "scene.json")
    assert scene.name == "flat"
    assert scene.panorama.camera_height == 1.4
    assert scene.panorama.file == "../flat.jpg"
    assert scene.relations is not None
    assert "17 objects: " in out
    assert "1 bed" in out
    assert made.loaded["settings"] is None
    assert made.loaded["level"] is True
    account = json.loads((made.folder / "reconstruction.json").read_text())
    assert set(account["timings"]) == {"upright", "detector", "layout", "pose", "arrangement"}


@pytest.mark.usefixtures("loaded", "drawn_here")
def test_a_bad_photo_does_not_stop_the_others(run: Run, photo: Path, tmp_path: Path) -> None:
    (tmp_path / "photos").mkdir()
    shutil.copy(photo, tmp_path / "photos" / "good.jpg")
    (tmp_path / "photos" / "cut.jpg").write_bytes(photo.read_bytes()[:500])
    square = tmp_path / "photos" / "square.png"
    Pillow.new("RGB", (64, 64)).save(square)
    code, out, err = run(tmp_path / "photos", "-o", tmp_path / "rooms", "--json", "--steps", 0)
    assert code == 2
    assert err.count("error: ") == 2
    assert f"{square}: found 64 x 64 pixels" in err
    told = {Path(entry["photo"]).stem: entry for entry in json.loads(out)}
    assert [told[name]["ok"] for name in ("cut", "good", "square")] == [False, True, False]
    assert [folder.name for folder in (tmp_path / "rooms").iterdir()] == ["good"]
    assert {file.name for file in (tmp_path / "rooms" / "good").iterdir()} == FILES


def test_what_is_wrong_is_told_before_torch_is_loaded(photo: Path, tmp_path: Path) -> None:
    (tmp_path / "cut.jpg").write_bytes(photo.read_bytes()[:500])
    wrong = (["nowhere.jpg"], [tmp_path / "cut.jpg", "nowhere.jpg"], [photo, "--steps", "-1"])
    given = [["reconstruct", *map(str, words), "-o", str(tmp_path / "room")] for words in wrong]
    code = f"""
import sys
from panoscene.cli import main
for arguments in {given!r}:
    print("ended with", main(arguments), "torch" in sys.modules)
    print("ended", file=sys.stderr)
"""
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.count("ended with 2 False") == 3
    assert [said.count("error: ") for said in done.stderr.split("ended")] == [1, 2, 1, 0]
    assert not (tmp_path / "room").exists()


@pytest.mark.usefixtures("loaded")
def test_resume_leaves_out_what_is_there(
    knowing: Knowing, run: Run, photo: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "room"
    folder.mkdir()
    (folder / "scene.json").write_text("made before")
    assert run(photo, "-o", folder, "--resume")[0] == 0
    assert knowing.asked == []
    assert (folder / "scene.json").read_text() == "made before"


@pytest.mark.usefixtures("loaded", "drawn_here")
def test_results_of_another_photo_do_not_count(made: Made, run: Run, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(made.folder, tmp_path / "room"))
    other = Path(shutil.copy(made.photo, tmp_path / "other.jpg"))
    code, out, _ = run(other, "-o", folder, "--steps", 0, "--resume")
    assert code == 0
    assert "other: a room" in out
    assert json.loads((folder / "reconstruction.json").read_text())["photo"] == "other.jpg"
    assert "nothing was done" in run(other, "-o", folder, "--resume")[1]
    # what says nothing of a photo does not speak against it
    (folder / "reconstruction.json").write_text("[]")
    assert "nothing was done" in run(other, "-o", folder, "--resume")[1]


@pytest.mark.usefixtures("loaded", "drawn_here")
def test_another_photo_of_the_same_name_is_made_anew(made: Made, run: Run, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(made.folder, tmp_path / "room"))
    assert "nothing was done" in run(made.photo, "-o", folder, "--resume")[1]
    other = tmp_path / made.photo.name
    with Pillow.open(made.photo) as picture:
        picture.transpose(Pillow.Transpose.FLIP_LEFT_RIGHT).save(other)
    assert "flat: a room" in run(other, "-o", folder, "--steps", 0, "--resume")[1]
    assert "nothing was done" in run(other, "-o", folder, "--resume")[1]


def failing(
    name: str, folder: Path, patch: pytest.MonkeyPatch, error: BaseException, at: int
) -> list[Path]:
    """Let a method of paths fail at its so-manieth draft in a folder; gives those it was told."""
    drafts: list[Path] = []
    whole = getattr(Path, name)

    def method(path: Path, *arguments: object) -> object:
        if path.suffix == ".part" and path.parent == folder:
            drafts.append(path)
            if len(drafts) == at:
                raise error
        return whole(path, *arguments)

    patch.setattr(Path, name, method)
    return drafts


@pytest.mark.usefixtures("loaded", "drawn_here")
def test_who_is_interrupted_over_older_results_leaves_no_scene(
    made: Made, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = Path(shutil.copytree(made.folder, tmp_path / "room"))
    moved = failing("replace", folder, monkeypatch, KeyboardInterrupt(), 2)
    assert run(made.photo, "-o", folder, "--steps", 0)[0] == 130
    assert len(moved) == 2
    assert {file.name for file in folder.iterdir()} == FILES - {"scene.json"}


@pytest.mark.usefixtures("loaded", "drawn_here")
def test_a_full_disk_leaves_the_older_results(
    made: Made, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = Path(shutil.copytree(made.folder, tmp_path / "room"))
    before = {file.name: file.read_bytes() for file in folder.iterdir()}
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    written = failing("write_bytes", folder, monkeypatch, full, 7)
    code, _, err = run(made.photo, "-o", folder, "--steps", 0)
    assert (code, len(written)) == (2, 7)
    assert err.endswith("cannot be written: no space left on device\n")
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == before


@pytest.mark.usefixtures("loaded", "drawn_here")
def test_a_fault_of_the_program_costs_one_photo(
    knowing: Knowing, run: Run, photo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = Path(shutil.copy(photo, tmp_path / "second.jpg"))
    whole = knowing.layout

    def faulty(*arguments: Any, **options: Any) -> object:
        if len(knowing.asked) == 1:
            knowing.asked.append("fault")
            raise RuntimeError("no layout today")
        return whole(*arguments, **options)

    monkeypatch.setattr(knowing, "layout", faulty)
    code, out, err = run(photo, other, "-o", tmp_path / "rooms", "--steps", 0, "--json")
    assert code == 1
    assert "Traceback" in err
    assert f"error: {photo}: found a fault of panoscene" in err
    assert [entry["ok"] for entry in json.loads(out)] == [False, True]
    assert [folder.name for folder in (tmp_path / "rooms").iterdir()] == ["second"]


def test_an_empty_name_of_a_photo_is_refused(run: Run) -> None:
    code, _, err = run("", "-o", "room")
    assert (code, "PHOTO: found an empty name" in err) == (2, True)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--camera-height", "0"], "--camera-height: found 0"),
        (["--resolution", "100"], "--resolution: found 100, expected 32, 64, 128 or 256"),
        (["--device", "abacus"], "--device: found abacus"),
        (["--device", "meta"], "--device: found meta, which cannot be used"),
        (["--edition", "paper"], "--edition paper: found no --weights, expected a folder"),
        (["--weights", "nowhere"], "--weights nowhere: found no folder there"),
        (["--steps", "-1"], "--steps: found -1"),
    ],
)
@pytest.mark.usefixtures("loaded")
def test_wrong_options_are_refused_before_anything_is_made(
    run: Run,
    photo: Path,
    tmp_path: Path,
    arguments: list[str],
    message: str,
) -> None:
    code, _, err = run(photo, "-o", tmp_path / "room", *arguments)
    assert code == 2
    assert message in err
    assert not (tmp_path / "room").exists()


@pytest.mark.usefixtures("loaded")
def test_outputs_that_cannot_be_are_refused(run: Run, photo: Path, tmp_path: Path) -> None:
    code, _, err = run(photo, "-o", photo)
    assert (code, "found a file, expected a folder" in err) == (2, True)
    other = tmp_path / "other"
    other.mkdir()
    shutil.copy(photo, other / "flat.jpg")
    code, _, err = run(photo, other / "flat.jpg", "-o", tmp_path / "rooms")
    assert (code, "would both go to" in err) == (2, True)
    empty = tmp_path / "empty"
    empty.mkdir()
    code, _, err = run(empty, "-o", tmp_path / "rooms")
    assert (code, "found no photos there" in err) == (2, True)
    assert not (tmp_path / "rooms").exists()


@pytest.mark.usefixtures("loaded")
@pytest.mark.skipif(not Path("/proc/self").exists(), reason="no folder that nobody can write into")
def test_an_output_that_cannot_be_written_is_refused_before_the_work(
    run: Run, photo: Path, knowing: Knowing
) -> None:
    code, _, err = run(photo, "-o", "/proc/nothing/room")
    assert code == 2
    assert "--output /proc/nothing/room: cannot be written" in err
    assert knowing.asked == []


@pytest.mark.usefixtures("drawn_here")
def test_missing_and_damaged_weights_are_refused(run: Run, photo: Path, tmp_path: Path) -> None:
    weights = tmp_path / "weights"
    weights.mkdir()
    code, _, err = run(photo, "-o", tmp_path / "room", "--weights", weights)
    assert code == 2
    assert str(weights / "detector.safetensors") in err
    (weights / "detector.safetensors").write_bytes(b"none")
    code, _, err = run(photo, "-o", tmp_path / "room", "--weights", weights)
    assert code == 2
    assert str(weights / "detector.safetensors") in err
    assert not (tmp_path / "room").exists()


@pytest.mark.parametrize("fault", ["missing", "cut off", "of zeros"])
def test_bad_weights_are_told_before_libraries_are_loaded(
    photo: Path, tmp_path: Path, fault: str
) -> None:
    weights = tmp_path / "weights"
    weights.mkdir()
    for stage in ("detector", "layout", "pose", "shape", "context"):
        shutil.copy(shipped_weights(stage), weights / f"{stage}.safetensors")
    last = weights / "context.safetensors"
    data = last.read_bytes()
    if fault == "missing":
        last.unlink()
    else:
        last.write_bytes(data[:-1] if fault == "cut off" else bytes(len(data)))
    arguments = ["reconstruct", str(photo), "-o", str(tmp_path / "room"), "--weights", str(weights)]
    code = f"""
import sys
from panoscene.cli import main
assert main({arguments!r}) == 2
assert "torch" not in sys.modules
"""
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stderr.startswith(f"error: {last}: found ")
    assert done.stderr.endswith("expected a .safetensors file with weights of panoscene\n")
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "room").exists()


def test_the_sample_photo_becomes_a_room(run: Run, tmp_path: Path) -> None:
    threads = torch.get_num_threads()
    code, out, _ = run(sample_photo_path(), "-o", tmp_path / "room", "--json")
    torch.set_num_threads(threads)
    assert code == 0
    [told] = json.loads(out)
    assert told["objects"] >= 3
    assert told["corners"] >= 4
    assert {file.name for file in (tmp_path / "room").iterdir()} == FILES


def test_photos_in_which_nothing_is_found_become_empty_rooms(run: Run, tmp_path: Path) -> None:
    threads = torch.get_num_threads()
    plain, tiny = tmp_path / "plain.png", tmp_path / "tiny.png"
    Pillow.new("RGB", (512, 256), (128, 128, 128)).save(plain)
    with Pillow.open(sample_photo_path()) as picture:
        picture.resize((64, 32)).save(tiny)
    code, out, err = run(plain, tiny, "-o", tmp_path / "rooms", "--json")
    torch.set_num_threads(threads)
    assert code == 0, err
    for told in json.loads(out):
        assert {file.name for file in Path(told["output"]).iterdir()} == FILES
    [empty, _] = json.loads(out)
    assert empty["objects"] == 0
    assert "nothing_found" in {flag["code"] for flag in empty["flags"]}
