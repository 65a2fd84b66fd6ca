"""Commands that show scenes, and convert them for other programs: draw, view, convert, arrange."""

import base64
import http.client
import io
import json
import math
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import trimesh
from ezdxf.filemanagement import readfile
from PIL import Image

from panoscene import views
from panoscene.cli import _draw as draw_module
from panoscene.cli import main
from panoscene.cli._photos import photo_image
from panoscene.scene import read_panorama, read_scene, write_scene

BEDROOM: dict[str, Any] = json.loads(Path(__file__).with_name("bedroom.json").read_text())
ROOM = BEDROOM | {
    "panorama": {"width": 128, "height": 64},
    "objects": BEDROOM["objects"][:2],
}
"""A bed and a chair, without a photo."""
PICTURES = {"birds-eye.png", "overlay.png", "render.png", "view.png", "sheet.png", "report.html"}

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Run a command in this process; gives exit code, stdout and stderr."""

    def run_command(*arguments: object) -> tuple[int, str, str]:
        code = main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        return code, out, err

    return run_command


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a scene and a panorama, where the commands run."""
    monkeypatch.chdir(tmp_path)
    Path("room.json").write_text(json.dumps(ROOM))
    photograph("photo.png")
    return tmp_path


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """Draw next to nothing; gives what the drawing functions were called with."""
    calls: list[dict[str, Any]] = []

    def drawn(place: int) -> Callable[..., None]:
        def draw(*arguments: Any, **options: Any) -> None:
            calls.append(options)
            Path(arguments[place]).write_bytes(b"drawn")

        return draw

    for name, place in {
        **dict.fromkeys(("draw_birds_eye", "draw_overlay", "draw_sheet", "write_image"), 1),
        "write_report": 0,
    }.items():
        monkeypatch.setattr(draw_module, name, drawn(place))
    for name in ("render_panorama", "render_view"):
        monkeypatch.setattr(draw_module, name, lambda *_, **__: torch.zeros(3, 32, 64))
    return calls


def photograph(path: str, spot: tuple[int, int] = (32, 64)) -> None:
    """Write a panorama that is blue but for a red spot around a row and a column."""
    image = np.full((64, 128, 3), (0, 0, 120), np.uint8)
    row, column = spot
    image[row - 4 : row + 4, column - 4 : column + 4] = (255, 0, 0)
    Image.fromarray(image).save(path)


def write_room(path: str, *, panorama: dict[str, Any] | None = None, **fields: Any) -> None:
    place = Path(path)
    place.parent.mkdir(parents=True, exist_ok=True)
    changed = {**ROOM, "panorama": ROOM["panorama"] | (panorama or {}), **fields}
    place.write_text(json.dumps(changed))


def files_in(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def one_error(result: tuple[int, str, str], message: str) -> None:
    code, out, err = result
    assert (code, out) == (2, "")
    assert err.startswith("error: ")
    assert err.count("error:") == 1
    assert message in err


def pictured_in(page: str) -> np.ndarray:
    """Return the panorama that a page carries, as rows, columns and RGB."""
    found = re.search(r"data:image/jpeg;base64,([\w+/=]+)", page)
    assert found
    with Image.open(io.BytesIO(base64.b64decode(found[1]))) as picture:
        return np.asarray(picture.convert("RGB"))


def red_at(picture: np.ndarray) -> tuple[float, float]:
    """Return where the red spot is: lon and lat in degrees."""
    red = np.clip(picture.astype(float)[..., 0] / 255 - 0.3, 0, 1)
    rows, columns = np.indices(red.shape)
    total, (height, width) = red.sum(), red.shape
    lon = 360 * ((red * (columns + 0.5)).sum() / total / width - 0.5)
    return float(lon), float(180 * (0.5 - (red * (rows + 0.5)).sum() / total / height))


# draw


def test_matplotlib_has_nothing_to_say_at_its_first_use(tmp_path: Path) -> None:
    # it cannot keep its cache where a file is in the way, and would remark on that
    (tmp_path / "file").write_text("")
    code = "from panoscene.cli import main; main(['--version']); import matplotlib.font_manager"
    result = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"MPLCONFIGDIR": str(tmp_path / "file" / "folder")},
        check=True,
        capture_output=True,
        text=True,
    )
    assert result.stderr == ""


