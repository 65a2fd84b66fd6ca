"""The part of the page of results about relations."""

from collections.abc import Sequence

from panoscene.eval._paper_rows import paper_relations_row
from panoscene.eval._report_facts import are_rendered, are_simulated, listed, truth_row
from panoscene.eval._results import Measured, ScoreFile
from panoscene.eval._score_tables import (
    END_TO_END,
    FIDELITY,
    MATCHED_RELATIONS,
    Column,
    measured_cell,
    score_table,
)

_RULE, _TOLD = "pose", ("full", "without-arrangement")
"""The row whose relations follow from the boxes of the pose network, and those that know more."""


def relations_part(scores: Sequence[ScoreFile]) -> list[str]:
    """Return the tables of relations, and who is better at them than the rule of geometry."""
    parts = [
        "## Relations",
        "Are the relation scores right? In percent and end to end: relations of missed objects "
        "count as missed, those of invented objects as false. TPR is the share of true relations "
        "that is claimed. All: the answers to the five kinds in one pool.",
        score_table(scores, END_TO_END),
        _against_rule(scores, END_TO_END),
        "The same between matched objects only, as in the paper: a method that finds fewer "
        "objects answers fewer questions. TNR is the share of rightly denied relations; a random "
        "guess of a yaw is 90° off. The last row is the paper's network on its own data.",
        score_table(scores, MATCHED_RELATIONS, beside=[paper_relations_row(MATCHED_RELATIONS)]),
        _against_rule(scores, MATCHED_RELATIONS),
        "`farther_than` is measured too, but not listed: one of two objects is always the farther "
        "one, so its F1 is nothing but the share of pairs in the right order, a coin gets half of "
        "them right, and the paper prints no number to compare it with.",
        "Do the predicted *boxes* have the relations that the true boxes have? Between matched "
        "objects; yaw errors are from the nearest of 8 directions to the true difference.",
        score_table(scores, FIDELITY),
    ]
    return [*parts, _flawed_truth(scores)]


def _flawed_truth(scores: Sequence[ScoreFile]) -> str:
    """Return why the truth does not have all of its own relations; empty if it has."""
    truth = truth_row(scores)
    short: list[str] = []
    known = {} if truth is None else truth.metrics
    for column in FIDELITY:
        measured = known.get(column.metric)
        if column.heading.endswith("F1") and measured is not None and measured.value is not None:
            cell = measured_cell(Measured(value=measured.value), column.factor)
            short += [f"{column.heading} {cell}"] if measured.value < 1 else []
    if not short:
        return ""
    such = " (a sampled stool before its piano, a window below the ceiling)"
    return (
        f"Why is the truth not perfect ({', '.join(short)})? Its files say which relations hold; "
        "here they are derived again from the boxes. Things exactly as far apart as the tolerance "
        f"of 10 cm{such if are_simulated(scores) else ''} are on either side of it by rounding."
    )


def _against_rule(scores: Sequence[ScoreFile], columns: Sequence[Column]) -> str:
    """Return in which F1 our relations are ahead of the rule, for sure or not, and in which not.

    Empty where the page is not about rendered homes.
    """
    rows = {score.method: score for score in scores}
    if not are_rendered(scores) or _RULE not in rows:
        return ""
    rule = rows[_RULE]
    verdicts = []
    for name in _TOLD:
        if name not in rows:
            continue
        ahead, behind = [], []
        for column in columns:
            ours, theirs = (row.metrics.get(column.metric) for row in (rows[name], rule))
            if not column.heading.endswith("F1") or ours is None or theirs is None:
                continue
            if ours.value is None or theirs.value is None or ours.value == theirs.value:
                continue
            both = rows[name].differences.get(_RULE, {}).get(column.metric)
            (ahead if ours.value > theirs.value else behind).append((column, ours, theirs, both))
        sure = [_relation(column) for column, *_, both in ahead if not _chance(both)]
        narrow = [_gained(column, both) for column, *_, both in ahead if both and _chance(both)]
        words = [f"ahead in {listed(sure)}"] if sure else []
        words += [f"ahead by no more than chance may bring: {listed(narrow)}"] if narrow else []
        words += [f"not in {listed([_lost(*found) for found in behind])}"] if behind else []
        verdicts.append(f"`{name}` is " + ", ".join(words))
    if not verdicts:
        return ""
    return f"F1 against the rule of geometry on the boxes of `{_RULE}`: {'; '.join(verdicts)}."


def _lost(column: Column, ours: Measured, theirs: Measured, both: Measured | None) -> str:
    """Return a relation with both numbers, and the interval of their difference if it is known."""
    first, second = (
        measured_cell(Measured(value=one.value), column.factor) for one in (ours, theirs)
    )
    difference = "" if both is None else f", difference {measured_cell(both, column.factor)}"
    return f"{_relation(column)} ({first} to {second}{difference})"


def _chance(difference: Measured | None) -> bool:
    """Return whether the interval of a gain reaches below nothing."""
    return difference is not None and difference.low is not None and difference.low <= 0


def _gained(column: Column, both: Measured) -> str:
    return f"{_relation(column)} ({measured_cell(both, column.factor)})"


def _relation(column: Column) -> str:
    return column.heading.removesuffix(" F1")
