"""Winding, normals, welding and simplification of loose triangles."""

import numpy as np
import pytest
import trimesh

from panoscene.synth.assets._decimate import decimated
from panoscene.synth.assets._soup import Triangles, cleaned, indexed, oriented, weld


def joined(*meshes: trimesh.Trimesh) -> trimesh.Trimesh:
    mesh = trimesh.util.concatenate(list(meshes))
    assert isinstance(mesh, trimesh.Trimesh)
    return mesh


def soup(mesh: trimesh.Trimesh, uv: np.ndarray | None = None) -> Triangles:
    positions = np.asarray(mesh.vertices, np.float64)[mesh.faces]
    count = len(positions)
    texels = np.zeros((count, 3, 2)) if uv is None else uv[mesh.faces]
    return Triangles(positions, texels, np.zeros((count, 3, 3)), np.zeros(count, np.int64))


def area_vectors(triangles: Triangles) -> np.ndarray:
    p = triangles.positions
    return np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])


def test_inside_out_shells_are_turned() -> None:
    ball, box = trimesh.creation.icosphere(2, 0.5), trimesh.creation.box((1, 1, 1))
    box.apply_translation((3, 0, 0))
    box.invert()
    turned = oriented(soup(joined(ball, box)))
    volume = np.einsum("nx,nx->n", area_vectors(turned), turned.positions.mean(axis=1)).sum() / 6
    assert volume == pytest.approx(ball.volume + 1.0)


def test_open_sheets_keep_their_winding_unless_normals_speak_against() -> None:
    sheet = soup(trimesh.creation.box((1, 1, 1))).take(np.array([0, 1]))
    assert np.allclose(oriented(sheet).positions, sheet.positions)
    flat = -np.repeat(area_vectors(sheet)[:, None], 3, axis=1)
    against = Triangles(sheet.positions, sheet.uv, flat, sheet.label)
    turned = oriented(against)
    assert (np.einsum("nx,nx->n", area_vectors(turned), turned.normals[:, 0]) > 0).all()


def test_box_is_flat_and_ball_is_smooth() -> None:
    box = indexed(soup(trimesh.creation.box((1, 2, 3))))
    assert len(box.vertices) == 24
    assert np.abs(box.normals).max(axis=1) == pytest.approx(1.0)
    ball = indexed(soup(trimesh.creation.icosphere(3, 1.0)))
    assert len(ball.vertices) == 642
    assert np.einsum("nx,nx->n", ball.normals, ball.vertices).min() > 0.999


def test_normals_of_a_file_are_kept_unless_astray() -> None:
    ball = trimesh.creation.icosphere(1, 1.0)
    given = np.asarray(ball.vertices)[ball.faces]
    plain = soup(ball)
    kept = indexed(Triangles(plain.positions, plain.uv, given * 7, plain.label))
    assert np.einsum("nx,nx->n", kept.normals, kept.vertices).min() > 0.9999
    box = soup(trimesh.creation.box((1, 1, 1)))
    odd = Triangles(box.positions, box.uv, box.positions.copy(), box.label)
    assert np.abs(indexed(odd).normals).max(axis=1) == pytest.approx(1.0)


def test_degenerate_and_coincident_triangles_go_and_the_textured_one_stays() -> None:
    a, b, c = [0.0, 0, 0], [1.0, 0, 0], [0.0, 1, 0]
    positions = np.array([[a, b, c], [b, a, c], [a, b, b], [a, [0.5, 0, 0], b], [c, b, a]])
    none = np.zeros_like(positions)
    triangles = Triangles(positions, none[..., :2], none, np.array([0, 1, 0, 0, 0]))
    assert cleaned(triangles).label.tolist() == [0]
    assert cleaned(triangles, prefer=np.array([False, True])).label.tolist() == [1]


def test_welding_sees_places_not_numbers() -> None:
    points = np.array([[0.0, 0, 0], [1e-8, 0, 0], [1, 2, 3], [1.001, 2, 3]])
    number = weld(points)
    assert number[0] == number[1]
    assert len(set(number.tolist())) == 3


def test_simplified_mesh_keeps_shape_labels_and_texture() -> None:
    pytest.importorskip("fast_simplification")
    ball = trimesh.creation.icosphere(5, 1.0)
    points = np.asarray(ball.vertices)
    full = soup(ball, uv=points[:, :2] * 0.5 + 0.5)
    label = (full.positions[..., 2].mean(axis=1) > 0).astype(np.int64)
    full = Triangles(full.positions, full.uv, full.normals, label)
    light = decimated(full, 3000)
    assert 2000 < len(light.label) <= 3000
    radius = np.linalg.norm(light.positions, axis=2)
    assert radius.min() > 0.98
    assert radius.max() < 1.02
    upper = light.positions[..., 2].mean(axis=1)
    assert ((upper > 0.05) <= (light.label == 1)).all()
    assert ((upper < -0.05) <= (light.label == 0)).all()
    steep = np.abs(light.positions[..., 2]) > 0.3
    error = np.abs(light.uv - (light.positions[..., :2] * 0.5 + 0.5)).max(axis=-1)
    assert error[steep].max() < 0.05
    assert decimated(light, 3000) is light


def test_open_panels_stay_whole_when_something_else_is_heavy() -> None:
    pytest.importorskip("fast_simplification")
    panel = trimesh.Trimesh([[0, 0, 0], [4, 0, 0], [4, 2, 0], [0, 2, 0]], [[0, 1, 2], [0, 2, 3]])
    ball = trimesh.creation.icosphere(5, 0.5)
    ball.apply_translation((0, 0, 3))
    light = decimated(soup(joined(panel, ball)), 5000)
    flat = light.positions[..., 2].max(axis=1) < 1e-9
    area = np.linalg.norm(area_vectors(light), axis=1) / 2
    assert area[flat].sum() == pytest.approx(8.0)


def test_what_cannot_be_collapsed_is_clustered() -> None:
    pytest.importorskip("fast_simplification")
    rng = np.random.default_rng(1)
    positions = rng.uniform(0, 1, (3000, 1, 3)) + rng.normal(0, 0.01, (3000, 3, 3))
    loose = Triangles(
        positions, np.zeros((3000, 3, 2)), np.zeros((3000, 3, 3)), np.zeros(3000, np.int64)
    )
    assert 0 < len(decimated(loose, 500).label) <= 500
