"""Pages of results: which rows and tables they have, and that they say what is missing."""

import json
import re
from pathlib import Path

import pytest

from panoscene.cli import main
from panoscene.eval import Measured, ScoreFile, results_page, summary_note, summary_table
from panoscene.eval import write_scores as write
from panoscene.eval._paper_rows import paper_relations_row, paper_semantic_rows
from panoscene.eval._report import whole_rooms
from panoscene.eval._score_tables import MATCHED_RELATIONS, SEMANTIC


def scores(method: str, fov_deg: int = 360, **metrics: float) -> ScoreFile:
    values = {
        "detection.ap_15_mean_57": 0.5,
        "plausibility.paper_hitting_floor": 0.0,
        "layout.regularised.overall.scenes": 2.0,
        "layout.regularised.overall.degenerate": 0.0,
    } | {name.replace("__", "."): value for name, value in metrics.items()}
    return ScoreFile(
        panoscene="0",
        method=method,
        kind="ours",
        description=f"about {method}",
        fov_deg=fov_deg,
        data="two rooms",
        scenes=2,
        objects=3,
        missing=0,
        targets_hash="0" * 16,
        predictions_hash="1" * 16,
        replicates=10,
        seed=0,
        metrics={name: Measured(value=value) for name, value in values.items()},
        categories={},
    )


def simulated(method: str, **metrics: float) -> ScoreFile:
    """Return a row as of our own export: on sampled rooms, the input under its own name."""
    kind = {"estimates": "input", "truth": "oracle"}.get(method, "ours")
    return scores(method, 360, **metrics).model_copy(
        update={"data": "sampled rooms, seed 7", "kind": kind}
    )


def true(score: ScoreFile) -> ScoreFile:
    return score.model_copy(update={"predictions_hash": score.targets_hash})


def with_ap(score: ScoreFile, ap: float, **targets: float) -> ScoreFile:
    """Return scores whose every category has the same AP, and 5 detections."""
    row = {key: Measured(value=ap) for key in ("ap_15", "ap_25", "ap_50", "released_ap_15")}
    rows = {
        name: row | {"targets": Measured(value=count), "detections": Measured(value=5.0)}
        for name, count in targets.items()
    }
    return score.model_copy(update={"categories": rows})


def part(page: str, heading: str) -> str:
    return page.split(f"\n## {heading}\n")[1].split("\n## ", maxsplit=1)[0]


def test_a_name_that_ends_in_a_number_is_no_split() -> None:
    net = scores("net-30")
    assert whole_rooms([net]) == [net]
    assert "`net-30`" in summary_table([net])
    page = results_page([scores("default"), net])
    for heading in ("Summary", "Detection", "Physical plausibility", "Semantic segmentation"):
        assert "`net-30`" in part(page, heading)
    assert "## Field of view" not in page


def test_splits_have_a_table_of_their_own() -> None:
    rows = [scores("default"), scores("quarters", 90), scores("thirds", 120)]
    assert whole_rooms(rows) == rows[:1]
    page = results_page(rows)
    assert "`quarters`" not in part(page, "Detection")
    table = part(page, "Field of view")
    assert "- | - | - |" in table
    assert table.index("| `default` | 360° |") < table.index("| `thirds` | 120° |")
    assert table.index("| `thirds` | 120° |") < table.index("| `quarters` | 90° |")


def test_splits_alone_are_rows_like_any_other() -> None:
    rows = [scores("a", 90), scores("b", 30)]
    assert whole_rooms(rows) == rows
    page = results_page(rows)
    assert "`a`" in part(page, "Detection")
    assert part(page, "Field of view").count("| `a` |") == 1


def test_the_report_of_one_method_with_any_name(tmp_path: Path) -> None:
    write(scores("net-30"), tmp_path / "net-30.json")
    assert main(["eval", "report", str(tmp_path), "-o", str(tmp_path / "page.md")]) == 0
    assert "`net-30`" in (tmp_path / "page.md").read_text()


TIMINGS = {
    "objects": 20,
    "detector_s": 0.25,
    "layout_s": 0.5,
    "context_s": 0.125,
    "shape_s": 1.0,
    "total_s": 2.0,
    "cold_start_s": 8.0,
    "peak_rss_mib": 1234.5,
    "machine": {"processor": "abacus", "cores": 2},
}


