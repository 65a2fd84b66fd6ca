"""Help texts from docstrings, wrapped to the terminal."""

import inspect
import shutil
import textwrap
from collections.abc import Callable, Sequence

from panoscene.cli._terminal import say

WIDTH = 88
"""Columns of text that read well, where the terminal has as many."""


def explain(text: str, arguments: Sequence[str]) -> None:
    """Print what a docstring explains before its arguments, if the arguments ask for help.

    tyro prints usage and options after it. It would print this too, but with each paragraph on
    one line.
    """
    if not {"-h", "--help"} & set(arguments):
        return
    explanation = inspect.cleandoc(text).partition("\nArgs:")[0]
    width = min(shutil.get_terminal_size().columns, WIDTH)
    paragraphs = [
        part if part.startswith(" ") else textwrap.fill(part, width, break_on_hyphens=False)
        for part in explanation.split("\n\n")
    ]
    say("\n\n".join(paragraphs).rstrip() + "\n")


def summarised(text: str | None) -> Callable[[], int]:
    """Return a command without options that is described by the first line of a text."""

    def summary() -> int:
        return 0

    summary.__doc__ = (text or "").partition("\n")[0]
    return summary
