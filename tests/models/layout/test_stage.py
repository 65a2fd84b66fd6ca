"""The layout stage: pictures of any size, its record, its weights."""

from pathlib import Path

import pytest
import torch

from panoscene.geometry import polygon_iou
from panoscene.models import CheckpointError, WeightsHeader, shipped_weights, write_weights
from panoscene.models.layout import LayoutNetwork, LayoutStage, load_layout_stage


@pytest.mark.parametrize("size", [(64, 128), (128, 256), (100, 200), (40, 80)])
def test_photos_of_any_size_give_a_room(tiny_network: LayoutNetwork, size: tuple[int, int]) -> None:
    image = torch.rand(3, *size, generator=torch.Generator().manual_seed(0))
    found = LayoutStage(tiny_network)(image, camera_height=1.5)
    assert found.boundary.shape == (2, 1024)
    assert found.corner.shape == (1024,)
    assert 0 <= float(found.corner.min()) <= float(found.corner.max()) <= 1
    assert found.layout.raw_polygon is not None
    assert found.layout.floor_height == 0.0
    assert found.layout.ceiling_height > 1.5


def test_rolling_the_photo_turns_the_room(tiny_network: LayoutNetwork) -> None:
    image = torch.rand(3, 64, 128, generator=torch.Generator().manual_seed(0))
    stage = LayoutStage(tiny_network)
    before, after = stage(image), stage(image.roll(32, -1))
    # a quarter turn clockwise: (x, y) to (y, -x)
    assert before.layout.raw_polygon is not None
    assert after.layout.raw_polygon is not None
    turned = before.layout.raw_polygon @ torch.tensor([[0.0, -1.0], [1.0, 0.0]])
    # outlines are simplified from another first point
    assert polygon_iou(turned, after.layout.raw_polygon) > 0.95
    assert torch.allclose(before.boundary.roll(256, -1), after.boundary, atol=1e-3)
    assert not torch.allclose(before.boundary, after.boundary, atol=1e-2)


def test_weights_make_the_same_stage(tiny_network: LayoutNetwork, tmp_path: Path) -> None:
    path = tmp_path / "layout.safetensors"
    config = tiny_network.config.model_dump(mode="json")
    header = WeightsHeader(stage="layout", edition="compact", config=config)
    write_weights(path, tiny_network, header)
    stage = load_layout_stage("compact", path)
    image = torch.rand(3, 64, 128, generator=torch.Generator().manual_seed(0))
    own, read = LayoutStage(tiny_network)(image), stage(image)
    assert torch.allclose(own.boundary, read.boundary, atol=5e-3)


def test_weights_of_another_stage_are_refused(tiny_network: LayoutNetwork, tmp_path: Path) -> None:
    path = tmp_path / "pose.safetensors"
    config = tiny_network.config.model_dump(mode="json")
    write_weights(path, tiny_network, WeightsHeader(stage="pose", edition="compact", config=config))
    with pytest.raises(CheckpointError, match="weights of the compact pose"):
        load_layout_stage("compact", path)
    with pytest.raises(CheckpointError, match="paper"):
        load_layout_stage("paper")


def test_a_damaged_configuration_is_told(tiny_network: LayoutNetwork, tmp_path: Path) -> None:
    path = tmp_path / "layout.safetensors"
    header = WeightsHeader(stage="layout", edition="compact", config={"backbone": "vgg"})
    write_weights(path, tiny_network, header)
    with pytest.raises(CheckpointError, match=r"layout\.safetensors"):
        load_layout_stage("compact", path)


def test_shipped_weights_load() -> None:
    assert shipped_weights("layout").stat().st_size < 9e6
    found = load_layout_stage()(torch.full((3, 128, 256), 0.5))
    assert found.boundary.shape == (2, 1024)
