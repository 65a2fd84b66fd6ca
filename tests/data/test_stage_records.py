"""Records of the first stages: what is written comes back; damage is named."""

from pathlib import Path

import pytest
import torch

from panoscene.data import (
    RECORDS,
    StageRecord,
    read_stage_record,
    read_stage_records,
    write_stage_record,
)
from panoscene.scene import Detections, Layout
from panoscene.synth.dataset import DatasetError


def record(*, masks: bool = True) -> StageRecord:
    mask = torch.zeros(2, 16, 32, dtype=torch.bool)
    mask[0, 3:9, 28:] = True
    mask[0, 3:9, :3] = True
    return StageRecord(
        Detections(
            bfov=torch.tensor([[0.1, -0.2, 0.5, 0.4], [-3.0, 0.0, 1.0, 0.3]]),
            category=torch.tensor([3, 20]),
            score=torch.tensor([0.75, 0.5]),
            mask=mask if masks else None,
        ),
        Layout(
            torch.tensor([[-1.0, -1.0], [2.0, -1.0], [2.0, 3.5], [-1.0, 3.5]]),
            ceiling_height=2.75,
            wall_score=torch.tensor([0.5, 1.0, 0.25, 0.75]),
            raw_polygon=torch.tensor([[-1.0, -1.1], [2.0, -1.0], [2.0, 3.5]]),
        ),
        ambiguous=True,
    )


@pytest.mark.parametrize("masks", [True, False])
def test_round_trip(tmp_path: Path, masks: bool) -> None:
    before = record(masks=masks)
    write_stage_record(before, tmp_path / "a.json")
    after = read_stage_record(tmp_path / "a.json")
    torch.testing.assert_close(after.detections.bfov, before.detections.bfov)
    assert torch.equal(after.detections.category, before.detections.category)
    torch.testing.assert_close(after.detections.score, before.detections.score)
    assert (after.detections.mask is None) == (before.detections.mask is None)
    if after.detections.mask is not None and before.detections.mask is not None:
        assert torch.equal(after.detections.mask, before.detections.mask)
    assert after.layout is not None
    assert before.layout is not None
    torch.testing.assert_close(after.layout.floor_polygon, before.layout.floor_polygon)
    torch.testing.assert_close(after.layout.raw_polygon, before.layout.raw_polygon)
    torch.testing.assert_close(after.layout.wall_score, before.layout.wall_score)
    assert after.layout.ceiling_height == 2.75
    assert after.ambiguous


def test_nothing_found(tmp_path: Path) -> None:
    empty = torch.zeros(0)
    nothing = StageRecord(Detections(empty.reshape(0, 4), empty.long(), empty))
    write_stage_record(nothing, tmp_path / "a.json")
    after = read_stage_record(tmp_path / "a.json")
    assert after.detections.bfov.shape == (0, 4)
    assert after.layout is None


def test_a_folder_of_records_has_no_masks_unless_wanted(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="found no records there"):
        read_stage_records(tmp_path)
    (tmp_path / RECORDS).mkdir()
    write_stage_record(record(), tmp_path / RECORDS / "a.json")
    assert read_stage_records(tmp_path)["a"].detections.mask is None
    assert read_stage_records(tmp_path, masks=True)["a"].detections.mask is not None


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"version":1', '"version":2', "version"),
        ('"score":0.75', '"score":7.5', r"detections\.0\.score"),
        ('"chair"', '"dragon"', "dragon"),
        ("}", "", "Invalid JSON"),
        ('"size":[16,32]', '"size":[16,31]', "counts"),
    ],
)
def test_damage_is_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    file = tmp_path / "a.json"
    found = record()
    found.detections.category[0] = 14
    write_stage_record(found, file)
    text = file.read_text()
    if old == '"chair"':
        text = text.replace(text.split('"category":')[1].split(",")[0], new, 1)
    else:
        assert old in text
        text = text.replace(old, new, 1)
    file.write_text(text)
    with pytest.raises(DatasetError, match=message):
        read_stage_record(file)
