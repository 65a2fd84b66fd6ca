"""Weights of HorizonNet as published: names, signs, and files that are not what they seem."""

import re
from pathlib import Path

import pytest
import torch
import torchvision
from torch import Tensor, nn

from panoscene.models import CheckpointError
from panoscene.models.layout import (
    CONFIGS,
    LayoutConfig,
    LayoutNetwork,
    build_layout,
    load_layout_stage,
    read_published_layout,
)
from panoscene.train import TrainRecipe
from panoscene.train._layout import layout_task


@pytest.fixture(scope="module")
def small_paper() -> LayoutConfig:
    """Return the paper's edition on ResNet-18, which the authors' release also has."""
    paper = CONFIGS["paper"].model_dump()
    widths = tuple((c // 2, c // 2, c // 4, c // 8) for c in (64, 128, 256, 512))
    small = {"backbone": "resnet18", "compression": widths, "hidden": 16}
    return LayoutConfig.model_validate(paper | small)


@pytest.fixture(scope="module")
def published(small_paper: LayoutConfig) -> dict[str, Tensor]:
    """Return tensors with the names of the authors' release, built from its description."""
    tensors: dict[str, Tensor] = {}
    resnet = torchvision.models.resnet18(weights=None)
    for name, module in resnet.named_modules():
        padded = isinstance(module, nn.Conv2d) and int(module.padding[1]) > 0
        # a padded convolution became (circular padding, convolution)
        prefix = f"feature_extractor.encoder.{name}." + ("1." if padded else "")
        if isinstance(module, nn.Conv2d | nn.BatchNorm2d):
            tensors |= {prefix + key: value for key, value in module.state_dict().items()}
    for level, widths in enumerate(small_paper.compression):
        before = 64 << level
        for index, after in enumerate(widths):
            block = f"reduce_height_module.ghc_lst.{level}.layer.{index}.layers"
            convolution = nn.Conv2d(before, after, 3).state_dict()
            norm = nn.BatchNorm2d(after).state_dict()
            tensors |= {f"{block}.0.1.{key}": value for key, value in convolution.items()}
            tensors |= {f"{block}.1.{key}": value for key, value in norm.items()}
            before = after
    recurrent = nn.LSTM(256, 16, num_layers=2, bidirectional=True).state_dict()
    tensors |= {f"bi_rnn.{key}": value for key, value in recurrent.items()}
    return tensors | {f"linear.{k}": v for k, v in nn.Linear(32, 12).state_dict().items()}


@pytest.fixture
def network(small_paper: LayoutConfig) -> LayoutNetwork:
    """Return a network to fill."""
    return build_layout(small_paper)


def test_every_tensor_finds_its_place(
    published: dict[str, Tensor], network: LayoutNetwork, tmp_path: Path
) -> None:
    path = tmp_path / "resnet18_rnn.pth"
    torch.save({"args": {"lr": 1e-4}, "kwargs": {"use_rnn": True}, "state_dict": published}, path)
    read_published_layout(path, network)
    state = network.state_dict()
    prefix = "feature_extractor.encoder."
    first = published[f"{prefix}conv1.1.weight"]
    assert torch.equal(state["backbone.network.conv1.weight"], first)
    side = published[f"{prefix}layer2.0.downsample.1.weight"]
    assert torch.equal(state["backbone.network.layer2.0.downsample.1.weight"], side)
    last = published["reduce_height_module.ghc_lst.3.layer.3.layers.0.1.bias"]
    assert torch.equal(state["compress.3.halve.3.0.bias"], last)
    assert len(published) == len(state)


def test_boundaries_point_upwards(
    published: dict[str, Tensor], network: LayoutNetwork, tmp_path: Path
) -> None:
    path = tmp_path / "plain.pth"
    torch.save(published, path)
    read_published_layout(path, network)
    assert torch.equal(network.head.weight[:4], published["linear.weight"][:4])
    assert torch.equal(network.head.weight[4:], -published["linear.weight"][4:])
    assert torch.equal(network.head.bias[4:], -published["linear.bias"][4:])


def test_the_lines_in_the_documentation_make_a_file_of_weights(
    published: dict[str, Tensor],
    small_paper: LayoutConfig,
    root: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    page = (root / "docs" / "layout.md").read_text()
    (lines,) = (
        block for block in re.findall(r"```text\n(.*?)```", page, re.DOTALL) if ".pth" in block
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(CONFIGS, "paper", small_paper)
    torch.save(published, "resnet50_rnn__st3d.pth")
    exec(compile(lines, "layout.md", "exec"), {})  # noqa: S102
    weights = tmp_path / "layout.safetensors"
    bias = published["linear.bias"]
    assert torch.equal(load_layout_stage("paper", weights).network.head.bias[:4], bias[:4])
    recipe = TrainRecipe(
        stage="layout",
        edition="paper",
        steps=1,
        batch_size=1,
        learning_rate=1e-3,
        data=root / "samples" / "synth",
        imagenet=True,  # "start" goes before: no file of them is asked for
        start=weights,
    )
    started = layout_task(recipe).model.state_dict()
    assert torch.equal(started["head.bias"][4:], -bias[4:])


class Malicious:
    """Runs a function when it is unpickled without care."""

    def __init__(self, victim: Path) -> None:
        self.victim = victim

    def __reduce__(self) -> tuple[object, ...]:
        return (Path.touch, (self.victim,))


def test_code_in_a_file_is_not_run(network: LayoutNetwork, tmp_path: Path) -> None:
    victim, path = tmp_path / "victim", tmp_path / "evil.pth"
    torch.save({"state_dict": Malicious(victim)}, path)
    with pytest.raises(CheckpointError, match=r"evil\.pth"):
        read_published_layout(path, network)
    assert not victim.exists()
    torch.load(path, weights_only=False)  # the test could fail: this runs it
    assert victim.exists()


@pytest.mark.parametrize(
    "fault", ["missing", "unknown", "shape", "not finite", "whole", "no tensors", "no file"]
)
def test_wrong_files_are_refused(
    published: dict[str, Tensor], network: LayoutNetwork, tmp_path: Path, fault: str
) -> None:
    path = tmp_path / "wrong.pth"
    content: object = dict(published)
    if fault == "missing":
        content = {k: v for k, v in published.items() if k != "linear.bias"}
    elif fault == "unknown":
        content = published | {"decoder.weight": torch.zeros(1)}
    elif fault == "shape":
        content = published | {"linear.bias": torch.zeros(3)}
    elif fault == "not finite":
        content = published | {"linear.weight": published["linear.weight"] / 0}
    elif fault == "whole":
        content = published | {"linear.bias": published["linear.bias"].long()}
    elif fault == "no tensors":
        content = {"state_dict": {"linear.bias": 3}}
    if fault != "no file":
        torch.save(content, path)
    before = network.head.bias.clone()
    with pytest.raises(CheckpointError, match=r"wrong\.pth"):
        read_published_layout(path, network)
    assert torch.equal(network.head.bias, before)
