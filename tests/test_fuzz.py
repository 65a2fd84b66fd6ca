"""300 damaged scene and model files: a valid result or one clear error, and nothing left behind."""

import io
import json
import random
import struct
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import Any

import networkx
import pytest
import torch
from ezdxf.filemanagement import readfile

from panoscene.cli import main
from panoscene.exports import read_glb, write_glb
from panoscene.geometry import OrientedBoxes
from panoscene.scene import (
    Layout,
    Mesh,
    Shapes,
    box_mesh,
    objects_from_boxes,
    read_box_table,
    read_scene,
    scene_from_boxes,
    write_scene,
)

FILES = 150
"""Of each kind."""
JUNK: tuple[Any, ...] = (
    *(None, True, False, "", "x" * 300, "bed", "\0", "\ud800", "\x1b[31m", "é\u202e/..\\"),
    *([], {}, [[]], [None], [1, 2, 3], {"a": {"b": 1}}, "1", "NaN"),
    *(0, -1, 1, 2, 3.5, 1e-300, 1e5, -1e6, 1e308, 2**31, -(2**63), 2**70, 10**400),
    *(float("nan"), float("inf"), -float("inf")),
)
FACTORS = (-1, 0, 1e-6, 1e-3, 0.5, 2, 30, 1e3, 1e5, 1e6)
"""What numbers are multiplied with: the results are often possible, and strange."""
CHECKS: dict[str, Callable[[Path], object]] = {
    "o.json": read_scene,
    "o.csv": read_box_table,
    "o.graphml": networkx.read_graphml,
    "o.relations.json": lambda path: json.loads(path.read_text())["edges"],
    "o.certificate.json": lambda path: json.loads(path.read_text())["after"],
    "o.glb": read_glb,
    "o.obj": lambda path: path.read_text().index("\nf "),
    "o.mtl": lambda path: path.read_text().index("newmtl"),
    "o.svg": lambda path: path.read_text().rindex("</svg>"),
    "o.dxf": readfile,
    "o.html": lambda path: path.read_text().rindex("</html>"),
}
"""How to read each file that a command may leave."""
SCENE_COMMANDS: tuple[tuple[str, ...], ...] = (
    *(("relations",), ("relations", "--all"), ("relations", "--keep", "--json")),
    *(("relations", "-o", "o.relations.json"), ("relations", "-o", "o.json")),
    *(("convert", "-o", name) for name in ("o.json", "o.csv", "o.graphml", "o.obj")),
    *(("convert", "-o", name) for name in ("o.glb", "o.svg", "o.dxf")),
    ("arrange", "-o", "o.json", "--steps", "2"),
)
MODEL_COMMANDS: tuple[tuple[str, ...], ...] = tuple(
    ("convert", "-o", name)
    for name in ("o.json", "o.csv", "o.glb", "o.graphml", "o.relations.json")
)
Ran = tuple[int, str, str]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """A small room with everything that a file can hold, as scene and as model."""
    rows = torch.tensor(
        [
            [0.0, 1.05, 0.3, 1.6, 2.0, 0.6, 3.1],
            [0.9, 0.9, 0.5, 0.5, 0.5, 0.9, 0.0],
            [1.8, -1.8, 0.7, 0.3, 0.3, 1.4, 1.5],
        ]
    )
    boxes = OrientedBoxes(rows[:, :3], rows[:, 3:6], rows[:, 6])
    objects = objects_from_boxes(
        boxes, ["bed", "chair", "floor_lamp"], id=("bed", "chair", "lampé")
    )
    box = box_mesh()
    narrow = Mesh(box.vertices * torch.tensor([0.8, 1.0, 1.0]), box.faces)
    shapes = Shapes(code=torch.rand(3, 4, generator=torch.Generator().manual_seed(0)))
    objects = replace(objects, shapes=replace(shapes, mesh=(None, narrow, None)))
    corners = torch.tensor([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])
    layout = Layout(corners, wall_score=torch.ones(4), raw_polygon=corners * 1.01)
    scene = scene_from_boxes(objects, layout, name="bedroom")
    scene = replace(scene, panorama=replace(scene.panorama, file="photo.jpg"), seed=3)
    folder = tmp_path_factory.mktemp("whole")
    write_scene(scene, folder / "room.json")
    write_glb(scene, folder / "room.glb")
    return {name: (folder / name).read_bytes() for name in ("room.json", "room.glb")}


# damage


def bits_flipped(data: bytes, rng: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(rng.choice([1, 2, 10, 300])):
        changed[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def cut_off(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data))]


def piece_moved(data: bytes, rng: random.Random) -> bytes:
    start, end = sorted(rng.randrange(len(data)) for _ in range(2))
    place = rng.randrange(len(data))
    return data[:place] + data[start : min(end, start + 500)] + data[place:]


