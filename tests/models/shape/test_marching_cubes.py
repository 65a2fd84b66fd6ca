"""Surfaces of grids: closed whatever the values are, and where those of scikit-image are."""

import numpy as np
import pytest
import torch
import trimesh
from jaxtyping import Int64
from skimage.measure import marching_cubes
from torch import Tensor

from panoscene.models.shape._blocks import finer_blocks, first_blocks
from panoscene.models.shape._cubes import case_triangles, march
from panoscene.models.shape._fewer import is_closed

BORDER = 0.5


def closed(values: Tensor) -> Tensor:
    """Return values of which those at the border are outside."""
    found = torch.full_like(values, BORDER)
    found[1:-1, 1:-1, 1:-1] = values[1:-1, 1:-1, 1:-1]
    return found


def surface(values: Tensor) -> trimesh.Trimesh:
    cells = len(values) - 1
    blocks = first_blocks(values, torch.zeros(cells, cells, cells))
    vertices, faces = march(blocks.values, blocks.cases, blocks.place, cells // 4)
    return trimesh.Trimesh(vertices.numpy(), faces.numpy(), process=False)


def ball(cells: int, radius: float) -> Tensor:
    axis = torch.linspace(-1, 1, cells + 1)
    return torch.stack(torch.meshgrid(axis, axis, axis, indexing="ij")).norm(dim=0) - radius


def test_each_case_has_the_crossed_edges() -> None:
    triangles = case_triangles()
    edges = [(a, b) for a in range(8) for b in range(8) if a < b and (a ^ b) in (1, 2, 4)]
    assert triangles[0] == triangles[255] == ()
    for case, found in enumerate(triangles):
        crossed = {k for k, (a, b) in enumerate(edges) if (case >> a & 1) != (case >> b & 1)}
        assert {edge for triangle in found for edge in triangle} == crossed
    assert max(map(len, triangles)) == 5


@pytest.mark.parametrize("seed", range(3))
def test_surfaces_of_noise_are_closed(seed: int) -> None:
    # every case comes many times, with every case beside it
    values = torch.randn(25, 25, 25, generator=torch.Generator().manual_seed(seed))
    found = surface(closed(values))
    assert is_closed(found.faces)
    assert found.volume > 0


def test_a_surface_is_that_of_scikit_image() -> None:
    values = ball(24, 0.7) + 0.1 * torch.sin(7 * ball(24, 0.0))
    found = surface(values)
    vertices, faces, _, _ = marching_cubes(values.numpy(), 0.0, gradient_direction="descent")
    other = trimesh.Trimesh(vertices, faces, process=False)
    assert len(found.faces) == len(faces)
    assert np.sort(found.vertices, axis=0) == pytest.approx(np.sort(vertices, axis=0), abs=1e-4)
    assert found.volume == pytest.approx(other.volume, rel=1e-4)
    assert found.area == pytest.approx(other.area, rel=1e-3)


def test_divided_blocks_are_those_of_the_fine_grid() -> None:
    fine, coarse = ball(32, 0.6), ball(16, 0.6)
    unknown = torch.full((16, 16, 16), torch.inf)

    def exact(number: Int64[Tensor, " n"]) -> Tensor:
        return fine.flatten()[number]

    blocks = finer_blocks(first_blocks(coarse, unknown), exact)
    vertices, faces = march(blocks.values, blocks.cases, blocks.place, 8)
    whole = surface(fine)
    assert is_closed(faces.numpy())
    assert trimesh.Trimesh(vertices, faces).volume == pytest.approx(whole.volume, rel=1e-4)
    # parabolas know the ball well enough: nothing is asked for
    known = torch.zeros(16, 16, 16)
    guessed = finer_blocks(first_blocks(coarse, known), lambda number: number * torch.nan)
    vertices, faces = march(guessed.values, guessed.cases, guessed.place, 8)
    assert is_closed(faces.numpy())
    assert trimesh.Trimesh(vertices, faces).volume == pytest.approx(whole.volume, rel=0.01)


def test_what_only_fine_nodes_see_stays_closed() -> None:
    coarse = ball(16, 0.6)
    noise = torch.randn(33, 33, 33, generator=torch.Generator().manual_seed(4))
    unknown = torch.full((16, 16, 16), torch.inf)
    blocks = first_blocks(coarse, unknown)
    for _ in range(2):
        blocks = finer_blocks(blocks, lambda number: noise.flatten()[number % noise.numel()])
    _, faces = march(blocks.values, blocks.cases, blocks.place, 16)
    assert is_closed(faces.numpy())


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("upper", [True, False])
def test_parabolas_do_up_to_the_rim(axis: int, upper: bool) -> None:
    # a board on one side, its inner face in the last cell before the rim
    place = torch.linspace(-1, 1, 33)
    along = place if upper else place.flip(0)
    board = (0.9 - along) + 0.3 * (along - 0.9) ** 2
    values = board.view([-1 if k == axis else 1 for k in range(3)]).expand(33, 33, 33)

    def never(number: Int64[Tensor, " n"]) -> Tensor:
        assert len(number) == 0
        return number.float()

    blocks = first_blocks(closed(values), torch.zeros(32, 32, 32), rim=True)
    for _ in range(2):
        blocks = finer_blocks(blocks, never)
    assert blocks.rim == 4
    vertices, faces = march(blocks.values, blocks.cases, blocks.place, 32)
    assert is_closed(faces.numpy())
    height = vertices[:, axis] if upper else 128 - vertices[:, axis]
    across = torch.cat((vertices[:, :axis], vertices[:, axis + 1 :]), 1)
    height = height[((across > 16) & (across < 112)).all(1)]
    inner = height[height < 123]
    assert inner.tolist() == pytest.approx([0.95 * 128] * 95**2, abs=0.01)
    assert (height[height > 123] - 125).abs().max() < 0.01


def test_in_the_rim_nothing_is_asked_for() -> None:
    generator = torch.Generator().manual_seed(7)
    coarse = closed(torch.randn(17, 17, 17, generator=generator))
    blocks = first_blocks(coarse, torch.full((16, 16, 16), torch.inf), rim=True)
    asked = []

    def evaluate(number: Int64[Tensor, " n"]) -> Tensor:
        asked.append(number)
        return torch.randn(len(number), generator=generator)

    for cells, rim in ((32, 2), (64, 4)):
        blocks = finer_blocks(blocks, evaluate)
        nodes = cells + 1
        number = asked[-1]
        assert len(number) == len(number.unique()) > 1000
        ticks = torch.stack((number // nodes**2, number // nodes % nodes, number % nodes))
        assert ticks.min() == rim
        assert ticks.max() == cells - rim
    vertices, faces = march(blocks.values, blocks.cases, blocks.place, 16)
    assert is_closed(faces.numpy())
    assert vertices.min() > 3
    assert vertices.max() < 61
