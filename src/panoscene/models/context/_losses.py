"""The losses of the relation graph network."""

from collections.abc import Mapping
from types import MappingProxyType

import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn import functional

from panoscene.geometry import (
    bfov_from_boxes,
    box_corners,
    decode_box_code,
    wrap_angle,
)
from panoscene.models.pose import pose_losses

from ._calibration import YAWS, relation_masks
from ._estimates import Estimates, boxes_from_output
from ._relations import ContextOutput, ContextTargets, RelationBatch
from ._walls import room_distances

RELATION_WEIGHT = 10.0
"""Of every relation's loss (supplement, table of the outputs and loss weights)."""
JOINT_WEIGHTS: Mapping[str, float] = MappingProxyType(
    {"corner": 50.0, "reprojection": 50.0, "outside": 5.0}
)
"""Of the losses of end-to-end training on boxes (authors' release, after Total3D)."""
LARGEST_IMBALANCE = 20.0
"""A rare answer weighs at most this much more than a frequent one."""
_WIDEST = 2.6


def context_losses(
    output: ContextOutput, target: ContextTargets, *, beta: float = 1.0, balanced: bool = True
) -> dict[str, Float[Tensor, ""]]:
    """Return the weighted losses: those of ``pose_losses``, and one for each relation.

    Only matched objects, pairs of them, and their pairs with walls count; no object counts with
    itself. Without any the loss is 0.

    Args:
        output: Of the network; without relations only the losses of the boxes come back.
        target: Between true boxes and estimated walls.
        beta: As in ``pose_losses``.
        balanced: Whether true and false answers of each yes-or-no relation weigh alike in a batch,
            within ``LARGEST_IMBALANCE``; few objects touch, and the plain loss of the authors'
            release makes them look improbable. ``fit_calibration`` undoes what it does to the
            probabilities.

    Source: paper, Sec. 3.4 and supplement.
    """
    matched = target.matched & output.valid
    losses = pose_losses(output.output, target.code, matched, beta=beta)
    if output.relations is not None:
        found = _relation_losses(
            output.relations, target.relations, matched, output.wall_valid, balanced
        )
        losses |= {name: RELATION_WEIGHT * value for name, value in found.items()}
    return losses


def joint_losses(
    output: ContextOutput, target: ContextTargets, estimates: Estimates
) -> dict[str, Float[Tensor, ""]]:
    """Return the weighted losses on refined boxes that end-to-end training adds.

    ``corner``: smooth L1 of the corners in metres. ``reprojection``: smooth L1 of the edges of the
    BFoVs of refined and true boxes, in half turns; each box is seen from a camera turned to it, and
    BFoVs that nearly look behind the camera do not count. ``outside``: squared metres by which
    boxes stick out of the estimated room, of matched and unmatched objects alike.

    Args:
        output: Of the network.
        target: As in ``context_losses``.
        estimates: What the network was given.

    Source: authors' release, after Total3D.
    """
    boxes = boxes_from_output(output.output, estimates)
    truth = decode_box_code(
        target.code, estimates.bfov, estimates.mean_size, estimates.camera_height[:, None]
    )
    matched = target.matched & output.valid
    corner = _smooth(box_corners(boxes)[matched], box_corners(truth)[matched])
    eye = estimates.camera_height[:, None].expand(matched.shape)[matched]
    seen, wanted = bfov_from_boxes(boxes[matched], eye), bfov_from_boxes(truth[matched], eye)
    sound = (seen[:, 2:] < _WIDEST).all(-1) & (wanted[:, 2:] < _WIDEST).all(-1)
    lon = wanted[:, :1] + wrap_angle(seen[:, :1] - wanted[:, :1])
    seen = torch.cat([lon, seen[:, 1:]], dim=-1)
    outside = room_distances(boxes, estimates).relu().square()[output.valid]
    found = {
        "corner": corner,
        "reprojection": _smooth(_edges(seen[sound]), _edges(wanted[sound])),
        "outside": outside.sum() / max(outside.numel(), 1),
    }
    return {name: JOINT_WEIGHTS[name] * value for name, value in found.items()}


def _relation_losses(
    logits: RelationBatch,
    truth: RelationBatch,
    matched: Bool[Tensor, "scenes n"],
    wall_valid: Bool[Tensor, "scenes m"],
    balanced: bool,
) -> dict[str, Float[Tensor, ""]]:
    losses: dict[str, Tensor] = {}
    for name, mask in relation_masks(matched, wall_valid).items():
        logit = getattr(logits, name)[mask]
        wanted = getattr(truth, name)[mask].to(logit)
        if name in YAWS:
            missed = -(wanted * logit.log_softmax(dim=-1)).sum()
            losses[name] = missed / max(len(logit), 1)
        else:
            missed = functional.binary_cross_entropy_with_logits(logit, wanted, reduction="none")
            weight = _balance(wanted) if balanced else torch.ones_like(wanted)
            losses[name] = (weight * missed).sum() / weight.sum().clamp(min=1e-6)
    return losses


def _balance(truth: Float[Tensor, " entries"]) -> Float[Tensor, " entries"]:
    """Return weights with which true and false entries weigh alike, if the ratio is moderate."""
    yes = truth.sum()
    no = len(truth) - yes
    ratio = (no / yes.clamp(min=1)).clamp(1 / LARGEST_IMBALANCE, LARGEST_IMBALANCE)
    return torch.where(truth > 0.5, ratio, 1.0)


def _edges(bfov: Float[Tensor, "n 4"]) -> Float[Tensor, "n 4"]:
    centre, half = bfov[:, :2], bfov[:, 2:] / 2
    return torch.cat([centre - half, centre + half], dim=-1) / torch.pi


def _smooth(found: Tensor, wanted: Tensor) -> Float[Tensor, ""]:
    total = functional.smooth_l1_loss(found, wanted, reduction="sum")
    return total / max(found.numel(), 1)
