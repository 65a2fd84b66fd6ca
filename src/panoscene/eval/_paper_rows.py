"""The paper's numbers as rows that stand beside ours."""

from collections.abc import Sequence

from panoscene.eval._fov import FOV_DEG
from panoscene.eval._published import (
    PAPER_ABLATION,
    PAPER_AP_FULL,
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

_ROUNDING = 0.05
"""By which the mean of printed numbers may differ from the printed mean, per cent."""


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
        [method, *(f"{value:.2f}" for value in PAPER_FOV_MAP_57[method])]
        for method in ("Ours w/o RO", "Ours Full")
    ]
    return markdown_table(["method", *(f"{fov}°" for fov in FOV_DEG)], rows)


def paper_fov_note() -> str:
    """Return why a method has two numbers in the paper, both as printed."""
    here, there = PAPER_FOV_MAP_57["Ours Full"][0], PAPER_MAP_57["Ours Full"]
    return (
        f"`Ours Full` at {FOV_DEG[0]}° is {here:.2f} in this table of the paper and {there:.2f} in "
        "its other tables; both are as printed."
    )


def paper_57_note() -> str:
    """Return what the paper's 57 categories are."""
    mean = sum(PAPER_AP_FULL.values()) / len(PAPER_AP_FULL)
    return (
        f"'57' stands in quotes because the paper's supplement lists {len(PAPER_AP_FULL)} "
        f"categories, and the mean over those is the {mean:.2f} of `Ours Full`."
    )


def paper_semantic_note() -> str:
    """Return which printed means are not those of their rows; empty if all are."""
    parts: list[str] = []
    for method, ious in PAPER_SEMANTIC_IOU.items():
        mean, printed = sum(ious.values()) / len(ious), PAPER_SEMANTIC_MIOU[method]
        if abs(mean - printed) > _ROUNDING:
            parts.append(
                f"The paper prints a mean of {printed:.1f} for `{method}`, though its row averages "
                f"{mean:.1f}."
            )
    return " ".join(parts)


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
