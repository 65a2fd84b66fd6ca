"""The relation graph network: boxes that know of each other, and their relations."""

import torch
from jaxtyping import Float
from torch import Tensor, nn

from panoscene.geometry import OrientedBoxes

from ._calibration import RELATIONS, Calibration
from ._config import ContextConfig
from ._estimates import Estimates
from ._features import WALL_NUMBERS, benign, object_features, object_width, wall_features
from ._heads import BoxHeads, RelationHeads
from ._messages import MessagePassing
from ._pairs import pair_features, pair_width
from ._relations import ContextOutput
from ._walls import walls_of

_FIRST_DEVIATION = 1e-3


class ContextNetwork(nn.Module):
    """The paper's RGCN: a graph of objects, walls and one relation node for every ordered pair.

    Attributes:
        config: What it was built from.
        scale: Of the logits, one number for each relation in the order of ``RelationBatch``, as
            ``fit_calibration`` finds them; stored with the weights.
        shift: Likewise.
    """

    scale: Float[Tensor, "8"]
    shift: Float[Tensor, "8"]

    def __init__(self, config: ContextConfig) -> None:
        super().__init__()
        self.config = config
        self.object = _embedding(object_width(config), config.width)
        self.wall = _embedding(WALL_NUMBERS, config.width)
        self.relation = _embedding(pair_width(config), config.width)
        self.messages = MessagePassing(config)
        self.boxes = BoxHeads(config)
        self.relations = RelationHeads(config) if config.relation_heads else None
        self.register_buffer("scale", torch.ones(len(RELATIONS)))
        self.register_buffer("shift", torch.zeros(len(RELATIONS)))
        self._start()

    def forward(self, estimates: Estimates) -> ContextOutput:
        """Return refined pose outputs and relation logits; padding gets numbers of no meaning.

        Gradients flow to the estimates.

        Raises:
            ValueError: Appearance or shapes have another width than the network's.
        """
        self._check(estimates)
        boxes = benign(estimates.boxes(), estimates.valid)
        node = self.object(object_features(estimates, boxes, self.config))
        count = node.shape[1]
        walls, wall_bfov = walls_of(estimates)
        wall = self.wall(wall_features(walls, wall_bfov, estimates.camera_height))
        if self.config.room == "node":
            relation, valid, wall = self._one_room(estimates, boxes, wall)
        else:
            every = OrientedBoxes(
                torch.cat([boxes.centre, walls.centre], dim=1),
                torch.cat([boxes.size, walls.size], dim=1),
                torch.cat([boxes.yaw, walls.yaw], dim=1),
            )
            bfov = torch.cat([estimates.bfov, wall_bfov], dim=1)
            relation = pair_features(every, bfov, estimates.camera_height, self.config)
            valid = torch.cat([estimates.valid, estimates.wall_valid], dim=1)
        node = torch.cat([node, wall], dim=1)
        node, relation = self.messages(node, self.relation(relation), valid)
        found = None
        if self.relations is not None:
            found = self.relations(node[:, :count], relation[:, :count])
        return ContextOutput(
            output=self.boxes(node[:, :count], estimates.output),
            relations=found,
            valid=estimates.valid,
            wall_valid=estimates.wall_valid,
        )

    @property
    def calibration(self) -> Calibration:
        """Return what turns its logits into probabilities."""
        return Calibration(self.scale, self.shift)

    @torch.no_grad()
    def calibrate(self, calibration: Calibration) -> None:
        """Keep what turns its logits into probabilities, from ``fit_calibration``."""
        self.scale.copy_(calibration.scale)
        self.shift.copy_(calibration.shift)

    def _one_room(
        self, estimates: Estimates, boxes: OrientedBoxes, wall: Float[Tensor, "scenes m width"]
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Return relation features, valid nodes and the node of the room: the mean of its walls.

        What objects are to the room is constant, as in Im3D.
        """
        present = estimates.wall_valid.to(wall).unsqueeze(-1)
        total = (wall * present).sum(dim=1, keepdim=True)
        room = total / present.sum(dim=1, keepdim=True).clamp(min=1)
        pair = pair_features(boxes, estimates.bfov, estimates.camera_height, self.config)
        relation = nn.functional.pad(pair, (0, 0, 0, 1, 0, 1))
        known = estimates.wall_valid.any(dim=1, keepdim=True)
        return relation, torch.cat([estimates.valid, known], dim=1), room

    def _check(self, estimates: Estimates) -> None:
        config = self.config
        found = {
            "appearance": (estimates.appearance.shape[-1], config.appearance),
            "shape_code": (estimates.shape_code.shape[-1], config.codes),
            "blob_centre": (estimates.blob_centre.shape[-2], config.blobs),
        }
        for name, (width, expected) in found.items():
            if expected and width != expected:
                raise ValueError(f"estimates.{name}: found {width} numbers, expected {expected}")

    def _start(self) -> None:
        deviation = self.config.deviation
        if deviation is None:
            # the network starts close to what the pose network said
            for head in (self.boxes.size, self.boxes.yaw, self.boxes.distance, self.boxes.delta):
                nn.init.normal_(head.get_parameter("3.weight"), std=_FIRST_DEVIATION)
                nn.init.zeros_(head.get_parameter("3.bias"))
            return
        for layer in self.modules():
            if isinstance(layer, nn.Linear):
                nn.init.normal_(layer.weight, std=deviation)
                nn.init.zeros_(layer.bias)


def build_context(config: ContextConfig) -> ContextNetwork:
    """Return a relation graph network with new weights.

    Args:
        config: Such as ``CONFIGS["compact"]``.
    """
    return ContextNetwork(config)


def _embedding(inputs: int, width: int) -> nn.Sequential:
    return nn.Sequential(nn.Linear(inputs, width), nn.ReLU(), nn.Linear(width, width))
