"""Which detection shows which object: training targets for detections."""

import torch
from jaxtyping import Float, Int64
from torch import Tensor

from panoscene.geometry import bfov_iou
from panoscene.scene import Detections, Objects

BFOV_IOU_THRESHOLD = 0.25
"""A detection shows an object if their BFoVs overlap by more than this."""


def match_detections(
    detections: Detections, objects: Objects, iou_threshold: float = BFOV_IOU_THRESHOLD
) -> Int64[Tensor, " n"]:
    """Return for each detection the index of the object that it shows, or -1.

    Every object takes the best detection of its category; without one, the best of any. Of
    several objects that take the same detection, the one that overlaps it most keeps it.

    Args:
        detections: n of them.
        objects: The truth; boxes are not looked at.
        iou_threshold: BFoV IoU that must be exceeded.

    Source: the authors' release, where the overlap is that of contours and the last object wins.

    Examples:
        >>> from panoscene.scene import objects_from_boxes
        >>> from panoscene.geometry import OrientedBoxes
        >>> boxes = OrientedBoxes(torch.tensor([[0.0, 2.0, 1.6]]), torch.ones(1, 3), torch.zeros(1))
        >>> objects = objects_from_boxes(boxes, ["chair"])
        >>> match_detections(Detections(objects.bfov, objects.category, torch.ones(1)), objects)
        tensor([0])
    """
    match = torch.full((len(detections.category),), -1, dtype=torch.int64)
    if not len(match) or not len(objects.category):
        return match
    iou: Float[Tensor, "n m"] = bfov_iou(detections.bfov, objects.bfov)
    iou = torch.where(iou > iou_threshold, iou, 0.0)
    same = detections.category[:, None] == objects.category[None, :]
    own, best_own = torch.where(same, iou, 0.0).max(dim=0)
    other, best_other = iou.max(dim=0)
    overlap = torch.where(own > 0, own, other)
    chosen = torch.where(own > 0, best_own, best_other)
    for k in overlap.argsort(stable=True).tolist():  # the largest overlap is written last
        if overlap[k] > 0:
            match[chosen[k]] = k
    return match
