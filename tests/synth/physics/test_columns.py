import numpy as np
import trimesh

from panoscene.synth.physics._columns import column_hits, columns_over


def test_a_ball_is_cut_where_the_formula_says():
    ball = trimesh.creation.icosphere(subdivisions=5, radius=1.0)
    columns = columns_over(np.array([-1.0, -1.0]), np.array([1.0, 1.0]), 900, 0.001, 0.1)
    hits = column_hits(np.array(ball.triangles), columns)
    cell, height = hits.cell, hits.height
    radius = np.linalg.norm(columns.places(cell), axis=1)
    inner = radius < 0.95
    expected = np.sqrt(1 - radius[inner] ** 2)
    np.testing.assert_allclose(np.abs(height[inner]), expected, atol=4e-3)
    places = columns.places(np.arange(columns.number))
    np.testing.assert_array_equal(hits.side[inner], -np.sign(height[inner]))
    missed = np.setdiff1d(np.flatnonzero(np.linalg.norm(places, axis=1) < 0.99), cell)
    assert not len(missed)


def test_cuts_are_those_of_a_ray_tracer():
    rng = np.random.default_rng(3)
    triangles = rng.uniform(-1, 1, (40, 3, 3))
    columns = columns_over(np.array([-0.9, -0.8]), np.array([0.7, 1.0]), 400, 0.001, 0.2)
    hits = column_hits(triangles, columns)
    cell, height = hits.cell, hits.height
    mesh = trimesh.Trimesh(triangles.reshape(-1, 3), np.arange(120).reshape(-1, 3), process=False)
    places = columns.places(np.arange(columns.number))
    origins = np.column_stack([places, np.full(len(places), -2.0)])
    up = np.tile([0.0, 0.0, 1.0], (len(places), 1))
    first = mesh.ray.intersects_first(origins, up)
    lines, lowest = np.unique(cell, return_index=True)
    np.testing.assert_array_equal(lines, np.flatnonzero(first >= 0))
    found = mesh.ray.intersects_location(origins, up, multiple_hits=False)
    order = np.argsort(found[1])
    np.testing.assert_allclose(height[lowest], found[0][order, 2], atol=1e-5)


def test_nothing_is_hit_beside_the_triangles():
    columns = columns_over(np.array([5.0, 5.0]), np.array([6.0, 6.0]))
    hits = column_hits(np.zeros((2, 3, 3)), columns)
    assert len(hits.cell) == len(hits.height) == len(hits.side) == 0
