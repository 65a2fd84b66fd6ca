"""Which scores stand in which table, and how a number becomes a cell in Markdown."""

from collections.abc import Sequence
from typing import NamedTuple

from panoscene.eval._report_facts import categories_with
from panoscene.eval._results import Measured, ScoreFile
from panoscene.scene import CATEGORIES, COMMON_11, PANOCONTEXT_12


class Column(NamedTuple):
    """A column of a table of methods."""

    heading: str
    metric: str
    """Dotted name in the file of scores."""
    factor: float = 1.0
    """What the number is multiplied with."""
    interval: bool = True
    """Whether its 95 % interval is shown."""
    digits: int | None = None
    """After the point; by default 1 for a factor of 100 or more, else 2."""


def _percent(heading: str, metric: str, *, interval: bool = True) -> Column:
    return Column(heading, metric, 100.0, interval)


DETECTION: tuple[Column, ...] = tuple(
    _percent(f"AP {iou}, {count} cat.", f"detection.ap_{iou}_mean_{count}")
    for count in (11, 57)
    for iou in (15, 25, 50)
)
AP_15_57, AP_25_57 = DETECTION[3:5]
RECALL: tuple[Column, ...] = (
    _percent("recall 15, %", "detection.recall_15"),
    _percent("recall 25, %", "detection.recall_25"),
    _percent("recall 50, %", "detection.recall_50"),
    _percent("precision 15, %", "detection.precision_15"),
    Column("matched IoU", "detection.matched_iou"),
)
RELEASED: tuple[Column, ...] = tuple(
    _percent(f"released {column.heading}", column.metric.replace(".", ".released_"))
    for column in DETECTION
)
PAPER_COUNTS: tuple[Column, ...] = (
    Column("colliding pairs", "plausibility.paper_colliding_pairs"),
    Column("with object", "plausibility.paper_hitting_object"),
    Column("ceiling", "plausibility.paper_hitting_ceiling"),
    Column("floor", "plausibility.paper_hitting_floor"),
    Column("wall", "plausibility.paper_hitting_wall"),
)
PLAUSIBILITY: tuple[Column, ...] = (
    Column("pairs colliding, ‰", "plausibility.collision_rate", 1000.0),
    Column("outside, m³ per scene", "plausibility.out_of_room_volume"),
    _percent("objects > 5 % outside, %", "plausibility.partly_outside_share"),
    _percent("floating, %", "plausibility.floating_share"),
    _percent("floating distance, cm", "plausibility.floating_distance"),
)
MATCHED_RECALL: tuple[Column, ...] = (
    *(
        Column(f"pairs colliding, ‰, at {r} %", f"plausibility_at_recall_{r}.collision_rate", 1e3)
        for r in (20, 40, 60)
    ),
    *(
        Column(f"outside, m³, at {r} %", f"plausibility_at_recall_{r}.out_of_room_volume")
        for r in (20, 40, 60)
    ),
)
END_TO_END: tuple[Column, ...] = (
    _percent("all F1", "relations.all_f1_end_to_end"),
    _percent("touching F1", "relations.touching_f1_end_to_end"),
    _percent("TPR", "relations.touching_tpr_end_to_end"),
    _percent("wall F1", "relations.touching_wall_f1_end_to_end"),
    _percent("wall TPR", "relations.touching_wall_tpr_end_to_end"),
    _percent("floor F1", "relations.on_floor_f1_end_to_end"),
    _percent("ceiling F1", "relations.under_ceiling_f1_end_to_end"),
    _percent("in room F1", "relations.inside_room_f1_end_to_end"),
)
MATCHED_RELATIONS: tuple[Column, ...] = (
    _percent("all F1", "relations.all_f1"),
    _percent("touching F1", "relations.touching_f1"),
    _percent("TPR", "relations.touching_tpr"),
    _percent("TNR", "relations.touching_tnr"),
    _percent("wall F1", "relations.touching_wall_f1"),
    _percent("wall TPR", "relations.touching_wall_tpr"),
    _percent("wall TNR", "relations.touching_wall_tnr"),
    _percent("floor F1", "relations.on_floor_f1"),
    _percent("ceiling F1", "relations.under_ceiling_f1"),
    _percent("in room F1", "relations.inside_room_f1"),
    Column("yaw error, °", "relations.relative_yaw_bin_error_deg"),
    Column("to walls, °", "relations.relative_yaw_wall_bin_error_deg"),
)
FIDELITY: tuple[Column, ...] = (
    _percent("touching F1", "fidelity.touching_f1"),
    _percent("wall F1", "fidelity.touching_wall_f1"),
    _percent("floor F1", "fidelity.on_floor_f1"),
    _percent("ceiling F1", "fidelity.under_ceiling_f1"),
    _percent("in room F1", "fidelity.inside_room_f1"),
    Column("yaw error, °", "fidelity.relative_yaw_error_deg"),
    Column("to walls, °", "fidelity.relative_yaw_wall_error_deg"),
)
SEMANTIC: tuple[Column, ...] = (
    _percent("mean IoU", "semantic.mean"),
    _percent("of objects", "semantic.mean_objects"),
    *(_percent(label, f"semantic.{label}", interval=False) for label in PANOCONTEXT_12),
)
SHAPE: tuple[Column, ...] = (
    Column("targets", "shape.targets", interval=False, digits=0),
    Column("found", "shape.matched", interval=False, digits=0),
    Column("as boxes", "shape.boxes_stand_in", interval=False, digits=0),
    Column("Chamfer, found", "shape.canonical.chamfer"),
    _percent("F-score, found", "shape.canonical.f_score"),
    _percent("F-score", "shape.canonical_with_misses.f_score"),
    _percent("normals", "shape.canonical_with_misses.normal_consistency"),
    _percent("volume IoU", "shape.canonical_with_misses.volume_iou"),
    _percent("F-score in the room", "shape.world_with_misses.f_score"),
)
PENETRATION: tuple[Column, ...] = (
    Column("pairs per scene", "penetration.penetrating_pairs"),
    Column("of pairs, ‰", "penetration.penetration_rate", 1000.0),
    _percent("depth, cm per scene", "penetration.penetration_depth"),
    Column("volume, litres per scene", "penetration.penetration_volume", 1000.0),
    _percent("worst, cm", "penetration.worst_penetration"),
    _percent("hulls stand in, %", "penetration.hull_share"),
    _percent("boxes stand in, %", "penetration.box_share"),
)
FIELD_OF_VIEW: tuple[Column, ...] = (
    AP_15_57,
    AP_25_57,
    PAPER_COUNTS[0],
    _percent("boxes obey: touching F1", "fidelity.touching_f1"),
)
SUMMARY: tuple[Column, ...] = (
    AP_15_57,
    RECALL[0],
    PAPER_COUNTS[0],
    PLAUSIBILITY[1],
    _percent("layout 3D IoU, %", "layout.regularised.overall.iou_3d"),
    _percent("semantic IoU, %", "semantic.mean"),
)


