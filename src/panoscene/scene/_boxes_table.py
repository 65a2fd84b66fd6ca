"""Boxes from anywhere: a CSV table, or tensors, to objects and to a scene with relations."""

import csv
import difflib
import io
import math
import os
from collections.abc import Sequence
from pathlib import Path

import torch
from jaxtyping import Float, Int64
from torch import Tensor

from panoscene.geometry import OrientedBoxes, bfov_from_boxes

from ._atomic import write_atomically
from ._categories import CATEGORIES, category_index, category_suggestion
from ._errors import Problem, SceneFormatError, shown
from ._numbers import numbers_from_tensor, tensor_from_numbers
from ._records import Layout, Objects, Panorama, Scene
from ._relations import relations_from_boxes
from ._triples import object_names

_NUMBERS = ("x", "y", "z", "width", "depth", "height")
_YAWS = ("yaw", "yaw_deg")
_SCORES = ("score", "distance_score", "yaw_score")
_COLUMNS = ("category", *_NUMBERS, *_YAWS, "id", *_SCORES)
_RANGES = {
    **dict.fromkeys(("x", "y", "z"), (-1e6, 1e6, "metres")),
    **dict.fromkeys(("width", "depth", "height"), (1e-6, 1e6, "metres above 0")),
    "yaw": (-6.2832, 6.2832, "radians in [-2 pi, 2 pi]; for degrees call the column yaw_deg"),
    "yaw_deg": (-360.0, 360.0, "degrees in [-360, 360]"),
    **dict.fromkeys(_SCORES, (0.0, 1.0, "a score in [0, 1]")),
}


