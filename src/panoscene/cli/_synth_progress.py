"""How far the making of a data set is: a bar where somebody watches, lines in a log."""

import multiprocessing
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
)

from panoscene.cli._terminal import note

LOG_SECONDS = 60.0
"""At least between two lines of a log."""


@contextmanager
def steps_told(task: str) -> Iterator[Callable[[int, int], None]]:
    """Give a function that is told how many steps are done and how many there are."""
    start = time.monotonic()

    def words(done: int, total: int) -> str:
        passed = time.monotonic() - start
        return f"about {spoken(passed / done * (total - done))} left" if done < total else ""

    with told_in_words(task) as told:
        yield lambda done, total: told(done, total, words(done, total))


@contextmanager
def told_in_words(task: str) -> Iterator[Callable[[int, int, str], None]]:
    """Give a function that is told done, total and what more there is to say."""
    if not sys.stderr.isatty():
        yield _log(task)
        return
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[words]}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        running = bar.add_task(task, total=None, words="")
        yield lambda done, total, words: bar.update(
            running, completed=done, total=total, words=words
        )


def spoken(seconds: float) -> str:
    """Return a duration as people say it.

    Examples:
        >>> spoken(12.0), spoken(200.0), spoken(7300.0), spoken(90000.0)
        ('12 s', '4 min', '2 h 2 min', '25 h')
    """
    if seconds < 90:
        return f"{max(seconds, 1):.0f} s"
    minutes = -int(-seconds // 60)
    if minutes < 60:
        return f"{minutes} min"
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours < 10 else f"{hours} h"


@contextmanager
def stopping_at_once() -> Iterator[None]:
    """Make Ctrl-C and termination end the worker processes too, in the middle of their homes.

    Panoramas are written as a whole or not at all, so nothing is lost but those in the making.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, frame: FrameType | None) -> None:
        for child in multiprocessing.active_children():
            child.terminate()
        raise KeyboardInterrupt

    before = {number: signal.signal(number, stop) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _log(task: str) -> Callable[[int, int, str], None]:
    last = time.monotonic()

    def told(done: int, total: int, words: str) -> None:
        nonlocal last
        if done == total or time.monotonic() - last >= LOG_SECONDS:
            last = time.monotonic()
            note(f"{task}: {done} of {total}" + (f", {words}" if words else ""))

    return told
