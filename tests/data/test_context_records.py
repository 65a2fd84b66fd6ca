"""Files with what the first stages see: what is read is what was written."""

from dataclasses import fields
from pathlib import Path

import pytest
import torch

from panoscene.data import (
    ESTIMATES,
    EncodedObjects,
    EstimateRecord,
    read_estimate_record,
    read_estimate_records,
    write_estimate_record,
)
from panoscene.scene import Layout
from panoscene.synth.dataset import DatasetError


def view(count: int, seed: int) -> EncodedObjects:
    generator = torch.Generator().manual_seed(seed)
    return EncodedObjects(
        bfov=torch.rand(count, 4, generator=generator),
        category=torch.arange(count),
        score=torch.rand(count, generator=generator),
        target=torch.arange(count) - 1,
        appearance=torch.rand(2, count, 5, generator=generator),
        shape_code=torch.rand(2, count, 20, generator=generator),
    )


@pytest.mark.parametrize("moved", [0, 2])
def test_round_trip(tmp_path: Path, moved: int) -> None:
    layout = Layout(torch.tensor([[-1.0, -1.0], [1.0, -1.0], [0.0, 2.0]]), ceiling_height=2.25)
    true = view(3, 1)
    # views may share tensors; files may not
    record = EstimateRecord(view(0, 0), true, (true,) * moved, layout if moved else None)
    (tmp_path / ESTIMATES).mkdir()
    write_estimate_record(record, tmp_path / ESTIMATES / "room.safetensors")
    again = read_estimate_records(tmp_path)["room"]
    assert len(again.moved) == moved
    for old, new in zip(
        (record.found, record.true, *record.moved), (again.found, again.true, *again.moved),
        strict=True,
    ):  # fmt: skip
        for field in fields(EncodedObjects):
            assert torch.equal(getattr(old, field.name), getattr(new, field.name))
    if again.layout is None:
        assert not moved
    else:
        assert torch.equal(again.layout.floor_polygon, layout.floor_polygon)
        assert again.layout.ceiling_height == layout.ceiling_height


def test_what_is_wrong_is_said(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="found no estimates"):
        read_estimate_records(tmp_path)
    with pytest.raises(DatasetError, match="expected an estimate record"):
        read_estimate_record(tmp_path / "none.safetensors")
    file = tmp_path / "room.safetensors"
    write_estimate_record(EstimateRecord(view(1, 0), view(1, 1)), file)
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2])
    with pytest.raises(DatasetError, match="damaged"):
        read_estimate_record(file)
    from safetensors.torch import load, save  # noqa: PLC0415

    tensors = load(whole)
    del tensors["true.score"]
    file.write_bytes(save(tensors))
    with pytest.raises(DatasetError, match=r"true\.score is missing"):
        read_estimate_record(file)