def read_box_table(
    path: str | os.PathLike[str],
    *,
    camera_height: float = 1.6,
    dtype: torch.dtype = torch.float32,
) -> Objects:
    """Return the objects in a CSV table with one box a line.

    Columns, in any order: ``category``; ``x``, ``y``, ``z`` of the box centre; ``width``,
    ``depth``, ``height``; ``yaw`` (radians) or ``yaw_deg`` (degrees); and if wanted ``id``,
    ``score``, ``distance_score``, ``yaw_score`` (1 when missing). The BFoV is the projection of
    the box.

    Convention:
        - metres, world frame: origin on the floor under the camera, +y the panorama's centre
          column, +x to its right; yaw counter-clockwise from above, 0 faces +y

    Raises:
        SceneFormatError: The file cannot be read or holds something else; the message names line
            and column of each problem.
    """
    file = os.fspath(path)
    try:
        text = Path(path).read_bytes().decode("utf-8-sig")
    except OSError as error:
        found = error.strerror or "an error"
        raise SceneFormatError(file, [Problem("the path", found, "a readable CSV file")]) from None
    except UnicodeDecodeError as error:
        found = f"byte {error.start} that is not UTF-8"
        raise SceneFormatError(file, [Problem("the file", found, "text in UTF-8")]) from None
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        rows = [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
    except csv.Error as error:
        place = f"line {reader.line_num}"
        raise SceneFormatError(file, [Problem(place, str(error), "a CSV table")]) from None
    columns = _header(rows, file)
    return _objects_from_rows(rows[1:], columns, file, camera_height, dtype)


def write_box_table(objects: Objects, path: str | os.PathLike[str]) -> None:
    """Write objects to a CSV table that ``read_box_table`` gives back: boxes and scores exactly.

    BFoVs and shapes have no columns. The file appears complete or not at all.
    """
    names = ("id", "category", *_NUMBERS, "yaw", *_SCORES)
    boxes = objects.boxes
    numbers = torch.cat((boxes.centre, boxes.size, boxes.yaw[:, None]), dim=1)
    columns = zip(
        object_names(objects),
        numbers_from_tensor(objects.category),
        numbers_from_tensor(numbers),
        numbers_from_tensor(objects.score),
        numbers_from_tensor(objects.distance_score),
        numbers_from_tensor(objects.yaw_score),
        strict=True,
    )
    stream = io.StringIO(newline="")
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(names)
    for name, category, box, *scores in columns:
        writer.writerow([name, CATEGORIES[category], *box, *scores])
    write_atomically(Path(path), stream.getvalue())


def objects_from_boxes(
    boxes: OrientedBoxes,
    category: Sequence[str] | Int64[Tensor, " n"],
    *,
    camera_height: float = 1.6,
    score: Float[Tensor, " n"] | None = None,
    id: tuple[str, ...] = (),
) -> Objects:
    """Return boxes in the world frame as objects, with BFoVs projected from the boxes.

    Scores are 1 unless given.

    Raises:
        ValueError: A category is unknown, or there is not one for each box.

    Examples:
        >>> bed = OrientedBoxes(
        ...     torch.tensor([[0.0, 2.0, 0.3]]), torch.tensor([[1.6, 2.0, 0.6]]), torch.zeros(1)
        ... )
        >>> objects_from_boxes(bed, ["bed"]).category
        tensor([2])
    """
    if not isinstance(category, Tensor):
        category = torch.tensor([category_index(name) for name in category], dtype=torch.int64)
    n = len(boxes)
    for name, count in (("category", len(category)), ("id", len(id) or n)):
        if count != n:
            raise ValueError(f"{name}: expected {n}, one for each box, found {count}")
    ones = torch.ones_like(boxes.yaw)
    return Objects(
        boxes=boxes,
        category=category,
        score=ones if score is None else score,
        bfov=bfov_from_boxes(boxes, camera_height),
        distance_score=ones,
        yaw_score=ones,
        id=id,
    )


def scene_from_boxes(
    objects: Objects,
    layout: Layout,
    *,
    camera_height: float = 1.6,
    name: str = "",
    panorama: Panorama | None = None,
) -> Scene:
    """Return a scene with the relations that follow from boxes and layout.

    Without a panorama it gets one of 1024 x 512 pixels with the camera at ``camera_height``; the
    camera height of a given panorama must be the same.

    Raises:
        ValueError: The boxes or the camera height are not valid.
    """
    if panorama is None:
        panorama = Panorama(width=1024, height=512, camera_height=camera_height)
    if panorama.camera_height != camera_height:
        raise ValueError(
            f"camera_height: expected {panorama.camera_height} as in panorama, "
            f"found {camera_height}"
        )
    # boxes from elsewhere may be off, so one corner inside is enough to belong in the room
    relations = relations_from_boxes(objects.boxes, layout, camera_height, inside="any_corner")
    return Scene(panorama, layout, objects, relations, name)


def _header(rows: list[tuple[int, list[str]]], file: str) -> list[str]:
    if not rows:
        expected = f"a header line such as {','.join(('category', *_NUMBERS, 'yaw'))}"
        raise SceneFormatError(file, [Problem("the file", "nothing in it", expected)])
    line, header = rows[0]
    columns = [name.strip().lower() for name in header]
    place = f"line {line}"
    if len(columns) == 1 and any(mark in columns[0] for mark in ";\t"):
        found = "columns separated by semicolons or tabs"
        raise SceneFormatError(file, [Problem(place, found, "commas")])
    problems: list[Problem] = []
    for name in columns:
        if name not in _COLUMNS:
            close = difflib.get_close_matches(name, _COLUMNS, n=1)
            hint = f"; did you mean {close[0]!r}?" if close else ""
            problems.append(Problem(place, f"the column {name!r}", f"known columns only{hint}"))
    problems += [
        Problem(place, f"no column {name!r}", "that column")
        for name in ("category", *_NUMBERS)
        if name not in columns
    ]
    yaws = [name for name in columns if name in _YAWS]
    if len(yaws) != 1:
        found = f"{len(yaws)} yaw columns"
        problems.append(Problem(place, found, "one of 'yaw' (radians) and 'yaw_deg' (degrees)"))
    problems += [
        Problem(place, f"the column {name!r} twice", "it once")
        for name in dict.fromkeys(columns)
        if columns.count(name) > 1 and name not in _YAWS
    ]
    if problems:
        raise SceneFormatError(file, problems)
    return columns


def _objects_from_rows(
    rows: list[tuple[int, list[str]]],
    columns: list[str],
    file: str,
    camera_height: float,
    dtype: torch.dtype,
) -> Objects:
    problems: list[Problem] = []
    numbers: dict[str, list[float]] = {name: [] for name in columns if name in _RANGES}
    categories: list[str] = []
    ids: list[str] = []
    for line, row in rows:
        if len(row) != len(columns):
            expected = f"{len(columns)}, as many as the header has columns"
            problems.append(Problem(f"line {line}", f"{len(row)} values", expected))
            continue
        for name, cell in zip(columns, map(str.strip, row), strict=True):
            place = f"line {line}, column {name}"
            if name == "category":
                categories.append(cell)
                if cell not in CATEGORIES:
                    expected = f"a category; {category_suggestion(cell)}"
                    problems.append(Problem(place, shown(cell), expected))
            elif name == "id":
                if not cell or cell in ids:
                    problems.append(Problem(place, shown(cell), "a name that no other line has"))
                ids.append(cell)
            else:
                numbers[name].append(_number(cell, name, place, problems))
    if problems:
        raise SceneFormatError(file, problems)

    def column(*names: str) -> Float[Tensor, "n width"]:
        values = [numbers[name] for name in names]
        return tensor_from_numbers(values, (len(names), len(rows)), dtype).T.contiguous()

    if "yaw_deg" in numbers:
        numbers["yaw"] = [math.radians(value) for value in numbers["yaw_deg"]]
    boxes = OrientedBoxes(
        column("x", "y", "z"), column("width", "depth", "height"), column("yaw")[:, 0]
    )
    scores = [
        column(name)[:, 0] if name in numbers else torch.ones_like(boxes.yaw) for name in _SCORES
    ]
    return Objects(
        boxes=boxes,
        category=torch.tensor([category_index(name) for name in categories], dtype=torch.int64),
        score=scores[0],
        bfov=bfov_from_boxes(boxes, camera_height),
        distance_score=scores[1],
        yaw_score=scores[2],
        id=tuple(ids),
    )


def _number(cell: str, name: str, place: str, problems: list[Problem]) -> float:
    low, high, expected = _RANGES[name]
    try:
        value = float(cell)
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        decimal = "; write decimals with a point" if "," in cell else ""
        problems.append(Problem(place, shown(cell), expected + decimal))
    return value
