"""Comparison sheets: what went in and what came out, method by method, as in the paper."""

import os
from collections.abc import Sequence

import numpy as np
import shapely
from jaxtyping import UInt8
from torch import Tensor

from panoscene.scene import CATEGORIES, Scene
from panoscene.style import (
    BODY,
    FAINT_INK,
    GROUP_COLOURS,
    INK,
    LEADER,
    MARGIN,
    OPAQUE,
    REFERENCE,
    THIN,
    TITLE,
    group_of,
)
from panoscene.views._cells import framed, room_cell
from panoscene.views._drawing import draw_alarm
from panoscene.views._overlay import overlay_page
from panoscene.views._page import Page
from panoscene.views._panels import LARGEST
from panoscene.views._pieces import TOLERANCE
from panoscene.views._sheet_grid import (
    HEADING_ROW,
    HEADINGS,
    LEAST_WIDTH,
    LONGEST,
    NAME_ROW,
    ROOM_GAP,
    USUAL_WIDTH,
    Column,
    Grid,
    SheetRow,
    make_grid,
    rooms_of,
    row_contents,
)

SMALLEST = 0.9
"""Type of headings and captions, as a share of the body's: 9 points at 900 pixels of width."""


def draw_sheet(
    rows: Sequence[SheetRow],
    path: str | os.PathLike[str],
    *,
    title: str = "",
    reference: Scene | None = None,
    labels: bool = False,
    width_px: int = USUAL_WIDTH,
    tolerance: float = TOLERANCE,
) -> None:
    """Write a PNG that compares scenes: a row for each, with input, above, overlay, render, view.

    Pictures that no row has are left out; what does not fit into one line at a legible size takes
    two, in every row alike. Rows of a room without a photo get that of the first that has one.
    Rooms of equal heading are drawn at one scale from above.

    Args:
        rows: from the top down; rows of one room next to each other.
        path: file to write; it appears complete or not at all.
        title: heading of the sheet.
        reference: a scene whose boxes are outlined from above, such as the truth.
        labels: whether to write names on the overlays.
        width_px: width of the sheet; its height follows.
        tolerance: metres of overlap from which boxes collide.

    Source: paper, Sec. 4, the qualitative comparisons.

    Raises:
        ValueError: no rows, a row without any picture, boxes or corners that are not finite, or
            a sheet below 800 or above 10000 pixels.
    """
    _check(rows, width_px)
    grid = make_grid(rows, title, width_px)
    if grid.height > LONGEST:
        raise ValueError(f"rows: found {len(rows)}, too many for a sheet {width_px} pixels wide")
    page = Page(grid.width, grid.height)
    _write_title(page, grid, title)
    for first, group in rooms_of(rows):
        _draw_room_heading(page, grid, group[0].room, grid.tops[first])
        tops = grid.tops[first:]
        _draw_group(page, grid, group, tops, reference, labels=labels, tolerance=tolerance)
    _draw_key(page, grid, rows, with_reference=reference is not None)
    page.save(path)


def _check(rows: Sequence[SheetRow], width_px: int) -> None:
    if not rows:
        raise ValueError("rows: found none, expected at least one")
    for row in rows:
        if all(part is None for part in (row.scene, row.image, row.rendering, row.view)):
            raise ValueError(f"rows: {row.name!r} has nothing to show")
    if not LEAST_WIDTH <= width_px <= LARGEST:
        raise ValueError(
            f"width_px: found {width_px}, expected a number from {LEAST_WIDTH} to {LARGEST}"
        )


def _write_title(page: Page, grid: Grid, title: str) -> None:
    if not title:
        return
    unit, margin = grid.unit, MARGIN * grid.unit
    size = TITLE * unit
    text = page.fitted(title, size, grid.width - 2 * margin, bold=True)
    page.text(margin, grid.height - margin - 0.5 * size, text, size=size, bold=True)


def _draw_room_heading(page: Page, grid: Grid, room: str, top: int) -> None:
    if not room:
        return
    unit, margin = grid.unit, MARGIN * grid.unit
    y = grid.height - top + 0.5 * ROOM_GAP * unit
    size = 1.1 * BODY * unit
    page.text(margin, y, room, size=size, bold=True)
    start = margin + page.text_size(room, size, bold=True)[0] + 12 * unit
    page.line([(start, y), (grid.width - margin, y)], colour=LEADER, width=0.6 * unit)


