"""What the nodes of the graph know at the start: normalised, and the same however the world turns.

The paper writes coordinates in the world frame. All that it says is kept, but directions are
written relative to a node's own line of sight, and differences between nodes relative to the first
one's own axes: then nothing depends on where the panorama begins.
"""

import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn import functional

from panoscene.geometry import (
    OrientedBoxes,
    lonlat_from_direction,
    view_relative_yaw,
)
from panoscene.models.pose import PoseOutput
from panoscene.scene import CATEGORIES

from ._config import ContextConfig
from ._estimates import Estimates
from ._walls import room_distances

METRES = 4.0
"""Unit of lengths among the features."""
FINE_METRES = 0.2
"""Unit of the lengths whose sign matters; beyond it only the sign is left."""
OBJECT_NUMBERS = 104
"""Numbers of an object besides appearance, shape and the distances to the room."""
ROOM_NUMBERS = 16
"""Numbers of an object's distances to floor, ceiling and layout polygon (Fo)."""
WALL_NUMBERS = 13
"""Numbers of a wall."""
_FARTHEST = 2.0
_SMALLEST = 1e-3
_UNLIKELY = -8.0


def object_width(config: ContextConfig) -> int:
    """Return how many numbers ``object_features`` gives for each object."""
    shape = config.codes + 3 * config.blobs
    room = ROOM_NUMBERS if config.object_features else 0
    return OBJECT_NUMBERS + config.appearance + shape + room


def object_features(
    estimates: Estimates, boxes: OrientedBoxes, config: ContextConfig
) -> Float[Tensor, "scenes n features"]:
    """Return the features of the objects.

    In order: category times score, score, pose outputs (bins as logarithms of probabilities), box,
    BFoV, appearance, Gaussians of the shape, distances to the room.

    Args:
        estimates: Of the stages before.
        boxes: ``estimates.boxes()``; with boxes of any kind in place of padding.
        config: Which of them the network knows.

    Source: paper, Sec. 3.2 (nodes of the graph); the order is ours.
    """
    category = functional.one_hot(estimates.category, len(CATEGORIES)).to(estimates.score)
    score = estimates.score.unsqueeze(-1)
    parts = [
        category * score, score, _said(estimates.output), _box(estimates, boxes),
        _seen(estimates.bfov), functional.layer_norm(estimates.appearance, (config.appearance,)),
    ]  # fmt: skip
    if config.blobs:
        parts.append(_blobs(estimates, boxes))
    if config.codes:
        parts.append(functional.layer_norm(estimates.shape_code, (config.codes,)))
    if config.object_features:
        parts.append(coarse_and_fine(room_distances(boxes, estimates)).flatten(-2))
    return torch.cat(parts, dim=-1)


def wall_features(
    walls: OrientedBoxes, bfov: Float[Tensor, "scenes m 4"], camera_height: Float[Tensor, " scenes"]
) -> Float[Tensor, "scenes m 13"]:
    """Return the features of the walls: place, size, yaw and BFoV, as those of the objects.

    Args:
        walls: From ``walls_of``.
        bfov: Likewise.
        camera_height: Metres above the floor.
    """
    lonlat, distance, across = _view(walls, camera_height)
    turn = view_relative_yaw(walls.yaw, lonlat[..., 0])
    numbers = [
        walls.size[..., 0] / METRES, walls.size[..., 2] / METRES, walls.centre[..., 2] / METRES,
        distance / METRES, across / METRES, turn.sin(), turn.cos(),
    ]  # fmt: skip
    return torch.cat([torch.stack(numbers, dim=-1), _seen(bfov)], dim=-1)


def _said(output: PoseOutput) -> Float[Tensor, "scenes n 29"]:
    bins = [
        logit.log_softmax(dim=-1).clamp(min=_UNLIKELY) / METRES
        for logit in (output.distance_logit, output.yaw_logit)
    ]
    rest = [output.distance_residual / 2, output.yaw_residual, output.size_residual, output.delta]
    return torch.cat(bins + rest, dim=-1)


