"""Tables of results for people to read."""

import shutil
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from panoscene.arrange import Certificate, Violations

COLUMNS: tuple[tuple[str, Callable[[Violations], int | float], str], ...] = (
    ("energy", lambda v: v.energy, ".2f"),
    ("colliding\npairs", lambda v: v.colliding_pairs, ".0f"),
    ("worst pene-\ntration, cm", lambda v: 100 * v.worst_penetration, ".1f"),
    ("worst out of\nroom, cm", lambda v: 100 * v.worst_out_of_room + 0.0, ".1f"),
)
"""What the table shows of the violations before and after."""


def say_certificates(rows: Sequence[tuple[Path, Certificate]]) -> None:
    """Print what happened to each scene, and the sum or worst over several."""
    table = Table(box=box.SIMPLE_HEAD, show_footer=len(rows) > 1, pad_edge=False)
    table.add_column("scene", footer="sum or\nworst", overflow="fold")
    for number, (title, value, form) in enumerate(COLUMNS):
        combined = sum if number < 2 else max
        before, after = (
            combined(value(state) for state in states)
            for states in zip(*((c.before, c.after) for _, c in rows), strict=True)
        )
        footer = f"{before:{form}} → {after:{form}}"
        table.add_column(title, footer=footer, justify="right", no_wrap=True)
    table.add_column("outcome", overflow="fold")
    for file, certificate in rows:
        cells = [
            f"{value(certificate.before):{form}} → {value(certificate.after):{form}}"
            for _, value, form in COLUMNS
        ]
        words = certificate.outcome
        if certificate.left_outside:
            words += f"; {certificate.left_outside} outside, left there"
        table.add_row(Text(file.name), *cells, Text(words))
    _print(table)


def say_before_after(rows: Sequence[tuple[str, int | float, int | float, str]]) -> None:
    """Print quantities before and after: name, two values, how to format them."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("")
    for title in ("before", "after"):
        table.add_column(title, justify="right")
    for name, before, after, form in rows:
        table.add_row(name, f"{before:{form}}", f"{after:{form}}")
    _print(table)


def say_table(titles: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print rows under titles, the first column as words and the others as numbers."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for number, title in enumerate(titles):
        table.add_column(title, justify="right" if number else "left")
    for row in rows:
        table.add_row(*(Text(str(cell)) for cell in row))
    _print(table)


def _print(table: Table) -> None:
    # a log or a pipe has no width; the default of 80 columns would fold every line
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else 140
    Console(width=width, highlight=False).print(table)
