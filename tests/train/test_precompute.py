"""Records of a data set: once, whole, and never mixed with those of other weights."""

from pathlib import Path

import pytest
import torch
from torch import Tensor

from panoscene.data import RECORDS, read_stage_records
from panoscene.models.layout import LayoutPrediction
from panoscene.scene import Detections
from panoscene.synth.dataset import open_dataset
from panoscene.train import TrainError, precompute


class Stages:
    """A detector that finds one chair and a layout network that reads the true room."""

    def __init__(self) -> None:
        self.calls = 0
        self.heights: list[float] = []

    def detector(self, image: Tensor) -> Detections:
        self.calls += 1
        mask = torch.zeros(1, *image.shape[1:], dtype=torch.bool)
        return Detections(
            torch.tensor([[0.0, 0.1, 0.2, 0.3]]), torch.tensor([5]), torch.ones(1), mask
        )

    def layout(self, image: Tensor, *, camera_height: float) -> LayoutPrediction:
        del image
        self.heights.append(camera_height)
        room = open_dataset(SAMPLES)[0].scene().layout
        return LayoutPrediction(room, True, torch.zeros(2, 1024), torch.zeros(1024))


SAMPLES = Path(__file__).parents[2] / "samples" / "synth"


def test_what_is_there_is_kept(tmp_path: Path) -> None:
    stages = Stages()
    items = open_dataset(SAMPLES)
    splits = sorted({item.split for item in items})
    told: list[tuple[int, int]] = []

    def run() -> int:
        return precompute(
            SAMPLES, tmp_path, detector=stages.detector, layout=stages.layout,
            sources={"detector": "1"}, splits=splits, told=lambda *steps: told.append(steps),
        )  # fmt: skip

    assert run() == len(items)
    assert told[-1] == (len(items), len(items))
    records = read_stage_records(tmp_path)
    assert set(records) == {item.name for item in items}
    assert all(record.ambiguous and record.layout for record in records.values())
    assert stages.heights == [item.scene().panorama.camera_height for item in items] or splits
    assert run() == 0
    assert stages.calls == len(items)
    (tmp_path / RECORDS / f"{items[0].name}.json").unlink()
    assert run() == 1


def test_other_weights_need_another_folder(tmp_path: Path) -> None:
    def run(weights: str) -> int:
        return precompute(
            SAMPLES, tmp_path, detector=None, layout=None, sources={"layout": weights}, splits=()
        )

    assert run("1") == 0
    with pytest.raises(TrainError, match="records of other weights or data"):
        run("2")
