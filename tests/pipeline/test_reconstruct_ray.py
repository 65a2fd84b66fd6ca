"""panoscene reconstruct --ray: what is refused; ``test_two_nodes.py`` starts a cluster."""

import sys
from pathlib import Path
from types import ModuleType

import pytest

from panoscene._ray import ray_cluster
from panoscene.cli import main
from panoscene.cli._reconstruct import Choice, Task, reconstruct_there
from panoscene.pipeline import Pipeline
from panoscene.sample import sample_photo_path

CHOICE = Choice(1.6, 64, True)


def test_folders_that_are_not_shared_are_noticed(tmp_path: Path) -> None:
    def make() -> Pipeline:
        pytest.fail("networks are loaded for a photo that is not there")

    task = Task(tmp_path / "absent.jpg", tmp_path / "room", CHOICE)
    entry = reconstruct_there("run", make, task).entry
    assert not entry["ok"]
    assert "expected a shared folder" in entry["error"]


@pytest.mark.parametrize("address", ["127.0.0.1:1", "ray://127.0.0.1:1", "ray://here:there"])
def test_a_cluster_that_does_not_answer_is_refused_at_once(address: str) -> None:
    ray = ModuleType("ray")
    ray.is_initialized = lambda: False  # ty: ignore[missing-attribute]
    ray.init = lambda **_: pytest.fail("waits for minutes")  # ty: ignore[missing-attribute]
    with (
        pytest.raises(ConnectionError, match=f"{address}: found no Ray cluster there"),
        ray_cluster(ray, address),
    ):
        pass


def test_a_missing_package_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    code = main(["reconstruct", str(sample_photo_path()), "-o", str(tmp_path / "room"), "--ray"])
    assert code == 2
    assert "pip install 'panoscene[ray]'" in capsys.readouterr().err
    assert not (tmp_path / "room").exists()
