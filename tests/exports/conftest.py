"""Rooms that the tests of the exports share."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh

from panoscene.exports import write_glb
from panoscene.geometry import OrientedBoxes, panorama_directions
from panoscene.sample import sample_room_path
from panoscene.scene import (
    Layout,
    Mesh,
    Scene,
    Shapes,
    objects_from_boxes,
    read_scene,
    relations_from_boxes,
    scene_from_boxes,
)


@pytest.fixture(scope="session")
def sample() -> Scene:
    """The room that comes with the package: six walls, 17 objects, relations."""
    return read_scene(sample_room_path())


def a_room(turn: float = 0.0) -> Scene:
    """A room of 5 x 4 m: a door in the south wall, a window in the east wall, a bed, a lamp.

    The bed has a mesh, and stands in the middle; the lamp hangs from the ceiling.
    """
    cos, sin = math.cos(turn), math.sin(turn)
    rotation = torch.tensor([[cos, -sin], [sin, cos]], dtype=torch.float64)
    corners = torch.tensor([[-2, -1], [3, -1], [3, 3], [-2, 3]], dtype=torch.float64)
    places = torch.tensor([[-0.7, -1], [3.02, 1.5], [0.4, 1.2], [2, 2.2]], dtype=torch.float64)
    height = torch.tensor([[1.0], [1.5], [0.3], [2.3]], dtype=torch.float64)
    centre = torch.cat([places @ rotation.T, height], dim=1).float()
    size = torch.tensor([[0.9, 0.1, 2.0], [1.2, 0.1, 1.0], [1.6, 2.0, 0.6], [0.3, 0.3, 0.6]])
    yaw = torch.tensor([0.0, math.pi / 2, 0.25, 0.0]) + turn
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.5)
    mesh = Mesh(torch.tensor(np.asarray(ball.vertices)).float(), torch.tensor(ball.faces).long())
    objects = objects_from_boxes(
        OrientedBoxes(centre, size, yaw),
        ["door", "window", "bed", "floor_lamp"],
        id=("door", "window", "bed <1> & co", "Lämpchen"),
    )
    objects = replace(objects, shapes=Shapes(mesh=(None, None, mesh, None)))
    layout = Layout((corners @ rotation.T).float(), ceiling_height=2.6)
    scene = scene_from_boxes(objects, layout, name="test room")
    relations = relations_from_boxes(objects.boxes, layout, scene.panorama.camera_height)
    return replace(scene, relations=relations)


@pytest.fixture(scope="session")
def room() -> Scene:
    return a_room()


@pytest.fixture(scope="session")
def turned_room() -> Callable[[float], Scene]:
    return a_room


@pytest.fixture(scope="session")
def empty(room: Scene) -> Scene:
    """A room without objects."""
    objects = objects_from_boxes(
        OrientedBoxes(torch.zeros(0, 3), torch.zeros(0, 3), torch.zeros(0)), []
    )
    return scene_from_boxes(objects, room.layout)


@pytest.fixture(scope="session")
def smooth_panorama() -> torch.Tensor:
    """A panorama of 512 x 256 whose colour is half the direction plus one half."""
    return 0.5 + 0.5 * panorama_directions(256, 512, like=torch.zeros(())).permute(2, 0, 1)


@pytest.fixture(scope="session")
def room_glb(room: Scene, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The room as a GLB file."""
    path = tmp_path_factory.mktemp("glb") / "room.glb"
    write_glb(room, path)
    return path.read_bytes()


@pytest.fixture
def glb(room_glb: bytes, tmp_path: Path) -> Path:
    """A GLB file of the room, to be changed."""
    path = tmp_path / "room.glb"
    path.write_bytes(room_glb)
    return path