def test_seconds_stand_beside_the_papers(tmp_path: Path) -> None:
    page = part(results_page([scores("a")], TIMINGS), "Time")
    assert "| detector, layout, boxes and relations | 0.88 | 0.72 |" in page
    assert "| shapes, as meshes | 1.00 | 5.92 |" in page
    assert "| everything, weights loaded | 2.00 | 11.38 |" in page
    assert "arrangement" not in page
    assert "1234 MiB" in page
    assert "abacus" in page
    assert "## Time" not in results_page([scores("a")])
    (tmp_path / "scores").mkdir()
    write(scores("a"), tmp_path / "scores" / "a.json")
    command = ["eval", "report", str(tmp_path / "scores"), "-o", str(tmp_path / "page.md")]
    file = tmp_path / "seconds.json"
    for text in ("{}", "[1]", "{"):
        file.write_text(text)
        assert main([*command, "--timings", str(file)]) == 2
    assert not (tmp_path / "page.md").exists()
    file.write_text(json.dumps(TIMINGS))
    assert main([*command, "--timings", str(file)]) == 0
    assert "## Time" in (tmp_path / "page.md").read_text()


def test_the_seconds_of_all_parts_are_the_whole(root: Path) -> None:
    measured = json.loads((root / "benchmarks" / "pipeline.json").read_text())
    page = part(results_page([scores("a")], measured), "Time")
    told = [float(row.split("|")[2]) for row in page.splitlines() if re.match(r"\| .*\d", row)]
    *parts, whole, command = told
    assert (whole, command) == pytest.approx(
        (measured["total_s"], measured["cold_start_s"]), abs=0.01
    )
    # medians of each do not add up exactly
    assert sum(parts) == pytest.approx(whole, rel=0.15)


def test_meshes_have_tables_when_they_were_measured_and_a_sentence_when_not() -> None:
    page = results_page([scores("a")])
    assert "no rows of shapes and mesh penetration" in part(page, "What is not here")
    assert "\n## Shapes" not in page
    measured = scores("a", shape__targets=7.0, shape__canonical_with_misses__f_score=0.25)
    page = results_page([measured])
    assert "| `a` | ours | 7 |" in part(page, "Shapes")
    assert "| 25.0 |" in part(page, "Shapes")
    assert "no rows of mesh penetration" in part(page, "What is not here")
    both = scores("a", shape__targets=7.0, penetration__penetrating_pairs=0.5)
    page = results_page([both])
    assert "| `a` | ours | 0.50 |" in part(page, "Mesh penetration")
    assert "What is not here" not in page


def test_recall_that_is_not_reached_is_explained() -> None:
    reached = scores("a", plausibility_at_recall_20__collision_rate=0.002)
    plausible = part(results_page([reached]), "Physical plausibility")
    assert "| `a` | ours | 2.0 | - | - | - | - | - |" in plausible
    assert "`-`: the method never finds as many" in plausible


def test_methods_with_the_same_layout_share_a_row() -> None:
    rows = [scores("a"), scores("b"), scores("c", layout__regularised__overall__iou_2d=0.5)]
    table = part(results_page(rows), "Layout")
    assert "| `a`, `b` | regularised |" in table
    assert "| `c` | regularised |" in table


def test_a_truth_that_is_not_perfect_is_explained_whatever_its_name() -> None:
    perfect = true(scores("truth", fidelity__touching_f1=1.0))
    assert "Why" not in results_page([perfect])
    short = {"fidelity__touching_f1": 0.997, "plausibility__paper_hitting_floor": 0.14}
    page = results_page([true(scores("perfect", 360, **short))])
    assert "Why does the truth hit the floor 0.14 times" in part(page, "Physical plausibility")
    assert "Why is the truth not perfect (touching F1 99.7)?" in part(page, "Relations")
    assert "piano" not in page
    assert "piano" in results_page([simulated("estimates"), true(simulated("truth", **short))])
    assert "Why" not in results_page([scores("truth", 360, **short)])


def test_categories_of_what_was_given_stand_beside_ours() -> None:
    ours, given = (with_ap(simulated(m), ap, laptop=4) for m, ap in
                   (("default", 0.5), ("estimates", 0.25)))  # fmt: skip
    table = part(results_page([given, ours]), "Categories")
    assert "AP in percent of `default` and of `estimates`, that it starts from." in table
    line = "| `laptop` | 4 | 50.0 | 50.0 | 50.0 | 50.0 | 25.0 | 25.0 | 25.0 |"
    assert line in table
    assert "Thin objects fare worst (`laptop` 50.0)" in table
    alone = part(results_page([ours]), "Categories")
    assert "| `laptop` | 4 | 50.0 | 50.0 | 50.0 | 50.0 |" in alone


