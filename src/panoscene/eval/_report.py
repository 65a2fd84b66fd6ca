"""From files of scores to tables in Markdown; nothing in them is typed by hand."""

import re
from collections.abc import Sequence

from panoscene.eval._layout_scores import CORNER_GROUPS
from panoscene.eval._methods import FOV_DEG
from panoscene.eval._published import (
    PAPER_COLLISIONS,
    PAPER_FOV_DEG,
    PAPER_FOV_MAP_57,
    PAPER_MAP_57,
    PAPER_MAP_COMMON,
    PAPER_METHODS,
)
from panoscene.eval._results import Measured, ScoreFile

Column = tuple[str, str, float]
"""Heading, name of the metric, and what to multiply it with."""

DETECTION: tuple[Column, ...] = (
    ("AP 15, 11 cat.", "detection.ap_15_mean_11", 100.0),
    ("AP 15, 57 cat.", "detection.ap_15_mean_57", 100.0),
    ("AP 25, 57 cat.", "detection.ap_25_mean_57", 100.0),
    ("AP 50, 57 cat.", "detection.ap_50_mean_57", 100.0),
    ("released AP 15, 57 cat.", "detection.released_ap_15_mean_57", 100.0),
    ("recall 15, %", "detection.recall_15", 100.0),
    ("matched IoU", "detection.matched_iou", 1.0),
)
PLAUSIBILITY: tuple[Column, ...] = (
    ("colliding pairs", "plausibility.paper_colliding_pairs", 1.0),
    ("with object", "plausibility.paper_hitting_object", 1.0),
    ("ceiling", "plausibility.paper_hitting_ceiling", 1.0),
    ("floor", "plausibility.paper_hitting_floor", 1.0),
    ("wall", "plausibility.paper_hitting_wall", 1.0),
    ("pairs colliding, ‰", "plausibility.collision_rate", 1000.0),
    ("the same at recall 60 %", "plausibility_at_recall_60.collision_rate", 1000.0),
    ("outside, m³", "plausibility.out_of_room_volume", 1.0),
    ("floating, %", "plausibility.floating_share", 100.0),
)
RELATIONS: tuple[Column, ...] = (
    ("touching F1", "relations.touching_f1", 100.0),
    ("TPR", "relations.touching_tpr", 100.0),
    ("TNR", "relations.touching_tnr", 100.0),
    ("wall F1", "relations.touching_wall_f1", 100.0),
    ("yaw error, °", "relations.relative_yaw_bin_error_deg", 1.0),
    ("to walls, °", "relations.relative_yaw_wall_bin_error_deg", 1.0),
    ("touching F1 end to end", "relations.touching_f1_end_to_end", 100.0),
    ("boxes obey: touching F1", "fidelity.touching_f1", 100.0),
    ("wall F1", "fidelity.touching_wall_f1", 100.0),
)
SEMANTIC: tuple[Column, ...] = (
    ("mean IoU", "semantic.mean", 100.0),
    ("of objects", "semantic.mean_objects", 100.0),
    ("background", "semantic.background", 100.0),
    ("bed", "semantic.bed", 100.0),
    ("door", "semantic.door", 100.0),
    ("chair", "semantic.chair", 100.0),
    ("sofa", "semantic.sofa", 100.0),
    ("cabinet", "semantic.cabinet", 100.0),
)
SUMMARY: tuple[Column, ...] = (
    DETECTION[1],
    DETECTION[5],
    PLAUSIBILITY[0],
    PLAUSIBILITY[7],
    ("layout 3D IoU, %", "layout.regularised.overall.iou_3d", 100.0),
    SEMANTIC[0],
)


def score_table(scores: Sequence[ScoreFile], columns: Sequence[Column]) -> str:
    """Return a table of methods with the 95 % interval below each number."""
    head = ["method", "kind", *(name for name, _, _ in columns)]
    rows = [
        [
            f"`{score.method}`",
            score.kind,
            *(measured_cell(score.metrics.get(name), factor) for _, name, factor in columns),
        ]
        for score in scores
    ]
    return markdown_table(head, rows, left=2)


