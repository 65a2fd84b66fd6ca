"""Meshes with fewer triangles: closed, in the same bounds, and of the same shape."""

import numpy as np
import pytest
import torch
import trimesh

from panoscene.models.shape._fewer import _parted, fewer_faces, is_closed, simplified, unfolded
from panoscene.scene import Mesh, box_mesh


def as_trimesh(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices.numpy(), mesh.faces.numpy(), process=False)


def test_a_ball_keeps_its_shape_and_its_bounds() -> None:
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.5)
    mesh = Mesh(torch.tensor(ball.vertices).float(), torch.tensor(ball.faces))
    found = fewer_faces(mesh, 1000)
    assert 900 <= len(found.faces) <= 1100
    few = as_trimesh(found)
    assert few.is_watertight
    assert few.is_winding_consistent
    assert few.volume == pytest.approx(ball.volume, rel=0.02)
    assert few.bounds == pytest.approx(ball.bounds, abs=1e-6)
    assert torch.equal(found.vertices, fewer_faces(mesh, 1000).vertices)


def test_meshes_with_few_triangles_stay_as_they_are() -> None:
    mesh = box_mesh()
    assert fewer_faces(mesh, 12) is mesh


def test_few_triangles_are_only_mended() -> None:
    few = trimesh.creation.icosphere(subdivisions=2, radius=0.5)
    found = simplified(few.vertices, few.faces.astype(np.int64), 400)
    assert found is not None
    assert found[0] == pytest.approx(few.vertices)
    assert np.array_equal(found[1], few.faces)
    assert simplified(few.vertices, few.faces[1:].astype(np.int64), 400) is None


def test_what_is_not_closed_stays_as_it_is() -> None:
    grid = trimesh.creation.icosphere(subdivisions=3)
    mesh = Mesh(torch.tensor(grid.vertices).float(), torch.tensor(grid.faces[400:]))
    assert fewer_faces(mesh, 100) is mesh


def test_sheets_that_touch_in_an_edge_are_parted() -> None:
    # two tetrahedra with an edge in common
    faces = np.array(
        [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2], [0, 4, 1], [0, 1, 5], [1, 4, 5], [0, 5, 4]]
    )
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0], [0, 0, -1]]
    points = np.array(corners, float)
    assert not is_closed(faces)
    parted, found = _parted(points, faces)
    assert is_closed(found)
    both = trimesh.Trimesh(parted, found, process=False)
    assert both.is_watertight
    assert [part.volume for part in both.split()] == [pytest.approx(1 / 6)] * 2


def test_triangles_back_to_back_go() -> None:
    faces = np.array([[0, 1, 2], [3, 4, 5], [2, 1, 0]])
    assert unfolded(faces).tolist() == [[3, 4, 5]]


def test_of_three_triangles_on_one_another_one_is_left() -> None:
    faces = np.array([[0, 1, 2], [3, 4, 5], [2, 1, 0], [1, 2, 0]])
    found = unfolded(faces)
    assert len(found) == 2
    assert [3, 4, 5] in found.tolist()
    first = next(face for face in found.tolist() if 0 in face)
    assert first in ([0, 1, 2], [1, 2, 0])
