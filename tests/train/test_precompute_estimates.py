"""Estimates of a data set: what the encoders see, once, whole, never mixed with other weights."""

import json
from pathlib import Path

import pytest
import torch

from panoscene.data import (
    ESTIMATES,
    RECORDS,
    StageRecord,
    read_estimate_records,
    write_stage_record,
)
from panoscene.models.pose import CONFIGS, PoseStage, build_pose, pose_crops
from panoscene.scene import Detections, upright_photo
from panoscene.synth.dataset import open_dataset
from panoscene.train import TrainError, precompute_estimates
from panoscene.train._precompute import HEADER

SAMPLES = Path(__file__).parents[2] / "samples" / "synth"
TINY = CONFIGS["compact"].model_copy(
    update={"crop_px": 64, "features": 16, "groups": 2, "hidden": 8}
)


@pytest.fixture(scope="module")
def stage() -> PoseStage:
    with torch.random.fork_rng():
        torch.default_generator.manual_seed(0)
        return PoseStage(build_pose(TINY))


def stage_records(folder: Path) -> None:
    """Write records with the first three true objects, and one of nothing."""
    (folder / RECORDS).mkdir(parents=True)
    (folder / HEADER).write_text(json.dumps({"detector": "1"}))
    for item in open_dataset(SAMPLES, "val"):
        scene = item.scene()
        objects = scene.objects
        bfov = torch.cat([objects.bfov[:3], torch.tensor([[0.0, 1.3, 0.1, 0.1]])])
        category = torch.cat([objects.category[:3], torch.tensor([7])])
        found = Detections(bfov, category, torch.full((4,), 0.75))
        write_stage_record(StageRecord(found, scene.layout), folder / RECORDS / f"{item.name}.json")


def test_both_views_are_encoded_and_mirrored(tmp_path: Path, stage: PoseStage) -> None:
    stage_records(tmp_path / "stage1")

    def run(weights: str = "1") -> int:
        return precompute_estimates(
            SAMPLES, tmp_path / "stage1", tmp_path / "stage2", pose=stage, shape=None,
            sources={"pose": weights}, splits=("val",),
        )  # fmt: skip

    (item,) = open_dataset(SAMPLES, "val")[:]
    assert run() == 1
    assert run() == 0
    with pytest.raises(TrainError, match="records of other weights or data"):
        run("2")
    record = read_estimate_records(tmp_path / "stage2")[item.name]
    scene = item.scene()
    assert record.found.target.tolist() == [0, 1, 2, -1]
    assert record.true.target.tolist() == list(range(len(scene.objects.category)))
    assert record.moved == ()
    assert record.layout is not None
    assert torch.allclose(record.layout.floor_polygon, scene.layout.floor_polygon, atol=1e-5)
    assert record.true.shape_code.shape == (2, len(scene.objects.category), 0)
    image = upright_photo(item.image(), scene.panorama)
    crops = pose_crops(image, scene.objects.bfov, TINY.crop_px)
    with torch.inference_mode():
        plain, mirrored = stage.network.encoded(crops), stage.network.encoded(crops.flip(-1))
    assert torch.allclose(record.true.appearance[0], plain, atol=1e-4)
    assert torch.allclose(record.true.appearance[1], mirrored, atol=1e-3)
    assert not torch.allclose(plain, mirrored, atol=1e-2)


def test_stage_records_come_first(tmp_path: Path, stage: PoseStage) -> None:
    with pytest.raises(TrainError, match="make them with panoscene precompute"):
        precompute_estimates(
            SAMPLES, tmp_path, tmp_path / "out", pose=stage, shape=None, sources={}, splits=("val",)
        )
    assert not (tmp_path / "out" / ESTIMATES).exists()
