"""From files of scores to pages in Markdown; nothing in them is typed by hand."""

import re
from collections.abc import Sequence

from panoscene.eval._fov import FOV_DEG
from panoscene.eval._layout_scores import CORNER_GROUPS
from panoscene.eval._paper_rows import (
    paper_counts_table,
    paper_fov_table,
    paper_relations_row,
    paper_semantic_rows,
)
from panoscene.eval._published import PAPER_ABLATION
from panoscene.eval._results import Measured, ScoreFile
from panoscene.eval._score_tables import (
    DETECTION,
    END_TO_END,
    FIDELITY,
    MATCHED_RECALL,
    MATCHED_RELATIONS,
    PAPER_COUNTS,
    PENETRATION,
    PLAUSIBILITY,
    RECALL,
    RELEASED,
    SEMANTIC,
    SHAPE,
    SUMMARY,
    Column,
    column_cell,
    markdown_table,
    measured_cell,
    score_table,
)

_WHOLE = FOV_DEG[0]
_FLAT = ("laptop", "picture")
"""Categories whose boxes are a few centimetres thin."""


def results_page(scores: Sequence[ScoreFile]) -> str:
    """Return RESULTS.md for files of scores on the same targets.

    Raises:
        ValueError: there are none, or they are of different targets.
    """
    check_same_targets(scores)
    whole = whole_rooms(scores)
    parts = [
        *_introduction(scores),
        *_detection_part(whole),
        *_plausibility_part(whole),
        *_relations_part(whole),
        "## Layout",
        "IoU in percent, 3D by the number of corners of the true room; corner error in percent of "
        "the image's diagonal, pixel error in percent of the pixels. `raw` is the polygon before "
        "it is made rectangular. A room that is missing or not valid is `degenerate` and counts "
        "at its worst. Repairing moves no walls, so methods share rows. `-`: no such room.",
        _layout_table(whole),
        "## Semantic segmentation",
        "IoU in percent of the PanoContext protocol's 12 labels, on evenly spread directions. The "
        "last rows are the paper's, on photos.",
        score_table(whole, SEMANTIC, beside=paper_semantic_rows(SEMANTIC)),
        *_meshes_part(whole),
        *_fov_part(scores),
        *_category_part(whole),
        "## The paper's own numbers",
        "On the authors' data, which nobody else has, in their definition of AP. For orientation "
        "only: levels cannot be compared with the tables above.",
        paper_counts_table(),
    ]
    return "\n\n".join(parts) + "\n"


def summary_table(scores: Sequence[ScoreFile]) -> str:
    """Return the short table of the README.

    Raises:
        ValueError: there are no scores, or they are of different targets.
    """
    check_same_targets(scores)
    return score_table(whole_rooms(scores), SUMMARY)


def summary_note(scores: Sequence[ScoreFile]) -> str:
    """Return what must be read with the short table: what the simulated input is good at."""
    by_name = {score.method: score for score in scores}
    facts = [
        "The optimiser's weights were searched on other seeds of the sampler that these rooms "
        "come from."
    ]
    touching = Column("", "relations.touching_f1", 100.0, interval=False)
    paper = f"{100 * (PAPER_ABLATION['Full'].touching_f1 or 0):.0f} %"
    if "estimates" in by_name:
        found = column_cell(by_name["estimates"], touching)
        facts.append(
            "The relations that it is told are simulated, too: their touching F1 is "
            f"{found} % between matched objects. The paper's network reaches {paper}."
        )
    if "default-weak" in by_name:
        found = column_cell(by_name["default-weak"], touching)
        facts.append(
            "`default-weak` gets the same boxes with relations that are about as wrong as the "
            f"paper's (touching F1 {found} %)."
        )
    return " ".join(facts)


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


def whole_rooms(scores: Sequence[ScoreFile]) -> list[ScoreFile]:
    """Return the methods that saw whole rooms; all of them if none did."""
    return [score for score in scores if score.fov_deg == _WHOLE] or list(scores)


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


def _introduction(scores: Sequence[ScoreFile]) -> list[str]:
    first = scores[0]
    return [
        "# Results",
        "Every number on this page is written by `panoscene eval report` from the files in "
        "`results/`; nothing is typed by hand. Made with",
        "```text\npanoscene eval export -o runs/rooms\npanoscene eval score runs/rooms -o results\n"
        "panoscene eval report results -o RESULTS.md --readme README.md\n```",
        f"Targets: {first.data or 'scenes'} ({first.scenes} scenes, {first.objects} objects, hash "
        f"`{first.targets_hash}`). In brackets the 95 % interval of {first.replicates} bootstrap "
        "resamples of the scenes. Scenes without a prediction count as empty, never as absent. "
        "`-` stands where there is nothing to measure, and a number without brackets either has an "
        "interval that is narrower than its last digit, or was not resampled (single labels and "
        "categories, matched IoU). What each metric is: [docs/eval.md](docs/eval.md).",
        "**There are no networks yet.** `estimates` simulates what they will say: boxes, "
        "categories, scores, layout and relations with known errors. The other rows say what is "
        "made of that, so the differences between rows mean something and the levels do not.",
        markdown_table(
            ["method", "kind", "what it is"],
            [[f"`{score.method}`", score.kind, score.description] for score in scores],
            left=3,
        ),
        "## Summary",
        "One number from each part of this page.",
        summary_table(scores),
        summary_note(scores),
    ]


