"""The losses of the pose network."""

from collections.abc import Mapping
from types import MappingProxyType

import torch
from jaxtyping import Bool, Float
from torch import Tensor
from torch.nn import functional

from panoscene.geometry import BoxCode

from ._network import PoseOutput

LOSS_WEIGHTS: Mapping[str, float] = MappingProxyType(
    {
        "size": 10.0,
        "yaw_bin": 1.0,
        "yaw_residual": 10.0,
        "distance_bin": 1.0,
        "distance_residual": 10.0,
        "delta": 1.0,
    }
)
"""The paper's weights (authors' release)."""


def pose_losses(
    output: PoseOutput, target: BoxCode, matched: Bool[Tensor, "*batch"], *, beta: float = 1.0
) -> dict[str, Float[Tensor, ""]]:
    """Return the weighted losses of the matched objects: means over them, 0 without any.

    Smooth L1 for size, offset and the residuals of the true bins, cross entropy for the bins.

    Args:
        output: Of the network.
        target: From ``encode_boxes`` with the BFoVs that the network saw.
        matched: Which objects have a target.
        beta: Error at which smooth L1 turns from a square into a line; the paper has 1, where
            almost all errors are squared.

    Source: the paper, Sec. 3.4, and the authors' release.
    """
    term = {
        "size": _smooth(output.size_residual, target.size_residual, matched, beta),
        "yaw_bin": _cross_entropy(output.yaw_logit, target.yaw_bin, matched),
        "yaw_residual": _smooth(
            _true_bin(output.yaw_residual, target.yaw_bin), target.yaw_residual, matched, beta
        ),
        "distance_bin": _cross_entropy(output.distance_logit, target.distance_bin, matched),
        "distance_residual": _smooth(
            _true_bin(output.distance_residual, target.distance_bin),
            target.distance_residual,
            matched,
            beta,
        ),
        "delta": _smooth(output.delta, target.delta, matched, beta),
    }
    return {name: LOSS_WEIGHTS[name] * value for name, value in term.items()}


def _true_bin(residual: Tensor, index: Tensor) -> Tensor:
    return residual.gather(-1, index.unsqueeze(-1)).squeeze(-1)


def _smooth(found: Tensor, wanted: Tensor, matched: Tensor, beta: float) -> Tensor:
    found, wanted = found[matched], wanted[matched].to(found)
    total = functional.smooth_l1_loss(found, wanted, reduction="sum", beta=beta)
    return total / max(found.numel(), 1)


def _cross_entropy(logit: Tensor, index: Tensor, matched: Tensor) -> Tensor:
    count = torch.count_nonzero(matched).clamp(min=1)
    return functional.cross_entropy(logit[matched], index[matched], reduction="sum") / count
