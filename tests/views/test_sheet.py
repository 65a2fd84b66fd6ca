"""Sheets have a row for each scene, only columns with content, and one photo for a room."""

import itertools
from pathlib import Path

import numpy as np
import pytest
import shapely
import torch
from PIL import Image

from panoscene.style import BODY
from panoscene.synth import perturb_scene, sample_room
from panoscene.views._sheet import SMALLEST, draw_sheet
from panoscene.views._sheet_grid import SheetRow, make_grid

TRUTH = sample_room(np.random.default_rng(0), objects=5, corners=6)
WRONG = perturb_scene(TRUTH, np.random.default_rng(0))
RED = torch.tensor([1.0, 0.0, 0.0])[:, None, None].expand(3, 64, 128)
GREEN = torch.tensor([0.0, 1.0, 0.0])[:, None, None].expand(3, 64, 128)


def pixels(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB")).astype(int)


def where(picture: np.ndarray, colour: tuple[int, int, int]) -> tuple[int, int, int, int]:
    """Return left, top, right, bottom of the pixels of a colour."""
    rows, columns = np.nonzero((picture == colour).all(-1))
    return columns.min(), rows.min(), columns.max() + 1, rows.max() + 1


def test_methods_stand_below_each_other(tmp_path: Path) -> None:
    file = tmp_path / "sheet.png"
    rows = [
        SheetRow("Disturbed", WRONG, image=RED, rendering=GREEN, caption="3 pairs collide"),
        SheetRow("Truth", TRUTH),
    ]
    draw_sheet(rows, file, title="Sheet", reference=TRUTH, width_px=1000)
    picture = pixels(file)
    grid = make_grid(rows, "Sheet", 1000)
    assert picture.shape == (grid.height, 1000, 3)
    assert list(grid.cells) == ["input", "room", "overlay", "rendering"]
    left, top, right, _ = where(picture, (0, 255, 0))
    cell = grid.cells["rendering"]
    assert abs(left - cell.left) <= 1
    assert abs(right - left - cell.width) <= 2
    assert abs(top - grid.tops[0] - cell.down) <= 1
    # the photo stands in both rows, and behind both overlays
    for column in ("input", "overlay"):
        cell = grid.cells[column]
        for start in grid.tops:
            shown = picture[start + cell.down + 3, cell.left + 3 : cell.left + cell.width - 3]
            assert (shown == (255, 0, 0)).all(-1).mean() > 0.9
    assert [path.name for path in tmp_path.iterdir()] == ["sheet.png"]


def test_columns_without_content_are_left_out() -> None:
    grid = make_grid([SheetRow("Truth", TRUTH)], "", 1200)
    assert list(grid.cells) == ["room", "overlay"]
    view = torch.zeros(3, 30, 40)
    grid = make_grid([SheetRow("Input", image=RED), SheetRow("Ours", view=view)], "", 1200)
    assert list(grid.cells) == ["input", "view"]


def test_cells_are_large_and_apart() -> None:
    rows = [
        SheetRow(f"Row {k}", TRUTH, image=RED, rendering=GREEN, view=GREEN, room=f"Room {k // 2}")
        for k in range(6)
    ]
    grid = make_grid(rows, "Title", 2000)
    shapes = [
        shapely.box(
            cell.left, top + cell.down, cell.left + cell.width, top + cell.down + cell.height
        )
        for top in grid.tops
        for cell in grid.cells.values()
    ]
    assert all(a.disjoint(b) for a, b in itertools.combinations(shapes, 2))
    assert shapely.box(0, 0, 2000, grid.height).contains(shapely.union_all(shapes))
    # shown 900 pixels wide, each is still a picture to look at
    assert min(cell.height for cell in grid.cells.values()) * 900 / 2000 >= 170
    gaps = np.diff(grid.tops)
    assert (gaps[1::2] > gaps[0]).all(), "a new room needs its heading"


def test_type_is_legible_where_sheets_are_shown() -> None:
    pixels_at_900 = SMALLEST * BODY * make_grid([SheetRow("Truth", TRUTH)], "", 2000).unit * 0.45
    assert 0.75 * pixels_at_900 >= 9.0, "points, at 96 pixels per inch"


def test_a_row_of_its_own_keeps_its_photo(tmp_path: Path) -> None:
    rows = [SheetRow("Input", image=RED), SheetRow("Truth", TRUTH), SheetRow("Again", TRUTH)]
    draw_sheet(rows, tmp_path / "sheet.png", width_px=900)
    grid = make_grid(rows, "", 900)
    picture = pixels(tmp_path / "sheet.png")[: grid.tops[1]]
    cell = grid.cells["input"]
    _, top, _, bottom = where(picture, (255, 0, 0))
    assert abs(top - grid.tops[0] - cell.down) <= 1
    assert abs(bottom - top - cell.height) <= 2
    # its place stays empty in no other row
    assert grid.cells["room"].left == cell.left


@pytest.mark.parametrize(
    ("rows", "width", "match"),
    [
        ([], 2000, "rows"),
        ([SheetRow("Nothing")], 2000, "nothing to show"),
        ([SheetRow("Truth", TRUTH)], 100, "width_px"),
        ([SheetRow("Truth", TRUTH)] * 60, 2000, "too many"),
    ],
)
def test_bad_sheets_leave_nothing_behind(
    tmp_path: Path, rows: list[SheetRow], width: int, match: str
) -> None:
    with pytest.raises(ValueError, match=match):
        draw_sheet(rows, tmp_path / "sheet.png", width_px=width)
    assert not list(tmp_path.iterdir())