def places(document: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Return the path of every value in a JSON document."""
    items: Sequence[tuple[Any, Any]] = ()
    if isinstance(document, dict):
        items = list(document.items())
    elif isinstance(document, list):
        items = list(enumerate(document))
    found = [path] if path else []
    return found + [place for key, value in items for place in places(value, (*path, key))]


def value_changed(document: Any, rng: random.Random) -> Any:
    """Change a value for junk, or a number for a multiple, or leave it out, or double it."""
    *parents, key = rng.choice(places(document))
    parent = document
    for step in parents:
        parent = parent[step]
    value, action = parent[key], rng.randrange(5)
    if action == 0:
        del parent[key]
    elif action == 1 and isinstance(parent, list):
        parent.insert(key, value)
    elif action <= 3 and isinstance(value, int | float) and not isinstance(value, bool):
        parent[key] = value * rng.choice(FACTORS)
    else:
        parent[key] = rng.choice(JUNK)
    return document


def values_changed(text: str, rng: random.Random) -> str:
    document = json.loads(text)
    for _ in range(rng.choice([1, 1, 2, 5])):
        if places(document):
            document = value_changed(document, rng)
    return json.dumps(document)


def ids_changed(text: str, rng: random.Random) -> str:
    """Give an object another's name, or one that the room or nobody has."""
    document = json.loads(text)
    chosen = rng.choice(document["objects"])
    chosen["id"] = rng.choice(["bed", "chair", "wall-0", "floor", "new", "lampe", " ", "a/b"])
    return json.dumps(document)


def text_changed(text: str, rng: random.Random) -> bytes:
    """Write what JSON does not allow, or in another encoding."""
    numbers = [k for k in range(1, len(text)) if text[k].isdigit() and not text[k - 1].isalnum()]
    place = rng.choice(numbers)
    deep = 100_000
    inserted = rng.choice(
        [
            *("NaN, ", "Infinity, ", "-", "1e999, ", "9" * 10_000, "0x", "[" * deep),
            *('{"a":' * deep, "[" * deep + "]" * deep + ", ", "'", "// why\n", "\ufeff"),
        ]
    )
    kind = rng.randrange(6)
    if kind == 0:
        return text.encode("utf-16")
    if kind == 1:
        return text.encode("latin-1")
    if kind == 2:
        return text.replace('"version"', '"schema"').encode()
    return (text[:place] + inserted + text[place:]).encode()


def damaged_scene(data: bytes, rng: random.Random) -> bytes:
    text = data.decode()
    kind = rng.randrange(10)
    if kind < 3:
        return (bits_flipped, cut_off, piece_moved)[kind](data, rng)
    if kind == 3:
        return ids_changed(text, rng).encode()
    if kind == 4:
        return text_changed(text, rng)
    return values_changed(text, rng).encode()


def damaged_model(data: bytes, rng: random.Random) -> bytes:
    kind = rng.randrange(10)
    if kind < 3:
        return (bits_flipped, cut_off, piece_moved)[kind](data, rng)
    (length,) = struct.unpack_from("<I", data, 12)
    text, rest = data[20 : 20 + length].decode(), data[20 + length :]
    document = json.loads(text)
    extras = document["scenes"][0]["extras"]
    if kind == 3:
        extras["panoscene"] = ids_changed(extras["panoscene"], rng)
    elif kind < 6:
        extras["panoscene"] = values_changed(extras["panoscene"], rng)
    changed = text_changed(text, rng) if kind == 6 else json.dumps(document).encode()
    if kind > 6:
        changed = values_changed(text, rng).encode()
    changed += b" " * (-len(changed) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 20 + len(changed) + len(rest))
    return head + struct.pack("<I4s", len(changed), b"JSON") + changed + rest


# what commands make of it


def run(arguments: Sequence[str]) -> Ran:
    """Run a command; what it raises ends the test."""
    out = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", errors="strict")
    err = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", errors="backslashreplace")
    with redirect_stdout(out), redirect_stderr(err):
        code = main(arguments)
    texts = []
    for stream in (out, err):
        stream.flush()
        stream.seek(0)
        texts.append(stream.read())
    return code, texts[0], texts[1]


def tried(file: str, command: Sequence[str]) -> bool:
    """Return whether a command takes a file, after a look at all that it says and leaves."""
    name, *options = command
    result = Path("result")
    result.mkdir()
    options = [str(result / o) if o.startswith("o.") else o for o in options]
    code, out, err = run([name, file, *options])
    left = list(result.iterdir())
    assert "Traceback" not in out + err
    if code == 0:
        assert "error:" not in err
        assert left or out or "-o" not in command
        for path in left:
            CHECKS[path.name](path)
    else:
        assert code == 2
        assert out == ""
        errors = [line for line in err.splitlines() if line.startswith("error:")]
        assert len(errors) == 1
        assert errors[0].startswith(f"error: {file}")
        assert "expected" in err
        assert len(err.splitlines()) <= 14
        assert left == []
    for path in left:
        path.unlink()
    result.rmdir()
    return code == 0


def outcomes(
    file: str,
    data: bytes,
    damage: Callable[[bytes, random.Random], bytes],
    commands: Sequence[Sequence[str]],
) -> Counter[bool]:
    """Return how many damaged files were taken and refused, each by one command in turn."""
    found: Counter[bool] = Counter()
    for number in range(FILES):
        rng = random.Random(number)  # noqa: S311
        Path(file).write_bytes(damage(data, rng))
        command = commands[number % len(commands)]
        try:
            taken = tried(file, command)
        except BaseException as error:
            error.add_note(f"{file} damaged with seed {number}: {' '.join(command)}")
            raise
        if not taken and command[0] == "relations" and number % 2:
            assert not tried(file, ("draw", "-o", "o.pictures"))
        found[taken] += 1
    assert {path.name for path in Path().iterdir()} == {file}
    return found


def test_whole_files_are_taken(
    whole: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for file, commands in (("room.json", SCENE_COMMANDS), ("room.glb", MODEL_COMMANDS)):
        Path(file).write_bytes(whole[file])
        for command in commands:
            assert tried(file, command)


def test_150_damaged_scenes(
    whole: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    found = outcomes("room.json", whole["room.json"], damaged_scene, SCENE_COMMANDS)
    # some damage leaves a possible scene; most does not
    assert found[True] >= 15
    assert found[False] >= 75


def test_150_damaged_models(
    whole: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    found = outcomes("room.glb", whole["room.glb"], damaged_model, MODEL_COMMANDS)
    assert found[True] >= 15
    assert found[False] >= 50


def corners(size: float) -> list[list[float]]:
    return [[-size, -size], [size, -size], [size, size], [-size, size]]


ONE_CAUSE: dict[str, tuple[Callable[[Any], object], str]] = {
    "an id twice": (
        lambda d: d["objects"][2].update(id="bed"),
        "$.objects[2].id: found 'bed', expected a unique name (objects[0] has it too)",
    ),
    "another id than in the relations": (
        lambda d: d["objects"][1].update(id="chiar"),
        "other places), expected an object or wall of this scene; did you mean 'chiar'?",
    ),
    "an id of a wall": (lambda d: d["objects"][2].update(id="wall-0"), "$.objects[2].id: found"),
    "an id of blanks": (lambda d: d["objects"][2].update(id=" \u2028"), "$.objects[2].id: found"),
    "half a character in the name": (lambda d: d.update(name="a \ud800"), "$.name: found"),
    "half a character in the photo": (
        lambda d: d["panorama"].update(file="\udfff.jpg"),
        "$.panorama.file: found",
    ),
}


@pytest.mark.parametrize("cause", ONE_CAUSE)
def test_one_cause_gets_one_message(
    whole: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cause: str
) -> None:
    monkeypatch.chdir(tmp_path)
    change, message = ONE_CAUSE[cause]
    document = json.loads(whole["room.json"])
    change(document)
    Path("room.json").write_text(json.dumps(document))
    _, _, err = run(["relations", "room.json"])
    assert message in err
    assert err.count("\n") == 1
    for command in (("convert", "-o", "o.json"), ("draw", "-o", "o.pictures")):
        assert not tried("room.json", command)


STRANGE: dict[str, Callable[[Any], object]] = {
    "huge room": lambda d: d["layout"].update(floor_polygon=corners(1e6)),
    "tiny room": lambda d: d["layout"].update(floor_polygon=corners(1e-4), ceiling_height=1e-5),
    "high room": lambda d: d["layout"].update(floor_height=-1e6, ceiling_height=1e6),
    "far box": lambda d: d["objects"][0]["box"].update(centre=[1e6, 1e6, 1e6]),
    "huge box": lambda d: d["objects"][0]["box"].update(size=[1e6, 1e6, 1e6]),
    "tiny box": lambda d: d["objects"][0]["box"].update(size=[1e-6, 1e-6, 1e-6]),
    "box around the camera": lambda d: d["objects"][0]["box"].update(centre=[0, 0, 1.6]),
    "nothing in the room": lambda d: (d.update(objects=[]), d.pop("relations")),
    "controls in the name": lambda d: d.update(name="\0\x1b\n]]></title>"),
    "a photo nowhere": lambda d: d["panorama"].update(file="x" * 5000),
}


@pytest.mark.parametrize("case", STRANGE)
def test_strange_scenes_are_taken(
    whole: dict[str, bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: str
) -> None:
    monkeypatch.chdir(tmp_path)
    document = json.loads(whole["room.json"])
    STRANGE[case](document)
    Path("room.json").write_text(json.dumps(document))
    for command in SCENE_COMMANDS[-4:]:
        assert tried("room.json", command)
