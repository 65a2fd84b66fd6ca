"""Does tasks in several processes; one that dies costs its task, not the others."""

import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Generic, TypeVar

Task = TypeVar("Task")


def in_processes(
    do: Callable[[Task], None], tasks: Iterable[Task], processes: int
) -> Generator[tuple[Task, str | None], None, None]:
    """Yield tasks as they are done, with the reason of those that could not be.

    A process that dies takes the pool with it, and it is not known which task killed it. So those
    that were under way are done once more, each alone: only one that dies again has failed.
    Whoever closes the generator waits for what is under way.

    Args:
        do: Function of a module. A ``ValueError`` is the reason why a task could not be done,
            anything else ends the run.
        tasks: Are taken a few at a time, so that stopping is quick.
        processes: Side by side; they ignore Ctrl-C and end with this one.

    Raises:
        BrokenProcessPool: Processes die before they have done anything.
    """
    left, pools = iter(tasks), _Pools(do)
    while lost := (yield from pools.one(left, processes)):
        for task in lost:
            if (yield from pools.one(iter([task]), 1)):
                if not pools.finished:
                    raise pools.reason
                yield task, f"its process died, perhaps for want of memory: {pools.reason}"


def outcome(call: Callable[[], None]) -> str | None:
    """Return why something could not be done, or None when it was."""
    try:
        call()
    except ValueError as error:
        return str(error) or type(error).__name__
    return None


class _Pools(Generic[Task]):
    """Pools that do the same, one after the other."""

    def __init__(self, do: Callable[[Task], None]) -> None:
        self._do = do
        self.finished = 0
        """Tasks that were done or could not be, in any pool."""
        self.reason = BrokenProcessPool()
        """Why the last pool broke."""

    def one(
        self, left: Iterator[Task], processes: int
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
                        waiting[pool.submit(self._do, task)] = task
                    except BrokenProcessPool:
                        lost.append(task)
                if not waiting:
                    return lost
                for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                    task, error = waiting.pop(future), future.exception()
                    if isinstance(error, BrokenProcessPool):
                        self.reason = error
                        lost.append(task)
                    else:
                        self.finished += 1
                        yield task, outcome(future.result)
        finally:
            # nothing is written any more when this returns
            pool.shutdown(wait=True, cancel_futures=True)


def _begin() -> None:
    """Let the parent process decide what Ctrl-C means, and end when it is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(2.0)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
