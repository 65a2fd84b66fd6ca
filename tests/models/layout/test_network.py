"""The layout network: sizes, the ring, what is frozen."""

import pytest
import torch
from torch import nn

from panoscene.models.layout import (
    CONFIGS,
    LayoutConfig,
    LayoutNetwork,
    build_layout,
    layout_losses,
)
from panoscene.models.layout._network import LayoutSignals


def test_paper_edition_has_the_published_size() -> None:
    with torch.device("meta"):
        network = build_layout(CONFIGS["paper"])
    assert sum(p.numel() for p in network.parameters()) == 81_570_348
    assert network.recurrent.input_size == 1024
    assert network.recurrent.num_layers == 2
    assert network.recurrent.hidden_size == 512
    with torch.device("meta"):
        signals = network.eval()(torch.zeros(1, 3, 512, 1024))
    assert signals.boundary.shape == (1, 2, 1024)
    assert signals.corner.shape == (1, 1024)


def test_compact_edition_fits_the_budget() -> None:
    with torch.device("meta"):
        network = build_layout(CONFIGS["compact"])
    assert sum(p.numel() for p in network.parameters()) * 2 < 9e6
    with torch.device("meta"):
        assert network(torch.zeros(2, 3, 128, 256)).boundary.shape == (2, 2, 1024)


def test_first_answers_are_those_of_a_usual_room(tiny_network: LayoutNetwork) -> None:
    bias = tiny_network.head.bias.detach().reshape(3, -1)
    assert bias.mean(1).tolist() == pytest.approx([-1.0, 0.478, -0.425])


@pytest.mark.parametrize("strides", [1, 2])
def test_rolling_the_panorama_rolls_the_signals(tiny_network: LayoutNetwork, strides: int) -> None:
    image = torch.rand(1, 3, 64, 128, generator=torch.Generator().manual_seed(1))
    with torch.inference_mode():
        before = tiny_network(image)
        after = tiny_network(image.roll(32 * strides, -1))
    columns = 256 * strides
    # the recurrent layers remember what is half a ring away a little
    assert torch.allclose(before.boundary.roll(columns, -1), after.boundary, atol=1e-4)
    assert torch.allclose(before.corner.roll(columns, -1), after.corner, atol=1e-4)
    assert not torch.allclose(before.corner, after.corner, atol=1e-3)


def test_other_sizes_are_refused(tiny_network: LayoutNetwork) -> None:
    with pytest.raises(ValueError, match=r"image: found \(32, 64\)"):
        tiny_network(torch.rand(1, 3, 32, 64))


def test_frozen_stages_are_not_trained(tiny_config: LayoutConfig) -> None:
    network = build_layout(tiny_config).train()
    frozen = {n for n, p in network.backbone.named_parameters() if not p.requires_grad}
    assert any("conv_stem" in name for name in frozen)
    assert any("blocks.1." in name for name in frozen)
    assert not any("blocks.2." in name for name in frozen)
    norms = [m for m in network.backbone.modules() if isinstance(m, nn.BatchNorm2d)]
    assert norms
    assert not any(norm.training for norm in norms)
    assert any(m.training for m in network.compress.modules() if isinstance(m, nn.BatchNorm2d))


def test_gradients_are_finite(tiny_config: LayoutConfig) -> None:
    network = build_layout(tiny_config).train()
    generator = torch.Generator().manual_seed(2)
    signals = network(torch.rand(2, 3, 64, 128, generator=generator))
    terms = layout_losses(signals, torch.rand(2, 2, 1024), torch.rand(2, 1024))
    torch.stack(list(terms.values())).sum().backward()
    for name, parameter in network.named_parameters():
        assert (parameter.grad is not None) == parameter.requires_grad, name
        assert parameter.grad is None or bool(parameter.grad.isfinite().all()), name


def test_losses_by_hand() -> None:
    signals = LayoutSignals(torch.zeros(1, 2, 1024), torch.zeros(1, 1024))
    terms = layout_losses(
        signals, torch.full((1, 2, 1024), 0.1), torch.full((1, 1024), 0.5), boundary_weight=2.0
    )
    assert float(terms["boundary"]) == pytest.approx(0.2)
    assert float(terms["corner"]) == pytest.approx(0.6931, abs=1e-4)


@pytest.mark.parametrize("change", [{"steps": 100}, {"wrap": 999}, {"compression": ((8,),)}])
def test_configurations_that_do_not_fit_are_refused(change: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=next(iter(change))):
        LayoutConfig.model_validate(CONFIGS["compact"].model_dump() | change)
