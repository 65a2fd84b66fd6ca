"""Does tasks in several processes; one that dies costs its task, not the others."""

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

Task = TypeVar("Task")

DIED = "its process died; too little memory (each takes up to 2 GiB) is the usual reason"
"""Why a task could not be done that kills even a process of its own."""


def in_processes(
    do: Callable[[Task], None], tasks: Iterable[Task], processes: int
) -> Generator[tuple[Task, str | None], None, None]:
    """Yield tasks as they are done, with the reason of those that could not be.

    A process that dies takes the pool with it, and it is not known which task killed it. So those
    that were under way are done once more, each alone: only one that dies again has failed.

    Args:
        do: Function of a module. A ``ValueError`` is the reason why a task could not be done,
            anything else ends the run.
        tasks: Are taken a few at a time, so that stopping is quick.
        processes: Side by side; they ignore Ctrl-C and end with this one.
    """
    left = iter(tasks)
    while lost := (yield from _in_one_pool(do, left, processes)):
        for task in lost:
            if (yield from _in_one_pool(do, iter([task]), 1)):
                yield task, DIED


def outcome(call: Callable[[], None]) -> str | None:
    """Return why something could not be done, or None when it was."""
    try:
        call()
    except ValueError as error:
        return str(error)
    return None


def _in_one_pool(
    do: Callable[[Task], None], left: Iterator[Task], processes: int
) -> Generator[tuple[Task, str | None], None, list[Task]]:
    """Yield tasks as they are done; return those that were under way when the pool broke."""
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(processes, context, initializer=_begin)
    waiting: dict[Future[None], Task] = {}
    lost: list[Task] = []
    try:
        while True:
            while not lost and len(waiting) < 2 * processes:
                task = next(left, None)
                if task is None:
                    break
                try:
                    waiting[pool.submit(do, task)] = task
                except BrokenProcessPool:
                    lost.append(task)
            if not waiting:
                return lost
            for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                task = waiting.pop(future)
                if isinstance(future.exception(), BrokenProcessPool):
                    lost.append(task)
                else:
                    yield task, outcome(future.result)
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _begin() -> None:
    """Let the parent process decide what Ctrl-C means, and end when it is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(2.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
