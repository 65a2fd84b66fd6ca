"""GLB files: what is in them, how others read them, and back to the same scene."""

import json
import math
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.exports import read_glb, write_glb
from panoscene.exports._glb_container import pack_glb, read_container
from panoscene.scene import (
    Scene,
    SceneFormatError,
    object_names,
    object_surface,
    room_surfaces,
    scene_to_json,
)


def parts(path: Path) -> tuple[dict[str, Any], bytes]:
    container = read_container(path)
    assert isinstance(container.document, dict)
    return container.document, container.binary


def named(document: dict[str, Any], name: str) -> dict[str, Any]:
    return next(node for node in document["nodes"] if node["name"] == name)


def edited(path: Path, change: Callable[[dict[str, Any]], None]) -> Path:
    """Return the file after a change of its document."""
    document, binary = parts(path)
    change(document)
    path.write_bytes(pack_glb(document, binary))
    return path


def test_header_follows_the_specification(glb: Path) -> None:
    data = glb.read_bytes()
    magic, version, length, json_length, kind = struct.unpack_from("<4sIII4s", data)
    assert (magic, version, length, kind) == (b"glTF", 2, len(data), b"JSON")
    assert json_length % 4 == 0
    assert len(data) % 4 == 0


def test_nodes_and_extras(glb: Path) -> None:
    document, _ = parts(glb)
    top = [document["nodes"][k] for k in document["scenes"][0]["nodes"]]
    assert [node["name"] for node in top] == ["room", "objects"]
    below = [[document["nodes"][k]["name"] for k in node["children"]] for node in top]
    assert below[0] == ["floor", "ceiling", "wall-0", "wall-1", "wall-2", "wall-3"]
    assert below[1] == ["door", "window", "bed <1> & co", "Lämpchen"]
    bed = named(document, "bed <1> & co")["extras"]
    assert bed["category"] == "bed"
    assert bed["score"] == 1.0
    assert bed["size"] == pytest.approx([1.6, 2.0, 0.6])
    on_floor = {"predicate": "on_floor", "object": "floor", "score": 1.0}
    assert on_floor in bed["relations"]
    wall = named(document, "wall-0")["extras"]
    assert wall == {"name": "wall-0", "kind": "wall", "length": 5.0, "height": 2.6}


def test_relations_are_told_from_both_sides(sample: Scene, tmp_path: Path) -> None:
    write_glb(sample, tmp_path / "sample.glb")
    document, _ = parts(tmp_path / "sample.glb")
    told = {
        (node["name"], edge["predicate"], edge["object"]): edge.get("angle")
        for node in document["nodes"]
        for edge in node.get("extras", {}).get("relations", [])
    }
    assert ("bed_7", "touching", "chest_8") in told
    assert ("chest_8", "touching", "bed_7") in told
    objects = set(object_names(sample.objects))
    turns = {key: angle for key, angle in told.items() if key[1] == "relative_yaw"}
    for (subject, predicate, other), angle in turns.items():
        if other in objects:
            # half a turn is -pi from both sides
            back = -angle if angle > -math.pi + 1e-3 else angle
            assert turns[other, predicate, subject] == pytest.approx(back)


@pytest.mark.parametrize("textured", [False, True])
def test_trimesh_sees_the_same_triangles(
    room: Scene, tmp_path: Path, smooth_panorama: torch.Tensor, textured: bool
) -> None:
    path = tmp_path / "room.glb"
    write_glb(room, path, image=smooth_panorama if textured else None)
    loaded = trimesh.load_scene(path)
    # walls are whole: the photo on them shows doors and windows
    objects = [object_surface(room, k) for k in range(len(room.objects.boxes))]
    for surface in (*room_surfaces(room.layout), *objects):
        transform, geometry = loaded.graph[surface.name]
        mesh = loaded.geometry[geometry].copy()
        mesh.apply_transform(transform)
        x, y, z = surface.vertices.double().numpy().T
        wanted = trimesh.Trimesh(np.stack([x, z, -y], axis=1), surface.faces.numpy(), process=False)
        assert mesh.bounds == pytest.approx(wanted.bounds, abs=1e-5)
        assert mesh.area == pytest.approx(wanted.area, rel=1e-5)