@pytest.mark.render
def test_draw_fills_a_folder(folder: Path, run: Run) -> None:
    write_room("other.json", name="true room")
    code, out, err = run(
        *("draw", "room.json", "-o", "new/pictures"),
        *("--photo", "photo.png", "--truth", "other.json"),
    )
    assert (code, out) == (0, "")
    assert f"wrote {Path('new/pictures')}" in err
    assert files_in(folder / "new/pictures") == PICTURES
    for name in PICTURES - {"report.html"}:
        with Image.open(Path("new/pictures", name)) as picture:
            picture.load()
            assert picture.width >= 128
    page = Path("new/pictures/report.html").read_text()
    # the photo, not a rendering
    assert red_at(pictured_in(page)) == pytest.approx((0, 0), abs=3)


def test_draw_gives_photo_and_truth_to_the_pictures(
    folder: Path, run: Run, quick: list[dict[str, Any]]
) -> None:
    write_room("true.json", name="true room")
    write_room("named.json", panorama={"file": "photo.png"})
    assert run("draw", "named.json", "-o", "o", "--truth", "true.json")[0] == 0
    names = [call["reference"].name for call in quick if "reference" in call]
    assert names == ["true room"] * 3  # from above, on the panorama, on the sheet
    image, _ = read_panorama("photo.png")
    assert [torch.equal(call["image"], image) for call in quick if "image" in call] == [True] * 2
    assert quick[-1]["image_caption"] == ""
    quick.clear()
    assert run("draw", "room.json", "-o", "o")[0] == 0
    assert quick[-1]["image_caption"] == "Rendered from the boxes."


def test_draw_goes_on_without_the_photo_that_the_scene_names(
    folder: Path, run: Run, quick: list[dict[str, Any]]
) -> None:
    for name in ("gone.png", "x" * 5000, "a\0b", "."):
        write_room("named.json", panorama={"file": name})
        code, _, err = run("draw", "named.json", "-o", "o")
        assert code == 0
        assert err.startswith("named.json: its photo ")
        assert "is left out\n" in err
        assert files_in(folder / "o") == PICTURES


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("room.json", "--photo", "gone.png"), "--photo gone.png: found no file"),
        (("room.json", "--photo", "."), "--photo .: found no file"),
        (("room.json", "--photo", "square.png"), "square.png: found 100 x 100"),
        (("room.json", "--photo", "broken.jpg"), "broken.jpg: the picture is damaged"),
        (("room.json", "--photo", "room.json"), "room.json: not a picture"),
        (("room.json", "--truth", "gone.json"), "gone.json: the path: found nothing"),
        (("room.json", "--truth", "photo.png"), "photo.png: the file: found the byte"),
        (("gone.json",), "gone.json: the path: found nothing"),
        (("broken.json",), "broken.json: "),
    ],
)
def test_draw_refuses_before_it_writes(
    folder: Path, run: Run, arguments: tuple[str, ...], message: str
) -> None:
    Image.new("RGB", (100, 100)).save("square.png")
    Path("broken.jpg").write_bytes(Path("photo.png").read_bytes()[:90])
    write_room("broken.json", objects=[{"category": "bed"}])
    one_error(run("draw", *arguments, "-o", "out"), message)
    assert not Path("out").exists()


def test_draw_refuses_a_file_as_folder(folder: Path, run: Run) -> None:
    one_error(run("draw", "room.json", "-o", "photo.png"), "photo.png: found a file")


