import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.geometry import OrientedBoxes
from panoscene.scene import (
    Layout,
    Scene,
    SceneFormatError,
    read_scene,
    scene_from_json,
    scene_to_json,
)

MINIMAL = Path(__file__).with_name("minimal_scene.json").read_text()

Change = Callable[[dict[str, Any]], object]
BOX = "$.objects[0].box"
BAD_DOCUMENTS: list[tuple[str, Change, str, str]] = [
    ("missing schema", lambda d: d.pop("schema"), "$.schema: found nothing", "panoscene/scene"),
    ("other schema", lambda d: d.update(schema="x"), "$.schema: found 'x'", "panoscene/scene"),
    ("newer version", lambda d: d.update(version=2), "$.version: found 2", "newer panoscene"),
    ("text version", lambda d: d.update(version="1"), "$.version: found '1'", "expected 1"),
    ("true version", lambda d: d.update(version=True), "$.version: found True", "expected 1"),
    ("no version", lambda d: d.pop("version"), "$.version: found nothing", "expected 1"),
    ("feet", lambda d: d.update(units="feet, degrees"), "$.units", "metres, radians"),
    ("other frame", lambda d: d.update(frame="y up"), "$.frame: found 'y up'", "+z up"),
    ("missing", lambda d: d.pop("layout"), "$.layout: found nothing", "required"),
    (
        "American spelling",
        lambda d: d["objects"][0]["box"].update(center=d["objects"][0]["box"].pop("centre")),
        f"{BOX}.center",
        "did you mean 'centre'?",
    ),
    (
        "NaN",
        lambda d: d["objects"][0]["box"].update(yaw=math.nan),
        f"{BOX}.yaw: found nan",
        "finite",
    ),
    (
        "infinity",
        lambda d: d["objects"][0]["box"].update(centre=[0, math.inf, 0]),
        f"{BOX}.centre[1]: found inf",
        "",
    ),
    (
        "beyond float32",
        lambda d: d["objects"][0]["box"].update(centre=[0, 1e300, 0]),
        f"{BOX}.centre[1]: found 1e+300",
        "",
    ),
    (
        "integer beyond float64",
        lambda d: d["objects"][0]["box"].update(centre=[0, 10**400, 0]),
        f"{BOX}.centre[1]: found a number of about 401 digits",
        "",
    ),
    (
        "zero size",
        lambda d: d["objects"][0]["box"].update(size=[1, 0, 1]),
        f"{BOX}.size[1]: found 0",
        "greater",
    ),
    (
        "negative size",
        lambda d: d["objects"][0]["box"].update(size=[1, 1, -2]),
        f"{BOX}.size[2]: found -2",
        "greater",
    ),
    (
        "two numbers",
        lambda d: d["objects"][0]["box"].update(size=[1, 1]),
        f"{BOX}.size",
        "",
    ),
    (
        "degrees",
        lambda d: d["objects"][0]["box"].update(yaw=90),
        f"{BOX}.yaw: found 90",
        "radians, not degrees",
    ),
    (
        "text for a number",
        lambda d: d["objects"][0]["box"].update(yaw="0"),
        f"{BOX}.yaw: found '0'",
        "number",
    ),
    (
        "true for a number",
        lambda d: d["objects"][0]["box"].update(yaw=True),
        f"{BOX}.yaw: found True",
        "number",
    ),
    (
        "unknown category",
        lambda d: d["objects"][1].update(category="Sofa Chair"),
        "$.objects[1].category: found 'Sofa Chair'",
        "did you mean 'sofa_chair'",
    ),
    (
        "score",
        lambda d: d["objects"][1].update(score=1.5),
        "$.objects[1].score: found 1.5",
        "less than or equal to 1",
    ),
    (
        "same id",
        lambda d: [o.update(id="it") for o in d["objects"]],
        "$.objects[1].id: found 'it'",
        "objects[0] has it too",
    ),
    (
        "id that is another's default",
        lambda d: d["objects"][0].update(id="chair-1"),
        "$.objects[1].id: found 'chair-1'",
        "unique",
    ),
    (
        "id of a wall",
        lambda d: d["objects"][0].update(id="wall-3"),
        "$.objects[0].id: found 'wall-3'",
        "room",
    ),
    (
        "half a surrogate pair",
        lambda d: d["objects"][0].update(id="\ud800"),
        "$.objects[0].id",
        "",
    ),
    (
        "crossing polygon",
        lambda d: d["layout"].update(floor_polygon=[[-2, -2], [2, 2], [2, -2], [-2, 2]]),
        "$.layout.floor_polygon: found walls cross",
        "simple polygon",
    ),
    (
        "clockwise polygon",
        lambda d: d["layout"]["floor_polygon"].reverse(),
        "$.layout.floor_polygon",
        "reverse the corners",
    ),
    (
        "two corners",
        lambda d: d["layout"].update(floor_polygon=[[0, 0], [1, 0]]),
        "$.layout.floor_polygon",
        "at least 3",
    ),
    (
        "repeated corner",
        lambda d: d["layout"]["floor_polygon"].append([-2, 2]),
        "$.layout.floor_polygon: found corners 3 and 4 are the same",
        "simple polygon",
    ),
    (
        "ceiling below floor",
        lambda d: d["layout"].update(ceiling_height=-1),
        "$.layout.ceiling_height: found -1",
        "floor_height",
    ),
    (
        "wall scores",
        lambda d: d["layout"].update(wall_score=[1, 1]),
        "$.layout.wall_score: found 2 scores",
        "4",
    ),
    (
        "not 2:1",
        lambda d: d["panorama"].update(height=600),
        "$.panorama: found 1024 x 600",
        "twice the height",
    ),
    (
        "not a rotation",
        lambda d: d["panorama"].update(upright_from_photo=[[1, 0, 0], [0, 1, 0], [0, 0, -1]]),
        "$.panorama.upright_from_photo",
        "rotation",
    ),
    (
        "relation of an unknown object",
        lambda d: d["relations"]["on_floor"].update({"bad-0": 1}),
        "$.relations.on_floor: found 'bad-0'",
        "did you mean 'bed-0'?",
    ),
    (
        "relation to an unknown wall",
        lambda d: d["relations"]["touching"]["bed-0"].update({"wall-4": 1}),
        "$.relations.touching[\"bed-0\"]: found 'wall-4'",
        "object or wall",
    ),
    (
        "relation score",
        lambda d: d["relations"]["touching"]["bed-0"].update({"wall-2": 2}),
        '$.relations.touching["bed-0"]["wall-2"]: found 2',
        "less than",
    ),
    (
        "yaw bin",
        lambda d: d["relations"].update(relative_yaw_deg={"bed-0": {"wall-2": {"30": 1}}}),
        "relative_yaw_deg",
        "'-180'",
    ),
    (
        "codes of different lengths",
        lambda d: [o.update(shape={"code": [0.5] * (k + 1)}) for k, o in enumerate(d["objects"])],
        "$.objects[1].shape.code: found 2 numbers",
        "1 as in objects[0]",
    ),
    (
        "face of a missing vertex",
        lambda d: d["objects"][0].update(
            shape={"mesh": {"vertices": [[0, 0, 0]], "faces": [[0, 0, 1]]}}
        ),
        "$.objects[0].shape.mesh.faces: found index 1",
        "below 1",
    ),
]


