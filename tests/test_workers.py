"""Tasks in several processes, some of which do not survive them."""

import importlib
from pathlib import Path
from types import ModuleType

import pytest

from panoscene._workers import DIED, in_processes

DIES, IMPOSSIBLE = 1, 3
WORK = """
import os, signal, time

def work(task):
    folder, number = task
    (folder / f"{number}-began").touch()
    if number == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    if number == 3:
        raise ValueError("three is impossible")
    while number == 2 and not (folder / "1-began").exists():
        time.sleep(0.01)  # under way when the other process dies
    (folder / f"{number}-done").touch()

def stumble(task):
    raise KeyError("a mistake")
"""


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """Return a module that the processes can import, too."""
    (tmp_path / "work_of_processes.py").write_text(WORK)
    monkeypatch.syspath_prepend(tmp_path)
    return importlib.import_module("work_of_processes")


def test_a_process_that_dies_costs_its_own_task_only(module: ModuleType, tmp_path: Path) -> None:
    tasks = [(tmp_path, number) for number in range(6)]
    found = dict(in_processes(module.work, tasks, 2))
    assert len(found) == len(tasks)
    problems = {number: problem for (_, number), problem in found.items() if problem}
    assert problems == {DIES: DIED, IMPOSSIBLE: "three is impossible"}
    assert {path.name for path in tmp_path.glob("*-done")} == {
        "0-done",
        "2-done",
        "4-done",
        "5-done",
    }


def test_mistakes_end_the_run(module: ModuleType) -> None:
    with pytest.raises(KeyError, match="a mistake"):
        list(in_processes(module.stumble, range(4), 2))
