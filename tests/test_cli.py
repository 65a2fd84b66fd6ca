"""The commands: what they print and write, how they end, and what they say about bad input."""

import inspect
import json
import os
import stat
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import networkx
import numpy as np
import pytest
import torch
from PIL import Image

from panoscene import __version__
from panoscene.arrange import PRESETS
from panoscene.cli import COMMANDS, main
from panoscene.cli import _arrange as arrange_module
from panoscene.cli import _demo as demo_module
from panoscene.cli import _measure as measure_module
from panoscene.scene import SceneFormatError, read_box_table, read_scene, scene_json_schema
from panoscene.views import DemoResult

ROOM: dict[str, Any] = json.loads(Path(__file__).with_name("bedroom.json").read_text())
TABLE = (
    "category,x,y,z,width,depth,height,yaw_deg\n"
    "bed,0,1,0.3,1.6,2,0.6,180\n"
    "chair,1,-1,0.45,0.5,0.5,0.9,90\n"
)
SQUARE = "-2,-2 2,-2 2,2 -2,2"

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Run a command in this process; gives exit code, stdout and stderr."""

    def run_command(*arguments: object) -> tuple[int, str, str]:
        try:
            code = main([str(argument) for argument in arguments])
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 0
        out, err = capsys.readouterr()
        return code, out, err

    return run_command


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a scene, a table and a panorama, where the commands run."""
    monkeypatch.chdir(tmp_path)
    Path("room.json").write_text(json.dumps(ROOM))
    Path("boxes.csv").write_text(TABLE)
    panorama().save("photo.png")
    return tmp_path


def panorama() -> Image.Image:
    """Return a panorama that is black but for a red spot a quarter turn to the left."""
    image = np.zeros((64, 128, 3), np.uint8)
    image[28:36, 28:36] = (255, 0, 0)
    return Image.fromarray(image)


def pixels(path: str) -> np.ndarray:
    """Return a picture as rows, columns and RGB."""
    with Image.open(path) as picture:
        return np.asarray(picture.convert("RGB"))


def changed(**fields: Any) -> str:
    return json.dumps({**ROOM, **fields})


def files_in(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


# the program


def test_overview_teaches(run: Run) -> None:
    code, out, _ = run("--help")
    assert code == 0
    assert all(name.split()[0] in out for name in COMMANDS)
    assert out.count("    panoscene ") >= 2


def test_version(run: Run) -> None:
    assert run("--version") == (0, f"panoscene {__version__}\n", "")


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["repair"],
        ["arrange", "room.json"],
        ["arrange", "room.json", "-o", "out", "--preset", "best"],
        ["arrange", "room.json", "-o", "out", "--steps", "many"],
        ["bench", "relations"],
        ["eval"],
        ["eval", "scores"],
        ["eval", "score", "--jsn"],
        ["schema", "--jsn"],
    ],
)
def test_usage_errors(run: Run, arguments: list[str]) -> None:
    code, out, err = run(*arguments)
    assert code == 2
    assert out == ""
    assert err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["experiment", "arrange", "--scenes", "many"], "--scenes: found 'many', expected a whole"),
        (["demo", "--seed", "1.5"], "--seed: found '1.5', expected a whole number"),
        (["view", "room.json", "--port", "http"], "--port: found 'http', expected a whole number"),
        (["relations", "room.json", "--threshold", "x"], "--threshold: found 'x', expected a"),
        (["convert", "a.csv", "-o", "b.json", "--ceiling", "2,6"], "--ceiling: found '2,6', exp"),
        (["arrange", "room.json", "-o", ""], "--output: found an empty name, expected that of"),
        (["draw", "room.json", "-o", "x", "--port", "abc"], "Unrecognized options: --port, abc"),
    ],
)
def test_wrong_types_get_few_words(run: Run, arguments: list[str], message: str) -> None:
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert len(err.splitlines()) <= 14
    assert "class" not in err
    assert "None" not in err


def test_help_is_wrapped_and_has_no_python(run: Run) -> None:
    for name in COMMANDS:
        _, out, _ = run(*name.split(), "--help")
        # tyro keeps the usage on one line
        lines = [line for line in out.splitlines() if not line.startswith("usage: ")]
        assert max(map(len, lines)) <= 100
        assert "Args:" not in out
        assert "None" not in out
        assert "::" not in out