def _box(estimates: Estimates, boxes: OrientedBoxes) -> Float[Tensor, "scenes n 11"]:
    lonlat, distance, across = _view(boxes, estimates.camera_height)
    turn = view_relative_yaw(boxes.yaw, lonlat[..., 0])
    numbers = [
        *(boxes.size / METRES).unbind(-1), distance / METRES, across / METRES,
        boxes.centre[..., 2] / METRES, lonlat[..., 1], turn.sin(), turn.cos(),
        estimates.output.distance_logit.softmax(-1).amax(-1),
        estimates.output.yaw_logit.softmax(-1).amax(-1),
    ]  # fmt: skip
    return torch.stack(numbers, dim=-1)


def _seen(bfov: Float[Tensor, "scenes n 4"]) -> Float[Tensor, "scenes n 6"]:
    """Return a BFoV without its lon, which means nothing by itself."""
    lat, extent = bfov[..., 1:2], bfov[..., 2:]
    return torch.cat([lat, lat.sin(), extent, extent.clamp(min=_SMALLEST).log()], dim=-1)


def _blobs(estimates: Estimates, boxes: OrientedBoxes) -> Float[Tensor, "scenes n numbers"]:
    """Return where the Gaussians are from the camera: aside of, along and above the sight line."""
    lonlat, _, across = _view(boxes, estimates.camera_height)
    local = estimates.blob_centre * boxes.size.unsqueeze(-2)
    # the box's own right and front, seen along the line of sight
    turn = -view_relative_yaw(boxes.yaw, lonlat[..., 0])
    sin, cos = turn.sin().unsqueeze(-1), turn.cos().unsqueeze(-1)
    x, y, z = local.unbind(-1)
    eye = estimates.camera_height[:, None, None]
    placed = [
        x * cos - y * sin,
        x * sin + y * cos + across.unsqueeze(-1),
        z + boxes.centre[..., 2:] - eye,
    ]
    return torch.stack(placed, dim=-1).flatten(-2) / METRES


def coarse_and_fine(metres: Float[Tensor, "*batch"]) -> Float[Tensor, "*batch 2"]:
    """Return a length in units of ``METRES``, at most 2, and its course near zero, in [-1, 1].

    Examples:
        >>> coarse_and_fine(torch.tensor([0.0, 40.0])).tolist()
        [[0.0, 0.0], [2.0, 1.0]]
    """
    coarse = (metres / METRES).clamp(-_FARTHEST, _FARTHEST)
    return torch.stack([coarse, (metres / FINE_METRES).tanh()], dim=-1)


def _view(
    boxes: OrientedBoxes, camera_height: Float[Tensor, " scenes"]
) -> tuple[Float[Tensor, "scenes n 2"], Float[Tensor, "scenes n"], Float[Tensor, "scenes n"]]:
    """Return (lon, lat) of the centres, their distance, and its part along the floor."""
    x, y, z = boxes.centre.unbind(-1)
    ray = torch.stack([x, y, z - camera_height[:, None]], dim=-1)
    squared = ray.square()
    # the square root has no slope at zero
    distance = squared.sum(-1).clamp(min=1e-8).sqrt()
    across = squared[..., :2].sum(-1).clamp(min=1e-8).sqrt()
    return lonlat_from_direction(ray), distance, across


def benign(boxes: OrientedBoxes, valid: Bool[Tensor, "scenes n"]) -> OrientedBoxes:
    """Return the boxes, and a unit box before the camera in place of each that is not valid."""
    ahead = boxes.centre.new_tensor([0.0, 2.0, 1.0])
    keep = valid.unsqueeze(-1)
    return OrientedBoxes(
        centre=torch.where(keep, boxes.centre, ahead),
        size=torch.where(keep, boxes.size, 1.0),
        yaw=torch.where(valid, boxes.yaw, 0.0),
    )
