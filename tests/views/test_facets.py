"""Facets and the best view: as found the slow way."""

import numpy as np
import torch
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from panoscene.scene import Surface, box_mesh
from panoscene.views._facets import facets
from panoscene.views._rays import join_surfaces


def surface(mesh: trimesh.Trimesh) -> Surface:
    points = torch.tensor(mesh.vertices).float()
    return Surface("thing", "object", 0, points, torch.tensor(mesh.faces))


def test_a_box_has_six_facets_and_a_ball_one() -> None:
    box = box_mesh()
    ball = surface(trimesh.creation.icosphere(subdivisions=3))
    soup = join_surfaces([Surface("box", "object", 0, box.vertices, box.faces), ball])
    found = facets(soup)
    assert len(set(found[:12].tolist())) == 6
    assert len(set(found[12:].tolist())) == 1
    assert not set(found[:12].tolist()) & set(found[12:].tolist())


def test_facets_are_those_of_trimesh() -> None:
    generator = np.random.default_rng(0)
    mesh = trimesh.creation.icosphere(subdivisions=3)
    mesh.vertices += generator.normal(0, 0.03, mesh.vertices.shape)
    soup = join_surfaces([surface(mesh)])
    slow = trimesh.Trimesh(soup.vertices, soup.faces, process=False)
    flat = slow.face_adjacency[slow.face_adjacency_angles < np.radians(35)]
    count = len(soup.faces)
    graph = coo_array((np.ones(len(flat)), (flat[:, 0], flat[:, 1])), shape=(count, count))
    expected = connected_components(graph, directed=False)[1]
    pairs = np.unique(np.stack([facets(soup), expected]), axis=1)
    assert pairs.shape[1] == len(np.unique(expected)) == len(np.unique(pairs[0])) > 10


def test_nothing_has_no_facets() -> None:
    assert facets(join_surfaces([])).shape == (0,)
