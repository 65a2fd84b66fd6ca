"""What every test shares: one thread for each worker, quiet plots, modest property tests."""

import os
from pathlib import Path

import pytest
import torch
from hypothesis import HealthCheck, settings

# pytest-xdist runs one worker on each core
torch.set_num_threads(1)
os.environ.setdefault("MPLBACKEND", "Agg")

settings.register_profile(
    "panoscene",
    deadline=None,
    max_examples=30,
    derandomize="CI" in os.environ,
    # shape checks make the first example of a test slow to draw
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("panoscene")


@pytest.fixture(scope="session")
def root() -> Path:
    """Return the top of the source tree."""
    return Path(__file__).parents[1]


@pytest.fixture
def generator() -> torch.Generator:
    """Return a seeded source of random tensors."""
    return torch.Generator().manual_seed(0)