@pytest.mark.parametrize(
    ("change", "found", "expected"),
    [case[1:] for case in BAD_DOCUMENTS],
    ids=[case[0] for case in BAD_DOCUMENTS],
)
def test_bad_document(change: Change, found: str, expected: str) -> None:
    document = json.loads(MINIMAL)
    change(document)
    with pytest.raises(SceneFormatError) as caught:
        scene_from_json(document, file="room.json")
    message = str(caught.value)
    assert message.startswith("room.json: ")
    assert found in message
    assert expected in message


@pytest.mark.parametrize("document", [None, [], "scene", 3, {}])
def test_not_even_an_object(document: object) -> None:
    with pytest.raises(SceneFormatError, match="panoscene/scene"):
        scene_from_json(document)


def test_several_problems_are_told_at_once_but_not_hundreds() -> None:
    document = json.loads(MINIMAL)
    document["objects"] = [
        {"category": "bad", "box": {"centre": [0, 0, 0], "size": [0, 0, 0]}} for _ in range(50)
    ]
    with pytest.raises(SceneFormatError) as caught:
        scene_from_json(document)
    assert len(caught.value.problems) == 200
    assert len(str(caught.value).splitlines()) == 12
    assert "and 190 more problems" in str(caught.value)


BAD_FILES: list[tuple[str, bytes, str]] = [
    ("empty", b"", "nothing in it"),
    ("blank", b" \n\n", "nothing in it"),
    ("truncated", MINIMAL[:-40].encode(), "truncated"),
    ("truncated in a key", MINIMAL[:30].encode(), "truncated"),
    ("two documents", (MINIMAL + "{}").encode(), "line 12, column 1"),
    ("comment", MINIMAL.replace("{", "{ // room", 1).encode(), "line 1, column 3"),
    ("not JSON", b"PK\x03\x04 zip", "line 1, column 1"),
    ("UTF-16", MINIMAL.encode("utf-16"), "UTF-8"),
    ("Latin-1", MINIMAL.replace("bed", "b\u00e9d").encode("latin-1"), "UTF-8"),
    ("duplicate key", MINIMAL.replace('"yaw": 3.14', '"yaw": 0, "yaw": 1').encode(), "'yaw' twice"),
    ("deep", b"[" * 200_000 + b"]" * 200_000, "nested"),
    ("deep objects", b'{"a":' * 200_000 + b"1" + b"}" * 200_000, "nested"),
    ("long integer", MINIMAL.replace("3.14", "1" * 5000).encode(), "too long"),
    ("huge exponent", MINIMAL.replace("3.14", "1e999").encode(), "$.objects[0].box.yaw: found inf"),
    ("NaN", MINIMAL.replace("3.14", "NaN").encode(), "$.objects[0].box.yaw: found nan"),
]


