"""The detector's network: shapes, sizes, equivariance, learning."""

import math
from pathlib import Path

import pytest
import torch
from torchvision.models.detection import maskrcnn_resnet50_fpn

from panoscene.models import Backbone, CheckpointError, build_backbone
from panoscene.models.detector import (
    CONFIGS,
    DetectorConfig,
    DetectorNetwork,
    box_overlaps,
    build_detector,
    load_coco_weights,
)
from panoscene.models.detector._pyramid import fold_norms
from panoscene.models.detector._targets import mask_targets

from .conftest import rectangle_targets


def _paper() -> DetectorNetwork:
    with torch.device("meta"):
        return build_detector(CONFIGS["paper"])


def _torchvision() -> torch.nn.Module:
    with torch.device("meta"):
        return maskrcnn_resnet50_fpn(weights=None, weights_backbone=None, num_classes=58)


def test_the_paper_edition_has_torchvisions_parameters() -> None:
    ours, theirs = (
        sorted(tuple(p.shape) for p in network.parameters())
        for network in (_paper(), _torchvision())
    )
    assert ours == theirs
    assert sum(math.prod(shape) for shape in ours) == 44_276_907


def test_the_compact_edition_fits_into_14_mb() -> None:
    with torch.device("meta"):
        network = build_detector(CONFIGS["compact"])
    assert sum(p.numel() for p in network.parameters()) * 2 < 14e6
    assert not any(isinstance(m, torch.nn.BatchNorm2d) for m in network.modules())


def test_coco_weights_go_where_they_belong(tmp_path: Path) -> None:
    given = {
        name: torch.full(tensor.shape, 0.5, dtype=torch.float16)
        for name, tensor in _torchvision().state_dict().items()
        if "fc6" not in name
    }
    file = tmp_path / "coco.pth"
    torch.save(given, file)
    network = _paper()
    with pytest.raises(CheckpointError, match="fc6"):
        load_coco_weights(network, file)
    given |= {
        name: torch.full(tensor.shape, 0.5, dtype=torch.float16)
        for name, tensor in _torchvision().state_dict().items()
        if "fc6" in name
    }
    torch.save(given, file)
    network = network.to_empty(device="cpu")
    for parameter in network.parameters():
        torch.nn.init.zeros_(parameter)
    load_coco_weights(network, file)
    left = {n.split(".")[2] for n, p in network.named_parameters() if bool((p == 0).any())}
    assert "fc6" not in left
    untouched = [n for n, p in network.named_parameters() if bool((p == 0).all())]
    assert untouched == [
        "roi_heads.box_predictor.cls_score.weight",
        "roi_heads.box_predictor.cls_score.bias",
        "roi_heads.box_predictor.bbox_pred.weight",
        "roi_heads.box_predictor.bbox_pred.bias",
        "roi_heads.mask_predictor.mask_fcn_logits.weight",
        "roi_heads.mask_predictor.mask_fcn_logits.bias",
    ]


@pytest.mark.parametrize(
    ("value", "message"), [(torch.nan, "not finite"), (7, r"type torch\.int64")]
)
def test_coco_weights_are_finite_numbers(tmp_path: Path, value: float, message: str) -> None:
    file = tmp_path / "coco.pth"
    odd = "roi_heads.mask_head.mask_fcn1.0.weight.more"
    tensors = {"backbone.body.conv1.weight": torch.full((64, 3, 7, 7), value), odd: torch.ones(1)}
    torch.save(tensors, file)
    with pytest.raises(CheckpointError, match=f"conv1.weight.*{message}"):
        load_coco_weights(_paper(), file)


@pytest.mark.parametrize("name", ["tf_efficientnet_lite0", "resnet18"])
def test_folded_norms_change_nothing(name: str) -> None:
    generator = torch.Generator().manual_seed(0)
    backbone: Backbone = build_backbone(name).eval()  # ty: ignore[invalid-argument-type]
    for module in backbone.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            assert module.running_mean is not None
            assert module.running_var is not None
            module.running_mean.copy_(torch.randn(module.running_mean.shape, generator=generator))
            module.running_var.copy_(1 + torch.rand(module.running_var.shape, generator=generator))
    image = torch.rand(1, 3, 64, 64, generator=generator)
    with torch.no_grad():
        before = backbone(image)
        fold_norms(backbone)
        after = backbone(image)
    for one, other in zip(before, after, strict=True):
        torch.testing.assert_close(one, other, atol=1e-3, rtol=1e-3)
    assert not any(isinstance(m, torch.nn.BatchNorm2d) for m in backbone.modules())