def test_the_note_says_how_good_the_simulated_relations_are() -> None:
    rows = [
        simulated("estimates", relations__touching_f1=0.867),
        simulated("default-weak", relations__touching_f1=0.48),
    ]
    note = summary_note(rows)
    assert "touching F1 is 86.7 %" in note
    assert "network reaches 47 %" in note
    assert "touching F1 48.0 %" in note
    assert "`default-weak`" not in summary_note(rows[:1])
    assert note in results_page(rows)


def test_anybodys_page_says_nothing_of_our_rooms() -> None:
    """Methods and targets of somebody else, scored without intervals."""
    net = with_ap(scores("net", detection__released_ap_15_mean_57=0.4), 0.5, laptop=4, sofa=2)
    rows = [net, scores("net-quarters", 90)]
    rows = [row.model_copy(update={"kind": "prediction", "replicates": 0}) for row in rows]
    page = results_page(rows)
    foreign = ("sampler", "sampled rooms", "no networks", "simulate", "eval export", "docs/")
    foreign += ("Thin objects", "95 %", "0 bootstrap", "Repairing", "True boxes", "`estimates`")
    assert {words for words in foreign if words in page} == set()
    assert summary_note(rows) == ""
    assert "There are no intervals" in page
    assert "intervals are corrected" not in page
    splits = part(page, "Field of view")
    assert splits.index("| `net` | 360° |") < splits.index("| `net-quarters` | 90° |")
    assert "AP in percent of `net`." in part(page, "Categories")
    assert "| `sofa` | 2 | 50.0 | 50.0 | 50.0 | 50.0 |" in part(page, "Categories")
    ours = simulated("estimates")
    assert "`estimates` simulates what networks say" in results_page([ours])
    beside = rows[0].model_copy(update={"data": ours.data})
    page = results_page([ours, beside])
    assert "no networks yet" not in page
    assert "`estimates` simulates networks" in page
    assert "10 bootstrap resamples of the scenes (none for `net`)" in page


def test_a_split_stands_below_the_method_that_it_is_of() -> None:
    rows = [scores("net"), scores("other"), scores("net-quarters", 90)]
    table = part(results_page(rows), "Field of view")
    assert "| `net` | 360° |" in table
    assert "`other`" not in table
    both = part(results_page([*rows[:2], scores("quarters", 90)]), "Field of view")
    assert "| `net` | 360° |" in both
    assert "| `other` | 360° |" in both


def test_headings_say_how_many_categories_have_targets() -> None:
    score = with_ap(simulated("estimates", detection__released_ap_15_mean_57=0.3), 0.5,
                    sofa=2, bed=9, chair=40, cushion=0)  # fmt: skip
    page = results_page([score])
    detection = part(page, "Detection")
    assert "AP 15, 57 cat. (3 with targets)" in part(page, "Summary")
    assert "| AP 50, 57 cat. (3 with targets) |" in detection
    assert "all 57 but the 54 without targets." in detection
    assert "| released AP 15, 57 cat. |" in detection
    assert "57 categories that are detected (4 here)" in detection
    why = "1 of 3 categories have more detections than targets (1 of the 2 with fewer than 10"
    assert why in detection
    assert "1 without targets are detected and count 0." in detection
    assert "Why" not in results_page([with_ap(scores("a"), 0.5, sofa=2)])


def test_only_settings_that_lose_are_explained() -> None:
    worse = [simulated("estimates"), simulated("released", detection__ap_15_mean_57=0.4)]
    assert "Why is `released` worse" in part(results_page(worse), "Detection")
    better = [simulated("estimates"), simulated("released", detection__ap_15_mean_57=0.6)]
    assert "Why is `released` worse" not in results_page(better)


def test_layouts_by_corners_have_a_table_and_missing_readings_a_reason() -> None:
    start = "layout__raw__overall__scenes"
    groups = {f"layout__regularised__6__{name}": value for name, value in
              (("scenes", 3.0), ("iou_3d", 0.5), ("corner_error", 1.25))}  # fmt: skip
    rows = [scores("a", 360, **{start: 2.0}, **groups), scores("b")]
    layout = part(results_page(rows), "Layout")
    assert "| regularised | 6 | 3 | 50.0 | - | 1.25 | - |" in layout
    assert "The layout of `a` by the number of corners" in layout
    assert "`b` have no `raw` row" in layout
    assert "no `raw` row" not in part(results_page(rows[1:]), "Layout")


def test_intervals_of_relations_are_shown() -> None:
    wide = {"relations.under_ceiling_f1": Measured(value=0.485, low=0.408, high=0.553)}
    score = scores("a")
    score = score.model_copy(update={"metrics": score.metrics | wide})
    assert "| 48.5 [40.8, 55.3] |" in part(results_page([score]), "Relations")


