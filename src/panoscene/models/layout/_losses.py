"""HorizonNet's losses."""

import torch.nn.functional as F
from jaxtyping import Float
from torch import Tensor

from panoscene.models.layout._network import LayoutSignals


def layout_losses(
    signals: LayoutSignals,
    boundary: Float[Tensor, "batch 2 columns"],
    corner: Float[Tensor, "batch columns"],
    *,
    boundary_weight: float = 1.0,
    corner_weight: float = 1.0,
) -> dict[str, Tensor]:
    """Return the weighted terms ``boundary`` and ``corner``, means over columns.

    Args:
        signals: Of the network.
        boundary: True latitudes in radians, positive up, of ceiling and floor.
        corner: True evidence in [0, 1].
        boundary_weight: Of the absolute difference of latitude; 1 as published.
        corner_weight: Of the cross-entropy; 1 as published.

    Source: HorizonNet, Sec. 3.2.2 (L1 for the boundary, binary cross-entropy for corners).
    """
    return {
        "boundary": boundary_weight * F.l1_loss(signals.boundary.float(), boundary),
        "corner": corner_weight
        * F.binary_cross_entropy_with_logits(signals.corner.float(), corner),
    }
