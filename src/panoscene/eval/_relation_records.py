"""What the relation scores count in one scene, and how counts become scores."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import chain, islice
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from panoscene.eval._plausibility import ratio

RANDOM_YAW_ERROR_DEG = 90.0
"""Mean absolute error in degrees of guessing a relative yaw at random, with bins and without."""


class RelationCounts(NamedTuple):
    """Answers to one kind of yes-or-no relation in one scene.

    An entry is an ordered pair of two different objects, an object with a wall, or an object.
    """

    true_positive: int
    false_positive: int
    true_negative: int
    false_negative: int
    missed: int
    """Target relations with an object that no predicted object matches."""
    invented: int
    """Predicted relations with an object that matches no target."""
    in_target: int
    """All entries of the target; the first four of these numbers add up to the compared ones."""


class YawErrors(NamedTuple):
    """Errors of relative yaws in one scene, added up over entries as in ``RelationCounts``."""

    compared: int
    in_target: int
    bin_error_deg: float
    """Between the values of the predicted and the target bin."""
    error_deg: float
    """Between the value of the predicted bin and the true difference of the yaws."""


@dataclass(frozen=True, slots=True)
class RelationRecord:
    """Relations of one scene, compared: plain numbers, to be added up over scenes."""

    touching: RelationCounts
    touching_wall: RelationCounts
    on_floor: RelationCounts
    under_ceiling: RelationCounts
    inside_room: RelationCounts
    farther_than: RelationCounts
    relative_yaw: YawErrors
    relative_yaw_wall: YawErrors

    def as_dict(self) -> dict[str, dict[str, int | float]]:
        """Return the fields as plain values, for JSON."""
        return {field.name: getattr(self, field.name)._asdict() for field in fields(self)}


YES_OR_NO = tuple(field.name for field in fields(RelationRecord) if field.type is RelationCounts)
"""Relations that hold or do not."""
_OF_EVERY_PAIR = "farther_than"
"""Holds in one of the two directions of each pair, whatever the scene."""
TURNS = tuple(field.name for field in fields(RelationRecord) if field.type is YawErrors)
"""Relations that are angles."""


def score_relations(records: Sequence[RelationRecord]) -> dict[str, float | None]:
    """Return the relation scores of a data set, all scenes pooled.

    For each of ``touching``, ``touching_wall``, ``on_floor``, ``under_ceiling``, ``inside_room``
    and ``farther_than``, as ``<relation>_<score>``:

    - ``f1``, ``tpr`` (recall), ``tnr``, ``precision``, ``accuracy``: between matched objects only,
      as in the paper; ``compared`` and ``in_target``: how many entries that were, of how many
    - ``f1_end_to_end``, ``tpr_end_to_end``, ``precision_end_to_end``: target relations of objects
      that were not found count as missed, predicted relations of objects that do not exist as
      false

    ``all_f1`` and the others that begin with ``all``: of these relations together, all answers in
    one pool, without ``farther_than``, which holds for one direction of every pair.

    For ``relative_yaw`` and ``relative_yaw_wall``:

    - ``bin_error_deg``: mean absolute difference between predicted and target bin, as in the
      paper; ``error_deg``: between predicted bin and true difference of yaws. A random guess has
      90 degrees in both (``RANDOM_YAW_ERROR_DEG``)
    - ``compared``, ``in_target``

    A score is None when nothing could be right or wrong: F1 where no relation is in the target and
    none is predicted, TPR without positives in the target, TNR without negatives, precision
    without positive answers, accuracy and errors without entries. With a false positive and no
    relation in the target F1 is 0.

    Raises:
        ValueError: there are no records.
    """
    if not records:
        raise ValueError("records: expected those of at least one scene, found none")
    return relations_of_sums(relation_sums(records).sum(axis=0))


def relation_sums(records: Sequence[RelationRecord]) -> Float[np.ndarray, "scenes columns"]:
    """Return for each scene a 1 and the numbers of its record, to be added up."""
    parts = attrgetter(*YES_OR_NO, *TURNS)
    return np.array([(1, *chain(*parts(record))) for record in records], dtype=np.float64)


def relations_of_sums(sums: Float[np.ndarray, " columns"]) -> dict[str, float | None]:
    """Return ``score_relations`` for added rows of ``relation_sums``."""
    numbers = iter(sums.tolist())
    scores: dict[str, float | None] = {"scenes": next(numbers)}
    counts = {name: tuple(islice(numbers, len(RelationCounts._fields))) for name in YES_OR_NO}
    pooled = [counts[name] for name in YES_OR_NO if name != _OF_EVERY_PAIR]
    counts["all"] = tuple(map(sum, zip(*pooled, strict=True)))
    for name, some in counts.items():
        scores |= {f"{name}_{key}": value for key, value in _yes_or_no(*some).items()}
    for name in TURNS:
        compared, in_target, bin_error, error = islice(numbers, len(YawErrors._fields))
        scores |= {
            f"{name}_bin_error_deg": ratio(bin_error, compared),
            f"{name}_error_deg": ratio(error, compared),
            f"{name}_compared": compared,
            f"{name}_in_target": in_target,
        }
    return scores


def _yes_or_no(*counts: float) -> dict[str, float | None]:
    hit, false_alarm, rejected, overlooked, missed, invented, in_target = counts
    claimed, wanted = hit + false_alarm, hit + overlooked
    compared = claimed + rejected + overlooked
    return {
        "f1": ratio(2 * hit, claimed + wanted),
        "tpr": ratio(hit, wanted),
        "tnr": ratio(rejected, rejected + false_alarm),
        "precision": ratio(hit, claimed),
        "accuracy": ratio(hit + rejected, compared),
        "compared": compared,
        "in_target": in_target,
        "f1_end_to_end": ratio(2 * hit, claimed + invented + wanted + missed),
        "tpr_end_to_end": ratio(hit, wanted + missed),
        "precision_end_to_end": ratio(hit, claimed + invented),
    }
