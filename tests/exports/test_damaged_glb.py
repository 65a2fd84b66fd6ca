"""Damaged and hostile GLB files: the scene, or one clear error; nothing else, and no delay."""

import json
import random
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from panoscene.exports import _glb_read, _gltf_meshes, read_glb
from panoscene.exports._glb_container import pack_glb, read_container
from panoscene.scene import Scene, SceneFormatError


def refused(path: Path) -> str:
    with pytest.raises(SceneFormatError) as caught:
        read_glb(path)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert "expected" in message
    return message


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "'glTF'"),
        (b"glTF", "truncated"),
        (b"PK\x03\x04 not a model", "'glTF'"),
        (struct.pack("<4sII", b"glTF", 1, 12), "version"),
        (struct.pack("<4sII", b"glTF", 2, 99), "truncated"),
        (struct.pack("<4sII", b"glTF", 2, 12), "chunk 0"),
        (struct.pack("<4sIIII", b"glTF", 2, 20, 2**32 - 1, 0), "length of chunk 0"),
        (struct.pack("<4sIII4s", b"glTF", 2, 20, 0, b"BIN\0"), "'JSON'"),
        (struct.pack("<4sIII4s4s", b"glTF", 2, 24, 4, b"JSON", b"[1, "), "JSON"),
        (struct.pack("<4sIII4s4s", b"glTF", 2, 24, 4, b"JSON", b"\xff\xff  "), "UTF-8"),
        (struct.pack("<4sIII4s4s", b"glTF", 2, 24, 4, b"JSON", b"[1] "), "list"),
    ],
)
def test_broken_containers(tmp_path: Path, data: bytes, words: str) -> None:
    path = tmp_path / "broken.glb"
    path.write_bytes(data)
    assert words in refused(path)


def test_missing_files_and_directories(tmp_path: Path) -> None:
    assert "existing" in refused(tmp_path / "none.glb")
    assert "directory" in refused(tmp_path)


def bed(document: dict[str, Any]) -> dict[str, Any]:
    return next(node for node in document["nodes"] if node["name"].startswith("bed"))


def accessor(document: dict[str, Any], which: str = "POSITION") -> dict[str, Any]:
    primitive = document["meshes"][bed(document)["mesh"]]["primitives"][0]
    index = primitive["indices"] if which == "indices" else primitive["attributes"][which]
    return document["accessors"][index]


def carried(document: dict[str, Any], **fields: object) -> None:
    extras = document["scenes"][0]["extras"]
    extras["panoscene"] = json.dumps(json.loads(extras["panoscene"]) | fields)


def again(document: dict[str, Any]) -> None:
    document["scenes"][0]["nodes"].append(document["scenes"][0]["nodes"][0])


HOSTILE: dict[str, tuple[Callable[[dict[str, Any]], object], str]] = {
    "glTF 1": (lambda d: d["asset"].update(version="1.0"), "asset.version"),
    "no scene extras": (lambda d: d["scenes"][0].pop("extras"), "write_glb"),
    "extras of another kind": (lambda d: d["scenes"][0].update(extras=[1]), "write_glb"),
    "carried text is no JSON": (lambda d: d["scenes"][0]["extras"].update(panoscene="{"), "JSON"),
    "carried nesting": (
        lambda d: d["scenes"][0]["extras"].update(panoscene="[" * 100_000), "nested",
    ),
    "carried long number": (
        lambda d: d["scenes"][0]["extras"].update(panoscene="1" * 10_000), "too long",
    ),
    "carried version": (lambda d: carried(d, version=99), "version"),
    "carried layout": (lambda d: carried(d, layout={"floor_polygon": []}), "floor_polygon"),
    "scene out of range": (lambda d: d.update(scene=7), "$.scene"),
    "node out of range": (lambda d: bed(d).update(children=[10**6]), "children"),
    "negative index": (lambda d: bed(d).update(mesh=-1), "mesh"),
    "mesh out of range": (lambda d: bed(d).update(mesh=999), "mesh"),
    "cycle": (lambda d: bed(d).update(children=[d["scenes"][0]["nodes"][0]]), "again"),
    "two parents": (again, "again"),
    "tilted": (lambda d: bed(d).update(rotation=[0.38, 0, 0, 0.92]), "tilted by 4"),
    "mirrored": (lambda d: bed(d).update(scale=[-1, 1, 1]), "mirror"),
    "flat": (lambda d: bed(d).update(scale=[1, 0, 1]), "above 0"),
    "zero quaternion": (lambda d: bed(d).update(rotation=[0, 0, 0, 0]), "quaternion"),
    "perspective": (lambda d: bed(d).update(matrix=[0.5] * 16), "matrix"),
    "huge translation": (lambda d: bed(d).update(translation=[1e300, 0, 0]), "translation"),
    "far away": (lambda d: bed(d).update(translation=[1e8, 0, 0]), "centre"),
    "huge count": (lambda d: accessor(d).update(count=2**31), "bytes"),
    "huge offset": (lambda d: accessor(d).update(byteOffset=2**31), "bytes"),
    "boolean count": (lambda d: accessor(d).update(count=True), "count"),
    "wrong type": (lambda d: accessor(d).update(type="SCALAR"), "VEC3"),
    "sparse": (lambda d: accessor(d).update(sparse={"count": 1}), "sparse"),
    "view out of range": (lambda d: accessor(d).update(bufferView=999), "bufferView"),
    "view of nothing": (
        lambda d: d["bufferViews"][accessor(d)["bufferView"]].update(byteOffset=2**31), "bytes",
    ),
    "index out of range": (lambda d: accessor(d).update(count=3), "vertex"),
    "external buffer": (lambda d: d["buffers"][0].update(uri="file:///etc/passwd"), "another file"),
    "compression": (lambda d: d.update(extensionsRequired=["KHR_draco"]), "compression"),
    "lines": (
        lambda d: d["meshes"][bed(d)["mesh"]]["primitives"][0].update(mode=1), "triangles",
    ),
    "no position": (
        lambda d: d["meshes"][bed(d)["mesh"]]["primitives"][0].update(attributes={}), "POSITION",
    ),
    "no triangles": (lambda d: accessor(d, "indices").update(count=4), "corners"),
}  # fmt: skip