def test_presets_of_the_option_are_those_of_the_library() -> None:
    (literal,) = [p.annotation for p in _parameters("arrange") if p.name == "preset"]
    assert set(literal.__args__) == set(PRESETS)


def _parameters(command: str) -> Any:
    return inspect.signature(COMMANDS[command]).parameters.values()


def test_help_loads_nothing_heavy() -> None:
    heavy = ("torch", "numpy", "matplotlib", "pydantic", "shapely", "networkx")
    code = f"""
import sys
from panoscene.cli import main
for arguments in (["--help"], ["arrange", "--help"], ["convert"]):
    try:
        main(arguments)
    except SystemExit:
        pass
assert not set(sys.modules) & {set(heavy)!r}
"""
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


@pytest.mark.parametrize(
    "arguments",
    [
        ["arrange", "gone.json", "-o", "o"],
        ["relations", "gone.json"],
        ["convert", "gone.json", "-o", "o.glb"],
        ["draw", "gone.json", "-o", "o"],
        ["draw", "room.json", "-o", "o", "--truth", "gone.json"],
        ["view", "gone.json"],
    ],
)
def test_missing_scenes_are_told_before_libraries_are_loaded(
    folder: Path, arguments: list[str]
) -> None:
    code = f"""
import sys
from panoscene.cli import main
assert main({arguments!r}) == 2
assert not set(sys.modules) & {{"torch", "numpy", "matplotlib"}}
"""
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    with pytest.raises(SceneFormatError) as error:
        read_scene(Path("gone.json"))
    assert (done.stdout, done.stderr) == ("", f"error: {error.value}\n")


def test_missing_scenes_are_told_as_json_too(folder: Path, run: Run) -> None:
    code, out, err = run("arrange", "gone.json", "away.json", "-o", "o", "--json")
    entries = json.loads(out)
    assert (code, err.count("found nothing")) == (2, 2)
    assert [(entry["scene"], entry["ok"]) for entry in entries] == [
        ("gone.json", False),
        ("away.json", False),
    ]
    assert all("found nothing" in entry["error"] for entry in entries)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_unwritable_output_ends_without_a_traceback() -> None:
    program = Path(sys.executable).parent / "panoscene"
    reading, writing = os.pipe()
    os.close(reading)
    full = os.open("/dev/full", os.O_WRONLY)
    for device, code, message in (
        (writing, 141, b""),
        (full, 2, b"error: no space left on device\n"),
    ):
        result = subprocess.run(
            [program, "--help"], check=False, stdout=device, stderr=subprocess.PIPE
        )
        os.close(device)
        assert (result.returncode, result.stderr) == (code, message)


def test_names_cannot_control_the_terminal(folder: Path, run: Run) -> None:
    # the one-byte form of the escape that starts a colour; scene files refuse the other one
    box = ROOM["objects"][0]["box"]
    Path("red.json").write_text(changed(objects=[{"id": "\x9b31m", "category": "bed", "box": box}]))
    assert "\\x9b31m rests on the floor\n" in run("relations", "red.json")[1]
    assert run("relations", "\x1b[31m.json")[2].startswith("error: \\x1b[31m.json: ")


