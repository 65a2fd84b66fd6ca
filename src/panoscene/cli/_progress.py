# ruff: noqa: PLC0415
# The imports stand inside: where nobody watches nobody waits for them.
"""Progress on stderr, where somebody watches."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from panoscene.cli._terminal import note


@contextmanager
def progress_bar(task: str, total: int) -> Iterator[Callable[[int], None]]:
    """Give a function that moves a bar on by so many steps; nothing is drawn for a single one."""
    if total < 2 or not sys.stderr.isatty():
        yield lambda steps: None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        running = bar.add_task(task, total=total)
        yield lambda steps: bar.advance(running, steps)


@contextmanager
def progress_words() -> Iterator[Callable[[str], None]]:
    """Give a function that says what is being done: on one changing line, or as lines of a log."""
    if not sys.stderr.isatty():
        yield note
        return
    from rich.console import Console

    with Console(stderr=True).status("starting") as status:
        yield status.update
