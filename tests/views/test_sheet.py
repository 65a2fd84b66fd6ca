"""Sheets have a row for each scene, only columns with content, and one photo for a room."""

from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from panoscene.synth import perturb_scene, sample_room
from panoscene.views._sheet import draw_sheet
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
    assert list(grid.columns) == ["input", "room", "overlay", "rendering"]
    left, top, right, _ = where(picture, (0, 255, 0))
    column, width = grid.columns["rendering"]
    assert abs(left - column) <= 1
    assert abs(right - left - width) <= 2
    assert abs(top - grid.tops[0]) <= 1
    # the photo stands beside both rows, and behind both overlays
    shown = np.nonzero((picture[:, : sum(grid.columns["input"])] == (255, 0, 0)).all(-1))[0]
    assert grid.tops[0] < shown.min() < grid.tops[1] < shown.max()
    start, width = grid.columns["overlay"]
    overlays = (picture[:, start : start + width] == (255, 0, 0)).all(-1).any(1)
    assert overlays[grid.tops[0] + 5]
    assert overlays[grid.tops[1] + 5]
    assert [path.name for path in tmp_path.iterdir()] == ["sheet.png"]


def test_columns_without_content_are_left_out() -> None:
    grid = make_grid([SheetRow("Truth", TRUTH)], "", 1200)
    assert list(grid.columns) == ["room", "overlay"]
    view = torch.zeros(3, 30, 40)
    grid = make_grid([SheetRow("Input", image=RED), SheetRow("Ours", view=view)], "", 1200)
    assert list(grid.columns) == ["input", "view"]


def test_cells_lie_beside_and_below_each_other() -> None:
    rows = [
        SheetRow(f"Row {k}", TRUTH, image=RED, rendering=GREEN, view=GREEN, room=f"Room {k // 2}")
        for k in range(6)
    ]
    grid = make_grid(rows, "Title", 2000)
    ends = [left + width for left, width in grid.columns.values()]
    starts = [left for left, _ in grid.columns.values()]
    assert all(end < start for end, start in zip(ends[:-1], starts[1:], strict=True))
    assert ends[-1] <= 2000
    gaps = np.diff(grid.tops)
    assert (gaps > grid.cell_height).all()
    assert (gaps[1::2] > gaps[0]).all(), "a new room needs its heading"
    assert grid.tops[-1] + grid.cell_height < grid.height


def test_a_row_of_its_own_keeps_its_photo(tmp_path: Path) -> None:
    rows = [SheetRow("Input", image=RED), SheetRow("Truth", TRUTH), SheetRow("Again", TRUTH)]
    draw_sheet(rows, tmp_path / "sheet.png", width_px=900)
    grid = make_grid(rows, "", 900)
    picture = pixels(tmp_path / "sheet.png")[:, : sum(grid.columns["input"])]
    _, top, _, bottom = where(picture, (255, 0, 0))
    assert abs(top - grid.tops[0]) <= 1
    assert bottom <= grid.tops[1]


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
