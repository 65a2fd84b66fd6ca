"""The parts of the page of results with tables of their own kind: layout, splits, categories."""

from collections.abc import Sequence

from panoscene.eval._layout_scores import CORNER_GROUPS
from panoscene.eval._paper_rows import paper_fov_note, paper_fov_table
from panoscene.eval._report_facts import (
    WHOLE,
    are_simulated,
    categories_without_targets,
    listed,
)
from panoscene.eval._results import ScoreFile
from panoscene.eval._score_tables import (
    FIELD_OF_VIEW,
    SUMMARY,
    Column,
    column_cell,
    markdown_table,
    measured_cell,
    with_counts,
)

_FLAT = ("laptop", "picture")
"""Categories whose boxes are a few centimetres thin."""
_READINGS = ("regularised", "raw")


def layout_part(scores: Sequence[ScoreFile]) -> list[str]:
    """Return the tables of layouts: all methods, and the first one by number of corners."""
    same = " Repairing moves no walls, so methods share rows." if are_simulated(scores) else ""
    parts = [
        "## Layout",
        "IoU in percent, 3D by the number of corners of the true room; corner error in percent of "
        "the image's diagonal, pixel error in percent of the pixels. `raw` is the polygon before "
        "it is made rectangular. A room that is missing or not valid is `degenerate` and counts "
        f"at its worst.{same} `-`: no such room.",
        _layout_table(scores),
    ]
    with_raw = [score for score in scores if "layout.raw.overall.scenes" in score.metrics]
    without = [f"`{score.method}`" for score in scores if score not in with_raw]
    if with_raw and without:
        guessed = " (they are guessed or true, not recovered from a boundary)"
        parts.append(
            f"{listed(without)} have no `raw` row: the rooms in their files come without a polygon "
            f"from before{guessed if are_simulated(scores) else ''}."
        )
    first = (with_raw or list(scores))[0]
    table = _corners_table(first)
    if table:
        parts += [f"The layout of `{first.method}` by the number of corners of the room:", table]
    return parts


def by_part(scores: Sequence[ScoreFile]) -> list[str]:
    """Return the summary of each part of the data set; nothing where there is one part only."""
    names = sorted({name for score in scores for name in score.parts})
    if not names:
        return []
    rows = [
        [f"`{score.method}`", f"`{name}`", *(column_cell(part, column) for column in SUMMARY)]
        for score in scores
        for name in names
        if name in score.parts
        for part in [score.model_copy(update={"metrics": score.parts[name]})]
    ]
    head = ["method", "part", *(column.heading for column in SUMMARY)]
    return [
        "## Parts of the set",
        f"The summary for {listed([f'`{name}`' for name in names])} alone.",
        markdown_table(head, rows, left=2),
    ]


def _layout_table(scores: Sequence[ScoreFile]) -> str:
    head = ["methods", "reading", *(f"3D IoU, {group}" for group in CORNER_GROUPS)]
    head += ["2D IoU", "corner error, %", "pixel error, %", "degenerate"]
    rows: dict[tuple[str, ...], list[str]] = {}
    for score in scores:
        for reading in _READINGS:
            start = f"layout.{reading}"
            if f"{start}.overall.scenes" not in score.metrics:
                continue
            groups = [f"{start}.{group}.iou_3d" for group in CORNER_GROUPS]
            columns = [Column("", name, 100.0, interval=False) for name in groups[:-1]]
            columns += [Column("", groups[-1], 100.0), *_layout_columns(f"{start}.overall")]
            columns += [Column("", f"{start}.overall.degenerate", digits=0)]
            cells = (reading, *(column_cell(score, column) for column in columns))
            rows.setdefault(cells, []).append(f"`{score.method}`")
    return markdown_table(head, [[", ".join(who), *row] for row, who in rows.items()], left=2)