def measured_cell(measured: Measured | None, factor: float = 1.0) -> str:
    """Return a number with its interval as a cell of a table.

    Examples:
        >>> measured_cell(Measured(value=0.5, low=0.4, high=0.625), 100.0)
        '50.0 [40.0, 62.5]'
        >>> measured_cell(None)
        '-'
    """
    if measured is None or measured.value is None:
        return "-"
    digits = 1 if factor >= 100 else 2
    text = f"{factor * measured.value:.{digits}f}"
    if measured.low is None or measured.high is None:
        return text
    return f"{text} [{factor * measured.low:.{digits}f}, {factor * measured.high:.{digits}f}]"


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]], *, left: int = 1) -> str:
    """Return a Markdown table whose first ``left`` columns are aligned to the left."""
    rule = ["---" if k < left else "---:" for k in range(len(head))]
    return "\n".join("| " + " | ".join(row) + " |" for row in (head, rule, *rows))


def results_page(scores: Sequence[ScoreFile]) -> str:
    """Return RESULTS.md for files of scores on the same targets.

    Raises:
        ValueError: there are none, or they are of different targets.
    """
    check_same_targets(scores)
    first = scores[0]
    whole = [score for score in scores if not is_split(score)]
    best = next((score for score in scores if score.method == "default"), whole[0])
    parts = [
        "# Results",
        "Every number on this page is written by `panoscene eval report` from the files in "
        "`results/`; nothing is typed by hand. Made with",
        "```text\npanoscene eval export -o runs/rooms\npanoscene eval score runs/rooms -o results\n"
        "panoscene eval report results -o RESULTS.md --readme README.md\n```",
        f"Targets: {first.data or 'scenes'} ({first.scenes} scenes, {first.objects} objects, hash "
        f"`{first.targets_hash}`). In brackets the 95 % interval of {first.replicates} bootstrap "
        "resamples of the scenes. Scenes without a prediction count as empty, never as absent.",
        "**There are no networks yet.** `estimates` simulates what they will say: boxes, "
        "categories, scores, layout and relations with known errors. The other rows say what is "
        "made of that, so the differences between rows mean something and the levels do not.",
        markdown_table(
            ["method", "kind", "what it is"],
            [[f"`{score.method}`", score.kind, score.description] for score in scores],
            left=3,
        ),
        "## Detection",
        "AP in the standard definition, recall over all targets; the `released` column is the "
        "authors' definition, whose recall divides by the number of detections, so it never "
        "counts a missed object. Oriented 3D IoU at 0.15, 0.25 and 0.5.",
        score_table(whole, DETECTION),
        "## Physical plausibility",
        "The first five columns are the paper's, per scene: they forgive 0.1 m, and count no wall "
        "for an object that is entirely outside. The others close the loopholes: per pair of "
        "objects, at the same recall, volume outside the room, objects without support.",
        score_table(whole, PLAUSIBILITY),
        "## Relations",
        "Scores between matched objects in percent; a random guess of a yaw is 90° off. End to "
        "end, relations of missed objects count as missed.",
        score_table(whole, RELATIONS),
        "## Layout",
        _layout_table(whole),
        "## Semantic segmentation",
        "IoU in percent of 12 labels on evenly spread directions (the PanoContext protocol).",
        score_table(whole, SEMANTIC),
        *_fov_part(scores),
        f"## Categories of `{best.method}`",
        _category_table(best),
        "## The paper's own numbers",
        "On the authors' data, which nobody else has, in their definition of AP. For orientation "
        "only: levels cannot be compared with the tables above.",
        _paper_table(),
    ]
    return "\n\n".join(parts) + "\n"


def summary_table(scores: Sequence[ScoreFile]) -> str:
    """Return the short table of the README."""
    check_same_targets(scores)
    return score_table([score for score in scores if not is_split(score)], SUMMARY)


def check_same_targets(scores: Sequence[ScoreFile]) -> None:
    """Refuse scores that cannot stand in one table.

    Raises:
        ValueError: there are none, or they are of different targets.
    """
    if not scores:
        raise ValueError("found no files of scores, expected at least one")
    for score in scores[1:]:
        if score.targets_hash != scores[0].targets_hash:
            raise ValueError(
                f"{score.method}: found scores on other targets ({score.targets_hash}) than "
                f"{scores[0].method} ({scores[0].targets_hash}), expected the same"
            )