def score_table(
    scores: Sequence[ScoreFile],
    columns: Sequence[Column],
    *,
    beside: Sequence[Sequence[str]] = (),
) -> str:
    """Return a table of methods with the 95 % interval beside each number.

    Args:
        scores: a row each.
        columns: after method and kind.
        beside: cells of further rows, such as those of the paper.
    """
    head = ["method", "kind", *(column.heading for column in columns)]
    rows = [
        [
            f"`{score.method}`",
            score.kind,
            *(column_cell(score, column) for column in columns),
        ]
        for score in scores
    ]
    return markdown_table(head, [*rows, *map(list, beside)], left=2)


def with_counts(columns: Sequence[Column], scores: Sequence[ScoreFile]) -> list[Column]:
    """Return columns whose headings say how many of the categories have targets, if not all.

    The standard mean is over those. The released one is over the categories with detections,
    which differ from method to method, so its headings stay as they are.
    """
    known = set(categories_with(scores[0], "targets"))
    counted: list[Column] = []
    for column in columns:
        heading = column.heading
        for categories in (COMMON_11, CATEGORIES):
            total, found = len(categories), len(known.intersection(categories))
            standard = column.metric.startswith("detection.ap_")
            if standard and column.metric.endswith(f"_mean_{total}") and 0 < found < total:
                heading = heading.replace("cat.", f"cat. ({found} with targets)")
        counted.append(column._replace(heading=heading))
    return counted


def column_cell(score: ScoreFile, column: Column) -> str:
    """Return the cell of a method in a column."""
    measured = score.metrics.get(column.metric)
    if measured is not None and not column.interval:
        measured = Measured(value=measured.value)
    return measured_cell(measured, column.factor, digits=column.digits)


def measured_cell(
    measured: Measured | None, factor: float = 1.0, *, digits: int | None = None
) -> str:
    """Return a number with its interval as a cell of a table.

    An interval that is narrower than the last digit is left out.

    Examples:
        >>> measured_cell(Measured(value=0.5, low=0.4, high=0.625), 100.0)
        '50.0 [40.0, 62.5]'
        >>> measured_cell(Measured(value=1.0, low=1.0, high=1.0))
        '1.00'
        >>> measured_cell(None)
        '-'
    """
    if measured is None or measured.value is None:
        return "-"
    if digits is None:
        digits = 1 if factor >= 100 else 2
    text = f"{factor * measured.value:.{digits}f}"
    if measured.low is None or measured.high is None:
        return text
    low, high = (f"{factor * end:.{digits}f}" for end in (measured.low, measured.high))
    return text if low == text == high else f"{text} [{low}, {high}]"


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]], *, left: int = 1) -> str:
    """Return a Markdown table whose first ``left`` columns are aligned to the left."""
    rule = ["---" if k < left else "---:" for k in range(len(head))]
    return "\n".join("| " + " | ".join(row) + " |" for row in (head, rule, *rows))