def _corners_table(score: ScoreFile) -> str:
    rows: list[list[str]] = []
    for reading in _READINGS:
        for group in CORNER_GROUPS[:-1]:
            start = f"layout.{reading}.{group}"
            if f"{start}.scenes" in score.metrics:
                columns = [
                    Column("", f"{start}.scenes", interval=False, digits=0),
                    Column("", f"{start}.iou_3d", 100.0),
                    *_layout_columns(start),
                ]
                rows.append([reading, group, *(column_cell(score, one) for one in columns)])
    head = ["reading", "corners", "rooms", "3D IoU", "2D IoU", "corner error, %", "pixel error, %"]
    return markdown_table(head, rows, left=2) if rows else ""


def _layout_columns(start: str) -> list[Column]:
    errors = [Column("", f"{start}.{name}") for name in ("corner_error", "pixel_error")]
    return [Column("", f"{start}.iou_2d", 100.0), *errors]


def fov_part(scores: Sequence[ScoreFile]) -> list[str]:
    """Return the table of splits of the panorama; nothing if no method saw splits."""
    splits = [score for score in scores if score.fov_deg != WHOLE]
    if not splits:
        return []
    whole = [score for score in scores if score.fov_deg == WHOLE]
    # `net-quarters` is a split of `net`; without such names, rows of the same kind belong together
    same = [one for one in whole if any(s.method.startswith(f"{one.method}-") for s in splits)]
    same = same or [one for one in whole if one.kind in {score.kind for score in splits}]
    # for comparison: the input, baselines and oracles, which see all
    beside = [one for one in whole if one.kind in _REFERENCES and one not in same]
    columns = with_counts(FIELD_OF_VIEW, scores)
    rows = [
        [f"`{score.method}`", f"{score.fov_deg}°", *(column_cell(score, c) for c in columns)]
        for score in (*same, *sorted(splits, key=lambda score: -score.fov_deg), *beside)
    ]
    return [
        "## Field of view",
        "Horizontal splits of the panorama, each on its own with the full layout. What is lost is "
        "what relations across the borders of splits are good for.",
        markdown_table(["method", "split", *(column.heading for column in columns)], rows),
        "The paper's AP 15 over '57' categories, in its own definition of AP and on its own data:",
        paper_fov_table(),
        paper_fov_note(),
    ]


_REFERENCES = ("input", "baseline", "oracle")


def category_part(scores: Sequence[ScoreFile]) -> list[str]:
    """Return AP by category of ``default`` and what it starts from, or of the first two rows."""
    first = {"default": 0, "estimates": 1}
    tables = sorted(scores, key=lambda score: first.get(score.method, 2))[:2]
    names = sorted({name for score in tables for name in score.categories})
    if not names:
        return []

    def cell(score: ScoreFile, name: str, key: str) -> str:
        return measured_cell(score.categories.get(name, {}).get(key), 100.0)

    def count(name: str) -> str:
        rows = [score.categories[name] for score in tables if name in score.categories]
        return measured_cell(rows[0]["targets"], digits=0)

    keys = ("ap_15", "ap_25", "ap_50")
    head = ["category", "targets"]
    for place, score in enumerate(tables):
        head += [f"`{score.method}` AP 15", "AP 25", "AP 50", *["released AP 15"][place:]]
    rows = [[f"`{name}`", count(name)] for name in names]
    for place, score in enumerate(tables):
        shown = (*keys, *["released_ap_15"][place:])
        for row, name in zip(rows, names, strict=True):
            row += [cell(score, name, key) for key in shown]
    starts = are_simulated(scores) and [score.method for score in tables] == list(first)
    which = " and of ".join(f"`{score.method}`" for score in tables)
    empty = (
        " `-`: no targets, and then the released definition counts 0 for false detections."
        if any(name in names for name in categories_without_targets(scores[0]))
        else ""
    )
    parts = [
        "## Categories",
        f"AP in percent of {which}{', that it starts from' if starts else ''}.{empty}",
        markdown_table(head, rows),
    ]
    flat = [f"`{name}` {cell(tables[0], name, 'ap_15')}" for name in _FLAT if name in names]
    if flat and are_simulated(scores):
        parts.append(
            f"Thin objects fare worst ({', '.join(flat)}): where a box is a few centimetres thin "
            "or less, an error of that size leaves no overlap, though the object is all but in "
            "its place."
        )
    return parts
