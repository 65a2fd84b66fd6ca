"""A second process that draws while this one computes."""

import logging
import os
import signal
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from importlib import import_module
from multiprocessing import get_context, parent_process
from threading import Thread


@contextmanager
def artist(*modules: str) -> Iterator[ProcessPoolExecutor]:
    """Give what runs one task after the other in a process of its own.

    Libraries take seconds to import and drawing holds the interpreter, so threads of one process
    would wait for each other. Tasks that have not begun when the block is left are given up.

    Args:
        modules: that the process imports at once, while nobody asks for anything.
    """
    context = get_context("spawn")
    pool = ProcessPoolExecutor(1, mp_context=context, initializer=_begin)
    try:
        pool.submit(_import, modules)
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)


def _begin() -> None:
    # Ctrl-C is for the other process, which then ends this one
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_follow, daemon=True).start()
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    # whatever a library prints must not get between the results of the command
    os.dup2(2, 1)


def _follow() -> None:
    """End this process when the one that started it has ended, however that came about."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _import(modules: tuple[str, ...]) -> None:
    for module in modules:
        import_module(module)
    if torch := sys.modules.get("torch"):
        # the networks need the other cores
        torch.set_num_threads(1)
