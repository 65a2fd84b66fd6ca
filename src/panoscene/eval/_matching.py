"""Which predicted object is which target: greedy matching by oriented 3D IoU."""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float, Int64
from torch import Tensor

from panoscene.geometry import OrientedBoxes, paired_box_iou
from panoscene.scene import Objects

IOU_THRESHOLD = 0.15
"""The oriented 3D IoU that the paper asks of a true positive; it must be exceeded."""


def match_objects(
    prediction: Objects,
    target: Objects,
    *,
    iou_threshold: float = IOU_THRESHOLD,
    same_category: bool = True,
) -> Int64[Tensor, " n"]:
    """Return for each predicted object the index of its target, or -1.

    In the order of descending score, each predicted object takes the target with the largest
    oriented 3D IoU among those that are still free, if that IoU is above the threshold. Equal
    scores are served in the order of the predicted objects; of equal IoUs the first target is
    taken. A box that is not finite overlaps nothing.

    Args:
        prediction: n objects.
        target: the true objects; their scores do not matter.
        iou_threshold: an IoU that must be exceeded, in [0, 1).
        same_category: whether only targets of the predicted category count.

    Raises:
        ValueError: A threshold outside [0, 1), or a predicted score that is not finite.

    Source: DeepPanoContext, Sec. 4, and the evaluation in the authors' release.

    Examples:
        >>> from panoscene.scene import objects_from_boxes
        >>> boxes = OrientedBoxes(
        ...     torch.tensor([[0.0, 2.0, 0.5], [2.0, 0.0, 0.5]]), torch.ones(2, 3), torch.zeros(2)
        ... )
        >>> target = objects_from_boxes(boxes, ["chair", "sofa"], camera_height=1.6)
        >>> prediction = objects_from_boxes(boxes[[1, 0]], ["sofa", "bed"], camera_height=1.6)
        >>> match_objects(prediction, target).tolist()
        [1, -1]
    """
    (iou,) = object_ious([prediction], [target], same_category=same_category)
    return torch.from_numpy(greedy_matches(iou, scores_of(prediction), (iou_threshold,))[0])


def object_ious(
    predictions: Sequence[Objects], targets: Sequence[Objects], *, same_category: bool = True
) -> list[Float[np.ndarray, "n m"]]:
    """Return the oriented 3D IoUs of n predicted objects with m targets, for each scene.

    All scenes are computed at once, in float64, and only the pairs that matter.

    Args:
        predictions: the predicted objects of each scene.
        targets: the true objects of each scene.
        same_category: whether pairs of different categories have IoU 0.
    """
    shapes = [(len(p.boxes), len(t.boxes)) for p, t in zip(predictions, targets, strict=True)]
    ious = [np.zeros(shape) for shape in shapes]
    if not ious:
        return ious
    wanted = [
        p.category[:, None].cpu().numpy() == t.category[None, :].cpu().numpy()
        if same_category
        else np.ones(shape, dtype=bool)
        for p, t, shape in zip(predictions, targets, shapes, strict=True)
    ]
    pairs = [np.nonzero(mask) for mask in wanted]
    first_row, first_column = np.cumsum([(0, 0), *shapes], axis=0)[:-1].T
    rows = np.concatenate([row + first for (row, _), first in zip(pairs, first_row, strict=True)])
    columns = np.concatenate(
        [column + first for (_, column), first in zip(pairs, first_column, strict=True)]
    )
    with torch.no_grad():
        overlap = paired_box_iou(
            boxes_in_a_row([part.boxes for part in predictions])[torch.from_numpy(rows)],
            boxes_in_a_row([part.boxes for part in targets])[torch.from_numpy(columns)],
        )
    values = overlap.numpy()
    parts = np.split(values, np.cumsum([len(row) for row, _ in pairs])[:-1])
    for iou, mask, part in zip(ious, wanted, parts, strict=True):
        iou[mask] = part
    return ious


def greedy_matches(
    iou: Float[np.ndarray, "n m"], score: Float[np.ndarray, " n"], thresholds: Sequence[float]
) -> Int64[np.ndarray, "thresholds n"]:
    """Return for each threshold and predicted object the index of its target, or -1.

    The rule of ``match_objects``, for every threshold on its own: an object that is not good
    enough for a target leaves it to the next one.
    """
    limits = np.asarray(thresholds, dtype=np.float64)
    if not ((limits >= 0.0) & (limits < 1.0)).all():
        raise ValueError(f"IoU thresholds must be in [0, 1), found {tuple(thresholds)}")
    match = np.full((len(limits), len(score)), -1, dtype=np.int64)
    if 0 in iou.shape or not len(limits):
        return match
    every = np.arange(len(limits))
    free = np.ones((len(limits), iou.shape[1]), dtype=bool)
    promising = iou.max(axis=1) > limits.min()
    order = np.argsort(-score, kind="stable")
    # each choice depends on the ones before; only objects that overlap something take part
    for row in order[promising[order]]:
        candidates = np.where(free, iou[row], 0.0)
        best = candidates.argmax(axis=1)
        hit = candidates[every, best] > limits
        match[hit, row] = best[hit]
        free[every[hit], best[hit]] = False
    return match


def scores_of(objects: Objects) -> Float[np.ndarray, " n"]:
    """Return the scores of predicted objects as float64, all finite."""
    score = objects.score.detach().cpu().double().numpy()
    if not np.isfinite(score).all():
        raise ValueError(
            f"scores of predicted objects must be finite, found {score[~np.isfinite(score)][0]}"
        )
    return score


def boxes_in_a_row(boxes: Sequence[OrientedBoxes]) -> OrientedBoxes:
    """Return the boxes of all scenes, one after the other, as float64 on the CPU."""
    return OrientedBoxes(
        torch.cat([part.centre for part in boxes]).detach().cpu().double(),
        torch.cat([part.size for part in boxes]).detach().cpu().double(),
        torch.cat([part.yaw for part in boxes]).detach().cpu().double(),
    )
