"""Pages of results: which rows and tables they have, and that they say what is missing."""

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


def test_a_truth_that_is_not_perfect_is_explained() -> None:
    perfect = scores("truth", fidelity__touching_f1=1.0)
    assert "Why" not in results_page([perfect])
    flawed = scores("truth", fidelity__touching_f1=0.997, plausibility__paper_hitting_floor=0.14)
    page = results_page([flawed])
    assert "Why does the truth hit the floor 0.14 times" in part(page, "Physical plausibility")
    assert "Why is the truth not perfect (touching F1 99.7)?" in part(page, "Relations")


def test_categories_of_what_was_given_stand_beside_ours() -> None:
    def with_ap(method: str, ap: float) -> ScoreFile:
        row = {key: Measured(value=ap) for key in ("ap_15", "ap_25", "ap_50", "released_ap_15")}
        row |= {"targets": Measured(value=4.0), "detections": Measured(value=5.0)}
        return scores(method).model_copy(update={"categories": {"laptop": row}})

    table = part(results_page([with_ap("default", 0.5), with_ap("estimates", 0.25)]), "Categories")
    line = "| `laptop` | 4 | 50.0 | 50.0 | 50.0 | 50.0 | 25.0 | 25.0 | 25.0 |"
    assert line in table
    assert "Thin objects fare worst (`laptop` 50.0)" in table
    alone = part(results_page([with_ap("default", 0.5)]), "Categories")
    assert "| `laptop` | 4 | 50.0 | 50.0 | 50.0 | 50.0 |" in alone


def test_the_note_says_how_good_the_simulated_relations_are() -> None:
    rows = [
        scores("estimates", relations__touching_f1=0.867),
        scores("default-weak", relations__touching_f1=0.48),
    ]
    note = summary_note(rows)
    assert "touching F1 is 86.7 %" in note
    assert "network reaches 47 %" in note
    assert "touching F1 48.0 %" in note
    assert "`default-weak`" not in summary_note(rows[:1])
    assert note in results_page(rows)


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


@pytest.mark.parametrize("fov_deg", [0, 361])
def test_a_field_of_view_is_one(fov_deg: int) -> None:
    with pytest.raises(ValueError, match="fov_deg"):
        scores("a", fov_deg)
