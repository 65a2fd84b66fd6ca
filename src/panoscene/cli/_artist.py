"""A second process that draws while this one computes."""

import logging
import os
import pickle
import signal
import sys
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from importlib import import_module
from multiprocessing import get_context, parent_process
from threading import Thread
from typing import Any


@contextmanager
def artist(*modules: str, fork: bool = False) -> Iterator[ProcessPoolExecutor]:
    """Give what runs one task after the other in a process of its own.

    Drawing holds the interpreter, so threads of one process would wait for each other. Tasks that
    have not begun when the block is left are given up.

    Args:
        modules: that the process imports at once, while nobody asks for anything.
        fork: On Linux, begin with the libraries that are loaded here, instead of seconds later.
            Nothing but this thread may be at work here.
    """
    context = get_context("fork" if fork and sys.platform == "linux" else "spawn")
    pool = _Sealed(1, mp_context=context, initializer=_begin)
    try:
        with warnings.catch_warnings():
            # Python 3.12 and later warn of any thread, as those of NumPy that wait for work
            warnings.simplefilter("ignore", DeprecationWarning)
            pool.submit(_import, modules)
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)


class _Sealed(ProcessPoolExecutor):
    """Sends copies of what a task is about, made at once.

    PyTorch would move the memory of each tensor to where both processes see it, from a thread of
    the pool and under the feet of who reads the tensor here meanwhile: a crash, now and then.
    """

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Return what will come of a call in the other process."""
        return super().submit(_opened, pickle.dumps((fn, args, kwargs), pickle.HIGHEST_PROTOCOL))


def _opened(sealed: bytes) -> Any:
    """Return what comes of a call that was sealed by this program a moment ago."""
    fn, args, kwargs = pickle.loads(sealed)  # noqa: S301
    return fn(*args, **kwargs)


def _begin() -> None:
    # Ctrl-C is for the other process, which then ends this one
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_follow, daemon=True).start()
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    # whatever a library prints must not get between the results of the command
    os.dup2(2, 1)
    _leave_cores()


def _follow() -> None:
    """End this process when the one that started it has ended, however that came about."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _import(modules: tuple[str, ...]) -> None:
    for module in modules:
        import_module(module)
    _leave_cores()


def _leave_cores() -> None:
    """Let the networks, in the other process, have the other cores."""
    if torch := sys.modules.get("torch"):
        torch.set_num_threads(1)