def _draw_group(
    page: Page,
    grid: Grid,
    group: Sequence[SheetRow],
    tops: Sequence[int],
    reference: Scene | None,
    *,
    labels: bool,
    tolerance: float,
) -> None:
    """Draw the rows of one room."""
    photo = next((row.image for row in group if row.image is not None), None)
    scenes = [row.scene for row in group if row.scene is not None]
    for row, top in zip(group, tops, strict=False):
        _write_name(page, grid, row, top)
        image = row.image if row.image is not None else photo
        pictures: dict[Column, Tensor | None] = {
            "input": image, "rendering": row.rendering, "view": row.view,
        }  # fmt: skip
        for column in row_contents(row, group):
            picture = pictures.get(column)
            if picture is not None:
                cell = grid.cells[column]
                _lay(page, grid, column, framed(picture, cell.width, cell.height), top)
        if row.scene is not None:
            cell = grid.cells["room"]
            above = room_cell(
                row.scene, scenes, cell.width, cell.height,
                reference=reference, tolerance=tolerance,
            )  # fmt: skip
            _lay(page, grid, "room", above, top)
            wide = grid.cells["overlay"].width
            overlay = overlay_page(row.scene, wide, image=image, labels=labels, tolerance=tolerance)
            _lay(page, grid, "overlay", overlay.pixels(), top)


def _lay(
    page: Page,
    grid: Grid,
    column: Column,
    pixels: UInt8[np.ndarray, "height width 3"],
    top: int,
) -> None:
    """Lay a picture into the middle of its cell, below the cell's heading."""
    cell = grid.cells[column]
    height, width = pixels.shape[:2]
    x = cell.left + (cell.width - width) // 2
    page.image(pixels, x, grid.height - top - cell.down - (cell.height + height) // 2)
    size = SMALLEST * BODY * grid.unit
    y = grid.height - top - cell.down + 0.5 * HEADING_ROW * grid.unit
    page.text(float(cell.left), y, HEADINGS[column], size=size, colour=FAINT_INK)


def _write_name(page: Page, grid: Grid, row: SheetRow, top: int) -> None:
    """Write the name of a row, and beside it the caption."""
    unit, margin = grid.unit, MARGIN * grid.unit
    size, small = 1.1 * BODY * unit, SMALLEST * BODY * unit
    y, free = grid.height - top - 0.5 * NAME_ROW * unit, grid.width - 2 * margin
    name = page.fitted(row.name, size, free if not row.caption else 0.5 * free, bold=True)
    page.text(margin, y, name, size=size, bold=True)
    taken = page.text_size(name, size, bold=True)[0] + 14 * unit
    caption = page.fitted(row.caption, small, free - taken)
    page.text(margin + taken, y, caption, size=small, colour=FAINT_INK)


def _draw_key(page: Page, grid: Grid, rows: Sequence[SheetRow], *, with_reference: bool) -> None:
    """Draw one line that says what the colours mean."""
    scenes = [row.scene for row in rows if row.scene is not None]
    if not scenes:
        return
    shown = {group_of(CATEGORIES[int(k)]) for scene in scenes for k in scene.objects.category}
    marks = [group for group in GROUP_COLOURS if group in shown]
    marks += ["collides, or outside", *(["true place"] if with_reference else [])]
    unit = grid.unit
    size = SMALLEST * BODY * unit
    widths = [page.text_size(mark, size)[0] + 52 * unit for mark in marks]
    shrink = min(1.0, (grid.width - 2 * MARGIN * unit) / sum(widths))
    x, y = MARGIN * unit, MARGIN * unit
    for mark, width in zip(marks, widths, strict=True):
        swatch = shapely.box(
            x, y - 8 * unit * shrink, x + 22 * unit * shrink, y + 8 * unit * shrink
        )
        if mark in GROUP_COLOURS:
            page.area(swatch, fill=GROUP_COLOURS[mark], edge=INK, width=THIN, alpha=OPAQUE)
        elif mark == "true place":
            page.area(swatch, edge=REFERENCE, width=1.2, dashes=(4.0, 2.5))
        else:
            draw_alarm(page, swatch)
        page.text(x + 30 * unit * shrink, y, mark, size=size * shrink, colour=FAINT_INK)
        x += width * shrink
