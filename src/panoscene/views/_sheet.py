"""Comparison sheets: what went in and what came out, method by method, as in the paper."""

import os
from collections.abc import Sequence

import numpy as np
import shapely
from jaxtyping import Float, UInt8
from torch import Tensor

from panoscene.scene import CATEGORIES, Scene
from panoscene.style import (
    BODY,
    FAINT_INK,
    GROUP_COLOURS,
    INK,
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
from panoscene.views._sheet_grid import (
    GAP,
    HEADING_ROW,
    HEADINGS,
    LEAST_WIDTH,
    NAMES,
    ROOM_GAP,
    TITLE_ROW,
    USUAL_WIDTH,
    Column,
    Grid,
    SheetRow,
    make_grid,
    rooms_of,
)


def draw_sheet(
    rows: Sequence[SheetRow],
    path: str | os.PathLike[str],
    *,
    title: str = "",
    reference: Scene | None = None,
    labels: bool = False,
    width_px: int = USUAL_WIDTH,
) -> None:
    """Write a PNG that compares scenes: a row for each, in columns input, above, overlay, render.

    Columns without any content are left out. A photo that one of the methods of a room has, and
    no other row, stands beside all of them. Rooms of equal heading are drawn at one scale from
    above, and over the same photo.

    Args:
        rows: from the top down; rows of one room next to each other.
        path: file to write; it appears complete or not at all.
        title: heading of the sheet.
        reference: a scene whose boxes are outlined from above, such as the truth.
        labels: whether to write names on the overlays.
        width_px: width of the sheet; its height follows.

    Source: paper, Sec. 4, the qualitative comparisons.

    Raises:
        ValueError: no rows, a row without any picture, boxes or corners that are not finite, or
            a sheet below 800 or above 10000 pixels.
    """
    _check(rows, width_px)
    grid = make_grid(rows, title, width_px)
    if grid.height > LARGEST:
        raise ValueError(f"rows: found {len(rows)}, too many for a sheet {width_px} pixels wide")
    page = Page(grid.width, grid.height)
    _draw_headings(page, grid, title)
    for first, group in rooms_of(rows):
        _draw_room_heading(page, grid, group[0].room, grid.tops[first])
        _draw_group(page, grid, group, grid.tops[first:], reference, labels=labels)
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


def _draw_headings(page: Page, grid: Grid, title: str) -> None:
    unit, margin = grid.unit, MARGIN * grid.unit
    top = grid.height - margin
    if title:
        size = TITLE * unit
        text = page.fitted(title, size, grid.width - 2 * margin, bold=True)
        page.text(margin, top - 0.5 * size, text, size=size, bold=True)
        top -= TITLE_ROW * unit
    for column, (left, width) in grid.columns.items():
        page.text(
            left + width / 2,
            top - 0.4 * HEADING_ROW * unit,
            HEADINGS[column],
            size=BODY * unit,
            colour=FAINT_INK,
            align="center",
        )


def _draw_room_heading(page: Page, grid: Grid, room: str, top: int) -> None:
    if not room:
        return
    unit, margin = grid.unit, MARGIN * grid.unit
    y = grid.height - top + 0.45 * ROOM_GAP * unit
    size = 1.1 * BODY * unit
    page.text(margin, y, room, size=size, bold=True)
    start = margin + page.text_size(room, size, bold=True)[0] + 12 * unit
    page.line([(start, y), (grid.width - margin, y)], colour=GROUP_COLOURS["doors and windows"])


def _draw_group(
    page: Page,
    grid: Grid,
    group: Sequence[SheetRow],
    tops: Sequence[int],
    reference: Scene | None,
    *,
    labels: bool,
) -> None:
    """Draw the rows of one room."""
    images = [row.image for row in group if row.image is not None]
    scenes = [row.scene for row in group if row.scene is not None]
    for row, top in zip(group, tops, strict=False):
        _write_name(page, grid, row, top)
        if row.image is not None:
            # one photo for all methods stands in their middle; a row of its own keeps it
            shared = len(images) == 1 and row.scene is not None
            middle = (tops[0] + tops[len(group) - 1]) / 2 if shared else top
            _lay(page, grid, "input", _picture(grid, "input", row.image), round(middle))
        if row.scene is not None:
            image = row.image if row.image is not None else (images[0] if images else None)
            width = grid.columns["room"][1]
            above = room_cell(row.scene, scenes, width, grid.cell_height, reference=reference)
            _lay(page, grid, "room", above, top)
            width = grid.columns["overlay"][1]
            overlay = overlay_page(row.scene, width, image=image, labels=labels).pixels()
            _lay(page, grid, "overlay", overlay, top)
        if row.rendering is not None:
            _lay(page, grid, "rendering", _picture(grid, "rendering", row.rendering), top)
        if row.view is not None:
            _lay(page, grid, "view", _picture(grid, "view", row.view), top)


def _picture(
    grid: Grid, column: Column, image: Float[Tensor, "3 height width"]
) -> UInt8[np.ndarray, "shown_height shown_width 3"]:
    return framed(image, grid.columns[column][1], grid.cell_height)


def _lay(
    page: Page,
    grid: Grid,
    column: Column,
    pixels: UInt8[np.ndarray, "height width 3"],
    top: int,
) -> None:
    """Lay a picture into the middle of a cell."""
    left, width = grid.columns[column]
    height = pixels.shape[0]
    x = left + (width - pixels.shape[1]) // 2
    page.image(pixels, x, grid.height - top - (grid.cell_height + height) // 2)


def _write_name(page: Page, grid: Grid, row: SheetRow, top: int) -> None:
    """Write the name of a row, and below it the caption in lines that fit."""
    unit = grid.unit
    x, width = MARGIN * unit, (NAMES - GAP) * unit
    size, small = BODY * unit, 0.8 * BODY * unit
    lines = _wrapped(page, row.caption, small, width)
    middle = grid.height - top - grid.cell_height / 2
    y = middle + (len(lines) * 1.3 * small) / 2
    page.text(x, y, page.fitted(row.name, size, width, bold=True), size=size, bold=True)
    y -= 0.35 * size
    for line in lines:
        y -= 1.3 * small
        page.text(x, y, line, size=small, colour=FAINT_INK)


def _wrapped(page: Page, text: str, size: float, width: float) -> list[str]:
    """Return the words of a text in lines of this width; words that are wider are cut."""
    lines: list[str] = []
    for word in text.split():
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and page.text_size(longer, size)[0] <= width:
            lines[-1] = longer
        else:
            lines.append(page.fitted(word, size, width))
    return lines


def _draw_key(page: Page, grid: Grid, rows: Sequence[SheetRow], *, with_reference: bool) -> None:
    """Draw one line that says what the colours mean."""
    scenes = [row.scene for row in rows if row.scene is not None]
    if not scenes:
        return
    shown = {group_of(CATEGORIES[int(k)]) for scene in scenes for k in scene.objects.category}
    marks = [group for group in GROUP_COLOURS if group in shown]
    marks += ["collides, or outside", *(["true place"] if with_reference else [])]
    unit = grid.unit
    size = 0.85 * BODY * unit
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
