"""The pipeline with stages that know the truth: order, replacement, doubts, frames."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from torch import Tensor

from panoscene.geometry import paired_box_iou
from panoscene.models.layout import LayoutPrediction
from panoscene.models.upright import UprightEstimate
from panoscene.pipeline import Given, Pipeline, load
from panoscene.sample import sample_photo_path
from panoscene.scene import (
    Detections,
    Mesh,
    Panorama,
    Scene,
    Shapes,
    box_mesh,
    read_panorama,
    select_objects,
    write_scene,
)

from .conftest import Image, Knowing


def test_ground_truth_through_every_stage_is_the_truth(truth: Scene, image: Tensor) -> None:
    knowing = Knowing(truth)
    result = Pipeline(knowing.stages())(image, truth.panorama)
    boxes = result.scene.objects.boxes
    # what IoU cannot tell: a laptop, 1 cm high, moves along its table
    assert float((boxes.centre - truth.objects.boxes.centre).norm(dim=-1).max()) < 0.15
    assert float(paired_box_iou(boxes, truth.objects.boxes).median()) > 0.9
    assert torch.equal(result.scene.layout.floor_polygon, truth.layout.floor_polygon)
    assert result.scene.relations is not None
    assert knowing.asked == ["detector", "layout", "pose", "shape"]
    assert list(result.timings) == ["upright", "detector", "layout", "pose", "arrangement", "shape"]
    assert knowing.sizes == [(3, 512, 1024)]
    assert [flag.code for flag in result.flags] == ["low_resolution"]
    assert result.certificate is not None


def test_without_arrangement_the_boxes_are_those_of_the_network(
    truth: Scene, image: Tensor
) -> None:
    result = Pipeline(Knowing(truth).stages(shape=None), settings=None)(image, truth.panorama)
    assert torch.equal(result.scene.objects.boxes.centre, truth.objects.boxes.centre)
    assert result.certificate is None
    assert result.scene.objects.shapes.mesh == ()


def test_given_records_take_the_place_of_stages(truth: Scene, image: Tensor) -> None:
    knowing = Knowing(truth)
    given = Given(layout=truth.layout, objects=truth.objects)
    result = Pipeline(knowing.stages(shape=None))(image, truth.panorama, given=given)
    assert knowing.asked == []
    assert result.layout is None
    seen = Detections(truth.objects.bfov, truth.objects.category, truth.objects.score)
    Pipeline(knowing.stages(shape=None))(image, truth.panorama, given=Given(detections=seen))
    assert knowing.asked == ["layout", "pose"]


def test_given_meshes_stay(truth: Scene, image: Tensor) -> None:
    knowing, one = Knowing(truth), Mesh(box_mesh().vertices * 0.5, box_mesh().faces)
    shapes = Shapes(mesh=(one,) * len(truth.objects.boxes))
    objects = replace(truth.objects, shapes=shapes)
    given = Given(layout=truth.layout, objects=objects)
    result = Pipeline(knowing.stages())(image, truth.panorama, given=given)
    assert knowing.asked == []
    assert all(mesh is one for mesh in result.scene.objects.shapes.mesh)


def test_a_room_without_objects_is_a_scene_with_a_doubt(truth: Scene, image: Tensor) -> None:
    empty = replace(truth, objects=select_objects(truth.objects, torch.zeros(0, dtype=torch.long)))
    result = Pipeline(Knowing(empty).stages())(image, truth.panorama)
    assert len(result.scene.objects.boxes) == 0
    assert result.doubts[-1] == "no object was found"
    assert [flag.code for flag in result.flags] == ["low_resolution", "nothing_found"]


def test_doubts_are_told(truth: Scene, image: Tensor) -> None:
    walls = torch.full((len(truth.layout.floor_polygon),), 0.1)
    weak = replace(truth, layout=replace(truth.layout, wall_score=walls))
    knowing = Knowing(weak)

    def ambiguous(image: Image, *, camera_height: float | None = None) -> LayoutPrediction:
        return replace(knowing.layout(image, camera_height=camera_height), ambiguous=True)

    result = Pipeline(knowing.stages(layout=ambiguous))(image, truth.panorama)
    assert [word in " ".join(result.doubts) for word in ("two ways", "uncertain")] == [True, True]


@pytest.mark.parametrize(("degrees", "turned"), [(10.0, True), (0.2, False)])
def test_a_tilted_photo_is_turned(
    truth: Scene, image: Tensor, degrees: float, turned: bool
) -> None:
    tilt = math.radians(degrees)
    c, s = math.cos(tilt), math.sin(tilt)
    rotation = ((1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c))
    estimate = UprightEstimate(rotation, tilt, 0.0, 0.9, 100)
    result = Pipeline(Knowing(truth).stages(leveller=lambda image: estimate))(image, truth.panorama)
    upright = Panorama(2, 1).upright_from_photo
    assert result.scene.panorama.upright_from_photo == (rotation if turned else upright)
    assert any("tilted by 10 degrees" in doubt for doubt in result.doubts) == turned


def test_a_photo_without_a_record_is_taken_at_the_usual_height(truth: Scene, image: Tensor) -> None:
    result = Pipeline(Knowing(truth).stages(shape=None))(image, name="room")
    assert result.scene.panorama == Panorama(256, 128, 1.6)
    assert result.scene.name == "room"


def test_the_same_photo_gives_the_same_scene(truth: Scene, image: Tensor) -> None:
    pipeline = Pipeline(Knowing(truth).stages())
    first, second = pipeline(image, truth.panorama), pipeline(image, truth.panorama)
    for one, two in ((first.scene, second.scene), (first.initial, second.initial)):
        assert torch.equal(one.objects.boxes.centre, two.objects.boxes.centre)
        assert torch.equal(one.objects.boxes.size, two.objects.boxes.size)
        assert torch.equal(one.objects.boxes.yaw, two.objects.boxes.yaw)
    assert torch.equal(first.image, second.image)
    assert first.flags == second.flags


def test_the_shipped_networks_give_the_same_scene_again(tmp_path: Path) -> None:
    photo, panorama = read_panorama(sample_photo_path())
    pipeline = load()
    found = []
    for name in ("first", "second"):
        scene = pipeline(photo, panorama, resolution=32).scene
        assert len(scene.objects.boxes) > 3
        write_scene(scene, tmp_path / f"{name}.json")
        found.append((tmp_path / f"{name}.json").read_bytes())
    assert found[0] == found[1]
