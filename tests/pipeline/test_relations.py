"""Relations of a finished scene: those of its boxes, and contacts that they miss by little."""

from dataclasses import fields, replace

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor

from panoscene.geometry import OrientedBoxes
from panoscene.pipeline import Pipeline
from panoscene.pipeline._relations import CONTACTS, box_relations, final_relations
from panoscene.scene import Layout, Panorama, Relations, Scene, objects_from_boxes

from .conftest import Knowing
from .test_context_stage import Context

SQUARE = torch.tensor([[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]])


def scene_of(gap: float, lift: float = 0.0) -> Scene:
    """Two cubes of 1 m in a row: ``gap`` between a wall, the first, and the second."""
    centre = torch.tensor([[2.5 - gap, 0.0, 0.5 + lift], [1.5 - 2 * gap, 0.0, 0.5 + lift]])
    boxes = OrientedBoxes(centre, torch.ones(2, 3), torch.zeros(2))
    objects = objects_from_boxes(boxes, ["chair", "table"], camera_height=1.6)
    return Scene(Panorama(1024, 512), Layout(SQUARE), objects)


def sure(scene: Scene, chance: float) -> Relations:
    """Everything is as probable as ``chance``, but the yaws."""
    had = box_relations(scene)
    said = {name: torch.full_like(getattr(had, name), chance) for name in CONTACTS}
    return replace(had, **said)


def test_without_a_network_they_are_those_of_the_boxes() -> None:
    scene = scene_of(0.05)
    found, had = final_relations(scene, None), box_relations(scene)
    assert all(torch.equal(getattr(found, f.name), getattr(had, f.name)) for f in fields(had))
    assert found.touching.tolist() == [[0.0, 1.0], [1.0, 0.0]]
    assert found.touching_wall[0].tolist() == [0.0, 1.0, 0.0, 0.0]


def test_a_likely_contact_over_a_small_gap_is_as_probable_as_the_network_says() -> None:
    scene = scene_of(0.2, lift=0.2)
    found = final_relations(scene, sure(scene, 0.8))
    assert torch.allclose(found.touching, torch.tensor([[0.0, 0.8], [0.8, 0.0]]))
    assert torch.allclose(found.touching_wall[0], torch.tensor([0.0, 0.8, 0.0, 0.0]))
    assert torch.allclose(found.on_floor, torch.tensor(0.8))
    assert not found.under_ceiling.any()


@pytest.mark.parametrize(("gap", "chance"), [(0.2, 0.5), (0.2, 0.3), (0.35, 0.99)])
def test_doubtful_or_distant_contacts_do_not_hold(gap: float, chance: float) -> None:
    scene = scene_of(gap, lift=gap)
    found = final_relations(scene, sure(scene, chance))
    assert not any(getattr(found, name).any() for name in CONTACTS)


def test_what_the_boxes_have_holds_unless_the_network_finds_it_unlikely() -> None:
    scene = scene_of(0.02)
    had = box_relations(scene)
    assert bool(had.touching.any())
    assert bool(had.on_floor.all())
    doubted = final_relations(scene, sure(scene, 0.29))
    assert not any(getattr(doubted, name).any() for name in CONTACTS)
    kept = final_relations(scene, sure(scene, 0.3))
    assert all(torch.equal(getattr(kept, name), getattr(had, name)) for name in CONTACTS)
    for found in (doubted, kept):
        assert torch.equal(found.inside_room, had.inside_room)
        assert torch.equal(found.relative_yaw, had.relative_yaw)


def test_doubtful_objects_need_more_to_touch_a_wall() -> None:
    scene = scene_of(0.02)
    for score, limit in ((0.59, 0.45), (0.61, 0.3)):
        doubted = replace(scene.objects, score=torch.full((2,), score))
        some = replace(scene, objects=doubted)
        for chance in (limit - 0.01, limit):
            found = final_relations(some, sure(some, chance))
            assert found.touching_wall.any() == (chance == limit)
            assert found.touching.any() == found.on_floor.any() == (chance >= 0.3)


def test_ceilings_are_touched_by_boxes_alone() -> None:
    scene = scene_of(0.02)
    top = scene.objects.boxes.centre[:, 2] + scene.objects.boxes.size[:, 2] / 2
    low = replace(scene, layout=replace(scene.layout, ceiling_height=float(top.max()) + 0.05))
    said = replace(sure(low, 0.0), under_ceiling=torch.zeros(len(top)))
    found = final_relations(low, said).under_ceiling
    assert bool(found.any())
    assert torch.equal(found, box_relations(low).under_ceiling)
    higher = replace(low, layout=replace(low.layout, ceiling_height=float(top.max()) + 0.2))
    said = replace(sure(higher, 1.0), under_ceiling=torch.ones(len(top)))
    assert not final_relations(higher, said).under_ceiling.any()


def test_an_object_outside_the_room_touches_no_wall() -> None:
    scene = scene_of(-1.2)
    found = final_relations(scene, sure(scene, 0.99))
    assert not found.inside_room.any()
    assert not found.touching_wall.any()


@given(st.floats(-0.4, 0.6), st.floats(0.0, 1.0))
def test_they_are_probabilities_of_what_is_not_far_apart(gap: float, chance: float) -> None:
    scene = scene_of(gap)
    found, near = final_relations(scene, sure(scene, chance)), box_relations(scene, 0.3)
    for name in CONTACTS:
        score = getattr(found, name)
        assert bool(((score >= 0) & (score <= 1)).all())
        assert not score[getattr(near, name) == 0].any()


def test_the_pipeline_gives_them(truth: Scene, image: Tensor, knowing: Knowing) -> None:
    said = sure(truth, 0.9)
    pipeline = Pipeline(knowing.stages(context=Context(truth, said), shape=None), settings=None)
    scene = pipeline(image, truth.panorama).scene
    wanted = final_relations(replace(scene, relations=None), said)
    assert scene.relations is not None
    assert torch.equal(scene.relations.touching, wanted.touching)


@pytest.mark.parametrize(("category", "stays"), [("window", True), ("chest", False)])
def test_walls_let_be_what_stands_in_them(category: str, stays: bool, image: Tensor) -> None:
    boxes = OrientedBoxes(
        torch.tensor([[3.05, 0.0, 1.5]]), torch.tensor([[0.3, 1.2, 1.0]]), torch.zeros(1)
    )
    objects = objects_from_boxes(boxes, [category], camera_height=1.6)
    scene = Scene(Panorama(1024, 512), Layout(SQUARE), objects)
    result = Pipeline(Knowing(scene).stages(shape=None))(image, scene.panorama)
    moved = float(boxes.centre[0, 0] - result.scene.objects.boxes.centre[0, 0])
    assert moved < 0.05 if stays else moved > 0.1
    assert result.scene.relations is not None
    assert float(result.scene.relations.inside_room[0]) == 1