def test_rolling_the_picture_rolls_what_is_found(network: DetectorNetwork) -> None:
    image = torch.rand(1, 3, 64, 256, generator=torch.Generator().manual_seed(1))
    with torch.no_grad():
        (found,) = network(image)
        (rolled,) = network(image.roll(128, -1))
    assert len(found.boxes) > 10
    assert len(found.boxes) == len(rolled.boxes)
    torch.testing.assert_close(found.score, rolled.score, atol=1e-4, rtol=1e-3)
    middle = (found.boxes[:, 0] + found.boxes[:, 2]) / 2 + 128
    moved = (rolled.boxes[:, 0] + rolled.boxes[:, 2]) / 2
    apart = (middle - moved + 128) % 256 - 128
    # equal scores may change places
    assert (apart.abs() < 0.1).float().mean() > 0.9


def test_losses_are_finite_and_reach_every_free_parameter(small: DetectorConfig) -> None:
    network = build_detector(small).train()
    boxes = [(10, 10, 40, 50), (240, 20, 280, 60), (100, 5, 110, 15), (120, 0, 220, 60)]
    targets = [rectangle_targets(boxes), rectangle_targets([])]
    image = torch.rand(2, 3, 64, 256, generator=torch.Generator().manual_seed(1))
    terms = network(image, targets)
    assert set(terms) == {"objectness", "proposal_box", "category", "box", "mask"}
    torch.stack(list(terms.values())).sum().backward()
    for name, parameter in network.named_parameters():
        if parameter.requires_grad:
            assert parameter.grad is not None, name
            assert bool(parameter.grad.isfinite().all()), name
    frozen = [n for n, p in network.named_parameters() if not p.requires_grad]
    assert frozen
    assert all("conv_stem" in n or "blocks.0" in n or "blocks.1" in n for n in frozen)


def test_the_same_seed_gives_the_same_losses(network: DetectorNetwork) -> None:
    image = torch.rand(1, 3, 64, 256, generator=torch.Generator().manual_seed(1))
    targets = [rectangle_targets([(10, 10, 40, 50)], seed=5)]
    with torch.no_grad():
        first, second = network(image, targets), network(image, targets)
    assert {k: float(v) for k, v in first.items()} == {k: float(v) for k, v in second.items()}


def test_mask_targets_go_around_the_seam() -> None:
    targets = rectangle_targets([(250, 10, 262, 30)])
    whole = mask_targets(targets, targets.boxes, torch.tensor([0]), 4)
    assert whole.tolist() == [[[1.0] * 4] * 4]
    wide = torch.tensor([[244.0, 10.0, 268.0, 30.0]])
    half = mask_targets(targets, wide, torch.tensor([0]), 4)
    assert half[0].mean(0).tolist() == [0.0, 1.0, 1.0, 0.0]


@pytest.mark.train
def test_it_learns_two_rectangles_one_at_the_seam(small: DetectorConfig) -> None:
    with torch.random.fork_rng(devices=[]):
        torch.default_generator.manual_seed(3)
        network = build_detector(small.model_copy(update={"width": 128})).train()
    targets = rectangle_targets([(40, 16, 72, 56), (112, 20, 144, 50)], 64, 128)
    image = torch.full((1, 3, 64, 128), 0.5)
    colours = torch.tensor([[1.0, 0.1, 0.1], [0.1, 0.1, 1.0]])
    for k in range(2):
        image[0, :, targets.instances == k + 1] = colours[k][:, None]
    free = [p for p in network.parameters() if p.requires_grad]
    optimiser = torch.optim.AdamW(free, 2e-3)
    for _ in range(45):
        loss = torch.stack(list(network(image, [targets]).values())).sum()
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(free, 5.0)
        optimiser.step()
    with torch.no_grad():
        (found,) = network.eval()(image)
    overlap = box_overlaps(targets.boxes, found.boxes, 128.0)[1]
    right = (found.category == targets.category[:, None]) & (found.score > 0.4)
    assert bool(((overlap > 0.5) & right).any(1).all())
