"""Relations of a padded batch of scenes: as logits, as probabilities, or as 0 and 1."""

from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene.geometry import BoxCode
from panoscene.models.pose import PoseOutput

from ._move import moved


@dataclass(frozen=True, slots=True)
class RelationBatch:
    """``panoscene.scene.Relations`` of scenes, padded to n objects and m walls.

    The meaning of the numbers (logits, probabilities, 0 and 1) is said where the record is used.
    """

    touching: Float[Tensor, "scenes n n"]
    touching_wall: Float[Tensor, "scenes n m"]
    on_floor: Float[Tensor, "scenes n"]
    under_ceiling: Float[Tensor, "scenes n"]
    inside_room: Float[Tensor, "scenes n"]
    farther_than: Float[Tensor, "scenes n n"]
    relative_yaw: Float[Tensor, "scenes n n 8"]
    relative_yaw_wall: Float[Tensor, "scenes n m 8"]


@dataclass(frozen=True, slots=True)
class ContextOutput:
    """What the network says of a batch of scenes."""

    output: PoseOutput
    """Refined: what the pose network said plus residuals, batch shape (scenes, n)."""
    relations: RelationBatch | None
    """Logits; None for a network without relation heads. Diagonals carry no meaning and are 0."""
    valid: Bool[Tensor, "scenes n"]
    """False for padding."""
    wall_valid: Bool[Tensor, "scenes m"]
    """Likewise."""

    def to(self, device: torch.device | str) -> "ContextOutput":
        """Return the same on a device."""
        return moved(self, device)


@dataclass(frozen=True, slots=True)
class ContextTargets:
    """What the network should say."""

    code: BoxCode
    """From ``encode_boxes`` with the BFoVs of the estimates, batch shape (scenes, n)."""
    matched: Bool[Tensor, "scenes n"]
    """Which objects have a target."""
    relations: RelationBatch
    """0 and 1; between the true boxes of matched objects, and the ESTIMATED walls."""

    def to(self, device: torch.device | str) -> "ContextTargets":
        """Return the same targets on a device."""
        return moved(self, device)