@pytest.mark.usefixtures("quick")
def test_draw_leaves_all_pictures_or_none(
    folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def failing(*_: object, **__: object) -> None:
        raise ValueError("the sheet cannot be drawn")

    monkeypatch.setattr(draw_module, "draw_sheet", failing)
    Path("out").mkdir()
    Path("out/render.png").write_bytes(b"of yesterday")
    code, _, err = run("draw", "room.json", "-o", "out")
    assert code == 2
    assert err.endswith("error: room.json: the sheet cannot be drawn\n")
    assert files_in(folder / "out") == {"render.png"}
    assert Path("out/render.png").read_bytes() == b"of yesterday"


@pytest.mark.usefixtures("quick")
def test_draw_says_what_cannot_be_written(folder: Path, run: Run) -> None:
    code, _, err = run("draw", "room.json", "-o", "photo.png/pictures")
    assert code == 2
    assert err.count("error:") == 1
    assert "cannot be written" in err


# photos that are not upright


def tilted() -> torch.Tensor:
    """Return the rotation that makes a photo upright whose camera looked up by 30 degrees."""
    up = math.radians(30)
    return torch.tensor(
        [[1, 0, 0], [0, math.cos(up), -math.sin(up)], [0, math.sin(up), math.cos(up)]],
        dtype=torch.float64,
    )


def test_tilted_photos_are_upright_everywhere(
    folder: Path, run: Run, quick: list[dict[str, Any]]
) -> None:
    # the camera looked up: the horizon ahead is in the photo 30 degrees below its middle
    photograph("tilted.png", spot=(43, 64))
    panorama = {"file": "tilted.png", "upright_from_photo": tilted().tolist()}
    write_room("tilted.json", panorama=panorama)
    assert run("convert", "tilted.json", "-o", "o.html")[0] == 0
    assert run("arrange", "tilted.json", "-o", "out", "--report", "--steps", "0")[0] == 0
    assert run("draw", "tilted.json", "-o", "o")[0] == 0
    for page in ("o.html", "out/tilted.report.html"):
        assert red_at(pictured_in(Path(page).read_text())) == pytest.approx((0, 0), abs=3)
    for call in quick:
        if "image" in call:
            picture = (call["image"] * 255).permute(1, 2, 0).numpy()
            assert red_at(picture) == pytest.approx((0, 0), abs=3)
    # another photo of the same scene is turned too
    scene = read_scene("tilted.json")
    image = photo_image(scene, Path("tilted.json"), Path("tilted.png"))
    assert image is not None
    assert float(image[0, 32, 64]) > 0.9


def test_textures_of_a_model_are_upright(folder: Path, run: Run) -> None:
    photograph("tilted.png", spot=(43, 64))
    panorama = {"file": "tilted.png", "upright_from_photo": tilted().tolist()}
    write_room("tilted.json", panorama=panorama)
    write_room("upright.json", panorama={"file": "photo.png"})
    assert run("convert", "tilted.json", "-o", "tilted.glb")[0] == 0
    assert run("convert", "upright.json", "-o", "upright.glb")[0] == 0
    for name in ("tilted.glb", "upright.glb"):
        # the wall ahead is wall 2; the spot is at the height of the camera, 1.6 of 2.6 m
        wall = texture_of(name, "wall-2")
        rows, columns = np.nonzero(wall[..., 0] > 150)
        assert rows.mean() / wall.shape[0] == pytest.approx(1 - 1.6 / 2.6, abs=0.06)
        assert columns.mean() / wall.shape[1] == pytest.approx(0.5, abs=0.06)
        assert not (texture_of(name, "wall-0")[..., 0] > 150).any()


def texture_of(file: str, node: str) -> np.ndarray:
    scene = trimesh.load_scene(file)
    visual: Any = scene.geometry[scene.graph[node][1]].visual
    return np.asarray(visual.material.baseColorTexture.convert("RGB"))


# convert


def test_scenes_become_models_and_plans(folder: Path, run: Run) -> None:
    for name, word in {
        "o.glb": "model",
        "o.obj": "model",
        "o.svg": "floor plan",
        "o.dxf": "floor plan",
        "o.html": "page",
    }.items():
        code, out, err = run("convert", "room.json", "-o", Path("sub") / name)
        assert (code, out) == (0, "")
        assert err == f"wrote {Path('sub') / name}: {word} of 2 objects\n"
    assert files_in(folder / "sub") == {"o.glb", "o.obj", "o.mtl", "o.svg", "o.dxf", "o.html"}
    assert {"bed", "chair"} < set(trimesh.load_scene("sub/o.glb").geometry)
    assert Path("sub/o.obj").read_text().count("\no ") == 2 + 4 + 2
    assert Path("sub/o.svg").read_text().rstrip().endswith("</svg>")
    assert readfile("sub/o.dxf").audit().has_errors is False
    assert "bedroom" in Path("sub/o.html").read_text()


def test_a_model_becomes_the_same_scene_again(folder: Path, run: Run) -> None:
    assert run("relations", "room.json", "-o", "full.json")[0] == 0
    assert run("convert", "full.json", "-o", "full.glb")[0] == 0
    assert run("convert", "full.glb", "-o", "again.json")[0] == 0
    assert run("convert", "full.json", "-o", "canonical.json")[0] == 0
    assert Path("again.json").read_text() == Path("canonical.json").read_text()
    assert run("convert", "full.glb", "-o", "o.csv")[0] == 0
    assert run("convert", "full.glb", "-o", "o.graphml", "--name", "new")[0] == 0


def test_a_model_in_another_folder_finds_its_photo(folder: Path, run: Run) -> None:
    write_room("rooms/room.json", panorama={"file": "../photo.png"})
    assert run("convert", "rooms/room.json", "-o", "models/deep/room.glb")[0] == 0
    code, _, err = run("convert", "models/deep/room.glb", "-o", "page.html")
    assert (code, err) == (0, "wrote page.html: page of 2 objects\n")
    assert red_at(pictured_in(Path("page.html").read_text())) == pytest.approx((0, 0), abs=3)
    assert run("convert", "models/deep/room.glb", "-o", "o.json")[0] == 0
    assert read_scene("o.json").panorama.file == "photo.png"


def test_an_edited_model_becomes_the_edited_scene(folder: Path, run: Run) -> None:
    assert run("convert", "room.json", "-o", "o.glb")[0] == 0
    data = Path("o.glb").read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20 : 20 + length])
    (chair,) = (node for node in document["nodes"] if node["name"] == "chair")
    chair["translation"] = [1.5, 0.45, 1.5]  # to the right, on the floor, behind the camera
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    head = struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest))
    Path("o.glb").write_bytes(head + struct.pack("<I4s", len(text), b"JSON") + text + rest)
    assert run("convert", "o.glb", "-o", "o.json")[0] == 0
    boxes = read_scene("o.json").objects.boxes
    assert torch.allclose(boxes.centre[1], torch.tensor([1.5, -1.5, 0.45]))
    assert torch.equal(boxes.centre[0], read_scene("room.json").objects.boxes.centre[0])


