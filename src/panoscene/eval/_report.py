"""From files of scores to pages in Markdown; nothing in them is typed by hand."""

import re
from collections.abc import Mapping, Sequence
from typing import Any

from panoscene.eval._paper_rows import (
    paper_57_note,
    paper_counts_table,
    paper_semantic_note,
    paper_semantic_rows,
)
from panoscene.eval._published import PAPER_ABLATION
from panoscene.eval._report_differences import differences_part
from panoscene.eval._report_facts import (
    are_rendered,
    are_simulated,
    categories_without_targets,
    check_same_targets,
    detected_categories,
    lower_released_note,
    row_named,
    truth_row,
    whole_rooms,
)
from panoscene.eval._report_relations import relations_part
from panoscene.eval._report_seconds import seconds_part
from panoscene.eval._report_tables import by_part, category_part, fov_part, layout_part
from panoscene.eval._results import ScoreFile
from panoscene.eval._score_tables import (
    AP_15_57,
    DETECTION,
    MATCHED_RECALL,
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
    score_table,
    with_counts,
)
from panoscene.scene import CATEGORIES

_FEW = 8
"""Names that a sentence can bear."""


def results_page(scores: Sequence[ScoreFile], timings: Mapping[str, Any] | None = None) -> str:
    """Return RESULTS.md for files of scores on the same targets.

    Args:
        scores: of all methods.
        timings: what ``panoscene bench pipeline --json`` printed; None where it does not belong.

    Raises:
        ValueError: there are none, they are of different targets, or the timings are something
            else.
    """
    check_same_targets(scores)
    whole = whole_rooms(scores)
    parts = [
        *_introduction(scores),
        *differences_part(whole),
        *_detection_part(whole),
        *_plausibility_part(whole),
        *relations_part(whole),
        *layout_part(whole),
        "## Semantic segmentation",
        "IoU in percent of the PanoContext protocol's 12 labels, on evenly spread directions. The "
        f"last rows are the paper's, on photos. {paper_semantic_note()}".strip(),
        score_table(whole, SEMANTIC, beside=paper_semantic_rows(SEMANTIC)),
        *_meshes_part(whole),
        *seconds_part(timings),
        *by_part(whole),
        *fov_part(scores),
        *category_part(whole),
        "## The paper's own numbers",
        "On the authors' data, which nobody else has, in their definition of AP. For orientation "
        "only: levels cannot be compared with the tables above.",
        paper_counts_table(),
        paper_57_note(),
    ]
    return "\n\n".join(filter(None, parts)) + "\n"


def summary_table(scores: Sequence[ScoreFile]) -> str:
    """Return the short table of the README.

    Raises:
        ValueError: there are no scores, or they are of different targets.
    """
    check_same_targets(scores)
    return score_table(whole_rooms(scores), with_counts(SUMMARY, scores))