def is_split(score: ScoreFile) -> bool:
    """Return whether the scores are of the experiment on the field of view."""
    return re.fullmatch(r".+-(" + "|".join(map(str, FOV_DEG)) + ")", score.method) is not None


def replace_between(text: str, name: str, content: str) -> str:
    """Return a text with something else between ``<!-- name:begin -->`` and its end.

    Raises:
        ValueError: the text has no such markers.
    """
    pattern = rf"(<!-- {name}:begin -->).*?(<!-- {name}:end -->)"
    replaced, count = re.subn(
        pattern, lambda match: f"{match[1]}\n{content}\n{match[2]}", text, flags=re.DOTALL
    )
    if not count:
        raise ValueError(f"found no <!-- {name}:begin --> ... <!-- {name}:end -->")
    return replaced


def _layout_table(scores: Sequence[ScoreFile]) -> str:
    head = ["method", "reading", *(f"3D IoU, {group}" for group in CORNER_GROUPS)]
    head += ["2D IoU", "corner error, %", "pixel error, %", "degenerate"]
    rows: list[list[str]] = []
    for score in scores:
        for reading in ("regularised", "raw"):
            start = f"layout.{reading}"
            if f"{start}.overall.scenes" not in score.metrics:
                continue
            cells = [
                measured_cell(score.metrics.get(f"{start}.{group}.iou_3d"), 100.0)
                for group in CORNER_GROUPS
            ]
            cells.append(measured_cell(score.metrics.get(f"{start}.overall.iou_2d"), 100.0))
            cells += [
                measured_cell(score.metrics.get(f"{start}.overall.{name}"))
                for name in ("corner_error", "pixel_error")
            ]
            count = score.metrics[f"{start}.overall.degenerate"].value
            rows.append([f"`{score.method}`", reading, *cells, f"{count or 0:.0f}"])
    return markdown_table(head, rows, left=2)


def _fov_part(scores: Sequence[ScoreFile]) -> list[str]:
    by_name = {score.method: score for score in scores}
    names = ["default", *(f"default-{fov}" for fov in FOV_DEG)]
    if any(name not in by_name for name in names):
        return []
    columns = (DETECTION[1], DETECTION[2], PLAUSIBILITY[0], RELATIONS[7])
    rows = [
        [f"{fov}°", *(measured_cell(by_name[name].metrics.get(c[1]), c[2]) for c in columns)]
        for fov, name in zip((360, *FOV_DEG), names, strict=True)
    ]
    paper = [[f"{PAPER_FOV_MAP_57[method][k]:.1f}" for k in range(6)] for method in
             ("Ours w/o RO", "Ours Full")]  # fmt: skip
    return [
        "## Field of view",
        "`default` on horizontal splits of the panorama, each on its own with the full layout.",
        markdown_table(["split", *(column[0] for column in columns)], rows),
        "The paper's, in its own definition of AP and on its own data:",
        markdown_table(
            ["method", *(f"{fov}°" for fov in PAPER_FOV_DEG)],
            [["Ours w/o RO", *paper[0]], ["Ours Full", *paper[1]]],
        ),
    ]


def _category_table(score: ScoreFile) -> str:
    head = ["category", "targets", "detections", "AP 15", "AP 25", "AP 50", "released AP 15"]
    rows = [
        [
            f"`{name}`",
            f"{row['targets'].value or 0:.0f}",
            f"{row['detections'].value or 0:.0f}",
            *(measured_cell(row[key], 100.0) for key in ("ap_15", "ap_25", "ap_50")),
            measured_cell(row["released_ap_15"], 100.0),
        ]
        for name, row in score.categories.items()
    ]
    return markdown_table(head, rows)


def _paper_table() -> str:
    head = ["method", "AP 15, 11 cat.", "AP 15, '57' cat.", "colliding pairs", "with object"]
    head += ["ceiling", "floor", "wall"]
    rows: list[list[str]] = []
    for method in PAPER_METHODS:
        counts = PAPER_COLLISIONS[method]
        numbers = (
            PAPER_MAP_COMMON[method], PAPER_MAP_57[method], counts.pairs, counts.with_object,
            counts.with_ceiling, counts.with_floor, counts.with_wall,
        )  # fmt: skip
        rows.append([method, *(f"{number:.2f}" for number in numbers)])
    return markdown_table(head, rows)
