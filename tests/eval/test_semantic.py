import dataclasses
import math

import numpy as np
import pytest
import torch
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.eval._semantic import SemanticRecord, score_semantic, semantic_record
from panoscene.eval._semantic_labels import semantic_labels, sphere_directions
from panoscene.geometry import OrientedBoxes, box_corners
from panoscene.scene import (
    CATEGORIES,
    PANOCONTEXT_12,
    PANOCONTEXT_LABELS,
    Layout,
    Mesh,
    Panorama,
    Scene,
    Shapes,
    box_mesh,
    objects_from_boxes,
    scene_surfaces,
)
from panoscene.synth import sample_room

POINTS = sphere_directions(5000)
AHEAD = torch.tensor([[0.0, 1.0, 0.0]])


def scene_of(*objects: tuple[str, tuple[float, ...], tuple[float, ...], float]) -> Scene:
    """Return a room of 8 x 8 x 3.2 m, camera in the middle, with (category, centre, size, yaw)."""
    boxes = OrientedBoxes(
        torch.tensor([one[1] for one in objects]).reshape(-1, 3),
        torch.tensor([one[2] for one in objects]).reshape(-1, 3),
        torch.tensor([one[3] for one in objects]),
    )
    polygon = torch.tensor([[-4.0, -4.0], [4.0, -4.0], [4.0, 4.0], [-4.0, 4.0]])
    layout = Layout(polygon, ceiling_height=3.2)
    objects_ = objects_from_boxes(boxes, [one[0] for one in objects])
    return Scene(Panorama(1024, 512), layout, objects_, name="room")


def seen(scene: Scene, directions: torch.Tensor = AHEAD, method: str = "boxes") -> list[str]:
    labels = semantic_labels(scene, directions, method)  # ty: ignore[invalid-argument-type]
    return [PANOCONTEXT_12[k] for k in labels.tolist()]


def test_directions_stand_for_equal_parts_of_the_sphere() -> None:
    assert torch.allclose(POINTS.norm(dim=-1), torch.ones(5000), atol=1e-6)
    axis = torch.nn.functional.normalize(
        torch.randn(50, 3, generator=torch.Generator().manual_seed(0)), dim=-1
    )
    for cosine in (-0.5, 0.0, 0.9):  # a cap above it covers (1 - cosine) / 2
        share = (cosine < POINTS @ axis.T).float().mean(0)
        assert torch.allclose(share, torch.tensor((1 - cosine) / 2), atol=2e-3)
    with pytest.raises(ValueError, match="count: expected at least 1"):
        sphere_directions(0)


@pytest.mark.parametrize("method", ["boxes", "surfaces"])
def test_a_box_ahead_covers_its_solid_angle(method: str) -> None:
    """A rectangle of half sides a, b at h covers 4 asin(a b / sqrt((a^2 + h^2) (b^2 + h^2)))."""
    a, b, h = 0.8, 0.5, 1.5
    scene = scene_of(("bed", (0.0, h + 0.3, 1.6), (2 * a, 0.6, 2 * b), 0.0))
    labels = semantic_labels(scene, sphere_directions(100_000), method)  # ty: ignore[invalid-argument-type]
    share = (labels == PANOCONTEXT_12.index("bed")).float().mean()
    wanted = 4 * math.asin(a * b / math.sqrt((a * a + h * h) * (b * b + h * h))) / (4 * math.pi)
    assert float(share) == pytest.approx(wanted, rel=2e-3)


@settings(max_examples=20)
@given(
    centre=st.tuples(*[st.floats(-3, 3)] * 3),
    size=st.tuples(*[st.floats(0.05, 2)] * 3),
    yaw=st.floats(-3.1, 3.1),
)
def test_outlines_are_what_rays_hit(
    centre: tuple[float, ...], size: tuple[float, ...], yaw: float
) -> None:
    scene = scene_of(("sofa", (*centre[:2], centre[2] + 1.6), size, yaw))
    corners = box_corners(scene.objects.boxes)[0].numpy() - [0, 0, 1.6]
    mesh = trimesh.Trimesh(corners, box_mesh().faces.numpy(), process=False)
    rays = POINTS[:1500].double().numpy()
    hit = mesh.ray.intersects_any(np.zeros_like(rays), rays)
    if mesh.contains([[0.0, 0.0, 0.0]])[0]:
        hit[:] = False  # no outline from inside
    drawn = semantic_labels(scene, POINTS[:1500]).numpy() == PANOCONTEXT_12.index("sofa")
    assert (drawn != hit).sum() <= 2  # at the rim