def test_a_table_becomes_a_model(folder: Path, run: Run) -> None:
    assert run("convert", "room.json", "-o", "boxes.csv")[0] == 0
    floor = "-2,-2 2,-2 2,2 -2,2"
    arguments = ("convert", "boxes.csv", "-o", "o.glb", "--room", floor, "--photo", "photo.png")
    assert run(*arguments)[0] == 0
    assert (texture_of("o.glb", "wall-2")[..., 0] > 150).any()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("room.json", "-o", "o.obj", "--photo", "photo.png"), "--photo: found it with o.obj"),
        (("room.json", "-o", "o.svg", "--photo", "photo.png"), "--photo: found it with o.svg"),
        (("room.json", "-o", "o.json", "--photo", "photo.png"), "--photo: found it with o.json"),
        (
            ("photo.png", "-o", "o.png", "--yaw-deg", "3", "--photo", "photo.png"),
            "--photo: found it with o.png",
        ),
        (("room.json", "-o", "o.glb", "--photo", "gone.png"), "--photo gone.png: found no file"),
        (("room.json", "-o", "o.html", "--photo", "room.json"), "room.json: not a picture"),
        (("room.json", "-o", "o.glb", "--cube"), "--cube with a scene"),
        (("room.json", "-o", "o.gltf"), "no such conversion (scene to file of another kind)"),
        (("photo.png", "-o", "o.glb"), "found none of --cube"),
        (("o.dxf", "-o", "o.json"), "no such conversion (DXF to scene)"),
        (("gone.glb", "-o", "o.json"), "gone.glb: "),
        (("fake.glb", "-o", "o.json"), "fake.glb: "),
        (("fake.glb", "-o", "o.json", "--ceiling", "3"), "--ceiling with a GLB"),
        (("room.json", "-o", "photo.png/o.glb"), "cannot be written"),
        (("room.json", "-o", "folder.obj"), "folder"),
    ],
)
def test_wrong_conversions_get_one_message(
    folder: Path, run: Run, arguments: tuple[str, ...], message: str
) -> None:
    Path("fake.glb").write_bytes(b"glTF, or not")
    Path("folder.obj").mkdir()
    there = files_in(folder)
    one_error(run("convert", *arguments), message)
    assert files_in(folder) == there


