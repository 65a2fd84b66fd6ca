"""Greedy non-maximum suppression over any overlaps."""

import torch
from jaxtyping import Float, Int
from torch import Tensor


def suppress(
    iou: Float[Tensor, "n n"],
    score: Float[Tensor, " n"],
    category: Int[Tensor, " n"] | None,
    iou_threshold: float,
) -> Int[Tensor, " kept"]:
    """Return the indices that greedy non-maximum suppression keeps, by descending score.

    Args:
        iou: Overlap of every pair.
        score: Confidences; equal ones keep their order.
        category: Only those of one category compete; without it all do.
        iou_threshold: Largest overlap that two kept ones may have, in [0, 1].

    Raises:
        ValueError: If the threshold is outside [0, 1] or a score is not finite.
    """
    if not 0 <= iou_threshold <= 1:
        raise ValueError(f"iou_threshold: found {iou_threshold}, expected a number in [0, 1]")
    if not score.isfinite().all():
        raise ValueError("score: found a value that is not finite")
    order = score.argsort(descending=True, stable=True)
    rival = (iou[order[:, None], order] > iou_threshold).triu(1)
    if category is not None:
        rival &= category[order, None] == category[order]
    # greedy suppression is the one fixed point: each pass settles at least one more, and in
    # practice the passes are as many as the longest chain of overlaps
    kept, previous = torch.ones_like(order, dtype=torch.bool), None
    while previous is None or bool((kept != previous).any()):
        previous = kept
        kept = ~(rival & previous[:, None]).any(0)
    return order[kept]