def summary_note(scores: Sequence[ScoreFile]) -> str:
    """Return what must be read with the short table: what the simulated input is good at.

    Empty when the scores are not those of our methods on sampled rooms.
    """
    given, weak = (row_named(scores, name) for name in ("estimates", "default-weak"))
    if given is None:
        return ""
    touching = Column("", "relations.touching_f1", 100.0, interval=False)
    paper = f"{100 * (PAPER_ABLATION['Full'].touching_f1 or 0):.0f} %"
    facts = [
        "The optimiser's weights were searched on other seeds of the sampler that these rooms "
        "come from.",
        "The relations that it is told are simulated, too: their touching F1 is "
        f"{column_cell(given, touching)} % between matched objects. The paper's network reaches "
        f"{paper}.",
    ]
    if weak is not None:
        facts.append(
            "`default-weak` gets the same boxes with relations that are about as wrong as the "
            f"paper's (touching F1 {column_cell(weak, touching)} %)."
        )
    return " ".join(facts)


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
    first, simulated, rendered = scores[0], are_simulated(scores), are_rendered(scores)
    folder = "results/simulated" if simulated else "results"
    ours = simulated or rendered
    parts = [
        "# Results on simulated estimates" if simulated else "# Results",
        "Every number on this page is written by `panoscene eval report` from "
        f"{f'the files in `{folder}/`' if ours else 'files of scores'}; nothing is typed by hand."
        f"{' Made with' if ours else ''}",
    ]
    if simulated:
        parts.append(
            "```text\npanoscene eval export -o runs/rooms\n"
            "panoscene eval score runs/rooms -o results/simulated\n"
            "panoscene eval report results/simulated -o docs/simulated.md\n```"
        )
    elif rendered:
        parts.append(
            "```text\npanoscene synth render configs/synth/full.yaml data --limit 400\n"
            "panoscene eval reconstruct data -o runs/test --shapes\n"
            "panoscene eval score runs/test -o results --shapes\n"
            "panoscene bench pipeline --json > benchmarks/pipeline.json\n"
            "panoscene eval report results -o RESULTS.md --readme README.md \\\n"
            "    --timings benchmarks/pipeline.json\n```"
        )
    page = "the page `eval` of panoscene's docs"
    if ours:
        page = "[eval](eval.md)" if simulated else "[docs/eval.md](docs/eval.md)"
    parts.append(
        f"Targets: {first.data or 'scenes'} ({first.scenes} scenes, {first.objects} objects, hash "
        f"`{first.targets_hash}`). {_intervals(scores)} Scenes without a prediction count as "
        "empty, never as absent. `-` stands where there is nothing to measure. What each metric "
        f"is: {page}."
    )
    if simulated and all(score.kind != "prediction" for score in scores):
        parts.append(
            "`estimates` simulates what networks say: boxes, categories, scores, layout and "
            "relations with known errors. The other rows say what is made of that, so the "
            "differences between rows mean something and the levels do not. What the real networks "
            "reach is in RESULTS.md of the repository."
        )
    elif simulated:
        parts.append(
            "`estimates` simulates networks: boxes, categories, scores, layout and relations with "
            "known errors."
        )
    elif rendered:
        parts.append(
            "The photos are rendered; the first command makes them if its generator makes homes of "
            "the same version (`homes_version` in dataset.json), others if not. No home of the "
            "test parts was in the training; `test-unseen` has furniture that was not there "
            "either. Every row but the oracles sees the photo and the height of its camera alone."
        )
    rows = [[f"`{score.method}`", score.kind, score.description] for score in scores]
    return [
        *parts,
        markdown_table(["method", "kind", "what it is"], rows, left=3),
        "## Summary",
        "One number from each part of this page.",
        summary_table(scores),
        summary_note(scores),
    ]


def _intervals(scores: Sequence[ScoreFile]) -> str:
    """Return what stands in brackets, and what does not."""
    counts = sorted({score.replicates for score in scores if score.replicates})
    if not counts:
        return "There are no intervals: the scores were made with `--replicates 0`."
    files = "the files of scores"
    if are_simulated(scores) or are_rendered(scores):
        files = f"`results/{'simulated/' if are_simulated(scores) else ''}*.json`"
    without = [f"`{score.method}`" for score in scores if not score.replicates]
    none = f" (none for {', '.join(without)})" if without else ""
    return (
        f"In brackets the 95 % interval of {' or '.join(map(str, counts))} bootstrap resamples of "
        f"the scenes{none}. It is left out where it is narrower than the last digit; intervals of "
        f"single labels and corner groups are in {files}. {_bare(scores)} and single "
        "categories have none."
    )


def _bare(scores: Sequence[ScoreFile]) -> str:
    """Return what has no intervals besides categories; older files have fewer."""
    resampled = [
        one
        for score in scores
        if score.replicates and (one := score.metrics.get("detection.matched_iou")) is not None
    ]
    known = all(one.low is not None for one in resampled if one.value is not None)
    return "Numbers of targets" if known else "Numbers of targets, matched IoU"