# arrange


def test_arrange_writes_reports_and_animations(
    folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    films: list[dict[str, Any]] = []

    def film(scene: Any, path: Path, **options: Any) -> None:
        films.append({"scene": scene, **options})
        path.write_bytes(b"moving")

    monkeypatch.setattr(views, "draw_animation", film)
    options = ("--report", "--animation", "--steps", "3", "--json")
    code, out, err = run("arrange", "room.json", "-o", "out", *options)
    assert (code, err) == (0, "")
    (result,) = json.loads(out)
    assert result["report"] == str(Path("out/room.report.html"))
    assert result["animation"] == str(Path("out/room.repair.webp"))
    assert "picture" not in result
    assert files_in(folder / "out") == {
        *("room.json", "room.certificate.json"),
        *("room.report.html", "room.repair.webp"),
    }
    (call,) = films
    assert (call["settings"].steps, call["title"]) == (3, "bedroom")
    # what moves is the scene as it came
    assert torch.equal(
        call["scene"].objects.boxes.centre, read_scene("room.json").objects.boxes.centre
    )
    page = Path("out/room.report.html").read_text()
    assert "Rendered from the boxes." in page
    assert '"certificate"' in page
    # reports and films are not scenes: the folder can be arranged again
    assert run("arrange", "out", "-o", "again", "--steps", "0")[0] == 0
    assert files_in(folder / "again") == {"room.json", "room.certificate.json"}


@pytest.mark.render
def test_arrange_animates(folder: Path, run: Run) -> None:
    write_room("small.json", objects=ROOM["objects"][1:])  # ty: ignore[invalid-argument-type]
    assert run("arrange", "small.json", "-o", "o.json", "--animation", "--steps", "1")[0] == 0
    with Image.open("o.repair.webp") as film:
        assert getattr(film, "n_frames", 0) >= 1
        film.load()


def test_arrange_goes_on_after_a_bad_photo(folder: Path, run: Run) -> None:
    write_room("a.json", panorama={"file": "room.json"})
    code, out, err = run(
        *("arrange", "a.json", "room.json", "-o", "out"), *("--report", "--steps", "0", "--json")
    )
    bad, good = json.loads(out)
    assert code == 2
    assert (bad["ok"], good["ok"]) == (False, True)
    assert "room.json: not a picture" in err
    assert err.count("error:") == 1
    assert not [name for name in files_in(folder / "out") if name.startswith("a.")]


# what is possible but unlikely


@pytest.mark.parametrize(
    ("fields", "note"),
    [
        (
            {"layout": {"floor_polygon": [[1, 1], [3, 1], [3, 3], [1, 3]]}},
            "the camera, at x = 0 and y = 0, is outside the floor polygon",
        ),
        (
            {"layout": {**ROOM["layout"], "ceiling_height": 1.5}},
            "the ceiling, at 1.5 m, is below the camera at 1.6 m",
        ),
        (
            {"layout": {"floor_polygon": [[-200, -200], [200, -200], [200, 150], [-200, 150]]}},
            "the room measures 400 x 350 m; are these centimetres?",
        ),
    ],
)
@pytest.mark.usefixtures("quick")
def test_unlikely_rooms_get_a_note(
    folder: Path, run: Run, fields: dict[str, Any], note: str
) -> None:
    write_room("odd.json", **fields)
    for arguments in (
        ("relations", "odd.json"),
        ("arrange", "odd.json", "-o", "out", "--steps", "0"),
        ("draw", "odd.json", "-o", "pictures"),
    ):
        code, _, err = run(*arguments)
        assert code == 0
        assert [line for line in err.splitlines() if line.startswith(f"odd.json: {note}")]
        assert err.count("odd.json: ") == 1


@pytest.mark.usefixtures("quick")
def test_likely_rooms_get_none(folder: Path, run: Run) -> None:
    for arguments in (("relations", "room.json", "--json"), ("draw", "room.json", "-o", "o")):
        assert "room.json: " not in run(*arguments)[2]


# view


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--port", "70000"), "--port: found 70000"),
        (("--port", "-1"), "--port: found -1"),
        (("--photo", "gone.png"), "--photo gone.png: found no file"),
        (("--photo", "square.png"), "square.png: found 100 x 100"),
        (("-o", "edited.glb"), "--output edited.glb: found another ending, expected .json"),
        (("-o", "photo.png/edited.json"), "cannot be written"),
        (("--host", "no.such.host.invalid"), "no.such.host.invalid"),
    ],
)
def test_view_checks_its_options(
    folder: Path, run: Run, arguments: tuple[str, ...], message: str
) -> None:
    Image.new("RGB", (100, 100)).save("square.png")
    there = files_in(folder)
    one_error(run("view", "room.json", *arguments), message)
    assert files_in(folder) == there


