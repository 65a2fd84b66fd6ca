"""panoscene reconstruct --ray: what is refused; ``test_two_nodes.py`` starts a cluster."""

import sys
from pathlib import Path

import pytest

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


def test_a_missing_package_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    code = main(["reconstruct", str(sample_photo_path()), "-o", str(tmp_path / "room"), "--ray"])
    assert code == 2
    assert "pip install 'panoscene[ray]'" in capsys.readouterr().err
    assert not (tmp_path / "room").exists()
