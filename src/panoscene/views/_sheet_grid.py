"""How a comparison sheet is divided: its rows, the columns that have content, the gaps."""

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
USUAL_WIDTH, LEAST_WIDTH = 2000, 800
"""Pixels; sizes of type and gaps are those of a sheet of ``_TYPE_WIDTH``."""
_TYPE_WIDTH = 1500
NAMES, GAP, ROOM_GAP, TITLE_ROW, HEADING_ROW, KEY_ROW = 128.0, 12.0, 30.0, 40.0, 34.0, 44.0


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
    """A few words below the name."""
    room: str = ""
    """Heading of this and the following rows of the same room."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Where everything goes, in pixels from the upper left corner."""

    width: int
    height: int
    unit: float
    """Pixels of the sheet for one of the usual type."""
    cell_height: int
    columns: dict[Column, tuple[int, int]]
    """Left end and width."""
    tops: list[int]
    """Upper end of each row."""


def rooms_of(rows: Sequence[SheetRow]) -> Iterator[tuple[int, list[SheetRow]]]:
    """Yield the index of the first row of each room, and its rows."""
    first = 0
    for _, group in groupby(rows, key=lambda row: row.room):
        members = list(group)
        yield first, members
        first += len(members)


def make_grid(rows: Sequence[SheetRow], title: str, width: int) -> Grid:
    unit = width / _TYPE_WIDTH
    has: dict[Column, bool] = {
        "input": any(row.image is not None for row in rows),
        "room": any(row.scene is not None for row in rows),
        "overlay": any(row.scene is not None for row in rows),
        "rendering": any(row.rendering is not None for row in rows),
        "view": any(row.view is not None for row in rows),
    }
    shown: list[Column] = [column for column, there in has.items() if there]
    margin, gap = MARGIN * unit, GAP * unit
    left = margin + NAMES * unit
    free = width - left - margin - gap * (len(shown) - 1)
    # no cell is higher than a third of the sheet is wide
    cell_height = min(free / sum(_ASPECT[column] for column in shown), width / 3)
    columns: dict[Column, tuple[int, int]] = {}
    for column in shown:
        cell = int(_ASPECT[column] * cell_height) // 2 * 2
        columns[column] = round(left), cell
        left += _ASPECT[column] * cell_height + gap
    tops: list[int] = []
    top = margin + ((TITLE_ROW if title else 0.0) + HEADING_ROW) * unit
    for first, group in rooms_of(rows):
        top += ROOM_GAP * unit if group[0].room else (gap if first else 0.0)
        for _ in group:
            tops.append(round(top))
            top += cell_height + gap
    height = round(top - gap + KEY_ROW * unit + margin)
    return Grid(width, height, unit, int(cell_height), columns, tops)
