"""Errors of a pose network, made up: what is added to its output for the training of the next."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene.geometry import DISTANCE_BINS, YAW_BIN_WIDTH, YAW_BINS
from panoscene.models.pose import PoseOutput


@dataclass(frozen=True, slots=True)
class OutputNoise:
    """What changes in the output of the pose network, for each object."""

    delta: Float[Tensor, "*batch 2"]
    distance: Float[Tensor, "*batch"]
    """As a share of the distance."""
    yaw: Float[Tensor, "*batch"]
    """Radians."""
    size: Float[Tensor, "*batch 3"]
    """As a share of the mean size."""
    distance_logit: Float[Tensor, "*batch 6"]
    yaw_logit: Float[Tensor, "*batch 6"]
    turned: Bool[Tensor, "*batch"]
    """Whether front and back are exchanged."""

    @staticmethod
    def none(count: int) -> "OutputNoise":
        """Return what changes nothing.

        Examples:
            >>> OutputNoise.none(2).delta.tolist()
            [[0.0, 0.0], [0.0, 0.0]]
        """
        zero = torch.zeros(count, 2)
        bins = torch.zeros(count, DISTANCE_BINS)
        three = torch.zeros(count, 3)
        return OutputNoise(zero, zero[:, 0], zero[:, 0], three, bins, bins, zero[:, 0] > 0)


def output_noise(
    count: int,
    generator: torch.Generator,
    *,
    delta: float,
    distance: float,
    size: float,
    yaw_deg: float,
    logit: float,
    turned: float,
) -> OutputNoise:
    """Return random errors of objects of one scene, more in some scenes than in others.

    Args:
        count: Objects.
        generator: Of all that is random.
        delta: Deviation of the offsets.
        distance: Of the distances, as a share of them.
        size: Of the sizes, as a share of the mean ones.
        yaw_deg: Of the yaws.
        logit: Of the logits.
        turned: Share of the objects that are turned by half a turn.
    """
    severity, number = torch.rand((), generator=generator) * 2, 7 + DISTANCE_BINS + YAW_BINS
    random = torch.randn(count, number, generator=generator) * severity
    coin = torch.rand(count, generator=generator)
    return OutputNoise(
        delta=random[:, :2] * delta,
        distance=random[:, 2] * distance,
        yaw=random[:, 3] * math.radians(yaw_deg),
        size=random[:, 4:7] * size,
        distance_logit=random[:, 7 : 7 + DISTANCE_BINS] * logit,
        yaw_logit=random[:, 7 + DISTANCE_BINS :] * logit,
        turned=coin < turned,
    )


def noise_of(batch: Mapping[str, Tensor]) -> OutputNoise:
    """Return the errors of a batch from ``collate_context``."""
    return OutputNoise(*(batch[f"noise_{field.name}"] for field in fields(OutputNoise)))


def noisy_output(output: PoseOutput, noise: OutputNoise) -> PoseOutput:
    """Return the output of a pose network that is off by this much.

    Distances change by a share of what the likeliest bin says, yaws by an angle in all bins; where
    front and back are exchanged, all bins are those half a turn away.
    """
    middle = torch.arange(DISTANCE_BINS).to(output.distance_residual) + 0.5
    bins = output.distance_logit.argmax(dim=-1, keepdim=True)
    told = (middle[bins] + output.distance_residual.gather(-1, bins)).detach()
    half = YAW_BINS // 2
    back = noise.turned.unsqueeze(-1)
    yaw_logit = torch.where(back, output.yaw_logit.roll(half, -1), output.yaw_logit)
    yaw_residual = torch.where(back, output.yaw_residual.roll(half, -1), output.yaw_residual)
    return PoseOutput(
        delta=output.delta + noise.delta,
        distance_logit=output.distance_logit + noise.distance_logit,
        distance_residual=output.distance_residual + told * noise.distance.unsqueeze(-1),
        yaw_logit=yaw_logit + noise.yaw_logit,
        yaw_residual=yaw_residual + (noise.yaw / YAW_BIN_WIDTH).unsqueeze(-1),
        size_residual=output.size_residual + noise.size,
    )
