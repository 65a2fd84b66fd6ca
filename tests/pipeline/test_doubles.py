"""One object, one box: what the pipeline leaves out, and that it does."""

from dataclasses import replace

import pytest
import torch

from panoscene.geometry import OrientedBoxes
from panoscene.pipeline import Given, Pipeline
from panoscene.pipeline._doubles import without_doubles
from panoscene.scene import Detections, Layout, Objects, Panorama, Scene, objects_from_boxes

from .conftest import Knowing

SQUARE = torch.tensor([[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]])


def cubes(shift: float, categories: tuple[str, str], score: tuple[float, float]) -> Objects:
    """Two cubes of 1 m, the second beside the first by ``shift`` metres."""
    centre = torch.tensor([[1.5, 0.0, 0.5], [1.5, shift, 0.5]])
    boxes = OrientedBoxes(centre, torch.ones(2, 3), torch.zeros(2))
    objects = objects_from_boxes(boxes, categories, camera_height=1.6)
    return replace(objects, score=torch.tensor(score))


def scene_of(objects: Objects) -> Scene:
    return Scene(Panorama(1024, 512), Layout(SQUARE), objects)


@pytest.mark.parametrize(
    ("shift", "categories", "left"),
    [
        (0.8, ("sofa", "sofa"), 1),  # IoU 0.11
        (0.85, ("sofa", "sofa"), 2),  # IoU 0.08
        (0.6, ("sofa", "bed"), 2),  # IoU 0.25
        (0.5, ("sofa", "bed"), 1),  # IoU 0.33
    ],
)
def test_the_better_one_stays(shift: float, categories: tuple[str, str], left: int) -> None:
    scene = scene_of(cubes(shift, categories, (0.6, 0.9)))
    found = without_doubles(scene)
    assert len(found.objects.boxes) == left
    if left == 1:
        assert found.objects.score.tolist() == pytest.approx([0.9])
        assert found.objects.boxes.centre[0, 1] == pytest.approx(shift)
    else:
        assert found is scene


def test_others_keep_their_order() -> None:
    boxes = OrientedBoxes(
        torch.tensor([[0.0, 0.0, 0.5], [2.0, 0.0, 0.5], [2.1, 0.0, 0.5], [-2.0, 0.0, 0.5]]),
        torch.ones(4, 3),
        torch.zeros(4),
    )
    objects = objects_from_boxes(boxes, ["chair"] * 4, camera_height=1.6)
    objects = replace(objects, score=torch.tensor([0.2, 0.5, 0.4, 0.9]))
    kept = without_doubles(scene_of(objects)).objects
    assert kept.boxes.centre[:, 0].tolist() == pytest.approx([0.0, 2.0, -2.0])
    assert kept.id == ("chair_0", "chair_1", "chair_2")


def test_no_objects_no_doubles() -> None:
    none = objects_from_boxes(
        OrientedBoxes(torch.zeros(0, 3), torch.zeros(0, 3), torch.zeros(0)), [], camera_height=1.6
    )
    assert len(without_doubles(scene_of(none)).objects.boxes) == 0


def test_the_pipeline_leaves_doubles_out_unless_the_objects_are_given() -> None:
    scene = scene_of(cubes(0.2, ("sofa", "sofa"), (0.9, 0.6)))
    image = torch.zeros(3, 512, 1024)
    pipeline = Pipeline(Knowing(scene).stages(), settings=None)
    assert len(pipeline(image).scene.objects.boxes) == 1
    objects = scene.objects
    seen = Detections(objects.bfov, objects.category, objects.score)
    assert len(pipeline(image, given=Given(detections=seen)).scene.objects.boxes) == 2
    assert len(pipeline(image, given=Given(objects=objects)).scene.objects.boxes) == 2
