"""The local decoder: detail within each element."""

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn import functional as F

_MOMENTUM = 0.005
_EPS = 1e-5


class ConditionalNorm(nn.Module):
    """Normalises by one running mean and variance of everything; gain and bias come from a latent.

    The running values are used in training, too, and follow slowly.
    """

    mean: Tensor
    variance: Tensor

    def __init__(self, latent: int, width: int) -> None:
        super().__init__()
        self.gain = nn.Linear(latent, width)
        self.bias = nn.Linear(latent, width)
        self.register_buffer("mean", torch.zeros(()))
        self.register_buffer("variance", torch.ones(()))

    def forward(
        self, values: Float[Tensor, "*batch width"], affine: tuple[Tensor, Tensor]
    ) -> Float[Tensor, "*batch width"]:
        """Return normalised values, times a gain and plus a bias for each of them.

        Args:
            values: To normalise.
            affine: Gain and bias, of the same shape.
        """
        gain, bias = affine
        scale = (self.variance + _EPS).rsqrt()
        found = (values - self.mean) * scale * gain + bias
        if self.training:
            with torch.no_grad():
                variance, mean = torch.var_mean(values.detach(), correction=0)
                self.mean.lerp_(mean, _MOMENTUM)
                self.variance.lerp_(variance, _MOMENTUM)
        return found


class LocalDecoder(nn.Module):
    """A small residual network from a point in an element's frame to one number.

    Args:
        latent: Numbers that describe the detail of an element.
        width: Of the layers.

    Source: paper, Sec. 3.1 (LDIF); layers of the authors' release.
    """

    def __init__(self, latent: int, width: int) -> None:
        super().__init__()
        self.enter = nn.Linear(3, width)
        self.norm1 = ConditionalNorm(latent, width)
        self.inner = nn.Linear(width, width)
        self.norm2 = ConditionalNorm(latent, width)
        self.outer = nn.Linear(width, width)
        self.norm3 = ConditionalNorm(latent, width)
        self.leave = nn.Linear(width, 1)

    def modulation(self, latent: Float[Tensor, "*batch latent"]) -> Tensor:
        """Return gain and bias of each norm for each latent: six rows of ``width``."""
        norms = (self.norm1, self.norm2, self.norm3)
        return torch.stack([part(latent) for norm in norms for part in (norm.gain, norm.bias)], -2)

    def forward(
        self, local: Float[Tensor, "*batch 3"], modulation: Float[Tensor, "*batch 6 width"]
    ) -> Float[Tensor, "*batch"]:
        """Return one number for each point.

        Args:
            local: Points in the frames of their elements.
            modulation: Of their elements.
        """
        g1, b1, g2, b2, g3, b3 = modulation.unbind(-2)
        first = self.norm1(self.enter(local), (g1, b1))
        inner = self.norm2(self.inner(F.relu(first)), (g2, b2))
        out = first + self.outer(F.relu(inner))
        return self.leave(self.norm3(out, (g3, b3)))[..., 0]
