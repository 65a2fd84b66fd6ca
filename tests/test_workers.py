"""Tasks in several processes, some of which do not survive them."""

import importlib
import time
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from types import ModuleType

import pytest

from panoscene._workers import in_processes, outcome

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
    if number >= 10:
        time.sleep(0.3)
    while number == 2 and not (folder / "1-began").exists():
        time.sleep(0.01)  # under way when the other process dies
    (folder / f"{number}-done").touch()

def stumble(task):
    raise KeyError("a mistake")

def die(task):
    os.kill(os.getpid(), signal.SIGKILL)
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
    assert problems.pop(IMPOSSIBLE) == "three is impossible"
    assert "its process died" in problems.pop(DIES)
    assert problems == {}
    assert {path.name for path in tmp_path.glob("*-done")} == {
        "0-done",
        "2-done",
        "4-done",
        "5-done",
    }


def test_mistakes_end_the_run(module: ModuleType) -> None:
    with pytest.raises(KeyError, match="a mistake"):
        list(in_processes(module.stumble, range(4), 2))


def test_processes_that_never_do_anything_end_the_run(module: ModuleType) -> None:
    with pytest.raises(BrokenProcessPool):
        list(in_processes(module.die, range(4), 2))


def test_nothing_is_written_after_the_end(module: ModuleType, tmp_path: Path) -> None:
    made = in_processes(module.work, [(tmp_path, number) for number in range(10, 20)], 2)
    next(made)
    made.close()
    before = {path.name for path in tmp_path.glob("*-*")}
    time.sleep(0.7)
    assert {path.name for path in tmp_path.glob("*-*")} == before
    assert len(before) < 20


def test_every_problem_has_a_name() -> None:
    def fail() -> None:
        raise ValueError

    assert outcome(fail) == "ValueError"
