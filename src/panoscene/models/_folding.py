"""Batch normalisations made part of convolutions: the same network in less time."""

from torch import nn
from torch.nn.utils.fusion import fuse_conv_bn_weights

from ._backbone import Backbone


def fold_norms(backbone: Backbone) -> None:
    """Make each batch normalisation part of the convolution whose output it takes, in place.

    The function computed in inference mode stays the same; the normalisations are gone.

    Raises:
        ValueError: A normalisation does not take the output of a convolution without bias.
    """
    pairs = _convolutions_before_norms(backbone)
    for name, norm in list(backbone.named_modules()):
        if not isinstance(norm, nn.BatchNorm2d):
            continue
        conv = pairs.get(name)
        mean, variance = norm.running_mean, norm.running_var
        if conv is None or conv.bias is not None or mean is None or variance is None:
            raise ValueError(f"backbone: {name} does not follow a convolution without bias")
        conv.weight, conv.bias = fuse_conv_bn_weights(
            conv.weight, None, mean, variance, norm.eps, norm.weight, norm.bias
        )
        conv.bias.requires_grad_(True)
        backbone.set_submodule(name, getattr(norm, "act", nn.Identity()))


def _convolutions_before_norms(backbone: Backbone) -> dict[str, nn.Conv2d]:
    """Return the convolution before each normalisation: all backbones list them so."""
    pairs: dict[str, nn.Conv2d] = {}
    last: nn.Conv2d | None = None
    for name, module in backbone.named_modules():
        if isinstance(module, nn.Conv2d):
            last = module
        elif isinstance(module, nn.BatchNorm2d):
            if last is not None and last.out_channels == module.num_features:
                pairs[name] = last
            last = None
    return pairs
