"""Writes the measured numbers of benchmarks/*.json into README.md, docs/ and a model card.

    panoscene bench arrange --json > benchmarks/arrange.json
    panoscene experiment arrange --json > benchmarks/experiment.json
    panoscene experiment safety --json > benchmarks/safety.json
    panoscene bench score --json > benchmarks/score.json
    panoscene bench synth --json > benchmarks/synth.json
    panoscene bench stages --json > benchmarks/stages.json
    panoscene bench pipeline --json > benchmarks/pipeline.json
    python benchmarks/layout.py DATA
    python benchmarks/layout.py DATA --split train --output benchmarks/layout-train.json
    python benchmarks/pose.py DATA
    python benchmarks/pose.py DATA --split train --output benchmarks/pose-train.json
    python benchmarks/pose.py DATA --split test-seen test-unseen --records FOLDER \
        --output benchmarks/pose-test.json
    python benchmarks/upright.py FOLDER-OF-A-RENDERED-SET
    python benchmarks/curves.py NAME=RUN_FOLDER ...
    python benchmarks/rolls.py DATA
    python benchmarks/shape_scores.py RECIPE WEIGHTS
    panoscene eval score RUN -o results/more
    python benchmarks/tables.py

With --check it writes nothing and exits 1 when a table is stale.
"""

import json
import re
import sys
from pathlib import Path
from typing import Any

from curve_tables import curves_text
from relation_tables import relation_texts

from panoscene.cli._measure_pipeline import seconds_table
from panoscene.eval import (
    benchmark_table,
    experiment_table,
    safety_table,
    score_benchmark_table,
)
from panoscene.scene import CATEGORIES, MEAN_SIZE
from panoscene.synth.dataset import plan_homes, read_recipe
from panoscene.synth.production import synth_benchmark_table
from panoscene.train._shape_tables import shape_tables

ROOT = Path(__file__).resolve().parent.parent
PAGES = (
    "README.md",
    "docs/arrange.md",
    "docs/context.md",
    "docs/detector.md",
    "docs/eval.md",
    "docs/layout.md",
    "docs/pose.md",
    "docs/reconstruct.md",
    "docs/scene.md",
    "docs/shape.md",
    "docs/synth.md",
    "docs/train.md",
    "docs/upright.md",
    "model_cards/shape-compact.md",
)

POSE_ROWS = {
    "true_room": "true layout",
    "no_crops": "true layout, no crops",
    "no_room": "no layout",
    "floor": "baseline",
}
POSE_FOUND = {
    "found": "network",
    "found_no_crops": "network, no crops",
    "found_floor": "baseline on the same detections",
}


def tables() -> dict[str, str]:
    """Return the text between the markers, by the markers' name."""
    measured = {
        name: json.loads((ROOT / "benchmarks" / f"{name}.json").read_text())
        for name in ("arrange", "experiment", "safety", "score")
    }
    machine = measured["arrange"]["machine"]
    rooms = measured["experiment"]
    scoring = measured["score"]["machine"]
    return {
        "benchmark": benchmark_table(measured["arrange"])
        + f"\n\nMedians on {machine['processor']}, {machine['cores']} cores.",
        "experiment": experiment_table(measured["experiment"])
        + f"\n\n{rooms['scenes']} rooms, {rooms['objects']} objects.",
        "experiment-short": experiment_table(
            {"rows": [row for row in rooms["rows"] if "without" not in row["method"]]}
        ),
        "categories": categories_table(),
        "score": score_benchmark_table(measured["score"])
        + f"\n\nOn {scoring['processor']}, {scoring['cores']} cores.",
        "safety": safety_table(measured["safety"]) + " (`panoscene experiment safety`)",
        **upright_text(),
        **curves_text(),
        **detector_text(),
        **layout_text(),
        **pose_text(),
        **relation_texts(),
        **rolls_text(),
        **shape_tables(_measured("shape_scores")),
        **synth_text(),
        **seconds_text("stages"),
        **seconds_text("pipeline"),
    }