def test_view_refuses_a_bad_scene(folder: Path, run: Run) -> None:
    one_error(run("view", "gone.json"), "gone.json: the path: found nothing")
    one_error(run("view", "photo.png"), "photo.png: ")


def test_view_refuses_a_taken_port(folder: Path, run: Run) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        one_error(run("view", "room.json", "--port", port), f"found {port} on 127.0.0.1 in use")


def test_view_shows_the_photo_upright_and_saves_its_name(
    folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    served: list[Any] = []

    def interrupted(scene: Any, **options: Any) -> None:
        served.append((scene, options))
        raise KeyboardInterrupt

    monkeypatch.setattr("panoscene.viewer.serve", interrupted)
    photograph("tilted.png", spot=(43, 64))
    scene = read_scene("room.json")
    a, b, c = (tuple(row) for row in tilted().tolist())
    panorama = replace(scene.panorama, file="tilted.png", upright_from_photo=(a, b, c))
    write_scene(replace(scene, panorama=panorama), "tilted.json")
    assert run("view", "tilted.json", "-o", "deep/edited.json", "--port", "0") == (0, "", "")
    ((shown, options),) = served
    assert shown.panorama.file == "../tilted.png"
    assert options["save_to"] == Path("deep/edited.json")
    assert float(options["image"][0, 32, 64]) > 0.9


@pytest.mark.skipif(os.name != "posix", reason="needs signals")
def test_an_interrupt_that_a_library_drops_ends_the_view(
    folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    stopped: list[bool] = []

    class Viewer:
        url = "nowhere"

        def __enter__(self) -> "Viewer":
            return self

        def __exit__(self, *_: object) -> None:
            stopped.append(True)

        def wait(self) -> None:
            raise AssertionError("waits for another Ctrl-C")

    def serve(*_: object, **__: object) -> Viewer:
        with suppress(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(5)
        return Viewer()

    monkeypatch.setattr("panoscene.viewer.serve", serve)
    try:
        assert run("view", "room.json", "--port", "0") == (0, "", "")
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert stopped == [True]


@pytest.mark.skipif(os.name != "posix", reason="needs signals")
def test_view_ends_on_interrupt(folder: Path) -> None:
    program = Path(sys.executable).parent / "panoscene"
    # jobs in the background of a shell ignore Ctrl-C, and so would what they start
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    process = subprocess.Popen(
        [program, "view", "room.json", "--port", "0"], stderr=subprocess.PIPE, text=True
    )
    signal.signal(signal.SIGINT, before)
    # whatever happens, the test does not wait forever
    limit = threading.Timer(120, process.kill)
    limit.start()
    try:
        assert process.stderr is not None
        line = process.stderr.readline()
        found = re.match(r"http://127\.0\.0\.1:(\d+) shows room\.json; press Ctrl-C", line)
        assert found, line
        connection = http.client.HTTPConnection("127.0.0.1", int(found[1]), timeout=60)
        connection.request("GET", "/")
        assert connection.getresponse().status == 200
        connection.close()
        process.send_signal(signal.SIGINT)
        rest = process.stderr.read()
        assert (process.wait(), rest) == (0, "")
    finally:
        limit.cancel()
        process.kill()
        process.communicate()