def _detection_part(scores: Sequence[ScoreFile]) -> list[str]:
    return [
        "## Detection",
        "Average precision (AP) in the standard definition, in percent: oriented 3D IoU above "
        "0.15, 0.25 or 0.5, mean over the 11 common categories or all 57. AP of few targets is "
        "optimistic: the intervals are corrected for that, so they reach farther down than up.",
        score_table(scores, DETECTION),
        "Recall is the share of all targets that is found, precision the share of the "
        "predictions that are right; the IoU is that of what is found.",
        score_table(scores, RECALL),
        "The same AP in the definition of the authors' release: its recall divides by the number "
        "of detections, so a missed object costs nothing. Only these may stand next to the "
        "paper's.",
        score_table(scores, RELEASED),
    ]


def _plausibility_part(scores: Sequence[ScoreFile]) -> list[str]:
    parts = [
        "## Physical plausibility",
        "The paper's counts, per scene: they forgive 0.1 m, and count no wall for an object that "
        "is entirely outside.",
        score_table(scores, PAPER_COUNTS),
    ]
    truth = next((score for score in scores if score.method == "truth"), None)
    floor = None if truth is None else truth.metrics.get("plausibility.paper_hitting_floor")
    if floor is not None and floor.value:
        parts.append(
            f"Why does the truth hit the floor {floor.value:.2f} times per scene? The paper's test "
            "shrinks boxes, but to no less than 1 cm: a carpet that is flatter grows, and reaches "
            "through the floor that it lies on."
        )
    parts += [
        "What those counts overlook: collisions per pair of objects, what sticks out of the room, "
        "and objects that nothing holds (the distance that they would fall is the mean over all "
        "objects).",
        score_table(scores, PLAUSIBILITY),
        "Who predicts less collides less. Here each method keeps only as many of its best objects "
        "as it needs to find 20, 40 or 60 % of all targets. `-`: the method never finds as many, "
        "whatever it keeps. True boxes all have the score 1, so all are kept.",
        score_table(scores, MATCHED_RECALL),
    ]
    return parts


def _relations_part(scores: Sequence[ScoreFile]) -> list[str]:
    parts = [
        "## Relations",
        "Are the relation scores right? In percent and end to end: relations of missed objects "
        "count as missed, those of invented objects as false. TPR is the share of true relations "
        "that is claimed.",
        score_table(scores, END_TO_END),
        "The same between matched objects only, as in the paper: a method that finds fewer "
        "objects answers fewer questions. TNR is the share of rightly denied relations; a random "
        "guess of a yaw is 90° off. The last row is the paper's network on its own data.",
        score_table(scores, MATCHED_RELATIONS, beside=[paper_relations_row(MATCHED_RELATIONS)]),
        "Do the predicted *boxes* have the relations that the true boxes have? Between matched "
        "objects; yaw errors are from the nearest of 8 directions to the true difference.",
        score_table(scores, FIDELITY),
    ]
    truth = next((score for score in scores if score.method == "truth"), None)
    short: list[str] = []
    known = {} if truth is None else truth.metrics
    for column in FIDELITY:
        measured = known.get(column.metric)
        if column.heading.endswith("F1") and measured is not None and measured.value is not None:
            cell = measured_cell(Measured(value=measured.value), column.factor)
            short += [f"{column.heading} {cell}"] if measured.value < 1 else []
    if short:
        parts.append(
            f"Why is the truth not perfect ({', '.join(short)})? Its files say which relations "
            "hold; here they are derived again from the boxes. Things exactly as far apart as the "
            "tolerance of 10 cm (a sampled stool before its piano, a window below the ceiling) "
            "are on either side of it by rounding."
        )
    return parts


