"""Start weights from torchvision's Mask R-CNN, trained on COCO."""

import re
from pathlib import Path

from torch import Tensor, nn

from panoscene.models._errors import CheckpointError
from panoscene.models._imagenet import check_tensor, read_tensors

from ._network import DetectorNetwork

_OWN = (
    "roi_heads.box_predictor.",
    "roi_heads.mask_predictor.mask_fcn_logits.",
)
"""Layers that know categories: COCO's are others."""
_BODY, _OUR_BODY = "backbone.body.", "backbone.body.network."


def load_coco_weights(network: DetectorNetwork, file: Path) -> None:
    """Fill a ``paper`` network with torchvision's maskrcnn_resnet50_fpn, in place.

    Everything but the layers that know the categories is taken; those stay as they are.

    Args:
        network: Built from ``CONFIGS["paper"]``.
        file: torchvision's maskrcnn_resnet50_fpn_coco-*.pth; no code in it is run.

    Raises:
        CheckpointError: The file is missing, or is for another network.
    """
    given = {_our_name(name): tensor for name, tensor in read_tensors(file).items()}
    wanted: dict[str, Tensor] = network.state_dict()
    taken = {}
    for name, tensor in wanted.items():
        if name.startswith(_OWN) or name.endswith("num_batches_tracked"):
            continue
        if name not in given:
            expected = "torchvision's maskrcnn_resnet50_fpn, for the paper's edition"
            raise CheckpointError(file, f"no tensor {name}", expected)
        check_tensor(file, name, given[name], tensor, of="torchvision's maskrcnn_resnet50_fpn")
        taken[name] = given[name]
    network.load_state_dict(taken, strict=False)
    for layer in network.modules():
        if isinstance(layer, nn.BatchNorm2d):
            layer.eps = 0.0  # as torchvision has it with these weights


def _our_name(name: str) -> str:
    if name.startswith(_BODY):
        return _OUR_BODY + name.removeprefix(_BODY)
    for block in ("fpn.inner_blocks.", "fpn.layer_blocks."):
        # files of older versions have no name for the only part of a block
        start = f"backbone.{block}"
        parts = name.removeprefix(start).split(".")
        if name.startswith(start) and len(parts) == 2:
            return f"{start}{parts[0]}.0.{parts[1]}"
    old = {"rpn.head.conv.weight": "rpn.head.conv.0.0.weight"}
    old["rpn.head.conv.bias"] = "rpn.head.conv.0.0.bias"
    layer = re.fullmatch(r"roi_heads\.mask_head\.mask_fcn(\d+)\.(weight|bias)", name)
    if layer:
        return f"roi_heads.mask_head.{int(layer[1]) - 1}.0.{layer[2]}"
    return old.get(name, name)
