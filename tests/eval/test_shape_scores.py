import dataclasses
import math

import numpy as np
import pytest
import torch
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.eval._shape_errors import ShapeErrors, shape_errors, volume_iou
from panoscene.eval._shape_records import canonical_mesh, shape_record
from panoscene.eval._shape_scores import score_shapes, shape_sums, shapes_of_sums
from panoscene.eval._surface_distance import sample_surface, surface_distance, triangle_distance
from panoscene.geometry import OrientedBoxes
from panoscene.scene import Layout, Mesh, Panorama, Scene, Shapes, box_mesh, objects_from_boxes


def mesh_from(source: trimesh.Trimesh) -> Mesh:
    return Mesh(torch.from_numpy(source.vertices.copy()), torch.from_numpy(source.faces.copy()))


def sphere(radius: float) -> Mesh:
    return mesh_from(trimesh.creation.icosphere(4, radius))


def moved(mesh: Mesh, *by: float) -> Mesh:
    return Mesh(mesh.vertices + torch.tensor(by, dtype=mesh.vertices.dtype), mesh.faces)


def random_meshes(seed: int) -> tuple[Mesh, Mesh]:
    """Return two meshes of a few triangles each."""
    generator = torch.Generator().manual_seed(seed)
    faces = torch.arange(9).reshape(3, 3)
    first, other = torch.rand(2, 9, 3, generator=generator).double()
    return Mesh(first, faces), Mesh(other, faces)


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6))
def test_triangle_distance_agrees_with_trimesh(seed: int) -> None:
    generator = torch.Generator().manual_seed(seed)
    triangle = torch.randn(200, 3, 3, generator=generator).double()
    triangle[:20, 2] = triangle[:20, 1]  # without area
    points = 2 * torch.randn(200, 3, generator=generator).double()
    nearest = trimesh.triangles.closest_point(triangle[20:].numpy(), points[20:].numpy())
    wanted = (points[20:] - torch.from_numpy(nearest)).norm(dim=-1)
    found = triangle_distance(points, triangle)
    assert torch.allclose(found[20:], wanted, atol=1e-9)
    along = torch.linspace(0, 1, 2001, dtype=torch.float64)[:, None, None]
    on_edge = triangle[:20, 0] + along * (triangle[:20, 1] - triangle[:20, 0])
    assert torch.allclose(
        found[:20], (points[:20] - on_edge).norm(dim=-1).amin(0), atol=1e-3, rtol=1e-3
    )


def test_samples_are_spread_by_area(generator: torch.Generator) -> None:
    stretched = Mesh(box_mesh().vertices * torch.tensor([1.0, 1.0, 3.0]), box_mesh().faces)
    drawn = sample_surface(stretched, 20_000, generator)
    ends = float((drawn.point[:, 2].abs() > 1.5 - 1e-9).double().mean())
    assert ends == pytest.approx(2 / 14, abs=0.01)
    assert torch.allclose(drawn.point.mean(0), torch.zeros(3).double(), atol=0.02)
    # within each face too: the middle half of the height holds half of the sides' area
    sides = drawn.point[drawn.point[:, 2].abs() < 1.5 - 1e-9]
    assert float((sides[:, 2].abs() < 0.75).double().mean()) == pytest.approx(0.5, abs=0.02)
    again = sample_surface(stretched, 20_000, torch.Generator().manual_seed(0))
    assert torch.equal(again.point, drawn.point)


def test_points_are_at_the_distance_of_the_surface(generator: torch.Generator) -> None:
    ball = sample_surface(sphere(0.5), 3000, generator)
    points = torch.nn.functional.normalize(torch.randn(500, 3, generator=generator).double())
    found = surface_distance(points * 0.8, ball)
    assert torch.allclose(found.to_surface, torch.full((500,), 0.3).double(), atol=2e-3)
    assert bool((found.to_sample >= found.to_surface - 1e-12).all())


@settings(max_examples=10)
@given(seed=st.integers(0, 10**6))
def test_a_surface_is_at_no_distance_from_itself(seed: int) -> None:
    mesh = random_meshes(seed)[0]
    generator = torch.Generator().manual_seed(seed)
    errors = shape_errors(mesh, mesh, generator=generator, points=3000)
    assert errors.mean_distance == pytest.approx(0, abs=1e-4)
    assert errors.f_score == pytest.approx(1, abs=1e-3)
    assert errors.normal_consistency == pytest.approx(1, abs=0.02)
    assert errors.volume_iou is None


@settings(max_examples=4)
@given(seed=st.integers(0, 10**6))
def test_errors_are_symmetric(seed: int) -> None:
    first, other = random_meshes(seed)
    one, two = (
        shape_errors(*pair, generator=torch.Generator().manual_seed(1), points=4000, threshold=0.1)
        for pair in ((first, other), (other, first))
    )
    assert one.chamfer == pytest.approx(two.chamfer, rel=0.1)
    assert one.mean_distance == pytest.approx(two.mean_distance, rel=0.05, abs=1e-3)
    assert one.f_score == pytest.approx(two.f_score, abs=0.05)


