"""The process that draws: answers, errors, and how it ends."""

import operator
import os
import subprocess
import sys
import time
from concurrent.futures import BrokenExecutor
from pathlib import Path

import pytest
import torch

from panoscene.cli._artist import artist


@pytest.mark.parametrize("fork", [False, True])
def test_tasks_are_done_in_another_process(
    capfd: pytest.CaptureFixture[str], *, fork: bool
) -> None:
    with artist("json", fork=fork) as drawing:
        process = drawing.submit(os.getpid)
        assert list(drawing.map(operator.mul, (2, 3), (5, 7))) == [10, 21]
        # what a library prints is not among the results of the command
        drawing.submit(os.write, 1, b"drawing").result(60)
        assert process.result(60) != os.getpid()
    assert capfd.readouterr() == ("", "drawing")


@pytest.mark.skipif(sys.platform != "linux", reason="other systems start again")
def test_a_fork_has_what_is_loaded_here_and_works_with_one_thread() -> None:
    ones = torch.ones(300, 300)
    product = ones @ ones
    _LOADED.append(os.getpid())
    with artist(fork=True) as drawing:
        assert drawing.submit(_loaded).result(60) == _LOADED
        assert drawing.submit(torch.get_num_threads).result(60) == 1
        # threads that a library has here are not there, and nobody waits for them
        assert torch.equal(drawing.submit(torch.mm, ones, ones).result(60), product)


@pytest.mark.parametrize("fork", [False, True])
def test_tensors_stay_where_they_are(*, fork: bool) -> None:
    # PyTorch moves what it sends to another process, and who reads it meanwhile crashes
    image = torch.rand(3, 64, 128)
    place = image.data_ptr()
    with artist(fork=fork) as drawing:
        total = drawing.submit(torch.sum, image).result(60)
        assert (image.data_ptr(), image.is_shared()) == (place, False)
        # sent as it was when it was given away
        later = drawing.submit(torch.sum, image)
        image.zero_()
        assert torch.equal(later.result(60), total)


_LOADED: list[int] = []


def _loaded() -> list[int]:
    return _LOADED


def test_what_a_task_raises_is_raised_here() -> None:
    with artist() as drawing:
        with pytest.raises(ZeroDivisionError):
            drawing.submit(operator.truediv, 1, 0).result(60)
        with pytest.raises(FileNotFoundError) as absent:
            drawing.submit(os.stat, "nowhere").result(60)
        assert absent.value.filename == "nowhere"
        assert drawing.submit(operator.neg, 1).result(60) == -1


def test_a_process_that_dies_is_noticed() -> None:
    with artist() as drawing:
        with pytest.raises(BrokenExecutor):
            drawing.submit(os._exit, 3).result(60)
        with pytest.raises(BrokenExecutor):
            drawing.submit(os.getpid).result(60)


def test_leaving_gives_up_what_has_not_begun() -> None:
    with artist() as drawing:
        process = drawing.submit(os.getpid).result(60)
        tasks = [drawing.submit(time.sleep, 0.2) for _ in range(50)]
    assert tasks[-1].cancelled()
    with pytest.raises(ProcessLookupError):
        os.kill(process, 0)


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("fork", [False, True])
def test_it_ends_with_the_process_that_started_it(tmp_path: Path, *, fork: bool) -> None:
    code = f"""
import os, signal
from pathlib import Path
from panoscene.cli._artist import artist
with artist(fork={fork}) as drawing:
    Path({str(tmp_path / "pid")!r}).write_text(str(drawing.submit(os.getpid).result()))
    os.kill(os.getpid(), signal.SIGKILL)
"""
    subprocess.run([sys.executable, "-c", code], check=False)
    process = int((tmp_path / "pid").read_text())
    for _ in range(600):
        if not _is_running(process):
            return
        time.sleep(0.1)
    pytest.fail("the process that draws goes on alone")


def _is_running(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    state = Path(f"/proc/{process}/stat")
    # nobody may be there to collect what is left of it
    return not (state.exists() and state.read_text().rpartition(")")[2].split()[0] == "Z")
