"""One detection for each object: halves at the seam joined, doubles dropped."""

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene.geometry import bfov_from_mask, bfov_nms
from panoscene.scene import Detections

from ._config import DetectorConfig
from ._targets import RegionPredictions

_AT_EDGE = 2.0  # pixels
_INSIDE = 0.6  # share of a cut piece in the whole object
_SAME_ROWS = 0.5  # overlap of two halves' rows
_SAME_OBJECT, _SAME_PLACE = 0.6, 0.85  # overlaps of BFoVs, of one category and of any


def merge_detections(
    found: RegionPredictions, masks: Bool[Tensor, "n height width"], config: DetectorConfig
) -> Detections:
    """Return detections on the sphere, best first.

    A piece cut off by the picture's edge joins the detection of its category that holds most of
    it, or that is cut off by the other edge at the same rows. BFoVs are fitted to the masks, and
    those that overlap a better one too much are dropped: of the same category, or of any when
    they nearly coincide.

    Args:
        found: By the network.
        masks: On the panorama; none is empty.
        config: Of the network.
    """
    alone = torch.ones(len(masks), dtype=torch.bool, device=masks.device)
    if config.seam != "circular" and len(masks):
        owner = _owners(found, masks, config)
        alone = owner < 0
        masks = masks.clone()
        for piece in (~alone).nonzero()[:, 0].tolist():  # a few at the seam
            masks[int(owner[piece])] |= masks[piece]
    masks, category, score = masks[alone], found.category[alone], found.score[alone]
    bfov = bfov_from_mask(masks) if len(masks) else found.boxes[alone]
    kept = bfov_nms(bfov, score, category, iou_threshold=_SAME_OBJECT)
    again = bfov_nms(bfov[kept], score[kept], iou_threshold=_SAME_PLACE)
    kept = kept[again]
    return Detections(bfov[kept], category[kept], score[kept], masks[kept])


def _owners(
    found: RegionPredictions, masks: Bool[Tensor, "n height width"], config: DetectorConfig
) -> Tensor:
    """Return the index of the detection that each one is a piece of, or -1."""
    end = config.width * (1.5 if config.seam == "extend" else 1.0)
    at_left = found.boxes[:, 0] <= _AT_EDGE
    at_right = found.boxes[:, 2] >= end - _AT_EDGE
    small = masks[:, ::4, ::4].flatten(1).float()
    inside = small @ small.mT / small.sum(1).clamp_min(1)[:, None]
    same = found.category[:, None] == found.category
    same = same & ~torch.eye(len(masks), dtype=torch.bool, device=masks.device)
    part = same & (at_left | at_right)[:, None] & (inside > _INSIDE) & ~(at_left | at_right)
    if config.seam == "none":
        part |= same & at_right & at_left[:, None] & (_row_overlap(found.boxes) > _SAME_ROWS)
    best = torch.where(part, found.score, -1.0).max(1)
    return torch.where(best.values > 0, best.indices, -1)


def _row_overlap(boxes: Float[Tensor, "n 4"]) -> Float[Tensor, "n n"]:
    top, bottom = boxes[:, 1], boxes[:, 3]
    shared = torch.minimum(bottom[:, None], bottom) - torch.maximum(top[:, None], top)
    either = torch.maximum(bottom[:, None], bottom) - torch.minimum(top[:, None], top)
    return shared / either.clamp_min(1e-6)
