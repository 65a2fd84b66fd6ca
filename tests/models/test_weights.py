"""Files with weights: what is written comes back, and anything else is refused by name."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import torch
from safetensors.torch import load_file, save_file
from torch import nn

from panoscene.models import (
    CheckpointError,
    WeightsHeader,
    content_hash,
    read_weights,
    read_weights_header,
    shipped_weights,
    write_weights,
)
from panoscene.models.context import load_context_stage
from panoscene.models.detector import load_detector_stage
from panoscene.models.layout import load_layout_stage
from panoscene.models.pose import load_pose_stage
from panoscene.models.shape import load_shape_stage

LOADERS = {
    "detector": load_detector_stage,
    "layout": load_layout_stage,
    "pose": load_pose_stage,
    "shape": load_shape_stage,
    "context": load_context_stage,
}

HEADER = WeightsHeader(
    stage="layout", edition="compact", config={"width": 4}, metrics={"iou": 0.5}, seed=3
)


def network(width: int = 4) -> nn.Module:
    return nn.Sequential(nn.Conv2d(3, width, 3), nn.BatchNorm2d(width))


def test_round_trip(tmp_path: Path) -> None:
    one, other = network(), network()
    write_weights(tmp_path / "w.safetensors", one, HEADER, half=False)
    header = read_weights(tmp_path / "w.safetensors", other, stage="layout", edition="compact")
    assert header == HEADER == read_weights_header(tmp_path / "w.safetensors")
    assert content_hash(one.state_dict()) == content_hash(other.state_dict())


def test_halves_keep_vectors_exact(tmp_path: Path) -> None:
    one, other = network(), network()
    one[1].running_var.fill_(1e-9)  # ty: ignore[not-subscriptable]
    write_weights(tmp_path / "w.safetensors", one, HEADER)
    stored = load_file(tmp_path / "w.safetensors")
    assert stored["0.weight"].dtype == torch.float16
    read_weights(tmp_path / "w.safetensors", other, stage="layout", edition="compact")
    assert torch.equal(other[0].bias, one[0].bias)  # ty: ignore[not-subscriptable]
    assert torch.equal(other[1].running_var, one[1].running_var)  # ty: ignore[not-subscriptable]
    torch.testing.assert_close(other[0].weight, one[0].weight, atol=1e-3, rtol=1e-3)  # ty: ignore[not-subscriptable]


def test_too_large_for_a_half(tmp_path: Path) -> None:
    module = network()
    with torch.no_grad():
        module[0].weight[0, 0, 0, 0] = 1e6  # ty: ignore[not-subscriptable]
    with pytest.raises(ValueError, match=r"0\.weight that are not finite"):
        write_weights(tmp_path / "w.safetensors", module, HEADER)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("stage", "edition", "found"),
    [("pose", "compact", "compact layout"), ("layout", "paper", "compact layout")],
)
def test_another_stage_or_edition(tmp_path: Path, stage: str, edition: str, found: str) -> None:
    file = tmp_path / "w.safetensors"
    write_weights(file, network(), HEADER)
    message = f"{file}: found weights of the {found}, expected those of the {edition} {stage}"
    with pytest.raises(CheckpointError, match=message):
        read_weights(file, network(), stage=stage, edition=edition)  # ty: ignore[invalid-argument-type]


def test_another_shape_changes_nothing(tmp_path: Path) -> None:
    write_weights(tmp_path / "w.safetensors", network(), HEADER)
    other = network(5)
    before = content_hash(other.state_dict())
    message = "0.weight of shape 4 x 3 x 3 x 3, expected 5 x 3 x 3 x 3"
    with pytest.raises(CheckpointError, match=message):
        read_weights(tmp_path / "w.safetensors", other, stage="layout", edition="compact")
    assert content_hash(other.state_dict()) == before


@pytest.mark.parametrize(
    ("module", "message"),
    [
        (
            nn.Sequential(nn.Conv2d(3, 4, 3)),
            "found 1.bias, 1.num_batches_tracked, 1.running_mean and 2 more",
        ),
        (nn.Sequential(network(), nn.Linear(1, 1)), "found no 0.0.weight"),
    ],
)
def test_other_names(tmp_path: Path, module: nn.Module, message: str) -> None:
    write_weights(tmp_path / "w.safetensors", network(), HEADER)
    with pytest.raises(CheckpointError, match=message):
        read_weights(tmp_path / "w.safetensors", module, stage="layout", edition="compact")


def test_damaged_files(tmp_path: Path) -> None:
    file = tmp_path / "w.safetensors"
    with pytest.raises(CheckpointError, match="no readable file"):
        read_weights_header(file)
    file.write_bytes(b"1234")
    with pytest.raises(CheckpointError, match=r"expected a \.safetensors file"):
        read_weights_header(file)
    save_file({"a": torch.ones(1)}, file)
    with pytest.raises(CheckpointError, match="no header"):
        read_weights_header(file)
    save_file({"a": torch.ones(1)}, file, {"panoscene": '{"schema": 99}'})
    with pytest.raises(CheckpointError, match="a header of schema 99, expected schema 1"):
        read_weights_header(file)
    save_file({"a": torch.ones(1)}, file, {"panoscene": '{"schema": 1, "stage": "pose"}'})
    with pytest.raises(CheckpointError, match="edition"):
        read_weights_header(file)


def test_a_flipped_bit(tmp_path: Path) -> None:
    file = tmp_path / "w.safetensors"
    write_weights(file, network(), HEADER)
    data = bytearray(file.read_bytes())
    data[-1] ^= 1
    file.write_bytes(data)
    with pytest.raises(CheckpointError, match="do not match their hash"):
        read_weights(file, network(), stage="layout", edition="compact")


def test_unknown_stages_ship_no_weights() -> None:
    with pytest.raises(CheckpointError, match=r"kitchen-compact\.safetensors: found no such file"):
        shipped_weights("kitchen")


@pytest.mark.parametrize(("stage", "load"), LOADERS.items())
def test_what_a_file_says_of_its_network_is_checked_by_all_stages(
    tmp_path: Path, stage: str, load: Callable[..., Any]
) -> None:
    file = tmp_path / "w.safetensors"
    header = HEADER.model_copy(update={"stage": stage, "config": {"kitchen": 3}})
    write_weights(file, network(), header)
    message = r"w\.safetensors: found a configuration with faults in .*kitchen|and \d+ more"
    with pytest.raises(CheckpointError, match=message):
        load("compact", file)
    with pytest.raises(CheckpointError, match=f"weights of the compact {stage}, expected"):
        load("paper", file)
    with pytest.raises(CheckpointError, match=f"{stage}-paper.*none come with the paper edition"):
        load("paper")


def test_a_load_draws_no_random_numbers() -> None:
    before = torch.get_rng_state()
    network = load_layout_stage().network
    assert torch.equal(torch.get_rng_state(), before)
    assert all(bool(value.isfinite().all()) for value in network.state_dict().values())
