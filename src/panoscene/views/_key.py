"""The column beside the rooms that says what colours, numbers and marks mean."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import shapely

from panoscene.scene import CATEGORIES
from panoscene.style import (
    BODY,
    FAINT_INK,
    GROUP_COLOURS,
    INK,
    OPAQUE,
    PAPER,
    REFERENCE,
    SMALL,
    THIN,
    group_of,
    words,
)
from panoscene.views._drawing import draw_alarm, draw_camera, draw_contact, draw_front, draw_piece
from panoscene.views._far import draw_arrow_head
from panoscene.views._page import Page
from panoscene.views._pieces import Contact, Piece, Plan

Mark = Literal[
    "front", "overhead", "contact", "collision", "outside", "both", "far", "reference", "camera"
]
_MARKS: dict[Mark, str] = {
    "front": "front",
    "overhead": "overhead",
    "contact": "touching",
    "collision": "collision",
    "outside": "outside the room",
    "both": "collides, or outside",
    "far": "far away, distance",
    "reference": "true place",
    "camera": "camera",
}


_STEP = 23.0
"""Pixels from row to row."""
_WEIGHT = {"group": 1.25, "number": 1.0, "mark": 1.2, "space": 0.7}
"""Height of the kinds of rows in steps."""
_LINE = 9
"""Characters of numbers in a row."""
FOOT = 24.0
"""Pixels that stay free below the key."""


@dataclass(frozen=True, slots=True)
class Row:
    """A line of the key."""

    kind: Literal["group", "number", "mark", "space"]
    text: str = ""
    number: str = ""
    """Numbers in front of a category, such as "3-6"."""


def key_rows(
    plans: Sequence[Plan],
    numbers: Sequence[dict[int, str]],
    *,
    with_reference: bool,
    with_far: bool = False,
) -> list[Row]:
    """Return the rows for what the plans show, and no others."""
    shown: dict[str, dict[str, set[int]]] = {group: {} for group in GROUP_COLOURS}
    for plan, numbered in zip(plans, numbers, strict=True):
        for piece in plan.pieces:
            members = shown[group_of(piece.category)].setdefault(piece.category, set())
            if piece.index in numbered:
                members.add(int(numbered[piece.index]))
    rows: list[Row] = []
    for group, categories in shown.items():
        if not categories:
            continue
        rows.append(Row("group", group.capitalize()))
        for category, members in sorted(categories.items()):
            rows += number_rows(category, members)
    pieces = [piece for plan in plans for piece in plan.pieces]
    collides = any(plan.clashes for plan in plans)
    leaves = any(piece.outside.area > 0 for piece in pieces)
    present: dict[Mark, bool] = {
        "front": bool(pieces),
        "overhead": any(piece.overhead for piece in pieces),
        "contact": any(plan.contacts for plan in plans),
        "collision": collides and not leaves,
        "outside": leaves and not collides,
        "both": collides and leaves,
        "far": with_far,
        "reference": with_reference,
        "camera": True,
    }
    if rows:
        rows.append(Row("space"))
    return rows + [Row("mark", mark) for mark in _MARKS if present[mark]]


def number_rows(category: str, numbers: set[int]) -> list[Row]:
    """Return the rows that say which objects are of a category; long lists take several rows."""
    lines: list[str] = []
    for part in number_ranges(numbers).split(", ") if numbers else []:
        if lines and len(lines[-1]) + len(part) <= _LINE:
            lines[-1] += f", {part}"
        else:
            lines.append(part)
    return [Row("number", "" if k else words(category), line) for k, line in enumerate(lines)]


def longest_key(categories: Sequence[int]) -> float:
    """Return the height in pixels of a key in which every object of a scene has its number."""
    numbers: dict[str, set[int]] = {}
    for index, category in enumerate(categories):
        numbers.setdefault(CATEGORIES[category], set()).add(index)
    lines = sum(len(number_rows(name, members)) for name, members in numbers.items())
    groups = {group_of(name) for name in numbers}
    rows = _WEIGHT["group"] * len(groups) + lines + _WEIGHT["mark"] * (len(_MARKS) - 3)
    return _STEP * (rows + _WEIGHT["space"]) + 2 * FOOT


def number_ranges(numbers: set[int]) -> str:
    """Return numbers in words, runs of them as ranges.

    Examples:
        >>> number_ranges({1, 2, 3, 5})
        '1-3, 5'
    """
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs)


def draw_key(page: Page, rows: Sequence[Row], x: float, top: float, width: float) -> None:
    """Draw the rows from the top down, closer together when there are many."""
    total = sum(_WEIGHT[row.kind] for row in rows)
    step = min(_STEP, (top - FOOT) / max(total, 1.0))
    shrink = min(1.0, step / 18.0)
    indent = 30.0
    number_width = max(
        (page.text_size(row.number, SMALL * shrink, bold=True)[0] for row in rows if row.number),
        default=0.0,
    )
    y = top + 3
    for row in rows:
        y -= step * _WEIGHT[row.kind]
        middle = y + step / 2
        if row.kind == "group":
            colour = GROUP_COLOURS[row.text.lower()]
            half = 8.0 * shrink
            swatch = shapely.box(x, middle - half, x + 20, middle + half)
            page.area(swatch, fill=colour, edge=INK, width=THIN, alpha=OPAQUE)
            page.text(x + indent, middle, row.text, size=BODY * shrink)
        elif row.kind == "number":
            size = SMALL * shrink
            page.text(x + indent, middle, row.number, size=size, colour=INK, bold=True)
            left = indent + number_width + 10
            if page.text_size(row.text, size)[0] > width - left:  # rather out of line than cut
                left = indent + page.text_size(row.number, size, bold=True)[0] + 10
            text = page.fitted(row.text, size, width - left)
            page.text(x + left, middle, text, size=size, colour=FAINT_INK)
        elif row.kind == "mark":
            _draw_mark(page, row.text, x, middle)
            text = _MARKS[row.text]  # ty: ignore[invalid-argument-type]
            page.text(x + indent, middle, text, size=BODY * shrink)


def _draw_mark(page: Page, mark: str, x: float, y: float) -> None:
    """Draw a small example of a mark, 20 pixels wide, around height y."""
    middle = np.array([x + 10, y])
    if mark == "contact":
        draw_contact(page, Contact(np.array([x + 2, y]), np.array([x + 18, y])))
    elif mark == "camera":
        draw_camera(page, middle)
    elif mark == "far":
        draw_arrow_head(page, (x + 10, y), (1.0, 0.0), PAPER)
    elif mark == "reference":
        page.area(
            shapely.box(x, y - 7, x + 20, y + 7), edge=REFERENCE, width=1.2, dashes=(4.0, 2.5)
        )
    elif mark in ("collision", "outside", "both"):
        draw_alarm(page, shapely.box(x, y - 7, x + 20, y + 7))
    else:
        corners = [(x, y - 7), (x + 20, y - 7), (x + 20, y + 7), (x, y + 7)]
        example = Piece(
            index=0,
            category="door" if mark == "overhead" else "chair",
            footprint=shapely.Polygon(corners),
            front=np.array(corners)[[3, 2]],
            overhead=mark == "overhead",
            colliding=False,
            outside=shapely.Polygon(),
        )
        if mark == "front":
            page.area(example.footprint, edge=INK, width=THIN)
            draw_front(page, example)
        else:
            draw_piece(page, example)
