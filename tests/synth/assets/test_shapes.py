"""Closed surfaces and signed distances against bodies whose distance is known."""

from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree

from panoscene.synth.assets import (
    AssetError,
    CadModel,
    ClosedSurface,
    Material,
    close_surface,
    sample_shape,
)
from panoscene.synth.assets._shape_files import is_closed, read_shape, write_shape

for package in ("skimage", "fast_simplification"):
    pytest.importorskip(package, reason="an optional package")


def model(mesh: trimesh.Trimesh, placement: str = "floor") -> CadModel:
    size = np.ptp(mesh.vertices, axis=0)
    centre = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    return CadModel(
        id="test/a",
        base="test/a",
        category="table",
        vertices=(mesh.vertices - centre).astype(np.float32),
        normals=np.zeros((len(mesh.vertices), 3), np.float32),
        uv=np.zeros((len(mesh.vertices), 2), np.float32),
        faces=np.asarray(mesh.faces, np.int32),
        face_material=np.zeros(len(mesh.faces), np.int16),
        materials=(Material("m"),),
        size=(float(size[0]), float(size[1]), float(size[2])),
        placement=placement,  # ty: ignore[invalid-argument-type]
    )


def test_ball_with_a_sliver_missing() -> None:
    ball = trimesh.creation.icosphere(3, 0.6)
    ball.update_faces(np.arange(len(ball.faces)) > 0)
    assert not ball.is_watertight
    shape = sample_shape(model(ball), np.random.default_rng(0), 1500, resolution=44)
    assert shape.scale == pytest.approx(1.2, abs=0.01)
    assert is_closed(shape.faces.astype(np.int64))
    assert trimesh.Trimesh(shape.vertices, shape.faces).volume == pytest.approx(np.pi / 6, rel=0.03)
    for found in (shape.near, shape.uniform):
        true = np.linalg.norm(found[:, :3], axis=1) - 0.5
        assert np.abs(found[:, 3] - true).max() < 0.02
        assert np.abs(found[:, 3] - true).mean() < 0.004
        clear = np.abs(true) > 0.012
        assert (np.sign(found[clear, 3]) == np.sign(true[clear])).all()
    assert np.abs(shape.near[:, 3]).max() < 0.045
    assert np.abs(shape.uniform[:, :3]).max() <= 0.7
    axis = np.linspace(-0.7, 0.7, 32)
    assert shape.grid[31, 16, 16] == pytest.approx(
        np.hypot(np.hypot(0.7, axis[16]), axis[16]) - 0.5, abs=0.02
    )


def test_body_open_below_is_closed_but_not_one_open_above() -> None:
    box = trimesh.creation.box((1, 1, 1))
    sides = np.abs(box.face_normals[:, 2]) < 0.5
    below = box.copy()
    below.update_faces(sides | (box.face_normals[:, 2] > 0.5))
    above = box.copy()
    above.update_faces(sides | (box.face_normals[:, 2] < -0.5))
    middle = np.zeros((1, 3))
    assert close_surface(model(below), 32).inside(middle).all()
    assert not close_surface(model(above), 32).inside(middle).any()
    behind = box.copy()
    behind.update_faces(box.face_normals[:, 1] > -0.5)
    assert not close_surface(model(behind), 32).inside(middle).any()
    assert close_surface(model(behind, "wall"), 32).inside(middle).all()


def test_a_sheet_gets_a_thickness_and_keeps_its_outline() -> None:
    sheet = trimesh.creation.box((1.5, 1.0, 0.004))
    surface = close_surface(model(sheet), 64)
    assert np.ptp(surface.vertices, axis=0) * surface.scale == pytest.approx(
        [1.5, 1.0, 0.02], rel=0.05
    )
    assert is_closed(surface.faces)
    assert surface.inside(np.zeros((1, 3))).all()


def shown(surface: ClosedSurface, places: np.ndarray) -> bool:
    """Return whether places of a body are in it or within a voxel and a half of its surface."""
    away = np.asarray(KDTree(surface.vertices).query(places)[0])
    return bool((surface.inside(places) | (away < 1.5 / 96)).all())


@pytest.mark.parametrize("thick", [0.004, 0.012, 0.02, 0.05])
def test_thin_parts_stay_and_thick_ones_keep_their_size(thick: float) -> None:
    parts = [trimesh.creation.box((1.2, 0.7, thick))]
    for x in (-0.5, 0.5):
        for y in (-0.3, 0.3):
            leg = trimesh.creation.box((2 * thick, 2 * thick, 0.7))
            leg.apply_translation((x, y, -0.35 + thick / 2))
            parts.append(leg)
    table = trimesh.util.concatenate(parts)
    assert isinstance(table, trimesh.Trimesh)
    surface = close_surface(model(table), 96)
    assert is_closed(surface.faces)
    mesh = trimesh.Trimesh(surface.vertices * surface.scale, surface.faces, process=False)
    assert np.ptp(mesh.vertices, axis=0) == pytest.approx([1.2, 0.7, 0.7], abs=0.01)
    middle = (table.vertices.min(axis=0) + table.vertices.max(axis=0)) / 2
    for part in parts:  # no piece of it is missing
        axis = part.bounds.mean(axis=0) - middle
        along = np.linspace(-0.45, 0.45, 60)[:, None] * np.ptp(part.bounds, axis=0)
        long = along * (np.ptp(part.bounds, axis=0) > 0.5)
        assert shown(surface, (axis + long) / surface.scale)
    if thick > 2.5 * 1.2 / 96:
        assert mesh.volume == pytest.approx(sum(part.volume for part in parts), rel=0.1)


def test_a_sheet_before_a_body_stays() -> None:
    for gap in (0.012, 0.02, 0.03, 0.05):
        sheet = trimesh.creation.box((0.6, 0.0005, 0.1))
        sheet.apply_translation((0, 0.25 + gap, 0))
        both = trimesh.util.concatenate([trimesh.creation.box((1, 0.5, 0.3)), sheet])
        assert isinstance(both, trimesh.Trimesh)
        surface = close_surface(model(both), 96)
        x, z = np.meshgrid(np.linspace(-0.28, 0.28, 30), np.linspace(-0.04, 0.04, 9))
        places = np.stack([x, np.full_like(x, 0.25 + gap), z], axis=-1).reshape(-1, 3)
        assert shown(surface, places - (0, gap / 2, 0))
        volume = trimesh.Trimesh(surface.vertices, surface.faces, process=False).volume
        assert volume < 0.15 + 0.6 * 0.1 * max(1.6 * 2 / 96, gap + 2 / 96) + 0.003


def test_shapes_are_written_and_read(tmp_path: Path) -> None:
    shape = sample_shape(model(trimesh.creation.box((1, 1, 2))), np.random.default_rng(0), 500, 24)
    again = sample_shape(model(trimesh.creation.box((1, 1, 2))), np.random.default_rng(0), 500, 24)
    assert np.array_equal(shape.near, again.near)
    write_shape(tmp_path, "test/a", shape)
    found = read_shape(tmp_path, "test/a")
    assert np.array_equal(found.grid, shape.grid)
    assert found.scale == shape.scale
    with pytest.raises(AssetError, match="--shapes"):
        read_shape(tmp_path, "test/b")
    file = next((tmp_path / "shapes").iterdir())
    file.write_bytes(file.read_bytes()[:200])
    with pytest.raises(AssetError, match="damaged"):
        read_shape(tmp_path, "test/a")
