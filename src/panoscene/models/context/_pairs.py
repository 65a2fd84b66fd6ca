"""What the relation nodes know at the start: how two boxes lie to each other."""

import math

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry import OrientedBoxes, separation_margins, separation_weights, wrap_angle
from panoscene.models.pose import pair_embedding
from panoscene.scene import relative_yaw_angle, relative_yaw_bins

from ._config import ContextConfig
from ._features import METRES, coarse_and_fine

PAIR_NUMBERS = 72
"""Numbers of a pair of BFoVs."""
BOX_PAIR_NUMBERS = 21
"""Numbers of a pair of boxes: relative yaw, separation, collision (Fr)."""
_BIN = math.pi / 4
_FARTHEST = 2.0
# walls meet exactly at their ends: rounding must not decide whether they collide
_CONTACT = 0.01


def pair_width(config: ContextConfig) -> int:
    """Return how many numbers ``pair_features`` gives for each pair."""
    return PAIR_NUMBERS + (BOX_PAIR_NUMBERS if config.relation_features else 0)


def pair_features(
    boxes: OrientedBoxes,
    bfov: Float[Tensor, "scenes k 4"],
    camera_height: Float[Tensor, " scenes"],
    config: ContextConfig,
) -> Float[Tensor, "scenes k k features"]:
    """Return the features of all ordered pairs of nodes, [subject, object].

    Args:
        boxes: Objects, then walls, batch shape (scenes, k).
        bfov: Theirs.
        camera_height: Metres above the floor.
        config: Whether the network knows the features of the boxes.

    Source: paper, Sec. 3.2 (relation nodes); relative yaws are differences of world yaws.
    """
    seen = _seen_pair(bfov)
    if not config.relation_features:
        return seen
    return torch.cat([seen, _box_pair(boxes, camera_height)], dim=-1)


def _seen_pair(bfov: Float[Tensor, "scenes k 4"]) -> Float[Tensor, "scenes k k 72"]:
    count = bfov.shape[1]
    between = wrap_angle(bfov[:, None, :, 0] - bfov[:, :, None, 0])
    lon = torch.stack([between.sin(), between.cos()], dim=-1)
    own = bfov[..., 1:]
    first = own[:, :, None].expand(-1, -1, count, -1)
    second = own[:, None, :].expand(-1, count, -1, -1)
    return torch.cat([lon, first, second, pair_embedding(bfov)], dim=-1)


def _box_pair(
    boxes: OrientedBoxes, camera_height: Float[Tensor, " scenes"]
) -> Float[Tensor, "scenes k k 21"]:
    """Return the features of pairs of boxes.

    Whether they collide (by more than 1 cm), by how much over all axes, how far they are apart
    over all axes, the least margin of an axis (coarse and fine), where the second is in the axes of
    the first, by how much it is farther from the camera, and the difference of the yaws.
    """
    first, second = boxes[:, :, None], boxes[:, None, :]
    margin = separation_margins(first, second)
    weight = separation_weights(first, second)
    least = margin.amin(dim=-1)
    collide = least > _CONTACT
    overlap = torch.where(collide, (margin * weight).sum(dim=-1), 0.0)
    apart = (torch.relu(-margin) * weight).sum(dim=-1)
    contact = torch.stack([collide.to(least), overlap / METRES, apart / METRES], dim=-1)
    step = second.centre - first.centre
    sin, cos = first.yaw.sin(), first.yaw.cos()
    x, y, z = step.unbind(-1)
    own = torch.stack([x * cos + y * sin, y * cos - x * sin, z], dim=-1) / METRES
    centre_x, centre_y, centre_z = boxes.centre.unbind(-1)
    ray = torch.stack([centre_x, centre_y, centre_z - camera_height[:, None]], dim=-1)
    distance = ray.square().sum(dim=-1).clamp(min=1e-8).sqrt()
    farther = coarse_and_fine(distance[:, :, None] - distance[:, None, :])
    return torch.cat(
        [
            contact.clamp(max=_FARTHEST), coarse_and_fine(least), own.clamp(-_FARTHEST, _FARTHEST),
            farther, _turn(wrap_angle(second.yaw - first.yaw)),
        ],
        dim=-1,
    )  # fmt: skip


def _turn(angle: Float[Tensor, "*batch"]) -> Float[Tensor, "*batch 11"]:
    """Return a relative yaw as bin, rest in bins, sine and cosine."""
    bins = relative_yaw_bins(angle.detach())
    rest = wrap_angle(angle - relative_yaw_angle(bins)) / _BIN
    return torch.cat([bins, torch.stack([rest, angle.sin(), angle.cos()], dim=-1)], dim=-1)
