"""Tensors to the numbers of a text file and back, without losing a bit."""

from typing import Any

import numpy as np
import torch
from jaxtyping import Shaped
from torch import Tensor

_FEW_DIGITS = 4


def numbers_from_tensor(tensor: Shaped[Tensor, "..."]) -> Any:
    """Return a tensor as (nested lists of) Python numbers that give the same tensor back.

    A float32 becomes the shortest decimal that is nearest to it, so that files say 0.1 and not
    0.10000000149011612.

    Examples:
        >>> numbers_from_tensor(torch.tensor([0.1, 2.0]))
        [0.1, 2.0]
    """
    array = tensor.detach().cpu().numpy()
    if array.dtype != np.float32:
        return array.tolist()
    wide = array.astype(np.float64)
    if not np.isfinite(wide).all():
        return wide.tolist()
    # below 100, decimals of few digits differ from all others: no need to write them out
    rounded = np.round(wide, _FEW_DIGITS)
    if (np.abs(wide) < 100).all() and (rounded.astype(np.float32) == array).all():
        return rounded.tolist()
    shortest = array.astype(np.str_).astype(np.float64)
    return np.where(shortest.astype(np.float32) == array, shortest, wide).tolist()


def tensor_from_numbers(
    numbers: Any, shape: tuple[int, ...], dtype: torch.dtype
) -> Shaped[Tensor, "..."]:
    """Return nested numbers as a tensor of a given shape; -1 stands for any length."""
    tensor = torch.tensor(numbers, dtype=dtype)
    return tensor.reshape(tuple(0 if n == -1 else n for n in shape) if not len(numbers) else shape)
