"""Stages that know the truth, for the tests of the pipeline and of its command."""

from dataclasses import replace

import pytest
import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry import corner_signal_from_layout
from panoscene.models.layout import LayoutPrediction
from panoscene.pipeline import Stages
from panoscene.sample import sample_photo_path, sample_room_path
from panoscene.scene import (
    Detections,
    Layout,
    Objects,
    Scene,
    Shapes,
    box_mesh,
    read_panorama,
    read_scene,
)

Image = Float[Tensor, "3 height width"]


@pytest.fixture(scope="module")
def truth() -> Scene:
    return read_scene(sample_room_path())


@pytest.fixture(scope="module")
def image() -> Tensor:
    """The sample photo, a quarter as large as networks see it."""
    photo, _ = read_panorama(sample_photo_path())
    return torch.nn.functional.interpolate(photo[None], size=(128, 256), mode="area")[0]


class Knowing:
    """Stages that answer from a true scene and note who was asked."""

    def __init__(self, truth: Scene) -> None:
        self.truth = truth
        self.asked: list[str] = []
        self.sizes: list[tuple[int, ...]] = []

    def detector(self, image: Image) -> Detections:
        self.asked.append("detector")
        self.sizes.append(tuple(image.shape))
        objects = self.truth.objects
        return Detections(objects.bfov, objects.category, objects.score)

    def layout(self, image: Image, *, camera_height: float | None = None) -> LayoutPrediction:
        self.asked.append("layout")
        corner = corner_signal_from_layout(self.truth.layout.floor_polygon)
        return LayoutPrediction(self.truth.layout, False, torch.zeros(2, 1024), corner)

    def pose(
        self, image: Image, detections: Detections, layout: Layout | None, camera_height: float
    ) -> Objects:
        self.asked.append("pose")
        assert torch.equal(detections.category, self.truth.objects.category)
        assert layout is not None
        return self.truth.objects

    def shape(self, image: Image, objects: Objects, *, resolution: int = 64) -> Shapes:
        self.asked.append("shape")
        return Shapes(mesh=(box_mesh(),) * len(objects.boxes))

    def stages(self, **changes: object) -> Stages:
        stages = Stages(self.detector, self.layout, self.pose, self.shape)
        return replace(stages, **changes)


@pytest.fixture
def knowing(truth: Scene) -> Knowing:
    return Knowing(truth)
