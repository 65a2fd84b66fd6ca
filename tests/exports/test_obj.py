"""OBJ files, read by trimesh."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh

from panoscene.exports import write_obj
from panoscene.scene import Scene, SceneFormatError, scene_surfaces


def test_trimesh_reads_what_was_written(room: Scene, tmp_path: Path) -> None:
    write_obj(room, tmp_path / "room.obj")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["room.mtl", "room.obj"]
    loaded = trimesh.load_mesh(tmp_path / "room.obj")
    vertices = np.concatenate([s.vertices.double().numpy() for s in scene_surfaces(room)])
    x, y, z = vertices.T
    wanted = np.stack([x, z, -y], axis=1)
    assert loaded.bounds == pytest.approx(np.stack([wanted.min(0), wanted.max(0)]), abs=1e-5)


def test_groups_and_colours(room: Scene, tmp_path: Path) -> None:
    write_obj(room, tmp_path / "room.obj")
    lines = (tmp_path / "room.obj").read_text(encoding="utf-8").splitlines()
    names = [line[2:] for line in lines if line.startswith("o ")]
    walls = [f"wall-{k}" for k in range(4)]
    assert names == ["floor", "ceiling", *walls, "door", "window", "bed_<1>_&_co", "Lämpchen"]
    used = {line[7:] for line in lines if line.startswith("usemtl ")}
    colours = (tmp_path / "room.mtl").read_text(encoding="utf-8").splitlines()
    assert used == {line[7:] for line in colours if line.startswith("newmtl ")}


def test_names_that_become_alike_stay_apart(room: Scene, tmp_path: Path) -> None:
    objects = replace(room.objects, id=("a b", "a_b", "a  b", "c"))
    write_obj(replace(room, objects=objects), tmp_path / "room.obj")
    text = (tmp_path / "room.obj").read_text()
    assert [f"\no {name}\n" in text for name in ("a_b", "a_b-2", "a_b-3")] == [True] * 3


def test_bad_scenes_and_paths_leave_nothing(room: Scene, empty: Scene, tmp_path: Path) -> None:
    boxes = replace(room.objects.boxes, centre=torch.full((4, 3), torch.inf))
    with pytest.raises(SceneFormatError, match="centre"):
        write_obj(replace(room, objects=replace(room.objects, boxes=boxes)), tmp_path / "room.obj")
    with pytest.raises(ValueError, match=r"\.obj"):
        write_obj(room, tmp_path / "room.mtl")
    assert list(tmp_path.iterdir()) == []
    write_obj(empty, tmp_path / "empty.obj")
    assert (tmp_path / "empty.obj").read_text().count("\no ") == 6