def test_the_papers_rows_are_what_it_prints() -> None:
    row = paper_relations_row(MATCHED_RELATIONS)
    cells = dict(zip((column.heading for column in MATCHED_RELATIONS), row[2:], strict=True))
    shown = {name: cell for name, cell in cells.items() if cell != "-"}
    assert shown == {
        "touching F1": "47.0", "wall F1": "76.0", "yaw error, °": "62.97", "to walls, °": "43.72",
    }  # fmt: skip
    (_, ours) = paper_semantic_rows(SEMANTIC)
    assert ours[:3] == ["Ours Full", "paper", "50.7"]
    assert len(ours) == 2 + len(SEMANTIC) == 16
    assert "-" not in ours


def test_what_disagrees_in_the_paper_has_a_note() -> None:
    page = results_page([scores("net"), scores("net-quarters", 90)])
    fov = part(page, "Field of view")
    assert "| Ours Full | 33.92 |" in fov
    assert "33.92 in this table of the paper and 33.59 in its other tables" in fov
    assert "lists 42 categories, and the mean over those is the 33.59" in page
    printed = "The paper prints a mean of 31.4 for `PanoContext`, though its row averages 34.6."
    assert printed in part(page, "Semantic segmentation")
    assert page.count("though its row averages") == 1


@pytest.mark.parametrize("fov_deg", [0, 361])
def test_a_field_of_view_is_one(fov_deg: int) -> None:
    with pytest.raises(ValueError, match="fov_deg"):
        scores("a", fov_deg)


def rendered(method: str, **metrics: float) -> ScoreFile:
    return scores(method, 360, **metrics).model_copy(
        update={"data": "rendered homes of version 1, test-seen and test-unseen"}
    )


def test_the_page_says_where_relations_are_better_than_the_rule_and_where_not() -> None:
    wall, floor = "relations__touching_wall_f1", "relations__on_floor_f1"
    rule = rendered("pose", **{wall: 0.876, floor: 0.9})
    page = results_page([rendered("full", **{wall: 0.866, floor: 0.95}), rule])
    assert "`full` is ahead in floor, not in wall (86.6 to 87.6)." in page
    assert "against the rule" not in results_page([scores("full"), scores("pose")])
    difference = {"relations.touching_wall_f1": Measured(value=-0.01, low=-0.02, high=0.004)}
    full = rendered("full", **{wall: 0.866, floor: 0.95})
    full = full.model_copy(update={"differences": {"pose": difference}})
    assert "not in wall (86.6 to 87.6, difference -1.0 [-2.0, 0.4])." in results_page([full, rule])
    unsure = {"relations.on_floor_f1": Measured(value=0.05, low=-0.01, high=0.11)}
    full = full.model_copy(update={"differences": {"pose": unsure | difference}})
    words = "`full` is ahead by no more than chance may bring: floor (5.0 [-1.0, 11.0])"
    assert words in results_page([full, rule])


def test_parts_of_the_set_have_rows_of_their_own() -> None:
    seen = {"detection.ap_15_mean_57": Measured(value=0.314)}
    unseen = {"detection.ap_15_mean_57": Measured(value=0.185)}
    full = rendered("full").model_copy(update={"parts": {"test-unseen": unseen, "test-seen": seen}})
    page = results_page([full, rendered("pose")])
    rows = [line for line in page.splitlines() if line.startswith("| `full` | `test-")]
    assert [row.split("|")[2:4] for row in rows] == [
        [" `test-seen` ", " 31.4 "],
        [" `test-unseen` ", " 18.5 "],
    ]
    assert "## Parts of the set" not in results_page([rendered("pose")])


def test_differences_have_a_table_that_says_which_are_decided() -> None:
    heading = "What the parts bring"
    sure = Measured(value=-1.94, low=-2.3, high=-1.6)
    open_ = Measured(value=0.004, low=-0.01, high=0.02)
    metrics = {"plausibility.paper_colliding_pairs": sure, "detection.ap_15_mean_57": open_}
    few = rendered("full").model_copy(update={"differences": {"pose": metrics}})
    assert "neither above nor below it" in part(results_page([few, rendered("pose")]), heading)
    full = few.model_copy(update={"scenes": 110, "replicates": 1000})
    text = part(results_page([full, rendered("pose")]), heading)
    assert "| `full` | `pose` | +0.4 [-1.0, 2.0] | **-1.94 [-2.30, -1.60]** |" in text
    assert "`full` against `pose`: below it in colliding pairs." in text
    assert "What the parts bring" not in results_page([rendered("full"), rendered("pose")])