def test_interrupt_is_quiet(folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(arrange_module, "read_scene", interrupted)
    assert run("arrange", "room.json", "-o", "out") == (130, "", "")


def test_faults_of_the_program_keep_their_traceback(
    folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def faulty(*_: object) -> None:
        raise ValueError("a bug")

    monkeypatch.setattr(arrange_module, "read_scene", faulty)
    with pytest.raises(ValueError, match="a bug"):
        run("arrange", "room.json", "-o", "out")


# arrange


def test_arrange_one_file(folder: Path, run: Run) -> None:
    code, out, err = run("arrange", "room.json", "-o", "fixed.json")
    assert (code, err) == (0, "")
    assert "room.json" in out
    assert "1 → 0" in out
    assert out.endswith("wrote fixed.json\n")
    before, after = read_scene("room.json"), read_scene("fixed.json")
    assert not torch.equal(before.objects.boxes.centre, after.objects.boxes.centre)
    certificate = json.loads(Path("fixed.certificate.json").read_text())
    assert certificate["schema"] == "panoscene/certificate"
    assert certificate["before"]["colliding_pairs"] == 1
    assert certificate["after"]["colliding_pairs"] == 0
    assert files_in(folder) == {
        *("room.json", "boxes.csv", "photo.png"),
        *("fixed.json", "fixed.certificate.json"),
    }


def test_arrange_draws_before_and_after(folder: Path, run: Run) -> None:
    assert run("arrange", "room.json", "-o", "out", "--picture")[0] == 0
    assert files_in(folder / "out") == {
        "room.json",
        "room.certificate.json",
        "room.before-after.png",
    }
    assert pixels("out/room.before-after.png").shape[1] > 1000


def test_arrange_takes_files_folders_and_patterns(folder: Path, run: Run) -> None:
    for name in ("many/a.json", "many/b.json", "many/b.certificate.json", "more/deep/c.json"):
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_text(json.dumps(ROOM))
    code, out, _ = run("arrange", "room.json", "many", "more/**/*.json", "many/a.json", "-o", "o")
    assert code == 0
    assert {name for name in files_in(folder / "o") if "certificate" not in name} == {
        *("room.json", "a.json", "b.json", "c.json")
    }
    assert "sum or" in out
    assert "4 → 0" in out
    assert "wrote o: 4 of 4" in out


@pytest.mark.parametrize("output", [".", "room.json"])
def test_arrange_does_not_write_a_scene_onto_itself(folder: Path, run: Run, output: str) -> None:
    before = Path("room.json").read_bytes()
    code, _, err = run("arrange", "room.json", "-o", output)
    assert code == 2
    assert f"--output {output}: found the place of room.json itself" in err
    assert Path("room.json").read_bytes() == before


def test_arrange_goes_on_after_a_bad_file(folder: Path, run: Run) -> None:
    Path("bad.json").write_text('{"schema": "panoscene/scene"')
    code, out, err = run("arrange", "bad.json", "room.json", "gone.json", "-o", "out", "--json")
    assert code == 2
    assert [line.split(":")[0:2] for line in err.splitlines()] == [
        ["error", " bad.json"],
        ["error", " gone.json"],
    ]
    bad, good, gone = json.loads(out)
    assert (bad["scene"], bad["ok"], gone["ok"]) == ("bad.json", False, False)
    assert "truncated" in bad["error"]
    assert (good["ok"], good["output"]) == (True, str(Path("out/room.json")))
    assert good["certificate"]["after"]["energy"] < good["certificate"]["before"]["energy"]
    assert files_in(folder / "out") == {"room.json", "room.certificate.json"}


def test_arrange_isolates_a_scene_that_cannot_be_arranged(
    folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("other.json").write_text(changed(name="impossible"))
    solve = arrange_module.arrange_scenes

    def picky(scenes: Any, settings: Any) -> Any:
        if any(scene.name == "impossible" for scene in scenes):
            raise ValueError("scene 0: cannot be arranged")
        return solve(scenes, settings)

    monkeypatch.setattr(arrange_module, "arrange_scenes", picky)
    code, out, err = run("arrange", "other.json", "room.json", "-o", "out")
    assert code == 2
    assert err == "error: other.json: scene 0: cannot be arranged\n"
    assert "wrote out: 1 of 2" in out
    assert files_in(folder / "out") == {"room.json", "room.certificate.json"}


def test_arrange_solves_in_batches_that_fit_in_memory(folder: Path) -> None:
    scene = read_scene("room.json")
    repeated = scene.objects.boxes[torch.zeros(200, dtype=torch.int64)]
    large = replace(scene, objects=replace(scene.objects, boxes=repeated))
    mixed = [(Path(str(k)), large if k % 10 == 0 else scene) for k in range(64)]
    batches = list(arrange_module.batches(mixed))
    assert sorted(str(file) for batch in batches for file, _ in batch) == sorted(
        map(str, range(64))
    )
    assert [len(batch) for batch in batches] == [57, 2, 2, 2, 1]


def test_arrange_keeps_the_photo_within_reach(folder: Path, run: Run) -> None:
    run("arrange", "room.json", "-o", "out/fixed.json", "--steps", "0")
    assert read_scene("out/fixed.json").panorama.file == "../photo.jpg"


def test_arrange_takes_settings(folder: Path, run: Run) -> None:
    Path("mine.json").write_text('{"weights": {"touching": 0.5}, "steps": 3}')
    code, out, _ = run(
        *("arrange", "room.json", "-o", "out", "--preset", "paper", "--settings", "mine.json"),
        *("--steps", "2", "--json"),
    )
    (result,) = json.loads(out)
    assert code == 0
    assert (result["certificate"]["preset"], result["certificate"]["steps"]) == ("mine", 2)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ('{"weights": {"touchng": 1}}', "weights.touchng: there is no such setting; did you mean"),
        ('{"steps": -1}', "steps: found -1"),
        ('{"clearance": NaN}', "found NaN"),
        ("[1]", "found a list"),
        ("{", "not JSON"),
    ],
)
def test_arrange_refuses_settings(folder: Path, run: Run, settings: str, message: str) -> None:
    Path("mine.json").write_text(settings)
    code, out, err = run("arrange", "room.json", "-o", "out", "--settings", "mine.json")
    assert (code, out) == (2, "")
    assert err.startswith("error: mine.json: ")
    assert message in err
    assert not Path("out").exists()


BAD_SCENES = {
    "malformed": ('{"schema": ', "truncated"),
    "not JSON": ("hello", "expected JSON"),
    "empty": ("", "nothing in it"),
    "NaN": (
        changed(layout={"floor_polygon": [[0, 0], [1, 0], [float("nan"), 1]]}),
        "floor_polygon",
    ),
    "version": (changed(version=99), "version"),
    "schema": (changed(schema="other"), "schema"),
    "self-intersecting": (
        changed(layout={"floor_polygon": [[-2, -2], [2, 2], [2, -2], [-2, 2]]}),
        "floor_polygon",
    ),
    "negative size": (
        changed(objects=[{"category": "bed", "box": {"centre": [0, 0, 0], "size": [1, -1, 1]}}]),
        "size",
    ),
}


@pytest.mark.parametrize("kind", BAD_SCENES)
@pytest.mark.parametrize("command", ["arrange", "relations", "convert"])
def test_bad_scenes_are_refused(folder: Path, run: Run, command: str, kind: str) -> None:
    text, message = BAD_SCENES[kind]
    Path("bad.json").write_text(text)
    there = files_in(folder)
    code, out, err = run(command, "bad.json", "-o", "out.json")
    assert (code, out) == (2, "")
    assert err.startswith("error: bad.json: ")
    assert message in err
    assert "Traceback" not in err
    assert files_in(folder) == there


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("arrange", "-o", "o"), "SCENE: found nothing"),
        (("arrange", "gone.json", "-o", "o"), "gone.json: the path: found nothing"),
        (("arrange", "empty", "-o", "o"), "empty: found no scene files"),
        (("arrange", "*.jsn", "-o", "o"), "*.jsn: found no scene files"),
        (("arrange", "room.json", "twice", "-o", "o.json"), "one file for 2 scenes"),
        (("arrange", "room.json", "twice", "-o", "o"), "would both become"),
        (("arrange", "room.json", "-o", "boxes.csv"), "boxes.csv: found a file"),
        (
            ("arrange", "room.json", "-o", "boxes.csv/x"),
            "--output boxes.csv/x: cannot be written: not a directory",
        ),
        (("arrange", "room.json", "-o", "o", "--steps", "-1"), "--steps: found -1"),
        (("arrange", "room.json", "-o", "o", "--settings", "no.json"), "no.json: no such file"),
        (("relations", "gone.json"), "gone.json: the path: found nothing"),
        (("relations", "empty"), "empty: the path: found a directory"),
        (("relations", "room.json", "--threshold", "0"), "--threshold: "),
        (("relations", "room.json", "--threshold", "nan"), "--threshold: "),
        (("relations", "room.json", "--keep"), "room.json: found no relations to keep"),
        (("relations", "room.json", "-o", "o.csv"), "found the name of a table"),
        (("convert", "gone.csv", "-o", "o.json", "--room", SQUARE), "gone.csv: the path: found"),
        (("convert", "gone.png", "-o", "o", "--cube"), "gone.png: no such file"),
        (("convert", "room.txt", "-o", "o.json"), "no such conversion"),
        (("convert", "room.json", "-o", "o.xyz"), "boxes.csv --room"),
        (("convert", "room.json", "-o", "o.png"), "no such conversion (scene to picture)"),
        (("convert", "room.json", "-o", "o.json", "--ceiling", "3"), "--ceiling with a scene"),
        (("convert", "room.json", "-o", "o.json", "--cube"), "--cube with a scene"),
        (("convert", "boxes.csv", "-o", "o.json"), "without a floor plan"),
        (("convert", "boxes.csv", "-o", "o.json", "--room", "0,0 1,1"), "found 2 corners"),
        (("convert", "boxes.csv", "-o", "o.json", "--room", "0,0 1;1"), "--room: found '1'"),
        (("convert", "boxes.csv", "-o", "o.json", "--room", "0,0 1,1 1,0 0,1"), "simple polygon"),
        (("convert", "boxes.csv", "-o", "o.json", "--room", "0,0 1,nan 1,0"), "--room: found"),
        (
            ("convert", "boxes.csv", "-o", "o.json", "--room", SQUARE, "--ceiling", "-1"),
            "--ceiling: found -1",
        ),
        (
            ("convert", "boxes.csv", "-o", "o.json", "--room", SQUARE, "--camera-height", "nan"),
            "--camera-height: found nan",
        ),
        (("convert", "photo.png", "-o", "o"), "found none of --cube"),
        (("convert", "photo.png", "-o", "o", "--cube", "--yaw-deg", "3"), "found several"),
        (("convert", "photo.png", "-o", "o.png", "--cube"), "found the name of a picture"),
        (("convert", "photo.png", "-o", "o", "--view", "0,0,60"), "found the name of a folder"),
        (("convert", "photo.png", "-o", "o.png", "--view", "0,0"), "--view: found '0,0'"),
        (("convert", "photo.png", "-o", "o.png", "--view", "0,99,60"), "LAT from -90 to 90"),
        (("convert", "photo.png", "-o", "o.png", "--view", "0,0,180"), "FOV from 1 to 150"),
        (("convert", "photo.png", "-o", "o.png", "--yaw-deg", "inf"), "--yaw-deg: found inf"),
        (
            ("convert", "photo.png", "-o", "o.png", "--yaw-deg", "3", "--size", "9"),
            "--size: found 9",
        ),
        (("convert", "photo.png", "-o", "o", "--cube", "--size", "0"), "--size: found 0"),
        (("convert", "photo.png", "-o", "o", "--cube", "--name", "x"), "--name with a picture"),
        (("bench", "arrange", "--repeats", "0"), "--repeats: found 0"),
        (("experiment", "arrange", "--scenes", "0"), "--scenes: found 0"),
        (("experiment", "arrange", "--seed", "-1"), "--seed: found -1"),
        (("experiment", "arrange", "-o", "room.json"), "room.json: found a file"),
        (("demo", "--seed", "-1"), "--seed: found -1"),
        (("arrange", "", "-o", "there"), "SCENE: found an empty name"),
        (("demo", "-o", "room.json"), "room.json: found a file"),
    ],
)
def test_bad_arguments_get_one_message(
    folder: Path, run: Run, arguments: tuple[str, ...], message: str
) -> None:
    Path("empty").mkdir()
    Path("twice").mkdir()
    Path("twice/room.json").write_text(json.dumps(ROOM))
    there = files_in(folder)
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert err.startswith("error: ")
    assert err.count("error:") == 1
    assert message in err
    assert files_in(folder) == there


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_permission_is_reported(folder: Path, run: Run) -> None:
    Path("locked").mkdir(mode=stat.S_IRUSR | stat.S_IXUSR)
    code, _, err = run("arrange", "room.json", "-o", "locked/o.json")
    assert code == 2
    assert "permission denied" in err