def _meshes_part(scores: Sequence[ScoreFile]) -> list[str]:
    parts: list[str] = []
    missing: list[str] = []
    if any("shape.targets" in score.metrics for score in scores):
        parts += [
            "## Shapes",
            "Meshes against the true ones, each scaled to its box. Chamfer: 1000 times the mean "
            "squared distances, of found objects; all else in percent, a missed object counting "
            "as 0 unless the heading says `found`. `as boxes`: predicted without a mesh.",
            score_table(scores, SHAPE),
        ]
    else:
        missing.append("shapes")
    if any("penetration.penetrating_pairs" in score.metrics for score in scores):
        parts += [
            "## Mesh penetration",
            "How far the meshes of objects are in each other; a chair under a table is not. Hulls "
            "stand in for meshes that are not closed, boxes where there is none.",
            score_table(scores, PENETRATION),
        ]
    else:
        missing.append("mesh penetration")
    if missing:
        parts += [
            "## What is not here",
            f"There are no rows of {' and '.join(missing)}: they need meshes, and sampled "
            "rooms have boxes only. `panoscene eval score --shapes` measures them, and `eval "
            "report` then shows them here.",
        ]
    return parts


def _layout_table(scores: Sequence[ScoreFile]) -> str:
    head = ["methods", "reading", *(f"3D IoU, {group}" for group in CORNER_GROUPS)]
    head += ["2D IoU", "corner error, %", "pixel error, %", "degenerate"]
    rows: dict[tuple[str, ...], list[str]] = {}
    for score in scores:
        for reading in ("regularised", "raw"):
            start = f"layout.{reading}"
            if f"{start}.overall.scenes" not in score.metrics:
                continue
            groups = [f"{start}.{group}.iou_3d" for group in CORNER_GROUPS]
            columns = [Column("", name, 100.0, interval=False) for name in groups[:-1]]
            columns += [Column("", groups[-1], 100.0)]
            columns += [Column("", f"{start}.overall.iou_2d", 100.0)]
            columns += [
                Column("", f"{start}.overall.{name}") for name in ("corner_error", "pixel_error")
            ]
            columns += [Column("", f"{start}.overall.degenerate", interval=False, digits=0)]
            cells = (reading, *(column_cell(score, column) for column in columns))
            rows.setdefault(cells, []).append(f"`{score.method}`")
    return markdown_table(head, [[", ".join(who), *row] for row, who in rows.items()], left=2)


def _fov_part(scores: Sequence[ScoreFile]) -> list[str]:
    splits = [score for score in scores if score.fov_deg != _WHOLE]
    if not splits:
        return []
    default = [score for score in whole_rooms(scores) if score.method == "default"]
    rows = [
        [f"`{score.method}`", f"{score.fov_deg}°", *(column_cell(score, c) for c in _FOV_COLUMNS)]
        for score in (*default, *sorted(splits, key=lambda score: -score.fov_deg))
        if score in splits or score.fov_deg == _WHOLE
    ]
    return [
        "## Field of view",
        "Horizontal splits of the panorama, each on its own with the full layout. What is lost is "
        "what relations across the borders of splits are good for.",
        markdown_table(["method", "split", *(column.heading for column in _FOV_COLUMNS)], rows),
        "The paper's AP 15 over '57' categories, in its own definition of AP and on its own data:",
        paper_fov_table(),
    ]


_FOV_COLUMNS = (
    DETECTION[1],
    DETECTION[2],
    PAPER_COUNTS[0],
    Column("boxes obey: touching F1", "fidelity.touching_f1", 100.0),
)


def _category_part(scores: Sequence[ScoreFile]) -> list[str]:
    best = next((score for score in scores if score.method == "default"), scores[0])
    given = next((score for score in scores if score.method == "estimates"), None)
    given = None if given is best else given
    tables = [best] if given is None else [best, given]
    names = sorted({name for score in tables for name in score.categories})

    def cell(score: ScoreFile, name: str, key: str) -> str:
        row = score.categories.get(name, {})
        return measured_cell(row.get(key), 100.0)

    def count(name: str) -> str:
        rows = [score.categories[name] for score in tables if name in score.categories]
        return measured_cell(rows[0]["targets"], digits=0)

    head = ["category", "targets"]
    head += [f"`{best.method}` AP 15", "AP 25", "AP 50", "released AP 15"]
    if given is not None:
        head += [f"`{given.method}` AP 15", "AP 25", "AP 50"]
    keys = ("ap_15", "ap_25", "ap_50")
    rows = [
        [
            f"`{name}`",
            count(name),
            *(cell(best, name, key) for key in (*keys, "released_ap_15")),
            *(cell(given, name, key) for key in keys if given is not None),
        ]
        for name in names
    ]
    parts = [
        "## Categories",
        f"AP in percent of `{best.method}`"
        + ("" if given is None else f", and of `{given.method}` that it starts from")
        + ". `-`: no targets, and then the released definition counts 0 for false detections.",
        markdown_table(head, rows),
    ]
    flat = [f"`{name}` {cell(best, name, 'ap_15')}" for name in _FLAT if name in best.categories]
    if flat:
        parts.append(
            f"Thin objects fare worst ({', '.join(flat)}): where a box is a few centimetres thin "
            "or less, an error of that size leaves no overlap, though the object is all but in "
            "its place."
        )
    return parts
