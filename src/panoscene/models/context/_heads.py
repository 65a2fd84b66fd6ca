"""What is read off the nodes: residuals of the boxes, and logits of the relations."""

import torch
from jaxtyping import Float
from torch import Tensor, nn

from panoscene.geometry import DISTANCE_BINS, YAW_BINS
from panoscene.models.pose import PoseOutput

from ._config import ContextConfig
from ._messages import pairs_of
from ._relations import RelationBatch

_SLOPE = 0.2
_YAWS = 8
_REVERSED = [-k % _YAWS for k in range(_YAWS)]


class BoxHeads(nn.Module):
    """Adds residuals to what the pose network said: to logits and residuals alike.

    Source: paper, Sec. 3.2 (refinement).
    """

    def __init__(self, config: ContextConfig) -> None:
        super().__init__()
        self.size = _head(config, 3)
        self.yaw = _head(config, 2 * YAW_BINS)
        self.distance = _head(config, 2 * DISTANCE_BINS)
        self.delta = _head(config, 2)

    def forward(self, node: Float[Tensor, "scenes n width"], initial: PoseOutput) -> PoseOutput:
        """Return the refined output."""
        yaw = self.yaw(node).unflatten(-1, (2, YAW_BINS))
        distance = self.distance(node).unflatten(-1, (2, DISTANCE_BINS))
        return PoseOutput(
            delta=initial.delta + self.delta(node),
            distance_logit=initial.distance_logit + distance[..., 0, :],
            distance_residual=initial.distance_residual + distance[..., 1, :],
            yaw_logit=initial.yaw_logit + yaw[..., 0, :],
            yaw_residual=initial.yaw_residual + yaw[..., 1, :],
            size_residual=initial.size_residual + self.size(node),
        )


class RelationHeads(nn.Module):
    """Says how likely each relation is.

    Source: paper, Sec. 3.2 (relation estimation) and supplement (relation branch).
    """

    def __init__(self, config: ContextConfig) -> None:
        super().__init__()
        self.touching = _head(config, 1)
        self.touching_wall = _head(config, 1)
        self.on_floor = _head(config, 1)
        self.under_ceiling = _head(config, 1)
        self.inside_room = _head(config, 1)
        self.farther_than = _head(config, 1)
        self.relative_yaw = _head(config, _YAWS)
        self.relative_yaw_wall = _head(config, _YAWS)

    def forward(
        self, node: Float[Tensor, "scenes n width"], relation: Float[Tensor, "scenes n k width"]
    ) -> RelationBatch:
        """Return logits that agree with what each relation is; the diagonal is 0.

        Args:
            node: Objects only.
            relation: Objects are the subjects; the first n of k are objects, the others walls.
        """
        count = node.shape[1]
        of_objects = relation[:, :, :count].contiguous()
        of_walls = relation[:, :, count:].contiguous()
        apart = pairs_of(torch.ones(node.shape[:2], dtype=torch.bool, device=node.device))
        touching = self.touching(of_objects).squeeze(-1)
        farther = self.farther_than(of_objects).squeeze(-1)
        return RelationBatch(
            touching=(touching + touching.mT) / 2 * apart,
            touching_wall=self.touching_wall(of_walls).squeeze(-1),
            on_floor=self.on_floor(node).squeeze(-1),
            under_ceiling=self.under_ceiling(node).squeeze(-1),
            inside_room=self.inside_room(node).squeeze(-1),
            farther_than=(farther - farther.mT) / 2 * apart,
            relative_yaw=agreeing_yaw(self.relative_yaw(of_objects)) * apart.unsqueeze(-1),
            relative_yaw_wall=self.relative_yaw_wall(of_walls),
        )


def agreeing_yaw(logit: Float[Tensor, "scenes n n 8"]) -> Float[Tensor, "scenes n n 8"]:
    """Return logits of relative yaws that say of [b, a] the negative of what they say of [a, b].

    The negative of bin k, at 45 k - 180 degrees, is bin (8 - k) mod 8. The authors' release
    reverses the bins instead, which is one bin off.

    Examples:
        >>> logit = torch.zeros(1, 2, 2, 8)
        >>> logit[0, 0, 1, 5] = 2.0
        >>> agreeing_yaw(logit)[0, 1, 0].argmax().item()
        3
    """
    return (logit + logit.transpose(1, 2)[..., _REVERSED]) / 2


def _head(config: ContextConfig, outputs: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Linear(config.width, config.hidden),
        nn.LeakyReLU(_SLOPE),
        nn.Dropout(config.dropout),
        nn.Linear(config.hidden, outputs),
    )
