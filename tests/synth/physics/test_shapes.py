from pathlib import Path

import numpy as np
import pytest
import trimesh

from panoscene.synth.physics import collision_shape


def covered(boxes, points, margin):
    inside = (points[:, None] >= boxes[:, 0] - margin) & (points[:, None] <= boxes[:, 1] + margin)
    return inside.all(axis=-1).any(axis=1)


@pytest.mark.parametrize("name", ["table", "chair", "shelf", "sofa", "lamp"])
def test_the_boxes_contain_the_surface(models, cache, name):
    model = models[name]
    boxes = collision_shape(model, cache).boxes
    mesh = trimesh.Trimesh(model.vertices, model.faces, process=False)
    points = trimesh.sample.sample_surface(mesh, 4000, seed=1)[0]
    assert covered(boxes, points, 0.002).mean() > 0.995
    assert covered(boxes, points, 0.01).all()


@pytest.mark.parametrize("name", ["table", "chair", "shelf", "sofa"])
def test_little_more_is_covered_than_the_model(models, cache, name):
    """Boxes end where the surface ends, or at most a voxel beyond an inner corner."""
    model = models[name]
    boxes = collision_shape(model, cache).boxes
    rng = np.random.default_rng(2)
    points = np.concatenate([rng.uniform(low, high, (200, 3)) for low, high in boxes])
    mesh = trimesh.Trimesh(model.vertices, model.faces, process=False)
    beyond = np.full(len(points), np.inf)
    for part in mesh.split(only_watertight=False):
        low, high = part.bounds
        outside = np.maximum(np.maximum(low - points, points - high), 0.0)
        beyond = np.minimum(beyond, np.linalg.norm(outside, axis=1))
    assert beyond.max() < 0.03
    assert (beyond < 0.002).mean() > 0.8
    assert len(boxes) < 30


def test_there_is_room_under_a_table_and_between_boards(models, cache):
    table, shelf = models["table"], models["shelf"]
    under = np.array([[0.0, 0.0, -0.2], [0.3, 0.1, 0.2]])
    assert not covered(collision_shape(table, cache).boxes, under, 0.0).any()
    assert not covered(collision_shape(shelf, cache).boxes, np.array([[0.0, 0.0, -0.2]]), 0.0).any()
    assert (collision_shape(table, cache).states(under) == 0).all()


def test_a_body_without_a_bottom_is_solid(models):
    model = models["cabinet"]
    closed = collision_shape(model)
    assert closed.states(np.zeros((1, 3)))[0] == 2
    assert closed.states(np.array([[9.0, 0.0, 0.0]]))[0] == 0
    assert len(closed.boxes) == 1
    np.testing.assert_allclose(closed.boxes[0, 1] - closed.boxes[0, 0], model.size, atol=1e-5)


def test_shapes_are_kept_and_damaged_files_made_again(models, tmp_path: Path):
    first = collision_shape(models["lamp"], tmp_path)
    (file,) = (tmp_path / "collision").iterdir()
    again = collision_shape(models["lamp"], tmp_path)
    file.write_bytes(b"PK damaged")
    repaired = collision_shape(models["lamp"], tmp_path)
    content = bytearray(file.read_bytes())
    content[200:230] = bytes(30)  # inside the packed numbers: zlib notices
    file.write_bytes(content)
    mended = collision_shape(models["lamp"], tmp_path)
    for other in (again, repaired, mended):
        np.testing.assert_array_equal(first.boxes, other.boxes)
        np.testing.assert_array_equal(first.state, other.state)
    assert file.read_bytes() != b"PK damaged"


def test_few_boxes_when_few_are_wanted(models):
    assert len(collision_shape(models["lamp"], most_boxes=12).boxes) <= 12