def _detection_part(scores: Sequence[ScoreFile]) -> list[str]:
    empty = categories_without_targets(scores[0])
    total = len(CATEGORIES)
    names = f" ({', '.join(f'`{name}`' for name in empty)})" if len(empty) <= _FEW else ""
    mean = f"all {total}"
    if empty:
        mean = f"all {total} but the {len(empty)} without targets{names}"
    optimistic = (
        " AP of few targets is optimistic: the intervals are corrected for that, so they reach "
        "farther down than up."
        if any(score.replicates for score in scores)
        else ""
    )
    detected = detected_categories(scores)
    return [
        "## Detection",
        "Average precision (AP) in the standard definition, in percent: oriented 3D IoU above "
        f"0.15, 0.25 or 0.5, mean over the 11 common categories or {mean}.{optimistic}",
        score_table(scores, with_counts(DETECTION, scores)),
        _worse_than_its_input(scores),
        "Recall is the share of all targets that is found, precision the share of the "
        "predictions that are right; the IoU is that of what is found.",
        score_table(scores, RECALL),
        "The same AP in the definition of the authors' release: its recall divides by the number "
        "of detections, so a missed object costs nothing, and its mean is over those of the "
        f"{total} categories that are detected{f' ({detected})' if detected else ''}, with 0 for "
        "those without targets. Only these may stand next to the paper's.",
        score_table(scores, RELEASED),
        lower_released_note(scores),
    ]


def _worse_than_its_input(scores: Sequence[ScoreFile]) -> str:
    """Return why the authors' settings lose; empty unless they do, on our rooms."""
    rows = [row_named(scores, name) for name in ("released", "estimates")]
    found = [None if row is None else row.metrics.get(AP_15_57.metric) for row in rows]
    values = [None if one is None else one.value for one in found]
    if values[0] is None or values[1] is None or values[0] >= values[1]:
        return ""
    return (
        "Why is `released` worse than its input? It takes the published weights and learning rate "
        "as they are, and keeps whatever comes out: with true relations they improve the boxes, "
        "with wrong ones they do not ([arrange](arrange.md) has the experiment)."
    )


def _plausibility_part(scores: Sequence[ScoreFile]) -> list[str]:
    parts = [
        "## Physical plausibility",
        "The paper's counts, per scene: they forgive 0.1 m, and count no wall for an object that "
        "is entirely outside.",
        score_table(scores, PAPER_COUNTS),
    ]
    truth = truth_row(scores)
    floor = None if truth is None else truth.metrics.get("plausibility.paper_hitting_floor")
    if floor is not None and floor.value:
        parts.append(
            f"Why does the truth hit the floor {floor.value:.2f} times per scene? The paper's test "
            "shrinks boxes, but to no less than 1 cm: a flatter one, such as a carpet, grows, and "
            "reaches through the floor that it lies on."
        )
    true_scores = (
        " True boxes all have the score 1, so all are kept."
        if row_named(scores, "true-boxes")
        else ""
    )
    parts += [
        "What those counts overlook: collisions per pair of objects, what sticks out of the room, "
        "and objects that nothing holds (the distance that they would fall is the mean over all "
        "objects).",
        score_table(scores, PLAUSIBILITY),
        "Who predicts less collides less. Here each method keeps only as many of its best objects "
        "as it needs to find 20, 40 or 60 % of all targets. `-`: the method never finds as many, "
        f"whatever it keeps.{true_scores}",
        score_table(scores, MATCHED_RECALL),
    ]
    return parts


def _meshes_part(scores: Sequence[ScoreFile]) -> list[str]:
    parts: list[str] = []
    missing: list[str] = []
    if _with(scores, "shape.targets"):
        parts += [
            "## Shapes",
            "Meshes against the true ones, each scaled to its box. Chamfer: 1000 times the mean "
            "squared distances, of found objects; all else in percent, a missed object counting "
            "as 0 unless the heading says `found`. `as boxes`: predicted without a mesh, so that "
            "the box stands in; rows of boxes alone say what the shape network is good for.",
            score_table(_with(scores, "shape.targets"), SHAPE),
        ]
    else:
        missing.append("shapes")
    if _with(scores, "penetration.penetrating_pairs"):
        parts += [
            "## Mesh penetration",
            "How far the meshes of objects are in each other; a chair under a table is not. Hulls "
            "stand in for meshes that are not closed, boxes where there is none.",
            score_table(_with(scores, "penetration.penetrating_pairs"), PENETRATION),
        ]
    else:
        missing.append("mesh penetration")
    if missing:
        parts += [
            "## What is not here",
            f"There are no rows of {' and '.join(missing)}: they need meshes"
            f"{', and sampled rooms have boxes only' if are_simulated(scores) else ''}. `panoscene "
            "eval score --shapes` measures them, and `eval report` then shows them here.",
        ]
    return parts


def _with(scores: Sequence[ScoreFile], metric: str) -> list[ScoreFile]:
    return [score for score in scores if metric in score.metrics]
