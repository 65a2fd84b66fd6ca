"""Surfaces with corners in cells: those of marching cubes, with fewer triangles where flat."""

import numpy as np
import pytest
import torch
import trimesh
from torch import Tensor

from panoscene.models.shape import _quads
from panoscene.models.shape._blocks import Blocks, first_blocks
from panoscene.models.shape._cubes import march
from panoscene.models.shape._fewer import is_closed, simplified
from panoscene.models.shape._quads import gathered_surface

CELLS = 64


def blocks(values: Tensor) -> Blocks:
    closed = torch.full_like(values, 0.5)
    closed[1:-1, 1:-1, 1:-1] = values[1:-1, 1:-1, 1:-1]
    return first_blocks(closed, torch.zeros(CELLS, CELLS, CELLS))


def gathered(values: Tensor, least: int = 0) -> trimesh.Trimesh:
    found = blocks(values)
    parts = gathered_surface(found.values, found.cases, found.place, CELLS // 4, least=least)
    return trimesh.Trimesh(*parts, process=False)


def marched(values: Tensor) -> trimesh.Trimesh:
    found = blocks(values)
    vertices, faces = march(found.values, found.cases, found.place, CELLS // 4)
    return trimesh.Trimesh(vertices.numpy(), faces.numpy(), process=False)


def grid() -> Tensor:
    axis = torch.linspace(-1, 1, CELLS + 1)
    return torch.stack(torch.meshgrid(axis, axis, axis, indexing="ij"))


def test_a_box_keeps_its_shape_with_much_fewer_triangles() -> None:
    half = torch.tensor([0.7, 0.52, 0.61])[:, None, None, None]
    values = (grid().abs() - half).amax(0)
    few, whole = gathered(values), marched(values)
    assert len(few.faces) < len(whole.faces) / 2
    assert is_closed(few.faces)
    assert few.volume == pytest.approx(whole.volume, rel=0.02)
    assert few.bounds == pytest.approx(whole.bounds, abs=1e-4)


def test_a_ball_is_a_ball() -> None:
    values = grid().norm(dim=0) - 0.7
    few, whole = gathered(values, 2000), marched(values)
    assert 2000 <= len(few.faces) < len(whole.faces) / 2
    assert is_closed(few.faces)
    assert few.volume == pytest.approx(whole.volume, rel=0.01)
    assert few.bounds == pytest.approx(whole.bounds, abs=1e-4)
    radius = np.linalg.norm(few.vertices - CELLS / 2, axis=1)
    assert radius == pytest.approx(0.7 * CELLS / 2, abs=0.3)


def test_where_nothing_is_flat_there_is_a_quad_for_each_vertex_of_marching_cubes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(_quads, "_FLAT", (2.0, 2.0))
    values = grid().norm(dim=0) - 0.7
    few, whole = gathered(values), marched(values)
    assert len(few.faces) == 2 * len(whole.vertices)
    assert few.euler_number == whole.euler_number == 2


def test_thin_plates_keep_both_sheets() -> None:
    values = (grid().abs() - torch.tensor([0.8, 0.8, 0.02])[:, None, None, None]).amax(0)
    few = gathered(values)
    assert is_closed(few.faces)
    assert few.volume == pytest.approx(marched(values).volume, rel=0.06)


def test_edges_of_noise_have_as_many_triangles_on_either_side() -> None:
    values = torch.randn((CELLS + 1,) * 3, generator=torch.Generator().manual_seed(2))
    few = gathered(values)
    edges = few.edges
    there = np.sort(edges[:, 0] * len(few.vertices) + edges[:, 1])
    back = np.sort(edges[:, 1] * len(few.vertices) + edges[:, 0])
    assert np.array_equal(there, back)
    assert few.volume == pytest.approx(marched(values).volume, rel=0.15)


def test_rough_surfaces_are_closed_in_the_end() -> None:
    coarse = torch.randn(1, 1, 9, 9, 9, generator=torch.Generator().manual_seed(3))
    values = torch.nn.functional.interpolate(coarse, (CELLS + 1,) * 3, mode="trilinear")[0, 0]
    few = gathered(values)
    found = simplified(few.vertices, few.faces.astype(np.int64), 4000)
    assert found is not None
    assert is_closed(found[1])
    mesh = trimesh.Trimesh(*found, process=False)
    assert mesh.volume == pytest.approx(marched(values).volume, rel=0.03)