@pytest.mark.parametrize("case", HOSTILE)
def test_hostile_documents(glb: Path, case: str) -> None:
    change, words = HOSTILE[case]
    container = read_container(glb)
    document: Any = container.document
    change(document)
    glb.write_bytes(pack_glb(document, container.binary))
    assert words in refused(glb)


def test_the_same_numbers_again_and_again(glb: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    container = read_container(glb)
    document: Any = container.document
    one = document["meshes"][bed(document)["mesh"]]["primitives"][0]
    for module in (_gltf_meshes, _glb_read):
        monkeypatch.setattr(module, "MAX_TRIANGLES", 1000)
    for copies, meshes in ((4, 1), (1, 4)):  # of 320 triangles each
        for _ in range(meshes):
            document["meshes"].append({"primitives": [one] * copies})
            document["nodes"].append(bed(document) | {"mesh": len(document["meshes"]) - 1})
            document["scenes"][0]["nodes"].append(len(document["nodes"]) - 1)
        glb.write_bytes(pack_glb(document, container.binary))
        assert "more triangles" in refused(glb)
        del document["scenes"][0]["nodes"][2:]


def test_nan_in_the_buffer(glb: Path) -> None:
    container = read_container(glb)
    document: Any = container.document
    start = document["bufferViews"][accessor(document)["bufferView"]]["byteOffset"]
    binary = bytearray(container.binary)
    binary[start : start + 4] = np.float32(np.nan).tobytes()
    glb.write_bytes(pack_glb(document, bytes(binary)))
    assert "NaN" in refused(glb)


def damaged(data: bytes, rng: random.Random) -> bytes:
    """Return a file with flipped bits, without its end, with a piece twice, or with other JSON."""
    kind = rng.randrange(4)
    if kind == 0:
        changed = bytearray(data)
        for _ in range(rng.choice([1, 3, 20, 400])):
            changed[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        return bytes(changed)
    if kind == 1:
        return data[: rng.randrange(len(data))]
    if kind == 2:
        start = rng.randrange(len(data))
        return data[:start] + data[start // 2 :]
    (length,) = struct.unpack_from("<I", data, 12)
    document: Any = json.loads(data[20 : 20 + length])
    for _ in range(rng.choice([1, 2, 5])):
        parent: Any = document
        key: Any = None
        while isinstance(parent, dict | list) and parent:
            key = rng.choice(list(parent) if isinstance(parent, dict) else range(len(parent)))
            if rng.random() < 0.3 or not isinstance(parent[key], dict | list) or not parent[key]:
                break
            parent = parent[key]
        junk = [None, -1, 2**40, 0.5, "", "x" * 50, [], {}, [[]], True, 1e308, -1e308]
        if isinstance(parent, dict) and key is not None and rng.random() < 0.3:
            del parent[key]
        elif isinstance(parent, dict | list) and key is not None:
            parent[key] = rng.choice(junk)
    return pack_glb(document, data[28 + length :])


def test_150_damaged_files(glb: Path) -> None:
    data = glb.read_bytes()
    rng = random.Random(7)  # noqa: S311
    outcomes = {"read": 0, "refused": 0}
    for _ in range(150):
        glb.write_bytes(damaged(data, rng))
        try:
            assert isinstance(read_glb(glb), Scene)
            outcomes["read"] += 1
        except SceneFormatError as error:
            assert str(glb) in str(error)  # noqa: PT017
            outcomes["refused"] += 1
    # some damage hits names and colours that do not matter; most is noticed
    assert outcomes["read"] >= 10
    assert outcomes["refused"] >= 75