def test_walls_look_into_the_room(sample: Scene, tmp_path: Path) -> None:
    write_glb(sample, tmp_path / "sample.glb")
    loaded = trimesh.load_scene(tmp_path / "sample.glb")
    shell = [loaded.graph[f"wall-{k}"] for k in range(6)] + [loaded.graph["floor"]]
    shell.append(loaded.graph["ceiling"])
    corners = np.concatenate([loaded.geometry[geometry].triangles for _, geometry in shell])
    a, b, c = corners.swapaxes(0, 1)
    volume = (a * np.cross(b, c)).sum() / 6
    area = float(scene_to_json(sample)["layout"]["ceiling_height"]) * 26.712842
    # triangles that look inwards enclose a negative volume
    assert volume == pytest.approx(-area, rel=1e-4)


def test_round_trip_is_exact(sample: Scene, room: Scene, empty: Scene, tmp_path: Path) -> None:
    for scene in (sample, room, empty):
        write_glb(scene, tmp_path / "scene.glb")
        back = read_glb(tmp_path / "scene.glb")
        without = replace(scene.objects, shapes=replace(scene.objects.shapes, mesh=()))
        back_without = replace(back.objects, shapes=replace(back.objects.shapes, mesh=()))
        assert scene_to_json(replace(back, objects=back_without)) == scene_to_json(
            replace(scene, objects=without)
        )
        assert len(back.objects.shapes.mesh) == len(scene.objects.shapes.mesh)
        for mesh, wanted in zip(back.objects.shapes.mesh, scene.objects.shapes.mesh, strict=True):
            assert (mesh is None) == (wanted is None)
            if mesh is not None and wanted is not None:
                assert torch.equal(mesh.faces, wanted.faces)
                assert torch.allclose(mesh.vertices, wanted.vertices, rtol=2e-7, atol=1e-9)


def test_double_precision_survives(room: Scene, tmp_path: Path) -> None:
    boxes = room.objects.boxes
    fine = replace(boxes, centre=boxes.centre.double() + 1 / 3, size=boxes.size.double())
    fine = replace(fine, yaw=boxes.yaw.double() + 1 / 7)
    scene = replace(room, objects=replace(room.objects, boxes=fine))
    write_glb(scene, tmp_path / "fine.glb")
    back = read_glb(tmp_path / "fine.glb", dtype=torch.float64)
    assert torch.equal(back.objects.boxes.centre, fine.centre)
    assert torch.equal(back.objects.boxes.yaw, fine.yaw)


@settings(max_examples=8)
@given(
    st.tuples(*[st.floats(-5, 5)] * 3), st.floats(-3.1, 3.1), st.tuples(*[st.floats(0.2, 4)] * 3)
)
def test_edited_nodes_move_boxes(
    tmp_path_factory: pytest.TempPathFactory,
    turned_room: Callable[[float], Scene],
    place: tuple[float, float, float],
    turn: float,
    scale: tuple[float, float, float],
) -> None:
    path = tmp_path_factory.mktemp("glb") / "room.glb"
    room = turned_room(0.3)
    write_glb(room, path)

    def move(document: dict[str, Any]) -> None:
        node = named(document, "bed <1> & co")
        x, y, z = place
        node["name"] = "Cube.001"
        node["translation"] = [x, z, -y]
        node["rotation"] = [0.0, math.sin(turn / 2), 0.0, math.cos(turn / 2)]
        node["scale"] = [scale[0], scale[2], scale[1]]
        # hang everything below a new parent that moves one metre up
        top = document["scenes"][0]["nodes"]
        document["nodes"].append({"translation": [0, 1, 0], "children": top})
        document["scenes"][0]["nodes"] = [len(document["nodes"]) - 1]

    back = read_glb(edited(path, move))
    box = back.objects.boxes[2]
    assert box.centre.tolist() == pytest.approx([place[0], place[1], place[2] + 1], abs=2e-5)
    assert float(torch.cos(box.yaw - turn)) == pytest.approx(1, abs=1e-6)
    wanted = room.objects.boxes.size[2] * torch.tensor(scale)
    assert torch.allclose(box.size, wanted, rtol=2e-5)
    lamp = room.objects.boxes.centre[3] + torch.tensor([0.0, 0.0, 1.0])
    assert torch.allclose(back.objects.boxes.centre[3], lamp)
    assert torch.equal(back.objects.boxes.yaw[3], room.objects.boxes.yaw[3])


