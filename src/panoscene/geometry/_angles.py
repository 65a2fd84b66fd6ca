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

    Example:
        >>> wrap_angle(torch.tensor([0.0, 3.5])).tolist()
        [0.0, -2.7831850051879883]
    """
    turns = torch.floor(angle.detach() / (2 * math.pi) + 0.5)
    wrapped = angle - turns * (2 * math.pi)
    # float rounding can leave the result exactly at the open end
    return torch.where(wrapped >= math.pi, wrapped - 2 * math.pi, wrapped)
