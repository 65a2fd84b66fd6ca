"""Rooms to edit."""

import numpy as np
import pytest
import torch

from panoscene.geometry import OrientedBoxes
from panoscene.sample import sample_room_path
from panoscene.scene import Layout, Scene, objects_from_boxes, read_scene, scene_from_boxes
from panoscene.synth import perturb_scene

SQUARE = [[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]]


def room_with(*boxes: tuple[str, tuple[float, ...]]) -> Scene:
    """Return a room of 4 x 4 m with boxes: id and x, y, z, width, depth, height, yaw."""
    numbers = torch.tensor([row for _, row in boxes]).reshape(-1, 7)
    oriented = OrientedBoxes(numbers[:, :3], numbers[:, 3:6], numbers[:, 6])
    names = tuple(name for name, _ in boxes)
    objects = objects_from_boxes(oriented, [name.split("-")[0] for name in names], id=names)
    return scene_from_boxes(objects, Layout(torch.tensor(SQUARE)))


@pytest.fixture
def colliding() -> Scene:
    """A table in the middle, a chair 20 cm into it, and a plant in a corner."""
    return room_with(
        ("table-0", (0.0, 0.5, 0.4, 1.6, 0.8, 0.8, 0.0)),
        ("chair-0", (0.0, 0.05, 0.45, 0.5, 0.5, 0.9, 0.0)),
        ("plant-0", (1.7, 1.7, 0.5, 0.4, 0.4, 1.0, 0.0)),
    )


@pytest.fixture
def empty() -> Scene:
    return room_with()


@pytest.fixture(scope="session")
def disturbed() -> Scene:
    """The sample room with errors: things collide and stand in walls."""
    return perturb_scene(read_scene(sample_room_path()), np.random.default_rng(0))
