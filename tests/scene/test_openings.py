"""Openings of walls: where they are, and that a wall without them is whole."""

import pytest
import torch
import trimesh

from panoscene.geometry import OrientedBoxes
from panoscene.scene import Layout, Panorama, Scene, Surface, objects_from_boxes, scene_surfaces

SQUARE = torch.tensor([[-3.0, -2.0], [3.0, -2.0], [3.0, 2.0], [-3.0, 2.0]])


def walls(*things: tuple[str, list[float], list[float], float]) -> list[Surface]:
    """The walls of a room with things: category, centre, size and yaw in degrees."""
    centre, size = (torch.tensor([thing[k] for thing in things]) for k in (1, 2))
    yaw = torch.deg2rad(torch.tensor([thing[3] for thing in things]))
    boxes = OrientedBoxes(centre, size, yaw)
    objects = objects_from_boxes(boxes, [thing[0] for thing in things], camera_height=1.6)
    scene = Scene(Panorama(1024, 512), Layout(SQUARE, ceiling_height=2.5), objects)
    return [surface for surface in scene_surfaces(scene) if surface.kind == "wall"]


def mesh(wall: Surface) -> trimesh.Trimesh:
    return trimesh.Trimesh(wall.vertices.numpy(), wall.faces.numpy(), process=False)


WINDOW = ("window", [3.1, 0.5, 1.5], [1.2, 0.2, 1.0], 90.0)


def test_a_window_opens_its_wall_and_no_other() -> None:
    room = walls(WINDOW)
    assert [len(wall.faces) > 2 for wall in room] == [False, True, False, False]
    opened = mesh(room[1])
    assert opened.area == pytest.approx(4 * 2.5 - 1.2 * 1.0, rel=1e-5)
    # seen from the room
    assert (opened.face_normals @ [-1.0, 0.0, 0.0] > 0.999).all()
    through, beside = (
        len(opened.ray.intersects_id([[0.0, y, 1.5]], [[1.0, 0.0, 0.0]])[0]) for y in (0.5, 1.5)
    )
    assert (through, beside) == (0, 1)


def test_a_door_leaves_the_threshold_and_two_openings_may_overlap() -> None:
    door = ("door", [0.0, 2.0, 1.0], [0.9, 0.3, 2.0], 0.0)
    second = ("door", [0.6, 2.05, 1.0], [0.9, 0.3, 2.0], 180.0)
    opened = mesh(walls(door, second)[2])
    assert opened.area == pytest.approx(6 * 2.5 - 1.5 * 1.98, rel=1e-4)


@pytest.mark.parametrize(
    "thing",
    [
        ("picture", [3.01, 0.5, 1.5], [1.2, 0.05, 1.0], 90.0),
        ("window", [2.5, 0.5, 1.5], [1.2, 0.2, 1.0], 90.0),
        ("window", [3.1, 0.5, 1.5], [1.2, 0.2, 1.0], 30.0),
        ("window", [5.0, 0.5, 1.5], [1.2, 0.2, 1.0], 90.0),
    ],
    ids=["picture on the wall", "before the wall", "askew", "far away"],
)
def test_other_things_open_nothing(thing: tuple[str, list[float], list[float], float]) -> None:
    assert all(len(wall.faces) == 2 for wall in walls(thing))


def test_a_picture_that_has_sunk_into_the_wall_can_be_seen() -> None:
    opened = mesh(walls(("picture", [3.04, 0.5, 1.5], [1.2, 0.05, 1.0], 92.0))[1])
    assert opened.area == pytest.approx(4 * 2.5 - 1.2 * 1.0, rel=1e-2)


def test_something_as_large_as_the_wall_leaves_its_rim() -> None:
    (_, wall, *_) = walls(("window", [3.0, 0.0, 1.25], [9.0, 0.2, 9.0], 90.0))
    assert 0 < mesh(wall).area < 0.3
