"""What the network says, arranged: the unrolled optimiser as the last layer of the training."""

import math
from collections.abc import Mapping
from dataclasses import fields

import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn import functional

from panoscene.arrange import ArrangementBatch
from panoscene.geometry import OrientedBoxes, lonlat_from_direction, wrap_angle
from panoscene.models.context import (
    Calibration,
    ContextOutput,
    Estimates,
    boxes_from_output,
    relation_probabilities,
)
from panoscene.models.context._walls import closed_polygon, walls_of
from panoscene.scene import built_in, nested

ARRANGED_WEIGHT = 10.0
"""Of each loss on arranged boxes (supplement, table of the outputs and loss weights)."""
_BELOW = -1e3
_TURNS = 10.0


def arrangement_batch(
    estimates: Estimates, output: ContextOutput, calibration: Calibration | None = None
) -> ArrangementBatch:
    """Return refined boxes and relations as the arrangement takes them, with their gradients.

    Args:
        estimates: That the network was given.
        output: Of the network.
        calibration: Of the network; without it the logits are taken as they are.

    Raises:
        ValueError: The output has no relations.
    """
    if output.relations is None:
        raise ValueError("output.relations: found none, expected those of relation heads")
    valid = estimates.valid
    found = boxes_from_output(output.output, estimates)
    keep = valid.unsqueeze(-1)
    walls, _ = walls_of(estimates)
    relations = relation_probabilities(
        output.relations, output.valid, output.wall_valid, calibration
    )
    in_wall = built_in(estimates.category) & valid
    scores = {part.name: getattr(relations, part.name) for part in fields(relations)}
    # as in the pipeline, walls do not push those who stand in them
    scores["inside_room"] = scores["inside_room"].masked_fill(in_wall, 0)
    return ArrangementBatch(
        boxes=OrientedBoxes(
            torch.where(keep, found.centre, _BELOW),
            torch.where(keep, found.size, 1.0),
            torch.where(valid, found.yaw, 0.0),
        ),
        valid=valid,
        bfov=estimates.bfov,
        score=estimates.score,
        distance_score=output.output.distance_logit.softmax(dim=-1).amax(dim=-1),
        yaw_score=output.output.yaw_logit.softmax(dim=-1).amax(dim=-1),
        built_in=in_wall,
        nested=nested(estimates.category) & valid[..., :, None] & valid[..., None, :],
        **scores,
        polygon=closed_polygon(estimates.polygon, estimates.wall_valid),
        walls=walls,
        wall_valid=estimates.wall_valid,
        floor_height=torch.zeros_like(estimates.ceiling),
        ceiling_height=estimates.ceiling,
        camera_height=estimates.camera_height,
    )


def arranged_losses(
    boxes: OrientedBoxes,
    truth: OrientedBoxes,
    matched: Bool[Tensor, "scenes n"],
    camera_height: Float[Tensor, " scenes"],
) -> dict[str, Float[Tensor, ""]]:
    """Return the weighted losses on arranged boxes (L' of the paper): means over matched objects.

    Smooth L1 of the direction of the centre in tenths of a turn, of its distance in metres, of the
    yaw, and of the size.

    Args:
        boxes: From ``optimise_boxes``.
        truth: The true ones, of any kind where nothing is matched.
        matched: Which objects have a target.
        camera_height: Metres above the floor.

    Source: paper, Sec. 3.4 (end-to-end training).
    """
    seen, distance = _view(boxes, camera_height)
    wanted, true_distance = _view(truth, camera_height)
    error: Mapping[str, Tensor] = {
        "arranged_direction": wrap_angle(seen - wanted) * (_TURNS / (2 * math.pi)),
        "arranged_distance": (distance - true_distance).unsqueeze(-1),
        "arranged_yaw": wrap_angle(boxes.yaw - truth.yaw).unsqueeze(-1),
        "arranged_size": boxes.size - truth.size,
    }
    return {name: ARRANGED_WEIGHT * _smooth(value[matched]) for name, value in error.items()}


def _view(boxes: OrientedBoxes, camera_height: Float[Tensor, " scenes"]) -> tuple[Tensor, Tensor]:
    x, y, z = boxes.centre.unbind(-1)
    ray = torch.stack([x, y, z - camera_height[:, None]], dim=-1)
    return lonlat_from_direction(ray), ray.square().sum(-1).clamp(min=1e-8).sqrt()


def _smooth(error: Float[Tensor, "k numbers"]) -> Float[Tensor, ""]:
    total = functional.smooth_l1_loss(error, torch.zeros_like(error), reduction="sum")
    return total / max(error.numel(), 1)