@pytest.mark.parametrize(
    ("content", "expected"), [case[1:] for case in BAD_FILES], ids=[case[0] for case in BAD_FILES]
)
def test_bad_file(tmp_path: Path, content: bytes, expected: str) -> None:
    path = tmp_path / "scene.json"
    path.write_bytes(content)
    with pytest.raises(SceneFormatError) as caught:
        read_scene(path)
    assert str(caught.value).startswith(str(path))
    assert expected in str(caught.value)
    assert len(str(caught.value)) < 1000 + len(str(path))


def test_missing_file_directory_and_huge_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(SceneFormatError, match="found a directory"):
        read_scene(tmp_path)
    with pytest.raises(SceneFormatError, match=r"nothing\.json: the path: found nothing"):
        read_scene(tmp_path / "nothing.json")
    path = tmp_path / "scene.json"
    path.write_text(MINIMAL)
    monkeypatch.setattr("panoscene.scene._files.MAX_BYTES", 100)
    with pytest.raises(SceneFormatError, match="more than"):
        read_scene(path)


def test_a_byte_order_mark_is_harmless(tmp_path: Path) -> None:
    path = tmp_path / "scene.json"
    path.write_bytes(b"\xef\xbb\xbf" + MINIMAL.encode())
    assert len(read_scene(path).objects.category) == 2


@given(data=st.data())
@settings(max_examples=150, deadline=None)
def test_damaged_files_are_refused_or_read_never_worse(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    content = bytearray(MINIMAL.encode())
    for _ in range(data.draw(st.integers(1, 3))):
        place = data.draw(st.integers(0, len(content) - 1))
        content[place : place + data.draw(st.integers(0, 4))] = data.draw(st.binary(max_size=4))
    path = tmp_path_factory.mktemp("damaged") / "scene.json"
    path.write_bytes(content)
    try:
        scene = read_scene(path)
    except SceneFormatError:
        return
    assert bool(scene.objects.boxes.centre.isfinite().all())


def test_scenes_that_cannot_be_written_say_why(bedroom: Scene) -> None:
    boxes = bedroom.objects.boxes
    bad_centre = boxes.centre.clone()
    bad_centre[2, 1] = math.nan
    objects = bedroom.objects
    cases: list[tuple[Any, str]] = [
        ({"boxes": OrientedBoxes(bad_centre, boxes.size, boxes.yaw)}, "objects[2].box.centre[1]"),
        ({"category": torch.tensor([2, -1, 3, 57])}, "objects[1].category: found 'index -1'"),
        ({"id": ("a", "b")}, "objects.id: found 2 entries, expected 4"),
        ({"boxes": boxes[:3]}, "objects.boxes: found 3 entries, expected 4"),
    ]
    for change, expected in cases:
        changed = dataclasses.replace(objects, **change)
        with pytest.raises(SceneFormatError) as caught:
            scene_to_json(dataclasses.replace(bedroom, objects=changed))
        assert expected in str(caught.value)
    fewer_walls = Layout(bedroom.layout.floor_polygon[:3])
    with pytest.raises(SceneFormatError, match=r"touching_wall: found shape \(4, 4\)"):
        scene_to_json(dataclasses.replace(bedroom, layout=fewer_walls))