# relations


def test_relations_are_sentences(folder: Path, run: Run) -> None:
    code, out, err = run("relations", "room.json")
    assert code == 0
    lines = out.splitlines()
    assert lines[0] == "bed touches chair"
    assert {"bed touches wall-2", "chair rests on the floor", "lamp touches wall-1"} < set(lines)
    assert not [line for line in lines if "faces" in line or "farther" in line]
    assert "shown with --all" in err


def test_all_relations_say_what_faces_what(folder: Path, run: Run) -> None:
    _, out, err = run("relations", "room.json", "--all")
    # walls: south, east, north, west; the bed looks south, the chair north, the lamp west
    assert {
        "bed faces wall-0",
        "bed turns its back to wall-2",
        "chair faces wall-2",
        "chair turns its right side to wall-1",
        "chair turns its left side to wall-3",
        "lamp turns its back to wall-1",
        "bed faces the opposite way to chair",
        "lamp faces 90 degrees to the left of where chair faces",
        "lamp is farther from the camera than chair",
    } <= set(out.splitlines())
    assert err == ""


def test_relations_as_json(folder: Path, run: Run) -> None:
    code, out, err = run("relations", "room.json", "--json")
    graph = json.loads(out)
    assert (code, err) == (0, "")
    edges = {(edge["source"], edge["relation"], edge["target"]) for edge in graph["edges"]}
    assert {("bed", "touching", "chair"), ("lamp", "on_floor", "floor")} < edges


