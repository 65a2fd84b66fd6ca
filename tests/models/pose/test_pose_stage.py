"""The pose stage: records in, records out."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from torch import Tensor
from torch.nn import functional

from panoscene.eval import detection_record
from panoscene.geometry import OrientedBoxes, encode_boxes, wrap_angle
from panoscene.models import CheckpointError, WeightsHeader, write_weights
from panoscene.models.pose import (
    CONFIGS,
    PoseNetwork,
    PoseOutput,
    PoseStage,
    build_pose,
    load_pose_stage,
    pose_crops,
)
from panoscene.scene import Detections, Layout, Panorama, Scene, objects_from_boxes

TINY = CONFIGS["compact"].model_copy(update={"crop_px": 64, "features": 32})
ROOM = Layout(torch.tensor([[-2.0, -3.0], [2.5, -3.0], [2.5, 3.5], [-2.0, 3.5]]))


def photo(width: int = 256) -> Tensor:
    coarse = torch.rand(1, 3, 16, 32, generator=torch.Generator().manual_seed(0))
    return functional.interpolate(coarse, (width // 2, width))[0]


def detections() -> Detections:
    return Detections(
        torch.tensor([[0.4, -0.3, 0.5, 0.6], [-2.0, 0.1, 0.8, 0.4], [3.0, -0.6, 0.7, 0.5]]),
        torch.tensor([7, 33, 40]),
        torch.tensor([0.9, 0.8, 0.7]),
    )


@pytest.fixture(scope="module")
def network() -> PoseNetwork:
    with torch.random.fork_rng():
        torch.default_generator.manual_seed(0)
        return build_pose(TINY)


def test_stage_keeps_the_detections_and_gives_sound_boxes(network: PoseNetwork) -> None:
    seen = detections()
    objects = PoseStage(network)(photo(), seen, ROOM, 1.6)
    assert torch.equal(objects.bfov, seen.bfov)
    assert torch.equal(objects.score, seen.score)
    assert objects.id == ("chair_0", "picture_1", "sofa_2")
    assert bool((objects.boxes.size > 0).all())
    for score in (objects.distance_score, objects.yaw_score):
        assert bool(((score >= 1 / 6) & (score <= 1)).all())


def test_stage_of_nothing(network: PoseNetwork) -> None:
    nothing = Detections(torch.zeros(0, 4), torch.zeros(0, dtype=torch.int64), torch.zeros(0))
    for layout in (None, ROOM):
        objects = PoseStage(network)(photo(), nothing, layout, 1.6)
        assert len(objects.category) == 0
        assert objects.boxes.centre.shape == (0, 3)


def test_stage_refuses_a_camera_in_the_floor(network: PoseNetwork) -> None:
    with pytest.raises(ValueError, match="camera_height: found 0"):
        PoseStage(network)(photo(), detections(), None, 0.0)


@pytest.mark.parametrize("layout", [None, ROOM])
def test_rolling_the_panorama_turns_the_boxes(network: PoseNetwork, layout: Layout | None) -> None:
    columns, turn = 37, 2 * math.pi * 37 / 256
    seen, stage = detections(), PoseStage(network)
    before = stage(photo(), seen, layout, 1.6)
    lon = wrap_angle(seen.bfov[:, :1] + turn)
    rolled = replace(seen, bfov=torch.cat([lon, seen.bfov[:, 1:]], dim=1))
    cos, sin = math.cos(-turn), math.sin(-turn)
    matrix = torch.tensor([[cos, -sin], [sin, cos]])
    if layout is not None:
        layout = Layout(layout.floor_polygon @ matrix.T)
    after = stage(photo().roll(columns, dims=-1), rolled, layout, 1.6)
    assert torch.allclose(before.boxes.size, after.boxes.size, atol=1e-3)
    assert torch.allclose(
        before.boxes.centre[:, :2] @ matrix.T, after.boxes.centre[:, :2], atol=5e-3
    )
    assert torch.allclose(before.boxes.centre[:, 2], after.boxes.centre[:, 2], atol=5e-3)
    off = wrap_angle(before.boxes.yaw - turn - after.boxes.yaw)
    assert float(off.abs().max()) < 1e-2


def test_the_truth_through_the_stage_scores_one(
    network: PoseNetwork, monkeypatch: pytest.MonkeyPatch
) -> None:
    boxes = OrientedBoxes(
        torch.tensor([[1.0, 2.0, 0.5], [-1.5, 0.5, 1.5], [0.1, -2.0, 0.4]]),
        torch.tensor([[0.5, 0.6, 1.0], [0.8, 0.05, 0.6], [2.0, 0.9, 0.8]]),
        torch.tensor([0.3, -1.5, 3.0]),
    )
    truth = objects_from_boxes(boxes, ["chair", "picture", "sofa"])
    code = encode_boxes(boxes, truth.bfov, network.mean_size[truth.category], 1.6)

    def told(*_: Tensor, **__: Tensor) -> PoseOutput:
        return PoseOutput(
            delta=code.delta[None],
            distance_logit=functional.one_hot(code.distance_bin, 6).float()[None],
            distance_residual=code.distance_residual[None, :, None].expand(1, 3, 6),
            yaw_logit=functional.one_hot(code.yaw_bin, 6).float()[None],
            yaw_residual=code.yaw_residual[None, :, None].expand(1, 3, 6),
            size_residual=code.size_residual[None],
        )

    monkeypatch.setattr(network, "placed", told)
    seen = Detections(truth.bfov, truth.category, truth.score)
    found = PoseStage(network)(photo(), seen, ROOM, 1.6)
    target = Scene(Panorama(256, 128), ROOM, truth)
    record = detection_record(replace(target, objects=found), target)
    assert bool(record.hit.all())
    assert float(record.errors.iou.min()) > 0.999


def test_large_panoramas_are_shrunk_before_they_are_cropped() -> None:
    bfov = detections().bfov
    small = pose_crops(photo(1024), bfov, 32)
    fine = photo(1024).repeat_interleave(2, dim=1).repeat_interleave(2, dim=2)
    assert torch.allclose(pose_crops(fine, bfov, 32), small, atol=1e-5)
    assert pose_crops(photo(), bfov[:0], 32).shape == (0, 3, 32, 32)


def test_weights_come_back_and_refuse_another_network(network: PoseNetwork, tmp_path: Path) -> None:
    path = tmp_path / "pose.safetensors"
    header = WeightsHeader(stage="pose", edition="compact", config=TINY.model_dump(mode="json"))
    write_weights(path, network, header, half=False)
    first = PoseStage(network)(photo(), detections(), None, 1.6)
    again = load_pose_stage("compact", path)(photo(), detections(), None, 1.6)
    assert torch.allclose(first.boxes.centre, again.boxes.centre, atol=1e-6)
    with pytest.raises(CheckpointError, match="weights of the compact pose"):
        load_pose_stage("paper", path)
    with pytest.raises(CheckpointError, match="no file named"):
        load_pose_stage("paper")


def test_shipped_weights_load() -> None:
    objects = load_pose_stage()(photo(), detections(), ROOM, 1.6)
    assert bool(objects.boxes.centre.isfinite().all())
