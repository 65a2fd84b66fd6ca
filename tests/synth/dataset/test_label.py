"""Labels of a rendered panorama against what is known of the home."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from panoscene.geometry import bfov_from_boxes, bfov_from_mask
from panoscene.scene import CATEGORIES
from panoscene.synth.dataset import (
    SEMANTIC_NAMES,
    UNLABELLED,
    LabelledPanorama,
    ObjectLabel,
    VisibilityRules,
    label_panorama,
)


@pytest.fixture(scope="module")
def labelled(taken) -> LabelledPanorama:
    return label_panorama(taken.scene, taken.rendered, name="a-1", home="a", seed=5)


@pytest.fixture(scope="module")
def labelled_tilted(tilted) -> LabelledPanorama:
    return label_panorama(tilted.scene, tilted.rendered, name="a-2", home="a", seed=5)


def by_id(panorama: LabelledPanorama) -> dict[str, ObjectLabel]:
    return {label.id: label for label in panorama.labels.objects}


def test_scene_is_in_the_frame_of_the_camera(labelled, labelled_tilted):
    for panorama in (labelled, labelled_tilted):
        camera = panorama.rendered.camera
        scene = panorama.scene
        assert scene.panorama.camera_height == pytest.approx(camera.position[2])
        # back to the plan of the home by hand
        turn = np.array([[np.cos(camera.yaw), -np.sin(camera.yaw)],
                         [np.sin(camera.yaw), np.cos(camera.yaw)]])  # fmt: skip
        plan = scene.layout.floor_polygon.double().numpy() @ turn.T + camera.position[:2]
        np.testing.assert_allclose(plan, [(0, 0), (5, 0), (5, 4), (0, 4)], atol=1e-5)
        assert scene.layout.ceiling_height == pytest.approx(2.6)
        sofa = scene.objects.id.index("sofa-1")
        centre = scene.objects.boxes.centre[sofa].double().numpy()
        np.testing.assert_allclose(
            centre[:2] @ turn.T + camera.position[:2], (1.2, 3.55), atol=1e-5
        )
        np.testing.assert_allclose(scene.objects.boxes.size[sofa], (2.0, 0.8, 0.8), atol=1e-5)
        yaw = float(scene.objects.boxes.yaw[sofa]) + camera.yaw
        assert np.cos(yaw - np.pi) == pytest.approx(1.0, abs=1e-6)


def test_the_size_jitter_is_in_the_box(labelled):
    np.testing.assert_allclose(by_id(labelled)["chair-8"].box.size, (0.528, 0.528, 1.08), atol=1e-4)


def test_tilt_is_the_rotation_that_makes_the_photo_upright(labelled, labelled_tilted):
    assert labelled.scene.panorama.upright_from_photo == (
        (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0),
    )  # fmt: skip
    upright = np.array(labelled_tilted.scene.panorama.upright_from_photo)
    # the centre of the picture looks up by the pitch, and stays at lon 0
    np.testing.assert_allclose(upright @ (0, 1, 0), (0, np.cos(0.08), np.sin(0.08)), atol=1e-6)
    # the rolled camera's right hand points up on the other side: clockwise is down on the right
    assert (upright @ (1, 0, 0))[2] == pytest.approx(np.sin(0.05) * np.cos(0.08), abs=1e-6)


def test_visible_bfovs_are_those_of_the_masks(labelled):
    instance = torch.from_numpy(labelled.rendered.instance)
    for label in labelled.labels.objects:
        if label.category == "carpet":
            continue  # around the nadir, where the masks' fit has finer candidates
        expected = bfov_from_mask(instance == label.instance)
        np.testing.assert_allclose(label.bfov_visible, expected, atol=3e-3)


def test_visible_bfovs_of_a_tilted_camera_are_upright(labelled_tilted):
    """An unhidden object fills about the same BFoV that its box has in the upright frame."""
    for name in ("picture-6", "window-30", "chair-8"):
        label = by_id(labelled_tilted)[name]
        assert label.occlusion < 0.05
        np.testing.assert_allclose(label.bfov_visible[:2], label.bfov_amodal[:2], atol=0.012)
        np.testing.assert_allclose(label.bfov_visible[2:], label.bfov_amodal[2:], atol=0.03)


def test_amodal_bfovs_are_those_of_the_boxes(labelled):
    scene = labelled.scene
    expected = bfov_from_boxes(scene.objects.boxes, scene.panorama.camera_height)
    kept = [label.bfov_amodal for label in labelled.labels.objects if label.in_scene]
    np.testing.assert_allclose(kept, expected, atol=1e-6)


def test_occlusion_is_what_comes_to_light_without_the_others(taken, photograph, labelled):
    scene = taken.scene
    for name in ("sofa-1", "table-2"):
        label = by_id(labelled)[name]
        alone = replace(
            scene, placed=tuple(p for p in scene.placed if p.instance == label.instance)
        )
        from_alone = photograph(alone, taken.rendered.camera)
        rows = (from_alone.instance == label.instance).sum(axis=1)
        lat = np.pi * (0.5 - np.arange(513) / 512)
        weight = -np.diff(np.sin(lat)) * 2 * np.pi / 1024
        assert label.amodal_solid_angle == pytest.approx(float(rows @ weight), rel=0.02)
        assert label.occlusion == pytest.approx(
            1 - label.solid_angle / label.amodal_solid_angle, abs=1e-3
        )
    assert by_id(labelled)["sofa-1"].occlusion > 0.1
    assert by_id(labelled)["window-30"].occlusion == 0.0


def test_hardly_visible_objects_are_left_out_with_a_reason(taken, labelled):
    door = by_id(labelled)["door-113"]
    assert not door.in_scene
    assert door.left_out
    assert "door-113" not in labelled.scene.objects.id
    everything = VisibilityRules(1, 1, 1, 0.0)
    again = label_panorama(taken.scene, taken.rendered, rules=everything)
    assert "door-113" in again.scene.objects.id


def test_truncation_names_the_edges(labelled):
    labels = by_id(labelled)
    assert set(labels["carpet-5"].truncated) == {"seam", "nadir"}
    assert labels["sofa-9"].truncated == ("seam",)
    left, _, wide, _ = labels["sofa-9"].box_2d
    assert left + wide > 1024
    assert labels["window-30"].truncated == ()


def test_rooms_next_door_are_outside(labelled):
    labels = by_id(labelled)
    assert labels["chair-4"].inside_room
    assert not labels["chair-8"].inside_room
    place = labelled.scene.objects.id.index("chair-8")
    assert labelled.scene.relations.inside_room[place] == 0.0


def test_semantics_follow_the_instances(labelled):
    semantic, instance = labelled.semantic, labelled.rendered.instance
    assert set(np.unique(semantic[instance == 1])) == {CATEGORIES.index("sofa")}
    assert set(np.unique(semantic[instance == 7])) == {UNLABELLED}  # the vase
    for part in labelled.labels.structure:
        if part.kind in ("floor", "wall", "ceiling"):
            value = SEMANTIC_NAMES.index(part.kind)
            assert set(np.unique(semantic[instance == part.instance])) == {value}


def test_pixels_are_counted(labelled):
    counts = np.bincount(labelled.rendered.instance.reshape(-1))
    total = sum(label.solid_angle for label in labelled.labels.objects)
    for label in (*labelled.labels.objects, *labelled.labels.structure):
        assert label.pixels == counts[label.instance]
    assert 0.0 < total < 4 * np.pi


def test_contacts_tell_meshes_from_boxes(labelled):
    gaps = {(c.first, c.second): c.gap for c in labelled.labels.contacts}
    assert gaps["table-2", "table_lamp-3"] < 0.01  # it stands on it
    assert all(gap < 0.2 for gap in gaps.values())


def test_meshes_fill_their_boxes(labelled):
    scene = labelled.with_meshes()
    for mesh in scene.objects.shapes.mesh:
        assert float(mesh.vertices.abs().max()) == pytest.approx(0.5, abs=1e-4)


def test_the_place_of_the_model_gives_its_box(labelled, library):
    for label in labelled.labels.objects:
        if label.model in library:
            matrix = np.array(label.world_from_object)
            vertices = library[label.model].vertices @ matrix[:3, :3].T + matrix[:3, 3]
            middle = (vertices.min(0) + vertices.max(0)) / 2
            assert middle[2] == pytest.approx(label.box.centre[2], abs=1e-4)


def test_a_home_without_furniture_has_no_objects(taken, photograph):
    empty = replace(
        taken.scene,
        placed=(),
        panes=(),
        parts=tuple(p for p in taken.scene.parts if p.kind != "door"),
    )
    rendered = photograph(empty, replace(taken.rendered.camera, width=256, height=128))
    panorama = label_panorama(empty, rendered)
    assert len(panorama.scene.objects.category) == 0
    assert panorama.labels.objects == ()
    assert panorama.scene.relations is not None
    assert panorama.scene.relations.touching.shape == (0, 0)


def test_unknown_instances_and_rooms_are_refused(taken):
    rendered = taken.rendered
    strange = rendered.instance.copy()
    strange[0, 0] = 999
    with pytest.raises(ValueError, match="999"):
        label_panorama(taken.scene, replace(rendered, instance=strange))
    strange[0, 0] = 70000
    with pytest.raises(ValueError, match="65535"):
        label_panorama(taken.scene, replace(rendered, instance=strange))
    with pytest.raises(ValueError, match=r"camera\.room"):
        label_panorama(taken.scene, replace(rendered, camera=replace(rendered.camera, room=7)))


def test_labels_are_the_same_again(taken, labelled):
    again = label_panorama(taken.scene, taken.rendered, name="a-1", home="a", seed=5)
    assert again.labels == labelled.labels
    assert torch.equal(again.scene.objects.boxes.centre, labelled.scene.objects.boxes.centre)
