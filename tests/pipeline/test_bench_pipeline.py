"""panoscene bench stages and pipeline: the figures that are promised."""

import json

import pytest
import torch
from torch import Tensor

from panoscene.cli import _measure_pipeline as measure
from panoscene.cli import main
from panoscene.models.shape import ShapeStage
from panoscene.pipeline import Stages
from panoscene.pipeline._load import AtFirstUse
from panoscene.scene import Detections, Layout, Objects, Shapes, select_objects

from .conftest import Knowing

STAGES = {"detector_s", "layout_s", "pose_s", "codes_s", "shape_64_s", "shape_128_s"}
PARTS = {"upright_s", "detector_s", "layout_s", "pose_s", "arrangement_s", "shape_s"}


class KnowingShape(ShapeStage):
    """Gives shapes without a network."""

    def __init__(self, knowing: Knowing) -> None:
        self.knowing = knowing
        self.counts: list[int] = []

    def __call__(self, image: Tensor, objects: Objects, *, resolution: int = 64) -> Shapes:
        self.counts.append(len(objects.boxes))
        return self.knowing.shape(image, objects, resolution=resolution)

    def codes(self, image: Tensor, objects: Objects) -> Tensor:
        return torch.zeros(len(objects.boxes), 4)


@pytest.fixture(autouse=True)
def shapes(knowing: Knowing, monkeypatch: pytest.MonkeyPatch) -> KnowingShape:
    shape = KnowingShape(knowing)

    def pose(image: Tensor, found: Detections, layout: Layout, height: float) -> Objects:
        # those that come again stand where they did
        objects = knowing.truth.objects
        return select_objects(objects, torch.arange(len(found.score)) % len(objects.boxes))

    def load_stages() -> Stages:
        return knowing.stages(pose=pose, shape=AtFirstUse(lambda: shape))

    monkeypatch.setattr(measure, "load_stages", load_stages)
    monkeypatch.setattr(measure, "_command_seconds", lambda: 7.5)
    return shape


def test_stages(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "stages", "--repeats", "1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert set(found) == STAGES | {"objects", "repeats", "machine"}
    assert all(found[name] >= 0 for name in STAGES)


def test_pipeline(capsys: pytest.CaptureFixture[str], shapes: KnowingShape) -> None:
    assert main(["bench", "pipeline", "--repeats", "1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    more = {"total_s", "cold_start_s", "peak_rss_mib", "objects", "repeats", "machine"}
    assert set(found) == PARTS | more
    assert found["total_s"] >= max(found[name] for name in PARTS)
    assert found["cold_start_s"] == 7.5
    assert shapes.counts == [found["objects"]] * 2 == [20] * 2
    assert 50 < found["peak_rss_mib"] < 64_000


def test_people_get_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "pipeline", "--repeats", "1"]) == 0
    assert "| cold start | 7.50 s |" in capsys.readouterr().out
    assert main(["bench", "pipeline", "--repeats", "0"]) == 2
    assert "--repeats: found 0" in capsys.readouterr().err
