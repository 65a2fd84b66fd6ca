"""Scenes as triangles, with trimesh as the judge of volumes and directions."""

import numpy as np
import pytest
import torch
import trimesh

from panoscene.geometry import OrientedBoxes, box_corners
from panoscene.sample import sample_room_path
from panoscene.scene import (
    Layout,
    Surface,
    box_mesh,
    object_surface,
    place_vertices,
    read_scene,
    room_surfaces,
    scene_surfaces,
)

L_ROOM = [[-2.0, -2.0], [3.0, -2.0], [3.0, 1.0], [0.5, 1.0], [0.5, 2.5], [-2.0, 2.5]]


def solid(*parts: Surface) -> trimesh.Trimesh:
    meshes = [trimesh.Trimesh(p.vertices.numpy(), p.faces.numpy(), process=False) for p in parts]
    merged = trimesh.util.concatenate(meshes)
    assert isinstance(merged, trimesh.Trimesh)
    merged.merge_vertices()
    return merged


def test_the_box_points_out_and_has_the_corners_of_its_box() -> None:
    mesh = box_mesh()
    boxes = OrientedBoxes(
        torch.tensor([1.0, 2.0, 0.7]), torch.tensor([0.6, 1.2, 1.4]), torch.tensor(0.9)
    )
    placed = place_vertices(mesh.vertices, boxes)
    torch.testing.assert_close(placed, box_corners(boxes))
    judged = trimesh.Trimesh(placed.numpy(), mesh.faces.numpy())
    assert judged.is_watertight
    assert judged.volume == pytest.approx(0.6 * 1.2 * 1.4, rel=1e-5)


def test_a_room_is_closed_and_seen_from_inside() -> None:
    layout = Layout(torch.tensor(L_ROOM), floor_height=0.1, ceiling_height=2.6)
    room = solid(*room_surfaces(layout))
    assert room.is_watertight
    assert room.is_winding_consistent
    # 5 x 3 and 2.5 x 1.5 square metres; inside out, hence the sign
    assert room.volume == pytest.approx(-(15.0 + 3.75) * 2.5, rel=1e-5)


def test_the_floor_of_a_round_room_covers_it() -> None:
    turn = torch.linspace(0, 2 * torch.pi, 41)[:-1]
    radius = 2.0 + 0.7 * torch.cos(5 * turn)
    corners = torch.stack([radius * torch.cos(turn), radius * torch.sin(turn)], dim=-1)
    floor, ceiling, *_ = room_surfaces(Layout(corners))
    for part, up in ((floor, 1.0), (ceiling, -1.0)):
        judged = trimesh.Trimesh(part.vertices.numpy(), part.faces.numpy(), process=False)
        x, y = corners.double().unbind(-1)
        area = 0.5 * (x * y.roll(-1) - y * x.roll(-1)).sum()
        assert judged.area == pytest.approx(float(area), rel=1e-5)
        np.testing.assert_allclose(judged.face_normals[:, 2], up)


def test_every_part_of_the_sample_room_has_its_name() -> None:
    scene = read_scene(sample_room_path())
    parts = scene_surfaces(scene)
    assert len({part.name for part in parts}) == len(parts)
    walls = [part for part in parts if part.kind == "wall"]
    assert [wall.index for wall in walls] == list(range(len(scene.layout.floor_polygon)))
    objects = [part for part in parts if part.kind == "object"]
    assert len(objects) == len(scene.objects.boxes)
    assert objects[2].name == object_surface(scene, 2).name


def test_a_crossing_polygon_is_refused() -> None:
    crossing = torch.tensor([[0.0, 0.0], [4.0, 3.0], [4.0, 0.0], [0.0, 3.0]])
    with pytest.raises(ValueError, match="floor_polygon"):
        room_surfaces(Layout(crossing))