def test_relations_are_written_by_the_name_of_the_file(folder: Path, run: Run) -> None:
    for name in ("o.graphml", "sub/o.relations.json", "sub/o.json"):
        code, out, err = run("relations", "room.json", "-o", name)
        assert (code, out) == (0, "")
        assert err.startswith(f"wrote {name}: ")
    graph = networkx.read_graphml("o.graphml")
    document = json.loads(Path("sub/o.relations.json").read_text())
    assert graph.number_of_edges() == len(document["edges"]) > 10
    scene = read_scene("sub/o.json")
    assert scene.relations is not None
    assert scene.panorama.file == "../photo.jpg"


def test_relations_of_the_file_are_kept(folder: Path, run: Run) -> None:
    Path("room.json").write_text(changed(relations={"touching": {"bed": {"lamp": 0.6}}}))
    assert run("relations", "room.json", "--keep")[1] == "bed touches lamp (0.60)\n"
    assert run("relations", "room.json", "--keep", "--threshold", "0.7")[1] == ""
    assert "bed touches lamp" not in run("relations", "room.json")[1]


# convert


def test_table_to_scene_and_back(folder: Path, run: Run) -> None:
    clockwise = "-2,2 2,2 2,-2 -2,-2"
    options = ("--ceiling", "3", "--camera-height", "1.7")
    assert run("convert", "boxes.csv", "-o", "new.json", "--room", clockwise, *options)[0] == 0
    scene = read_scene("new.json")
    assert (scene.name, scene.layout.ceiling_height, scene.panorama.camera_height) == (
        *("boxes", 3.0, 1.7),
    )
    assert scene.relations is not None
    assert run("convert", "new.json", "-o", "back.csv")[0] == 0
    again, first = read_box_table("back.csv").boxes, read_box_table("boxes.csv").boxes
    assert torch.equal(again.centre, first.centre)
    assert torch.equal(again.size, first.size)


