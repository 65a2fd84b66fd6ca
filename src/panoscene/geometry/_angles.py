"""Angles in radians: the one place where they are wrapped and compared."""

import math

import torch
from jaxtyping import Float
from torch import Tensor


def wrap_angle(angle: Float[Tensor, "*batch"]) -> Float[Tensor, "*batch"]:
    """Return the same angle in [-pi, pi).

    The derivative is one everywhere it exists, so the result can be optimised through.

    Convention:
        - pi itself becomes -pi, so that every direction has exactly one number

    Examples:
        >>> wrap_angle(torch.tensor([0.0, 3.5]))
        tensor([ 0.0000, -2.7832])
    """
    turns = torch.floor(angle.detach() / (2 * math.pi) + 0.5)
    wrapped = angle - turns * (2 * math.pi)
    # rounding can leave the result at the open end, or just beyond the closed one
    wrapped = torch.where(wrapped >= math.pi, wrapped - 2 * math.pi, wrapped)
    return torch.where(wrapped < -math.pi, wrapped - wrapped.detach() - math.pi, wrapped)