def test_the_chamfer_distance_of_a_cube_to_itself_is_its_sampling(
    generator: torch.Generator,
) -> None:
    errors = shape_errors(box_mesh(), box_mesh(), generator=generator)
    assert errors.chamfer == pytest.approx(2000 / math.pi * 6 / 10_000, rel=0.05)
    assert errors.f_score == pytest.approx(1, abs=1e-3)
    assert errors.normal_consistency == pytest.approx(1, abs=2e-3)
    assert errors.volume_iou == pytest.approx(1)


def test_two_shifted_cubes(generator: torch.Generator) -> None:
    """Shifted by s = 0.1 along x: four sides, a face in front and one inside, averaged by hand.

    A side is at 0 but for a strip of width s, where the distance grows to s. The face in front
    is at s. On the face inside the other cube the distance is that to the cube's nearest side,
    at most s: its mean is (1 - (1 - 2 s)^3) / 6.
    """
    shift = 0.1
    errors = shape_errors(
        moved(box_mesh(), shift, 0.0, 0.0), box_mesh(), generator=generator, threshold=0.05
    )
    inside = (1 - (1 - 2 * shift) ** 3) / 6
    assert errors.mean_distance == pytest.approx((4 * shift**2 / 2 + shift + inside) / 6, rel=0.02)
    # within 0.05: all but half of the strip; nothing; a frame of width 0.05
    assert errors.f_score == pytest.approx((4 * 0.95 + 0 + 1 - 0.9**2) / 6, abs=0.015)
    assert errors.volume_iou == pytest.approx((1 - shift) / (1 + shift), rel=1e-3)


def test_two_spheres(generator: torch.Generator) -> None:
    small, large = 0.4, 0.5
    errors = shape_errors(sphere(small), sphere(large), generator=generator, threshold=0.12)
    assert errors.mean_distance == pytest.approx(large - small, abs=2e-3)
    floor = 1000 / math.pi * 4 * math.pi * (small**2 + large**2) / 10_000
    assert errors.chamfer == pytest.approx(2000 * (large - small) ** 2 + floor, rel=0.03)
    assert errors.f_score == 1
    assert errors.normal_consistency == pytest.approx(1, abs=5e-3)
    assert errors.volume_iou == pytest.approx((small / large) ** 3, rel=5e-3)
    strict = shape_errors(sphere(small), sphere(large), generator=generator, threshold=0.08)
    assert strict.f_score == 0


def test_volumes_need_closed_meshes() -> None:
    box = box_mesh()
    lidless = Mesh(box.vertices, box.faces[2:])
    assert volume_iou(box, lidless) is None
    assert volume_iou(lidless, box) == 0
    inside_out = Mesh(box.vertices, box.faces.flip(-1))
    assert volume_iou(inside_out, box) == pytest.approx(1)
    assert volume_iou(moved(box, 3.0, 0.0, 0.0), box) == 0


def test_parts_that_touch_in_an_edge_enclose_space() -> None:
    # four triangles meet in the edge, as where two sheets of a simplified shape touch
    cube = box_mesh()
    other = moved(cube, 1.0, 1.0, 0.0)
    both = Mesh(
        torch.cat([cube.vertices, other.vertices]),
        torch.cat([cube.faces, other.faces + len(cube.vertices)]),
    )
    welded = mesh_from(trimesh.Trimesh(both.vertices.numpy(), both.faces.numpy(), process=True))
    for mesh in (both, welded):
        assert volume_iou(mesh, mesh) == pytest.approx(1.0)
        assert volume_iou(mesh, cube) == pytest.approx(0.5, abs=0.02)


@pytest.mark.parametrize("vertices", [torch.zeros(0, 3), torch.full((3, 3), math.nan)])
def test_shapes_without_a_surface_are_missed(
    vertices: torch.Tensor, generator: torch.Generator
) -> None:
    empty = Mesh(vertices, torch.arange(len(vertices)).reshape(-1, 3))
    missed = ShapeErrors(math.inf, math.inf, 0.0, 0.0, 0.0)
    assert shape_errors(empty, box_mesh(), generator=generator, points=10) == missed
    with pytest.raises(ValueError, match="mesh: expected finite triangles"):
        shape_errors(box_mesh(), empty, generator=generator, points=10)


def test_a_point_like_mesh_has_a_distance(generator: torch.Generator) -> None:
    point = Mesh(torch.zeros(3, 3), torch.tensor([[0, 1, 2]]))
    errors = shape_errors(point, sphere(0.5), generator=generator, points=500)
    assert errors.mean_distance == pytest.approx(0.5, abs=5e-3)
    assert errors.normal_consistency == 0


def test_canonical_meshes_fill_their_box() -> None:
    stretched = Mesh(sphere(1.0).vertices * torch.tensor([1.0, 2.0, 5.0]) + 7, sphere(1.0).faces)
    mesh = canonical_mesh(stretched)
    assert torch.allclose(mesh.vertices.amax(0), torch.full((3,), 0.5).double())
    assert torch.allclose(mesh.vertices, sphere(0.5).vertices, atol=1e-5)
    flat = canonical_mesh(
        Mesh(torch.eye(3)[:, :3] * torch.tensor([2.0, 2.0, 0.0]), box_mesh().faces[:0])
    )
    assert flat.vertices[:, 2].tolist() == [0, 0, 0]


