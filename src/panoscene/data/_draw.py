"""Random numbers of an augmentation, from a generator."""

import torch
from torch import Tensor


class Draw:
    """Single random numbers from a generator.

    Examples:
        >>> draw = Draw(torch.Generator().manual_seed(0))
        >>> 2.0 <= draw.uniform(2.0, 3.0) <= 3.0, draw.chance(0.0), draw.chance(1.0)
        (True, False, True)
    """

    def __init__(self, generator: torch.Generator) -> None:
        self.generator = generator

    def uniform(self, low: float, high: float) -> float:
        """Return a number between two."""
        return low + (high - low) * float(torch.rand((), generator=self.generator))

    def chance(self, share: float) -> bool:
        """Return True in this share of cases."""
        return float(torch.rand((), generator=self.generator)) < share

    def whole(self, low: int, high: int) -> int:
        """Return a whole number from ``low`` to ``high - 1``."""
        return int(torch.randint(low, high, (), generator=self.generator))

    def uniforms(self, count: int, low: float, high: float) -> Tensor:
        """Return several numbers between two."""
        return low + (high - low) * torch.rand(count, generator=self.generator)
