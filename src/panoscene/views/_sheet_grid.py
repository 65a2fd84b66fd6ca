"""How a comparison sheet is divided: blocks of rows, the columns that have content, the gaps."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Literal

from jaxtyping import Float
from torch import Tensor

from panoscene.scene import Scene
from panoscene.style import MARGIN

Column = Literal["input", "room", "overlay", "rendering", "view"]
HEADINGS: dict[Column, str] = {
    "input": "Input panorama",
    "room": "Bird's-eye view",
    "overlay": "Overlay",
    "rendering": "Reconstruction",
    "view": "Free view",
}
_ASPECT: dict[Column, float] = {
    "input": 2.0, "room": 1.25, "overlay": 2.0, "rendering": 2.0, "view": 4 / 3,
}  # fmt: skip
"""Width over height of the cells."""
_LINES: tuple[tuple[Column, ...], ...] = (("input", "room", "view"), ("overlay", "rendering"))
"""How a block is divided when its cells would be too small in one line."""
_WIDEST_LINE = 5.3
"""Sum of width over height from which a line is divided."""
_MOST_LARGER = 1.2
"""How much higher one line of a block may be than the other."""
USUAL_WIDTH, LEAST_WIDTH, LONGEST = 2000, 800, 20_000
"""Pixels; sizes of type and gaps are those of a sheet of ``_TYPE_WIDTH``."""
_TYPE_WIDTH = 1050
GAP, ROOM_GAP, ROW_GAP, TITLE_ROW = 10.0, 34.0, 18.0, 40.0
NAME_ROW, HEADING_ROW, KEY_ROW = 29.0, 21.0, 46.0


@dataclass(frozen=True, slots=True)
class SheetRow:
    """One row of a comparison sheet: a method, its input, or the truth."""

    name: str
    """Such as "Input", "Disturbed", "Repaired", "Truth"."""
    scene: Scene | None = None
    """Shown from above and over the panorama."""
    image: Float[Tensor, "3 height width"] | None = None
    """The photo, colours in [0, 1]. Rows of the same room without one take that of the first."""
    rendering: Float[Tensor, "3 rows columns"] | None = None
    """The reconstruction as a panorama, colours in [0, 1]."""
    view: Float[Tensor, "3 view_rows view_columns"] | None = None
    """The reconstruction from a free camera, colours in [0, 1]."""
    caption: str = ""
    """A few words beside the name."""
    room: str = ""
    """Heading of this and the following rows of the same room."""


@dataclass(frozen=True, slots=True)
class Cell:
    """Where a picture goes, in pixels from the left of the sheet and the top of its row."""

    left: int
    down: int
    width: int
    height: int


@dataclass(frozen=True, slots=True)
class Grid:
    """Where everything goes, in pixels from the upper left corner."""

    width: int
    height: int
    unit: float
    """Pixels of the sheet for one of the usual type."""
    cells: dict[Column, Cell]
    tops: list[int]
    """Upper end of each row, where its name stands."""


def rooms_of(rows: Sequence[SheetRow]) -> Iterator[tuple[int, list[SheetRow]]]:
    """Yield the index of the first row of each room, and its rows."""
    first = 0
    for _, group in groupby(rows, key=lambda row: row.room):
        members = list(group)
        yield first, members
        first += len(members)


def make_grid(rows: Sequence[SheetRow], title: str, width: int) -> Grid:
    """Return the places of all cells: the same in every row, as large as the width allows."""
    unit = width / _TYPE_WIDTH
    rooms = list(rooms_of(rows))
    contents = [row_contents(row, group) for _, group in rooms for row in group]
    shown: list[Column] = [column for column in HEADINGS if any(column in row for row in contents)]
    if "input" in shown and all(row == ["input"] for row in contents if "input" in row):
        # photos have rows of their own: no cell of the others stays empty for them
        others: list[Column] = [column for column in shown if column != "input"]
        cells = _cells(["input"], width, unit) | _cells(others, width, unit)
    else:
        cells = _cells(shown, width, unit)
    tops: list[int] = []
    top = (MARGIN + (TITLE_ROW if title else 0.0)) * unit
    for first, group in rooms:
        top += ROOM_GAP * unit if group[0].room else 0.0
        for k in range(first, first + len(group)):
            top += ROW_GAP * unit if k else 0.0
            tops.append(round(top))
            top += max(cells[column].down + cells[column].height for column in contents[k])
    return Grid(width, round(top + (KEY_ROW + MARGIN) * unit), unit, cells, tops)


def row_contents(row: SheetRow, group: Sequence[SheetRow]) -> list[Column]:
    """Return what a row shows, given all rows of its room: a photo is shared with those without.

    A photo that has a row of its own is shown there alone.
    """
    photos = [other for other in group if other.image is not None]
    own = any(other.scene is None for other in photos)
    shared = row.scene is not None and bool(photos) and not own
    has: dict[Column, bool] = {
        "input": row.image is not None or shared,
        "room": row.scene is not None,
        "overlay": row.scene is not None,
        "rendering": row.rendering is not None,
        "view": row.view is not None,
    }
    return [column for column, there in has.items() if there]


def _cells(shown: Sequence[Column], width: int, unit: float) -> dict[Column, Cell]:
    """Return the cells of a row, in one line or in two."""
    if not shown:
        return {}
    lines: list[Sequence[Column]] = [shown]
    if sum(_ASPECT[column] for column in shown) > _WIDEST_LINE:
        lines = [[column for column in line if column in shown] for line in _LINES]
    margin, gap = MARGIN * unit, GAP * unit
    # no cell is higher than a third of the sheet is wide
    heights = [
        min((width - 2 * margin - gap * (len(line) - 1)) / sum(map(_ASPECT.__getitem__, line)),
            width / 3)
        for line in lines
    ]  # fmt: skip
    cells: dict[Column, Cell] = {}
    down = NAME_ROW * unit
    for line, height in zip(lines, heights, strict=True):
        down += HEADING_ROW * unit
        left, tall = margin, min(height, _MOST_LARGER * min(heights))
        for column in line:
            wide = int(_ASPECT[column] * tall) // 2 * 2
            cells[column] = Cell(round(left), round(down), wide, int(tall))
            left += _ASPECT[column] * tall + gap
        down += tall + gap
    return cells
