"""The relation graph network in the pipeline: what it says is what the arrangement is told."""

from dataclasses import replace

import pytest
import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.pipeline import Clock, Given, Pipeline, load_stages
from panoscene.scene import Detections, Layout, Objects, Relations, Scene, relations_from_boxes

from .conftest import Knowing

Image = Float[Tensor, "3 height width"]


class Context:
    """Says true boxes, moved, and relations."""

    def __init__(self, truth: Scene, relations: Relations | None) -> None:
        self.truth = truth
        self.relations = relations
        self.height = 0.0

    def __call__(
        self,
        image: Image,
        detections: Detections,
        layout: Layout,
        camera_height: float,
        *,
        clock: Clock,
    ) -> tuple[Objects, Relations | None]:
        self.height = camera_height
        boxes = self.truth.objects.boxes
        moved = replace(boxes, centre=boxes.centre + torch.tensor([0.01, 0.0, 0.0]))
        return replace(self.truth.objects, boxes=moved), self.relations


@pytest.fixture
def relations(truth: Scene) -> Relations:
    found = relations_from_boxes(truth.objects.boxes, truth.layout)
    return replace(found, touching=torch.zeros_like(found.touching))


def test_its_boxes_and_relations_are_the_initial_scene(
    truth: Scene, image: Tensor, knowing: Knowing, relations: Relations
) -> None:
    context = Context(truth, relations)
    result = Pipeline(knowing.stages(context=context, shape=None))(image, truth.panorama)
    assert "pose" not in knowing.asked
    assert {"context"} == set(result.timings) & {"context", "pose"}
    assert result.initial.relations is relations
    assert context.height == truth.panorama.camera_height
    shift = result.initial.objects.boxes.centre - truth.objects.boxes.centre
    assert torch.allclose(shift[:, 0], torch.tensor(0.01), atol=1e-5)


def test_given_relations_go_before_its_own(
    truth: Scene, image: Tensor, knowing: Knowing, relations: Relations
) -> None:
    told = relations_from_boxes(truth.objects.boxes, truth.layout)
    pipeline = Pipeline(knowing.stages(context=Context(truth, relations), shape=None))
    result = pipeline(image, truth.panorama, given=Given(relations=told))
    assert result.initial.relations is told


def test_without_relations_they_follow_from_its_boxes(
    truth: Scene, image: Tensor, knowing: Knowing
) -> None:
    pipeline = Pipeline(knowing.stages(context=Context(truth, None), shape=None), settings=None)
    result = pipeline(image, truth.panorama)
    assert result.initial.relations is None
    assert result.scene.relations is not None


def test_a_given_rotation_is_taken(truth: Scene, image: Tensor, knowing: Knowing) -> None:
    turn = ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    result = Pipeline(knowing.stages(shape=None))(image, given=Given(upright_from_photo=turn))
    assert result.scene.panorama.upright_from_photo == turn


def test_stages_and_settings_can_be_used_for_another_pipeline(knowing: Knowing) -> None:
    stages = knowing.stages()
    pipeline = Pipeline(stages, settings="released")
    assert pipeline.stages is stages
    assert pipeline.settings == "released"


def test_its_parts_are_timed(truth: Scene, image: Tensor) -> None:
    stages = load_stages(shapes=False)
    result = Pipeline(stages)(image, truth.panorama)
    timed = ["upright", "detector", "layout", "pose", "codes", "context", "arrangement"]
    assert list(result.timings) == timed
    assert all(seconds > 0 for seconds in result.timings.values())