@pytest.mark.parametrize("seed", [0, 1])
def test_surfaces_agree_with_rays_cast_at_all_triangles(seed: int) -> None:
    scene = sample_room(np.random.default_rng(seed), objects=20)
    camera = np.array([0.0, 0.0, scene.panorama.camera_height])
    surfaces = scene_surfaces(scene)
    names = ["background" if s.kind != "object" else _label(scene, s.index) for s in surfaces]
    corners = np.concatenate([s.vertices[s.faces].numpy() for s in surfaces]).astype(float)
    owner = np.repeat(np.arange(len(surfaces)), [len(s.faces) for s in surfaces])
    joined = trimesh.Trimesh(**trimesh.triangles.to_kwargs(corners), process=False)
    rays = POINTS.double().numpy()
    index = joined.ray.intersects_first(np.broadcast_to(camera, rays.shape), rays)
    wanted = np.array([PANOCONTEXT_12.index(names[k]) for k in owner[index]])
    found = semantic_labels(scene, POINTS, "surfaces").numpy()
    assert len(np.unique(wanted)) > 3
    assert (found != wanted)[index >= 0].mean() < 2e-3


def _label(scene: Scene, index: int) -> str:
    return PANOCONTEXT_LABELS[CATEGORIES[int(scene.objects.category[index])]]


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_boxes_are_drawn_by_centre_and_surfaces_as_they_are(order: tuple[int, ...]) -> None:
    """A long bed's near end is in front of a chair, but its centre is farther away."""
    objects = [
        ("bed", (0.0, 3.0, 1.6), (1.0, 4.0, 1.0), 0.0),
        ("chair", (0.0, 2.0, 1.6), (0.4, 0.4, 0.4), 0.0),
    ]
    scene = scene_of(*[objects[k] for k in order])
    assert seen(scene) == ["chair"]
    assert seen(scene, method="surfaces") == ["bed"]


def test_other_categories_hide_what_is_behind_them() -> None:
    bed = ("bed", (0.0, 3.0, 1.6), (1.0, 1.0, 1.0), 0.0)
    plant = ("plant", (0.0, 1.5, 1.6), (0.5, 0.5, 0.5), 0.3)
    assert seen(scene_of(bed)) == ["bed"]
    assert seen(scene_of(bed, plant)) == ["background"]
    assert seen(scene_of(bed, plant), method="surfaces") == ["background"]


def test_only_surfaces_hide_behind_walls() -> None:
    scene = scene_of(("bed", (0.0, 6.0, 1.6), (1.0, 1.0, 1.0), 0.0))
    assert seen(scene) == ["bed"]
    assert seen(scene, method="surfaces") == ["background"]
    crossed = Layout(torch.tensor([[-4.0, -4.0], [4.0, 4.0], [4.0, -4.0], [-4.0, 4.0]]))
    assert seen(dataclasses.replace(scene, layout=crossed), method="surfaces") == ["bed"]


@pytest.mark.parametrize("method", ["boxes", "surfaces"])
def test_a_flush_picture_is_seen(method: str) -> None:
    picture = ("picture", (0.0, 4.0, 1.6), (1.0, 1e-9, 1.0), 0.0)
    assert seen(scene_of(picture), method=method) == ["painting"]


@pytest.mark.parametrize("method", ["boxes", "surfaces"])
def test_a_box_around_the_camera_is_not_drawn(method: str) -> None:
    around = ("table", (0.3, 0.0, 1.5), (2.0, 2.0, 1.0), 0.4)
    bed = ("bed", (0.0, 3.0, 1.6), (1.0, 1.0, 1.0), 0.0)
    scene = scene_of(around, bed)
    assert seen(scene, method=method) == ["bed"]
    record = semantic_record(scene, scene_of(bed), POINTS, method)  # ty: ignore[invalid-argument-type]
    assert record.boxes_around_camera == 1
    assert score_semantic([record, record]).mean_iou == 1


