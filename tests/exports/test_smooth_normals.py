"""Normals of round shapes, against trimesh."""

import math

import numpy as np
import pytest
import trimesh

from panoscene.exports._smooth_normals import smooth_normals


@pytest.mark.parametrize("stretch", [(1.0, 1.0, 1.0), (0.4, 2.0, 0.7)])
def test_round_shapes_get_the_normals_of_trimesh(stretch: tuple[float, ...]) -> None:
    mesh = trimesh.creation.icosphere(3).apply_scale(stretch)
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    normals = smooth_normals(vertices, faces)
    assert normals is not None
    np.testing.assert_allclose(normals, mesh.vertex_normals, atol=1e-6)


@pytest.mark.parametrize("sections", [6, 9, 12, 40])
def test_edgy_shapes_are_those_with_many_sharp_edges(sections: int) -> None:
    mesh = trimesh.creation.cylinder(1.0, 1.0, sections=sections).subdivide()
    angles = mesh.face_adjacency_angles
    edgy = float((angles > math.radians(35)).mean()) > 0.05
    found = smooth_normals(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    assert (found is None) == edgy


def test_shapes_without_normals_are_edgy() -> None:
    corner = np.eye(3)
    assert smooth_normals(corner, np.array([[0, 1, 2]])) is None
    assert smooth_normals(corner, np.zeros((0, 3), np.int64)) is None
    mesh = trimesh.creation.icosphere(2)
    lonely = np.concatenate([mesh.vertices, np.ones((1, 3))])
    assert smooth_normals(lonely, np.asarray(mesh.faces)) is None
