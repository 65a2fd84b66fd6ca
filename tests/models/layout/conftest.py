"""A layout network that is small enough for tests."""

import pytest
import torch

from panoscene.models.layout import CONFIGS, LayoutConfig, LayoutNetwork, build_layout


@pytest.fixture(scope="session")
def tiny_config() -> LayoutConfig:
    """Return the compact edition at a quarter of its size."""
    return LayoutConfig.model_validate(
        CONFIGS["compact"].model_dump()
        | {"image_height": 64, "image_width": 128, "steps": 64, "hidden": 16, "wrap": 32}
    )


@pytest.fixture(scope="session")
def tiny_network(tiny_config: LayoutConfig) -> LayoutNetwork:
    """Return a network with random weights that answers differently in each column."""
    with torch.random.fork_rng(devices=[]):
        torch.default_generator.manual_seed(0)
        return build_layout(tiny_config).eval()
