"""1 x 1 convolutions as matrix products."""

import pytest
import torch
from torch import nn

from panoscene.models.detector._pointwise import PointwiseConv2d, make_pointwise


@pytest.mark.parametrize("stride", [1, 2])
def test_it_is_the_same_convolution(stride: int) -> None:
    layer = nn.Conv2d(5, 7, 1, stride=stride)
    image = torch.rand(2, 5, 9, 6, generator=torch.Generator().manual_seed(0))
    before = layer(image)
    names = list(layer.state_dict())
    make_pointwise(layer)
    assert isinstance(layer, PointwiseConv2d)
    assert list(layer.state_dict()) == names
    torch.testing.assert_close(layer(image), before, atol=1e-5, rtol=1e-5)


def test_other_layers_stay_as_they_are() -> None:
    layers = nn.Sequential(
        nn.Conv2d(4, 4, 3), nn.Conv2d(4, 4, 1, groups=2), nn.ConvTranspose2d(4, 4, 1)
    )
    make_pointwise(layers)
    assert not any(isinstance(layer, PointwiseConv2d) for layer in layers)