def test_table_to_graph(folder: Path, run: Run) -> None:
    assert run("convert", "boxes.csv", "-o", "o.graphml", "--room", SQUARE)[0] == 0
    assert "bed-0" in networkx.read_graphml("o.graphml")


def test_bad_table_names_line_and_column(folder: Path, run: Run) -> None:
    Path("boxes.csv").write_text(TABLE.replace("0.45", "nan"))
    code, out, err = run("convert", "boxes.csv", "-o", "o.json", "--room", SQUARE)
    assert (code, out) == (2, "")
    assert "boxes.csv: line 3, column z" in err
    assert not Path("o.json").exists()


def test_scene_is_normalised_and_renamed(folder: Path, run: Run) -> None:
    assert run("convert", "room.json", "-o", "o.json", "--name", "new name")[0] == 0
    assert read_scene("o.json").name == "new name"
    assert read_scene("o.json").relations is None
    text = Path("o.json").read_text()
    assert run("convert", "o.json", "-o", "o.json")[0] == 0
    assert Path("o.json").read_text() == text


def test_scene_to_graph_derives_relations(folder: Path, run: Run) -> None:
    assert run("convert", "room.json", "-o", "o.relations.json")[0] == 0
    assert json.loads(Path("o.relations.json").read_text())["edges"]


def spot(path: str) -> tuple[float, float]:
    """Return where the red spot is, from 0 to 1 to the right and down."""
    red = pixels(path).astype(float)[..., 0] / 255
    rows, columns = np.indices(red.shape)
    total = red.sum()
    return (
        float((red * (columns + 0.5)).sum() / total / red.shape[1]),
        float((red * (rows + 0.5)).sum() / total / red.shape[0]),
    )


def test_panorama_to_cube(folder: Path, run: Run) -> None:
    assert run("convert", "photo.png", "-o", "faces", "--cube", "--size", "20")[0] == 0
    assert files_in(folder / "faces") == {
        *("front.png", "right.png", "back.png", "left.png", "up.png", "down.png")
    }
    assert pixels("faces/left.png").shape == (20, 20, 3)
    assert spot("faces/left.png") == pytest.approx((0.5, 0.5), abs=0.02)
    assert pixels("faces/right.png").max() == 0


