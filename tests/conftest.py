"""What every test shares: one thread a worker, quiet plots, modest property tests, a browser.

With the environment variable PANOSCENE_MUST_RUN, such as "browser npm", tests that need these fail
where they would be skipped; with "renderer" in it all optional packages must be there.
"""

import gc
import importlib.util
import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NoReturn

import jaxtyping
import pytest
import torch
from hypothesis import HealthCheck, settings
from playwright.sync_api import Browser, expect, sync_playwright

# pytest-xdist runs one worker on each core
torch.set_num_threads(1)
os.environ.setdefault("MPLBACKEND", "Agg")
# no test asks the network for weights
os.environ["HF_HUB_OFFLINE"] = "1"
# collecting makes millions of objects that stay: looking through them takes a third of the time
gc.disable()

settings.register_profile(
    "panoscene",
    deadline=None,
    max_examples=30,
    derandomize="CI" in os.environ,
    # shape checks make the first example of a test slow to draw
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("panoscene")

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
BROWSER_FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    # the page itself without the imitated graphics card: twenty times faster here
    "--disable-gpu-compositing",
]
PATIENCE = 90_000
"""Milliseconds; busy machines draw 3D slowly without a graphics card."""


OPTIONAL = ("mitsuba", "mitsuba_oidn", "drjit", "mujoco", "ray")
"""Packages without which tests of data sets are skipped."""


def pytest_configure() -> None:
    """Refuse to start where tests would be skipped that may not be."""
    absent = [name for name in OPTIONAL if importlib.util.find_spec(name) is None]
    if absent and "renderer" in os.environ.get("PANOSCENE_MUST_RUN", "").split():
        raise pytest.UsageError(f"PANOSCENE_MUST_RUN names the renderer: {absent} not installed")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the longest tests, so that in the end no core waits for one that came late."""
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)


def pytest_collection_finish() -> None:
    """Look for garbage again, but only in what the tests themselves make."""
    gc.freeze()
    gc.enable()


@pytest.fixture(scope="session")
def root() -> Path:
    """Return the top of the source tree."""
    return Path(__file__).parents[1]


@pytest.fixture
def generator() -> torch.Generator:
    """Return a seeded source of random tensors."""
    return torch.Generator().manual_seed(0)


@pytest.fixture
def unchecked() -> Iterator[None]:
    """Look at no shapes in a test that calls by the thousand what other tests call and check."""
    before = jaxtyping.config.jaxtyping_disable
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", before)


@pytest.fixture(scope="session")
def missing() -> Callable[[str, str], NoReturn]:
    """Return what skips a test for want of a tool, or fails it where that tool must be there."""

    def skip_or_fail(tool: str, reason: str) -> NoReturn:
        if tool in os.environ.get("PANOSCENE_MUST_RUN", "").split():
            pytest.fail(f"PANOSCENE_MUST_RUN names {tool}, but the test {reason}")
        pytest.skip(reason)

    return skip_or_fail


@pytest.fixture(scope="module")
def browser(missing: Callable[[str, str], NoReturn]) -> Iterator[Browser]:
    """Return a running Chromium or Chrome without a window."""
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    if path is None:
        missing("browser", "needs Chromium or Chrome")
    expect.set_options(timeout=PATIENCE)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=BROWSER_FLAGS)
        yield browser
        browser.close()