def synth_text() -> dict[str, str]:
    """Return what rendering takes and how long the full set is; nothing before it was measured."""
    file = ROOT / "benchmarks" / "synth.json"
    if not file.is_file():
        return {}
    measured = json.loads(file.read_text())
    machine = measured["machine"]
    recipe = read_recipe(ROOT / "configs" / "synth" / "full.yaml")
    whole = sum(len(home.cameras) for home in plan_homes(recipe))
    hours = measured["panorama_s"] / 3600
    text = (
        f"{measured['measured_panoramas']} panoramas on {machine['processor']}, "
        f"{machine['cores']} cores. At this rate the {whole:,} of `full.yaml` "
        f"take {whole * hours:.1f} hours, and those after the first 400 "
        f"{(whole - 400) * hours:.1f}."
    )
    return {"synth": f"{synth_benchmark_table(measured)}\n\n{text}"}


def seconds_text(name: str) -> dict[str, str]:
    """Return how long stages or the pipeline take; nothing before it was measured."""
    file = ROOT / "benchmarks" / f"{name}.json"
    if not file.is_file():
        return {}
    measured = json.loads(file.read_text())
    machine = measured["machine"]
    text = (
        f"Medians for a panorama of 1024 x 512 with {measured['objects']} objects, on "
        f"{machine['processor']}, {machine['cores']} cores."
    )
    return {name: f"{seconds_table(measured)}\n\n{text}"}


