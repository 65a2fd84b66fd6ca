"""Any polygon becomes triangles of the same area that do not cover its holes."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.synth.assets._triangulate import clip_ears, triangulate


def star(radii: list[float], turn: float) -> np.ndarray:
    angle = np.linspace(0, 2 * np.pi, len(radii), endpoint=False) + turn
    return np.stack([np.cos(angle), np.sin(angle)], axis=1) * np.array(radii)[:, None]


@settings(max_examples=40)
@given(st.lists(st.floats(0.2, 3.0), min_size=4, max_size=24), st.floats(0, 6.0))
def test_star_shaped_polygons_are_covered_once(radii: list[float], turn: float) -> None:
    polygon = star(radii, turn)
    triangles = clip_ears(polygon)
    assert triangles.shape == (len(polygon) - 2, 3)
    pieces = [shapely.Polygon(polygon[triangle]) for triangle in triangles]
    whole = shapely.Polygon(polygon)
    assert sum(piece.area for piece in pieces) == pytest.approx(whole.area, rel=1e-6)
    # the sum and the union agree: no overlap, nothing outside
    covered = shapely.union_all([piece.buffer(1e-9) for piece in pieces])
    assert covered.symmetric_difference(whole).area < 1e-5


def test_slit_to_a_hole_is_not_filled() -> None:
    outer = [[0.0, 0], [4, 0], [4, 4], [0, 4]]
    hole = [[1.0, 1], [1, 3], [3, 3], [3, 1]]
    ring = np.array([*outer, outer[0], *hole, hole[0]])
    triangles = clip_ears(ring)
    pieces = [shapely.Polygon(ring[triangle]) for triangle in triangles]
    assert sum(piece.area for piece in pieces) == pytest.approx(12.0)
    assert max(piece.intersection(shapely.Polygon(hole)).area for piece in pieces) < 1e-9


def test_two_holes_and_collinear_corners() -> None:
    ring = np.array(
        [[0.0, 0], [3, 0], [6, 0], [6, 3], [0, 3], [0, 0], [1, 1], [1, 2], [2, 2], [2, 1],
         [4, 1], [4, 2], [5, 2], [5, 1], [4, 1], [2, 1], [1, 1]]
    )  # fmt: skip
    pieces = [shapely.Polygon(ring[triangle]) for triangle in clip_ears(ring)]
    assert sum(piece.area for piece in pieces) == pytest.approx(16.0)


def test_batch_of_convex_and_concave_in_space() -> None:
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    arrow = np.array([[0.0, 0], [2, 0], [0.5, 0.5], [0, 2]])
    flat = np.concatenate([square, arrow, square[:3]])
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    corners = np.c_[flat, np.zeros(len(flat))] @ turn.T
    triangles, owner = triangulate(corners, np.array([0, 4, 8, 11]))
    assert owner.tolist() == [0, 0, 1, 1, 2]
    points = corners[triangles]
    normals = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]) / 2
    area = np.linalg.norm(normals, axis=1)
    assert np.bincount(owner, area) == pytest.approx([1.0, 1.0, 0.5])
    # all wound like their polygon: the same side up
    assert (normals @ turn[:, 2] > 0).all() or (normals @ turn[:, 2] < 0).all()


def test_polygons_without_area_and_none_at_all() -> None:
    line = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 0, 0]])
    triangles, owner = triangulate(line, np.array([0, 4]))
    assert len(triangles) == len(owner) == 2
    triangles, owner = triangulate(np.zeros((0, 3)), np.array([0]))
    assert triangles.shape == (0, 3)