def test_a_matrix_is_as_good(glb: Path, room: Scene) -> None:
    def rewrite(document: dict[str, Any]) -> None:
        node = named(document, "Lämpchen")
        x, y, z = node.pop("translation")
        node.pop("rotation")
        node["matrix"] = [0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, x, y, z, 1]

    back = read_glb(edited(glb, rewrite))
    assert float(back.objects.boxes.yaw[3]) == pytest.approx(math.pi / 2)
    assert torch.equal(back.objects.boxes.centre, room.objects.boxes.centre)


def test_deleted_nodes_delete_objects(glb: Path, room: Scene) -> None:
    def delete(document: dict[str, Any]) -> None:
        children = named(document, "objects")["children"]
        del children[1]

    back = read_glb(edited(glb, delete))
    assert back.objects.id == ("door", "bed <1> & co", "Lämpchen")
    assert back.relations is not None
    assert room.relations is not None
    kept = torch.tensor([0, 2, 3])
    assert torch.equal(back.relations.farther_than, room.relations.farther_than[kept][:, kept])
    assert torch.equal(back.relations.touching_wall, room.relations.touching_wall[kept])
    assert len(back.objects.shapes.mesh) == 3
    assert back.objects.shapes.mesh[1] is not None


def test_copies_become_objects(glb: Path) -> None:
    def copy(document: dict[str, Any]) -> None:
        twin = named(document, "Lämpchen") | {"name": "Lämpchen.001", "translation": [1, 2, 3]}
        document["nodes"].append(twin)
        document["scenes"][0]["nodes"].append(len(document["nodes"]) - 1)

    back = read_glb(edited(glb, copy))
    assert back.objects.id == ("door", "window", "bed <1> & co", "Lämpchen", "Lämpchen-2")
    assert back.objects.boxes.centre[4].tolist() == [1, -3, 2]
    assert back.relations is not None
    assert back.relations.touching.shape == (5, 5)


def test_nothing_is_written_when_the_scene_is_bad(room: Scene, tmp_path: Path) -> None:
    boxes = replace(room.objects.boxes, yaw=torch.full((4,), torch.nan))
    bad = replace(room, objects=replace(room.objects, boxes=boxes))
    with pytest.raises(SceneFormatError, match="yaw"):
        write_glb(bad, tmp_path / "bad.glb")
    assert list(tmp_path.iterdir()) == []


def test_arguments_are_checked(room: Scene, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="texture_px_per_metre"):
        write_glb(room, tmp_path / "x.glb", texture_px_per_metre=0.0)
    with pytest.raises(ValueError, match="not finite"):
        write_glb(room, tmp_path / "x.glb", image=torch.full((3, 4, 8), torch.nan))
    assert list(tmp_path.iterdir()) == []


def test_the_document_can_be_read_by_others(glb: Path, room: Scene) -> None:
    document, _ = parts(glb)
    carried = json.loads(document["scenes"][0]["extras"]["panoscene"])
    assert carried["schema"] == "panoscene/scene"
    assert [one["category"] for one in carried["objects"]] == [
        "door", "window", "bed", "floor_lamp",
    ]  # fmt: skip
    # the document itself, which some tools make of the text, is as good
    document["scenes"][0]["extras"]["panoscene"] = carried
    glb.write_bytes(pack_glb(document, parts(glb)[1]))
    assert torch.equal(read_glb(glb).objects.boxes.centre, room.objects.boxes.centre)
