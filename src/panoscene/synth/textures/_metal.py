"""Brushed metal."""

import numpy as np

from ._noise import noise
from ._records import Draft

_METALS = ((0.72, 0.72, 0.73), (0.55, 0.56, 0.58), (0.80, 0.66, 0.40), (0.62, 0.45, 0.33),
           (0.30, 0.30, 0.31), (0.82, 0.82, 0.80))  # fmt: skip


def brushed(rng: np.random.Generator, size: int) -> Draft:
    """Return metal brushed along u."""
    colour = _METALS[int(rng.choice(len(_METALS), p=[0.4, 0.2, 0.1, 0.08, 0.1, 0.12]))]
    hair = noise(rng, size, 30, size * 0.48, 0.2, stretch=(60.0, 1.0))
    smear = noise(rng, size, 1, 8, 1.2)
    picture = np.asarray(colour, np.float32) * (1.0 + 0.025 * hair + 0.012 * smear)[..., None]
    return Draft(picture, 6e-6 * hair, 0.32 + 0.03 * hair + 0.02 * smear, 0.5)
