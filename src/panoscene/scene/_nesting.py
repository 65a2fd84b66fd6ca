"""Things that lie in the boxes of others: cushions on sofas, plants in shelves."""

from itertools import product

import torch
from jaxtyping import Bool, Int64
from torch import Tensor

from ._categories import CATEGORIES

_NESTED = (
    *product(("cushion",), ("bed", "sofa", "sofa_chair")),
    *product(("loudspeaker", "plant", "speaker_system"), ("shelf",)),
)
"""Of all pairs in the training homes that overlap by more than 0.1 m, each is one of these; and of
such pairs that are nearer than 0.1 m, at least two in three do."""


def _table() -> Bool[Tensor, "57 57"]:
    found = torch.zeros(len(CATEGORIES), len(CATEGORIES), dtype=torch.bool)
    for pair in _NESTED:
        inner, outer = (CATEGORIES.index(name) for name in pair)
        found[inner, outer] = found[outer, inner] = True
    return found


_TABLE = _table()


def nested(category: Int64[Tensor, "*batch n"]) -> Bool[Tensor, "*batch n n"]:
    """Return of which pairs one may well lie in the box of the other.

    Boxes of sofas, beds and shelves hold empty space, and things are kept there: cushions,
    plants, loudspeakers. That such boxes overlap is no fault.

    Args:
        category: indices into ``CATEGORIES``.

    Examples:
        >>> nested(torch.tensor([CATEGORIES.index(name) for name in ("sofa", "cushion", "table")]))
        tensor([[False,  True, False],
                [ True, False, False],
                [False, False, False]])
    """
    return _TABLE.to(category.device)[category[..., :, None], category[..., None, :]]