def test_meshes_show_their_own_shape() -> None:
    scene = scene_of(
        ("bed", (0.0, 2.0, 1.6), (1.0, 1.0, 1.0), 0.0),
        ("chair", (0.0, 3.0, 1.6), (0.5, 0.5, 0.5), 0.0),
    )
    faces = torch.tensor([[0, 1, 3], [0, 3, 2]])  # the bottom of the box alone
    shapes = Shapes(mesh=(Mesh(box_mesh().vertices, faces), None))
    scene = dataclasses.replace(scene, objects=dataclasses.replace(scene.objects, shapes=shapes))
    down = torch.tensor([[0.0, 2.0, -0.5], [0.0, 1.0, 0.0]])
    assert seen(scene, down) == ["bed", "bed"]
    assert seen(scene, down, "surfaces") == ["bed", "chair"]


@pytest.mark.parametrize("method", ["boxes", "surfaces"])
def test_an_empty_room_is_background(method: str) -> None:
    assert set(seen(scene_of(), POINTS, method)) == {"background"}
    score = score_semantic([semantic_record(scene_of(), scene_of(), POINTS, method)])  # ty: ignore[invalid-argument-type]
    assert score.mean_iou == 1
    assert score.mean_iou_objects is None
    assert len(score.absent) == 11


def test_boxes_that_are_not_finite_are_not_drawn() -> None:
    sofa = ("sofa", (0.0, 2.0, 1.6), (1.0, 1.0, 1.0), 0.0)
    scene = scene_of(sofa, sofa, sofa, ("bed", (0.0, 3.0, 1.6), (1.0, 1.0, 1.0), 0.0))
    boxes = scene.objects.boxes
    broken = OrientedBoxes(
        torch.cat((boxes.centre[:1] * math.nan, boxes.centre[1:])),
        torch.cat((boxes.size[:1], boxes.size[1:2] * math.nan, boxes.size[2:])),
        torch.tensor([0.0, 0.0, math.inf, 0.0]),
    )
    scene = dataclasses.replace(scene, objects=dataclasses.replace(scene.objects, boxes=broken))
    assert seen(scene) == ["bed"]


def test_ious_by_hand_are_pooled_over_scenes() -> None:
    bed, tv, door = (PANOCONTEXT_12.index(name) for name in ("bed", "tv", "door"))
    scene = scene_of(("bed", (0.0, 3.0, 1.6), (1.0, 1.0, 1.0), 0.0))
    directions = torch.tensor([[0.0, 1.0, 0.0]] * 3 + [[0.0, -1.0, 0.0]] * 5)  # 3 bed, 5 background
    first = semantic_record(
        scene, torch.tensor([bed, bed, 0, 0, 0, 0, tv, -1]), directions, name="first"
    )
    second = semantic_record(None, torch.tensor([bed, 0]), directions[:2])
    assert (first.name, int(first.confusion.sum())) == ("first", 7)
    score = score_semantic([first, second])
    # bed: agrees 2, predicted 3, true 2 + 1 missing; background: agrees 3, predicted 4, true 4 + 1
    assert float(score.iou[bed]) == pytest.approx(2 / 4)
    assert float(score.iou[0]) == pytest.approx(3 / 6)
    assert float(score.iou[tv]) == 0
    assert math.isnan(float(score.iou[door]))
    assert score.mean_iou == pytest.approx(1 / 3)
    assert score.mean_iou_objects == pytest.approx(1 / 4)
    assert (score.scenes, score.missing) == (2, 1)
    assert "door" in score.absent
    assert len(score.absent) == 9


def test_no_scenes_have_no_score() -> None:
    score = score_semantic([])
    assert score.mean_iou is score.mean_iou_objects is None
    assert score.absent == PANOCONTEXT_12


@pytest.mark.parametrize("bad", [torch.zeros(3).long(), torch.full((1,), 12), torch.tensor([-2])])
def test_bad_labels_are_refused(bad: torch.Tensor) -> None:
    with pytest.raises(ValueError, match="target: expected"):
        semantic_record(scene_of(), bad, AHEAD)


def test_an_unknown_method_is_refused() -> None:
    with pytest.raises((ValueError, TypeError), match=r"method|type"):
        semantic_labels(scene_of(), AHEAD, "outlines")  # ty: ignore[invalid-argument-type]


def test_records_add_up(generator: torch.Generator) -> None:
    counts = torch.randint(0, 50, (12, 13), generator=generator).numpy()
    parts = torch.randint(0, 50, (12, 13), generator=generator).numpy()
    together = score_semantic([SemanticRecord("", counts + parts)])
    apart = score_semantic([SemanticRecord("", counts), SemanticRecord("", parts)])
    assert torch.equal(together.iou, apart.iou)
