"""Shape elements: what the numbers of a code mean."""

import math
from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

from ._config import ANALYTIC, ShapeConfig

MAX_RADIUS = 0.15
"""Largest standard deviation of an element."""
_MAX_ANGLE = math.pi / 4
_EPS = 1e-8


@dataclass(frozen=True, slots=True)
class Elements:
    """Gaussians with detail, mirrored ones included: those follow the others."""

    constant: Float[Tensor, "batch elements"]
    """Value at the centre; 0 or less."""
    centre: Float[Tensor, "batch elements 3"]
    local_from_shape: Float[Tensor, "batch elements 3 3"]
    """Turns and stretches offsets from the centre, so that the Gaussian becomes a unit one."""
    latent: Float[Tensor, "batch elements latent"]


def elements_from_code(code: Float[Tensor, "batch code"], config: ShapeConfig) -> Elements:
    """Return the elements that a shape code stands for.

    The constant is -|a|, the centre a / 2, the variance (0.15 sigmoid(a))^2 along each axis, and
    the angles (roll, pitch, yaw) are cut to a quarter of pi. The first ``config.symmetric``
    elements come again at the end, reflected at the plane x = 0.

    Args:
        code: As ``ShapeNetwork.encode`` returns it.
        config: Of the network.

    Source: paper, Sec. 3.1 (LDIF); values of the authors' release.

    Raises:
        ValueError: the code has another length than the network's.
    """
    if code.shape[-1] != config.code:
        raise ValueError(f"code: found {code.shape[-1]} numbers, expected {config.code}")
    parts = code.reshape(len(code), config.elements, config.width)
    constant = -parts[..., 0].abs()
    centre = parts[..., 1:4] / 2
    variance = (MAX_RADIUS * parts[..., 4:7].sigmoid()).square()
    turn = rotation_from_angles(parts[..., 7:10].clamp(-_MAX_ANGLE, _MAX_ANGLE))
    scale = 1 / ((variance + _EPS).sqrt() + _EPS)
    matrix = scale[..., :, None] * turn.transpose(-1, -2)
    latent = parts[..., ANALYTIC:]
    mirror = torch.tensor([-1.0, 1.0, 1.0], dtype=code.dtype, device=code.device)
    twin = slice(0, config.symmetric)
    return Elements(
        constant=torch.cat((constant, constant[:, twin]), 1),
        centre=torch.cat((centre, centre[:, twin] * mirror), 1),
        local_from_shape=torch.cat((matrix, matrix[:, twin] * mirror), 1),
        latent=torch.cat((latent, latent[:, twin]), 1),
    )


def rotation_from_angles(angles: Float[Tensor, "*batch 3"]) -> Float[Tensor, "*batch 3 3"]:
    """Return Rz(yaw) Ry(pitch) Rx(roll) of (roll, pitch, yaw) in radians.

    Examples:
        >>> rotation_from_angles(torch.tensor([0.0, 0.0, torch.pi / 2])).round().abs()[0]
        tensor([0., 1., 0.])
    """
    (cx, cy, cz), (sx, sy, sz) = angles.cos().unbind(-1), angles.sin().unbind(-1)
    rows = (
        torch.stack((cy * cz, sx * sy * cz - cx * sz, cx * sy * cz + sx * sz), -1),
        torch.stack((cy * sz, sx * sy * sz + cx * cz, cx * sy * sz - sx * cz), -1),
        torch.stack((-sy, sx * cy, cx * cy), -1),
    )
    return torch.stack(rows, -2)


def analytic_code(
    code: Float[Tensor, "batch code"], config: ShapeConfig
) -> Float[Tensor, "batch analytic"]:
    """Return the part of shape codes that describes the Gaussians: ten numbers of each element.

    Examples:
        >>> from panoscene.models.shape import CONFIGS
        >>> analytic_code(torch.zeros(2, 1344), CONFIGS["paper"]).shape
        torch.Size([2, 320])
    """
    parts = code.reshape(len(code), config.elements, config.width)
    # not a reshape to -1, which is refused where there is nothing
    return parts[..., :ANALYTIC].flatten(1)


def blob_centres(
    analytic: Float[Tensor, "*batch codes"],
    size: Float[Tensor, "*batch 3"],
    config: ShapeConfig,
) -> Float[Tensor, "*batch blobs 3"]:
    """Return where the Gaussians of shapes are in the canonical box [-1/2, 1/2]^3.

    Mirrored ones follow the others.

    Args:
        analytic: From ``analytic_code``.
        size: Of the boxes in metres; only matters where the longest side is the unit.
        config: Of the network that the codes are from.
    """
    centre = analytic.unflatten(-1, (config.elements, ANALYTIC))[..., 1:4] / 2
    twin = centre[..., : config.symmetric, :] * centre.new_tensor([-1.0, 1.0, 1.0])
    centre = torch.cat([centre, twin], dim=-2)
    if config.frame == "box":
        return centre
    least = size.clamp(min=1e-3)
    return centre * (least.amax(dim=-1, keepdim=True) / least).unsqueeze(-2)


def local_points(
    elements: Elements, points: Float[Tensor, "batch points 3"]
) -> Float[Tensor, "batch points elements 3"]:
    """Return points in the frame of each element, where its Gaussian is a unit one."""
    matrix = elements.local_from_shape
    moved = torch.einsum("bpx,beyx->bpey", points, matrix)
    return moved - (matrix @ elements.centre[..., None])[:, None, :, :, 0]
