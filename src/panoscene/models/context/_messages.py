"""Messages between objects, walls and the relation nodes between them."""

import torch
from jaxtyping import Bool, Float
from torch import Tensor, nn

from ._config import ContextConfig


class MessagePassing(nn.Module):
    """Rounds of messages in complete graphs with a node for every ordered pair, densely.

    In every round an object or wall takes the mean of what all nodes of its scene (itself
    included) send, of what the relation nodes send in which it is the subject, and of those in
    which it is the object; their mean is added to it. A relation node takes the mean of its
    subject's and its object's. Both read the states of the round before. A message is one layer
    with a ReLU.

    Source: paper, Sec. 3.2, after Yang et al., Graph R-CNN.
    """

    def __init__(self, config: ContextConfig) -> None:
        super().__init__()
        width = config.width
        self.steps = config.steps
        # what a node sends to all nodes, and as subject and as object of relation nodes
        self.from_node = nn.Linear(width, 3 * width)
        # what a relation node sends to its subject and to its object
        self.from_relation = nn.Linear(width, 2 * width)
        self.node_norm = nn.LayerNorm(width) if config.norm else nn.Identity()
        self.relation_norm = nn.LayerNorm(width) if config.norm else nn.Identity()

    def forward(
        self,
        node: Float[Tensor, "scenes k width"],
        relation: Float[Tensor, "scenes k k width"],
        valid: Bool[Tensor, "scenes k"],
    ) -> tuple[Float[Tensor, "scenes k width"], Float[Tensor, "scenes k k width"]]:
        """Return the nodes and the relation nodes after all rounds, as the heads read them.

        Args:
            node: Objects and walls.
            relation: [subject, object]; the diagonal stands for nothing.
            valid: False for padding, which neither sends nor matters.
        """
        present = valid.to(node).unsqueeze(-1)
        pair = pairs_of(valid).to(node).unsqueeze(-1)
        nodes = present.sum(dim=1, keepdim=True).clamp(min=1)
        partners = pair.sum(dim=2).clamp(min=1)
        for _ in range(self.steps):
            read, related = self.node_norm(node), self.relation_norm(relation)
            to_all, as_subject, as_object = self.from_node(read).relu().chunk(3, dim=-1)
            to_subject, to_object = (self.from_relation(related).relu() * pair).chunk(2, dim=-1)
            from_all = (to_all * present).sum(dim=1, keepdim=True) / nodes
            from_pairs = to_subject.sum(dim=2) + to_object.sum(dim=1)
            node = node + (from_all + from_pairs / partners) / 3
            relation = relation + (as_subject.unsqueeze(2) + as_object.unsqueeze(1)) / 2
        return self.node_norm(node), self.relation_norm(relation)


def pairs_of(valid: Bool[Tensor, "scenes k"]) -> Bool[Tensor, "scenes k k"]:
    """Return which ordered pairs are of two valid nodes, and not of a node with itself.

    Examples:
        >>> pairs_of(torch.tensor([[True, True, False]]))[0].int().tolist()
        [[0, 1, 0], [1, 0, 0], [0, 0, 0]]
    """
    different = ~torch.eye(valid.shape[1], dtype=torch.bool, device=valid.device)
    return valid[:, :, None] & valid[:, None, :] & different
