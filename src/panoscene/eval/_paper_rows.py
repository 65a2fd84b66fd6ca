"""The paper's numbers as rows that stand beside ours."""

from collections.abc import Sequence

from panoscene.eval._fov import FOV_DEG
from panoscene.eval._published import (
    PAPER_ABLATION,
    PAPER_COLLISIONS,
    PAPER_FOV_MAP_57,
    PAPER_MAP_57,
    PAPER_MAP_COMMON,
    PAPER_METHODS,
    PAPER_SEMANTIC_IOU,
    PAPER_SEMANTIC_MIOU,
)
from panoscene.eval._score_tables import Column, markdown_table
from panoscene.scene import PANOCONTEXT_12


def paper_relations_row(columns: Sequence[Column]) -> list[str]:
    """Return the cells of the paper's relation network; `-` where the paper has no number."""
    full = PAPER_ABLATION["Full"]
    printed = {
        "relations.touching_f1": full.touching_f1,
        "relations.touching_wall_f1": full.touching_wall_f1,
        "relations.relative_yaw_bin_error_deg": full.relative_yaw_deg,
        "relations.relative_yaw_wall_bin_error_deg": full.relative_yaw_wall_deg,
    }
    cells = [_cell(printed.get(column.metric), column) for column in columns]
    return ["Ours Full", "paper", *cells]


def paper_semantic_rows(columns: Sequence[Column]) -> list[list[str]]:
    """Return the cells of the paper's semantic segmentation of photos.

    The mean of objects is that of the printed labels; the mean of all is the printed one.
    """
    rows: list[list[str]] = []
    for method, ious in PAPER_SEMANTIC_IOU.items():
        objects = [ious[label] for label in PANOCONTEXT_12 if label != "background"]
        printed = {f"semantic.{label}": value / 100 for label, value in ious.items()}
        printed["semantic.mean"] = PAPER_SEMANTIC_MIOU[method] / 100
        printed["semantic.mean_objects"] = sum(objects) / len(objects) / 100
        rows.append([method, "paper", *(_cell(printed.get(c.metric), c) for c in columns)])
    return rows


def paper_fov_table() -> str:
    """Return the paper's experiment on the field of view."""
    rows = [
        [method, *(f"{value:.1f}" for value in PAPER_FOV_MAP_57[method])]
        for method in ("Ours w/o RO", "Ours Full")
    ]
    return markdown_table(["method", *(f"{fov}°" for fov in FOV_DEG)], rows)


def paper_counts_table() -> str:
    """Return the paper's detection and physical violation."""
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


def _cell(value: float | None, column: Column) -> str:
    if value is None:
        return "-"
    return f"{column.factor * value:.{1 if column.factor >= 100 else 2}f}"