def test_panorama_to_view(folder: Path, run: Run) -> None:
    assert run("convert", "photo.png", "-o", "view.png", "--view", "-90,0,90")[0] == 0
    # as sharp as the panorama: 128 pixels around, 2 tan(45 degrees) * 128 / (2 pi)
    assert pixels("view.png").shape == (41, 41, 3)
    assert spot("view.png") == pytest.approx((0.5, 0.5), abs=0.02)
    assert run("convert", "photo.png", "-o", "view.png", "--view", "-100,10,90")[0] == 0
    right, down = spot("view.png")
    assert right > 0.55
    assert down > 0.55


@pytest.mark.parametrize("name", ["turned.png", "turned.jpg", "turned.webp", "turned.tif"])
def test_panorama_is_turned(folder: Path, run: Run, name: str) -> None:
    # turned to the left, the camera looks at what was on the left
    assert run("convert", "photo.png", "-o", name, "--yaw-deg", "90")[0] == 0
    assert pixels(name).shape == (64, 128, 3)
    assert spot(name) == pytest.approx((0.5, 0.5), abs=0.02)


def test_a_picture_that_is_no_panorama_is_refused(folder: Path, run: Run) -> None:
    Image.new("RGB", (100, 100)).save("square.png")
    Path("broken.jpg").write_bytes(b"\xff\xd8\xff\xe0 no more")
    for name in ("square.png", "broken.jpg"):
        code, out, err = run("convert", name, "-o", "o.png", "--view", "0,0,60")
        assert (code, out) == (2, "")
        assert err.startswith(f"error: {name}: ")
        assert not Path("o.png").exists()


# schema, demo, bench, experiment


def test_schema(run: Run) -> None:
    code, out, _ = run("schema")
    assert code == 0
    assert json.loads(out) == json.loads(json.dumps(scene_json_schema()))


def test_demo(folder: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def quick(output: Path, seed: int) -> DemoResult:
        return DemoResult(
            before=output / "b.json",
            after=output / "a.json",
            certificate=output / "c.json",
            before_picture=output / "b.png",
            after_picture=output / "a.png",
            comparison=output / "c.png",
            sheet=output / "s.png",
            report=output / "r.html",
            objects=17,
            seed=seed,
            mean_iou_before=0.2,
            mean_iou_after=0.6,
            colliding_pairs_before=3,
            colliding_pairs_after=0,
            worst_penetration_before=0.29,
            worst_penetration_after=0.004,
            out_of_room_volume_before=1.6,
            out_of_room_volume_after=0.04,
        )

    monkeypatch.setattr(demo_module, "run_demo", quick)
    code, out, err = run("demo", "-o", "there", "--seed", "5")
    assert (code, err) == (0, "")
    assert "17 objects, disturbed with seed 5" in out
    assert all(str(Path("there") / name) in out for name in ("b.png", "s.png", "r.html"))
    assert "0.200" in out
    assert json.loads(run("demo", "--json")[1])["before"] == str(Path("demo/b.json"))


def test_bench(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def quick(*, repeats: int, progress: Callable[[str], None]) -> dict[str, object]:
        progress("measuring")
        return {"scene_20_ms": 7.25 * repeats, "unmeasured": float("nan")}

    monkeypatch.setattr(measure_module, "run_arrange_benchmark", quick)
    code, out, err = run("bench", "arrange", "--json", "--repeats", "2")
    assert (code, err) == (0, "measuring\n")
    assert json.loads(out) == {"scene_20_ms": 14.5, "unmeasured": None}
    assert "14.5" in run("bench", "arrange", "--repeats", "2")[1]


def test_experiment(folder: Path, run: Run) -> None:
    arguments = ("experiment", "arrange", "--scenes", "1", "--seed", "3")
    code, out, err = run(*arguments, "--json", "-o", "results")
    assert code == 0
    rows = json.loads(out)["rows"]
    assert len(rows) > 3
    assert "wrote results" in err
    assert json.loads(Path("results/arrange.json").read_text())["rows"] == rows
    table = Path("results/arrange.md").read_text()
    assert len(table.splitlines()) == len(rows) + 2


def test_installed_command_repairs(folder: Path) -> None:
    program = Path(sys.executable).parent / "panoscene"
    result = subprocess.run(
        [program, "arrange", "room.json", "-o", "out", "--json"],
        check=True,
        capture_output=True,
        text=True,
    )
    assert json.loads(result.stdout)[0]["ok"]
    assert result.stderr == ""
