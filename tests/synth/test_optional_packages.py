"""Without the optional packages: what needs one says what to install, and nothing else breaks."""

import sys

import numpy as np
import pytest
import trimesh

from panoscene.synth.assets import AssetError
from panoscene.synth.assets._decimate import decimated
from panoscene.synth.assets._soup import Triangles
from panoscene.synth.physics._engine import simulate
from panoscene.synth.render import MissingRendererError, Renderer

HINT = r"pip install 'panoscene\[synth\]'"


def without(monkeypatch: pytest.MonkeyPatch, package: str) -> None:
    """Let every import of a package fail as if it were not installed."""
    monkeypatch.setitem(sys.modules, package, None)


def ball() -> trimesh.Trimesh:
    return trimesh.creation.icosphere(1, 0.5)


@pytest.mark.parametrize("package", ["mitsuba", "mitsuba_oidn", "drjit"])
def test_rendering_names_what_to_install(monkeypatch: pytest.MonkeyPatch, package: str) -> None:
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", "libLLVM.so")
    for name in ("mitsuba", "mitsuba_oidn", "drjit"):
        # the others are there, but not started
        monkeypatch.setitem(sys.modules, name, None if name == package else sys)
    with pytest.raises(MissingRendererError, match=f"{package}.*{HINT}"):
        Renderer(1)


def test_settling_names_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    without(monkeypatch, "mujoco")
    with pytest.raises(ModuleNotFoundError, match=f"mujoco: {HINT}"):
        simulate([], np.zeros((0, 2)))


def test_simplifying_names_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    without(monkeypatch, "fast_simplification")
    corners = np.asarray(ball().triangles, np.float64)
    count = len(corners)
    soup = Triangles(
        corners, np.zeros((count, 3, 2)), np.zeros((count, 3, 3)), np.zeros(count, np.int64)
    )
    assert decimated(soup, count) is soup
    with pytest.raises(AssetError, match=f"fast-simplification: {HINT}"):
        decimated(soup, count - 1)