def scene_of(*meshes: Mesh | None, shift: float = 0.0) -> Scene:
    """Return chairs of 1 m in a row, 2 m apart."""
    count = len(meshes)
    centre = torch.tensor([[2.0 * k + shift, 3.0, 0.5] for k in range(count)]).reshape(-1, 3)
    boxes = OrientedBoxes(centre, torch.ones(count, 3), torch.zeros(count))
    objects = objects_from_boxes(boxes, ["chair"] * count)
    objects = dataclasses.replace(objects, shapes=Shapes(mesh=meshes))
    layout = Layout(torch.tensor([[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]]))
    return Scene(Panorama(1024, 512), layout, objects, name="chairs")


def test_records_match_objects_and_count_misses(generator: torch.Generator) -> None:
    ball = Mesh(sphere(0.5).vertices.float(), sphere(0.5).faces)
    target = scene_of(ball, ball, None, ball)
    prediction = scene_of(ball, None, ball, shift=0.1)
    record = shape_record(prediction, target, generator=generator, points=1500, scene_points=4000)
    assert [(pair.prediction, pair.target) for pair in record.pairs] == [(0, 0), (1, 1)]
    assert [pair.box_stands_in for pair in record.pairs] == [False, True]
    assert (len(record.missed), record.targets_without_mesh) == (1, 1)
    first, second = record.pairs
    assert first.canonical.mean_distance == pytest.approx(0, abs=2e-3)
    assert first.canonical.volume_iou == pytest.approx(1)
    # in the world the sphere of 1 m is 0.1 m off: its mean distance is half of that
    assert first.world.mean_distance == pytest.approx(0.05, rel=0.05)
    assert second.canonical.volume_iou == pytest.approx(math.pi / 6, rel=0.01)

    score = score_shapes([record])
    assert (score.targets, score.matched, score.boxes_stand_in) == (3, 2, 1)
    assert score.canonical.volume_iou == pytest.approx((1 + math.pi / 6) / 2, rel=0.01)
    assert score.canonical_with_misses.volume_iou == pytest.approx((1 + math.pi / 6) / 3, rel=0.01)
    assert score.canonical.f_score is not None
    assert score.canonical_with_misses.f_score == pytest.approx(score.canonical.f_score * 2 / 3)
    assert score.canonical_with_misses.chamfer == score.canonical.chamfer
    assert (score.canonical.infinite, score.canonical_with_misses.infinite) == (0, 1)
    assert score.scene.shapes == 1
    assert score.scene.volume_iou is None
    assert score.scene.mean_distance is not None
    assert 0.05 < score.scene.mean_distance < 1


def test_a_missing_prediction_misses_everything(generator: torch.Generator) -> None:
    target = scene_of(box_mesh(), box_mesh())
    record = shape_record(None, target, generator=generator, points=100, scene_points=100)
    score = score_shapes([record])
    assert (score.targets, score.matched) == (2, 0)
    assert score.canonical.f_score is None
    assert score.canonical_with_misses.f_score == 0
    assert score.world_with_misses.volume_iou == 0
    assert (score.scene.f_score, score.scene.infinite, score.scene.chamfer) == (0, 1, None)


def test_scenes_without_objects_have_no_shapes(generator: torch.Generator) -> None:
    record = shape_record(scene_of(), scene_of(), generator=generator, scene_points=100)
    assert record.pairs == record.missed == ()
    assert record.scene is None
    assert score_shapes([record]).canonical_with_misses.f_score is None
    empty = shape_record(
        scene_of(), scene_of(box_mesh()), generator=generator, points=100, scene_points=100
    )
    assert len(empty.missed) == 1
    assert empty.scene is not None
    assert empty.scene.f_score == 0


@pytest.mark.parametrize("match", [[0], [0, 2], [0, 0]])
def test_a_wrong_match_is_refused(match: list[int], generator: torch.Generator) -> None:
    scene = scene_of(box_mesh(), box_mesh())
    with pytest.raises(ValueError, match="match: expected"):
        shape_record(scene, scene, generator=generator, match=torch.tensor(match), points=10)


def test_sums_of_scenes_are_worth_as_much_as_the_scenes(generator: torch.Generator) -> None:
    ball = Mesh(sphere(0.5).vertices.float(), sphere(0.5).faces)
    target, boxes = scene_of(ball, ball), scene_of(None, box_mesh())
    first = shape_record(boxes, target, generator=generator, points=300)
    second = shape_record(None, target, generator=generator, points=300)
    drawn = np.array([2, 1, 3]) @ shape_sums([first, second, None])
    found, expected = shapes_of_sums(drawn), score_shapes([first, first, second])
    assert (found.targets, found.matched, found.boxes_stand_in) == (6, 4, 2)
    for part in ("canonical", "canonical_with_misses", "world", "world_with_misses", "scene"):
        ours, theirs = (dataclasses.asdict(getattr(some, part)) for some in (found, expected))
        assert ours == pytest.approx(theirs), part
