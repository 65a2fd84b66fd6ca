"""The part of the page of results that compares two methods scene by scene."""

from collections.abc import Sequence

from panoscene.eval._report_facts import listed
from panoscene.eval._results import Measured, ScoreFile
from panoscene.eval._score_tables import (
    DETECTION,
    END_TO_END,
    PAPER_COUNTS,
    PLAUSIBILITY,
    RECALL,
    Column,
    markdown_table,
    measured_cell,
)

_FEWEST_SCENES, _FEWEST_REPLICATES = 10, 100
"""With fewer nothing is decided."""
_COLUMNS: tuple[Column, ...] = (
    *DETECTION,
    RECALL[0],
    PAPER_COUNTS[0],
    PLAUSIBILITY[1],
    *(column for column in END_TO_END if column.heading.endswith("F1")),
)


def differences_part(scores: Sequence[ScoreFile]) -> list[str]:
    """Return the table of differences between methods; nothing where none was measured."""
    columns = [
        column
        for column in _COLUMNS
        if any(column.metric in other for score in scores for other in score.differences.values())
    ]
    rows = [
        [
            f"`{score.method}`",
            f"`{name}`",
            *(_cell(score, metrics.get(c.metric), c) for c in columns),
        ]
        for score in scores
        for name, metrics in score.differences.items()
    ]
    if not rows:
        return []
    head = ["method", "compared with", *(column.heading for column in columns)]
    return [
        "## What the parts bring",
        "By how much a method is above another, both measured on the same resamples of the scenes. "
        "Most of what makes a scene hard is hard for both and cancels out, so these intervals "
        f"decide where those of the other tables overlap. Bold: 0 is outside, for at least "
        f"{_FEWEST_SCENES} scenes and {_FEWEST_REPLICATES} resamples.",
        markdown_table(head, rows, left=2),
        *_verdicts(scores),
    ]


def _verdicts(scores: Sequence[ScoreFile]) -> list[str]:
    """Return in which columns each difference is decided."""
    sentences = []
    for score in scores:
        for name, metrics in score.differences.items():
            above, below = [], []
            for column in _COLUMNS:
                measured = metrics.get(column.metric)
                if measured is not None and _is_decided(score, measured):
                    (above if (measured.value or 0) > 0 else below).append(_short(column.heading))
            sides = [
                f"{side} it in {listed(columns)}"
                for side, columns in (("above", above), ("below", below))
                if columns
            ]
            where = "; ".join(sides) or "neither above nor below it"
            sentences.append(f"`{score.method}` against `{name}`: {where}.")
    return [" ".join(sentences)]


def _short(heading: str) -> str:
    """Return a heading without its unit."""
    name, _, rest = heading.partition(", ")
    return f"{name} ({rest})" if rest.endswith("cat.") else name


def _cell(score: ScoreFile, measured: Measured | None, column: Column) -> str:
    if measured is None or measured.value is None:
        return "-"
    text = measured_cell(measured, column.factor, digits=column.digits)
    signed = text if text.startswith("-") else f"+{text}"
    return f"**{signed}**" if _is_decided(score, measured) else signed


def _is_decided(score: ScoreFile, measured: Measured | None) -> bool:
    if score.scenes < _FEWEST_SCENES or score.replicates < _FEWEST_REPLICATES:
        return False
    if measured is None or measured.low is None or measured.high is None:
        return False
    return measured.low > 0 or measured.high < 0