def detector_text() -> dict[str, str]:
    """Return the detector's scores on each part of the set; nothing before all were measured."""
    files = [ROOT / "benchmarks" / f"detector{part}.json" for part in ("-train", "", "-test")]
    if not all(file.is_file() for file in files):
        return {}
    names = ("mask_ap50", "box_ap50", "bfov_recall", "bfov_recall_any")
    lines = [
        "| part | panoramas | mask AP50 | box AP50 | BFoV recall | of any category |",
        "| --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    for file in files:
        measured = json.loads(file.read_text())
        scores = measured["scores"]["circular"]
        cells = [f"{100 * scores[name]:.1f}" for name in names]
        lines.append(f"| {_part(measured)} | {measured['panoramas']} | {' | '.join(cells)} |")
    seams = seams_table(_measured("detector"))
    return {"detector-parts": "\n".join(lines), "detector-seams": seams}


def seams_table(measured: dict[str, Any]) -> str:
    """Return what the detector finds with each way to see the seam."""
    scores = measured["scores"]
    across = int(next(iter(scores.values()))["seam_objects"])
    lines = [
        f"| `seam` | recall of the {across} objects across the seam | mask AP50 | BFoV recall |",
        "| --- | ---: | ---: | ---: |",
    ]
    for seam, found in scores.items():
        cells = [f"{100 * found[name]:.1f}" for name in ("seam_recall", "mask_ap50", "bfov_recall")]
        lines.append(f"| `{seam}` | {' | '.join(cells)} |")
    return "\n".join(lines)


def layout_text() -> dict[str, str]:
    """Return the layout's scores on each part of the set, and how much truth its reading keeps."""
    train, val = (_measured(f"layout{part}") for part in ("-train", ""))
    test = json.loads((ROOT / "results" / "pose.json").read_text())
    lines = [
        "| part | rooms | 2D IoU | 3D IoU | 2D IoU as drawn | 3D IoU as drawn |",
        "| --- " * 6 + "|",
    ]
    for found in (train, val):
        row = found["rows"]["network"]
        lines.append(_layout_row(_part(found), found["panoramas"], [
            row[f"{drawn}iou_{k}d"] for drawn in ("", "raw_") for k in (2, 3)
        ]))  # fmt: skip
    names = [f"layout.{how}.overall.iou_{k}d" for how in ("regularised", "raw") for k in (2, 3)]
    values = [test["metrics"][name]["value"] for name in names]
    homes = _measured("layout-test")
    if homes["panoramas"] != test["scenes"]:
        raise SystemExit("layout-test.json and results/pose.json: are of different panoramas")
    lines.append(_layout_row(_part(homes), test["scenes"], values))
    texts = {"layout-parts": "\n".join(lines)}
    true = val["rows"]["true boundaries"]
    texts["layout-truth"] = (
        f"True boundaries read back give a 3D IoU of {true['iou_3d_4']:.3f} for rooms of four "
        f"corners and {true['iou_3d']:.3f} for all {val['panoramas']} of {val['part']}."
    )
    row = val["rows"]["network"]
    if "worse" in row:
        rooms = val["panoramas"]
        texts["layout-worse"] = (
            f"On {val['part']} it is worse in {round(row['worse'] * rooms)} of {rooms} rooms, by "
            f"at most {row['most_worse']:.3f}"
        )
    row, rooms = homes["rows"]["network"], homes["panoramas"]
    if "layout-worse" in texts:
        texts["layout-worse"] += (
            f", on the test homes in {round(row['worse'] * rooms)} of {rooms}, by at most "
            f"{row['most_worse']:.3f}."
        )
    texts["layout-ambiguous"] = (
        f"It is set for {round(row['ambiguous'] * rooms)} of the {rooms} rooms of the test homes, "
        f"whose 3D IoU is {row['iou_3d_ambiguous']:.2f} on average, and {row['iou_3d_clear']:.2f} "
        "without it."
    )
    return texts


def _part(measured: dict[str, Any]) -> str:
    """Return which part of which homes was measured."""
    part = measured.get("split") or measured["part"]
    return f"{part}, homes of version {measured.get('homes_version', 1)}"


def _layout_row(part: str, rooms: int, values: list[float]) -> str:
    return f"| {part} | {rooms} | {' | '.join(f'{value:.3f}' for value in values)} |"


def pose_text() -> dict[str, str]:
    """Return the pose network's scores on each part of the set, and on what the networks find."""
    parts = [_measured(f"pose{part}") for part in ("-train", "", "-test")]
    tied = ("ap_15", "ap_25", "ap_50")
    head = "| part | objects | input | tied AP@0.15 | tied AP@0.25 | tied AP@0.5 | AP@0.15 |"
    lines = [f"{head} AP@0.25 | AP@0.5 | front for back |", "| --- " * 10 + "|"]
    for found in parts:
        for name, words in POSE_ROWS.items():
            row = found["rows"][name]
            turned = f"{row['front_back']:.1%}".replace("%", " %")
            lines.append(
                f"| {_part(found)} | {found['objects']} | {words} |"
                f" {' | '.join(f'{row[key]:.3f}' for key in tied)} | {_ranked(row)} | {turned} |"
            )
    rows = parts[2]["rows"]
    columns = ("AP@0.15", "AP@0.25", "AP@0.5", "centre", "distance", "size", "yaw")
    found = [f"| input | {' | '.join((*columns, 'front for back'))} |", "| --- " * 9 + "|"]
    found += [
        f"| {words} | {_ranked(rows[name])} | {' | '.join(_pose_errors(rows[name]))} |"
        for name, words in POSE_FOUND.items()
        if "yaw_error_deg" in rows.get(name, {})
    ]
    return {"pose-parts": "\n".join(lines), "pose-found": "\n".join(found)}


def _pose_errors(row: dict[str, float]) -> list[str]:
    return [
        f"{row['centre_error_m']:.2f} m",
        f"{row['distance_error_m']:.2f} m",
        f"{100 * row['size_error']:.0f} %",
        f"{row['yaw_error_deg']:.0f}°",
        f"{100 * row['front_back']:.0f} %",
    ]


def _ranked(row: dict[str, float]) -> str:
    return " | ".join(f"{row[f'ranked_ap_{percent}']:.3f}" for percent in (15, 25, 50))


def rolls_text() -> dict[str, str]:
    """Return how much of what is found turns with the panorama, for detector and layout."""
    measured = _measured("rolls")
    count = measured["panoramas"]
    shares = list(measured["angles"][0]["found_again"])
    detector = [f"| rolled by | of its picture | {' | '.join(f'above {o}' for o in shares)} |"]
    layout = ["| rolled by | of its picture | mean 3D IoU | least | as many corners |"]
    detector.append("| --- " * (2 + len(shares)) + "|")
    layout.append("| --- " * 5 + "|")
    for row in measured["angles"]:
        places = {
            name: f"| {row['angle_deg']:.1f}° | {pixels:g} pixels{_whole(row, name)}"
            for name, pixels in row["pixels"].items()
        }
        sure = row["sure_detections"]
        again = (f"{n} of {sure} ({100 * n / sure:.0f} %)" for n in row["found_again"].values())
        detector.append(f"{places['detector']} | {' | '.join(again)} |")
        layout.append(
            f"{places['layout']} | {row['layout_iou_3d']:.3f} | {row['layout_iou_3d_least']:.3f}"
            f" | {row['layout_same_corners']} of {count} |"
        )
    where = f"\n\n{count} panoramas of {_part(measured)} (`python benchmarks/rolls.py DATA`)."
    return {
        "detector-rolls": "\n".join(detector) + where,
        "layout-rolls": "\n".join(layout) + where,
    }


def _whole(row: dict[str, Any], name: str) -> str:
    return ", whole strides" if row["whole_strides"][name] else ""


def _measured(name: str) -> dict[str, Any]:
    return json.loads((ROOT / "benchmarks" / f"{name}.json").read_text())


def upright_text() -> dict[str, str]:
    """Return how exactly photos are made upright; nothing before it was measured."""
    path = ROOT / "benchmarks" / "upright.json"
    return {"upright": upright_table(json.loads(path.read_text()))} if path.is_file() else {}


def upright_table(measured: dict[str, Any]) -> str:
    """Return how exactly tilted panoramas are made upright."""
    head = "| part | panoramas | median | 90 % | worst | more than "
    lines = [head + f"{measured['failed_from_deg']:g} degrees |", "| --- " * 6 + "|"]
    for split, kinds in measured["splits"].items():
        for kind in ("rendered", "turned", "disturbed"):
            some = kinds[kind]["all"]
            lines.append(
                f"| {split}, {kind} | {some['count']} | {some['median_deg']:.2f} |"
                f" {some['p90_deg']:.2f} | {some['worst_deg']:.2f} | {some['failed_share']:.0%} |"
            )
    lines += ["", "| tilt of train, turned | panoramas | median | 90 % | worst |"]
    lines.append("| --- " * 5 + "|")
    for tilts, some in measured["splits"]["train"]["turned"]["by_tilt_deg"].items():
        lines.append(
            f"| {tilts} | {some['count']} | {some['median_deg']:.2f} | {some['p90_deg']:.2f} |"
            f" {some['worst_deg']:.2f} |"
        )
    machine = measured["machine"]
    seconds = measured["splits"]["train"]["median_cpu_s"]
    lines += ["", f"{seconds:.2f} s of processor time for 1024 x 512 pixels (median; one thread on"]
    lines.append(f"{machine['processor']}).")
    return "\n".join(lines)


def categories_table() -> str:
    """Return the names of the categories and their mean sizes, three to a line."""
    cells = [
        f"`{name}` {' x '.join(f'{extent:.2f}' for extent in size)}"
        for name, size in zip(CATEGORIES, MEAN_SIZE.tolist(), strict=True)
    ]
    rows = [cells[first : first + 3] for first in range(0, len(cells), 3)]
    head = "| category, mean width x depth x height in metres | | |\n| --- | --- | --- |\n"
    return head + "\n".join("| " + " | ".join(row) + " |" for row in rows)


def main() -> int:
    """Update or check the pages."""
    check = "--check" in sys.argv
    stale = []
    for page in PAGES:
        path = ROOT / page
        text = old = path.read_text()
        for name, table in tables().items():
            pattern = rf"(<!-- {name}:begin -->).*?(<!-- {name}:end -->)"
            text = re.sub(pattern, lambda m, t=table: f"{m[1]}\n{t}\n{m[2]}", text, flags=re.DOTALL)
        if text != old:
            stale.append(page)
            if not check:
                path.write_text(text)
    if stale:
        print(("stale: " if check else "updated: ") + ", ".join(stale))
    return int(check and bool(stale))


if __name__ == "__main__":
    sys.exit(main())
