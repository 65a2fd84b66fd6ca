"""Pictures of the sphere that are known in every direction."""

import torch
from torch import Tensor

from panoscene.geometry._resample import panorama_directions


def scene(direction: Tensor) -> Tensor:
    """Three smooth functions of the direction, channels first: what any view should show."""
    x, y, z = direction.unbind(-1)
    colours = (0.5 + 0.4 * x, 0.5 + 0.3 * y * z - 0.2 * x, 0.5 + 0.3 * (2 * x + z).sin())
    return torch.stack(colours, dim=-3)


def panorama(height: int, width: int, dtype: torch.dtype = torch.float64) -> Tensor:
    return scene(panorama_directions(height, width, like=torch.zeros((), dtype=dtype)))


def noise(*shape: int, seed: int = 0, dtype: torch.dtype = torch.float64) -> Tensor:
    return torch.rand(*shape, generator=torch.Generator().manual_seed(seed), dtype=dtype)
