"""Tables of how scores rose in trainings, from benchmarks/curves.json."""

import json
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent


def curves_text() -> dict[str, str]:
    """Return how scores rose in trainings; nothing before they were read."""
    file = ROOT / "benchmarks" / "curves.json"
    if not file.is_file():
        return {}
    runs = json.loads(file.read_text())
    of_sizes = {name: run for name, run in runs.items() if _is_of_sizes(name, run)}
    of_models = {name: run for name, run in runs.items() if name == f"shape-{run.get('models')}"}
    others = {k: run for k, run in runs.items() if k not in of_sizes and k not in of_models}
    texts = {
        "curves": curves_table(others),
        "curves-panoramas": panoramas_table(of_sizes),
        "curves-models": models_table(of_models),
    }
    if "detector" in runs:
        texts["curve-detector"] = detector_curve(runs["detector"])
    return texts


def curves_table(runs: dict[str, Any]) -> str:
    """Return the score of each training's validations, what it is, and what was learned from."""
    head = "| training | panoramas | samples a step | score after steps | score |"
    lines = [head, "| --- | ---: | ---: | --- | --- |"]
    for name, run in runs.items():
        best = max(point["selection"] for point in run["points"])
        scores = ", ".join(_point(point, point["selection"] == best) for point in run["points"])
        first = ", from weights" if run["started"] else ""
        lines.append(
            f"| {name}{first} | {run['panoramas']} | {run['batch_size']} | {scores} |"
            f" {run['selection']} |"
        )
    return "\n".join(lines)


def panoramas_table(runs: dict[str, Any]) -> str:
    """Return what the same training reaches with so many panoramas, a row for each stage."""
    stages: dict[str, dict[int, dict[str, Any]]] = {}
    for run in runs.values():
        stages.setdefault(run["stage"], {})[run["panoramas"]] = run
    counts = sorted({count for row in stages.values() for count in row})
    head = ["network", "homes of version", "steps", *(f"{n} panoramas" for n in counts), "score"]
    lines = [f"| {' | '.join(head)} |", "| --- " * len(head) + "|"]
    for stage, row in stages.items():
        run = next(iter(row.values()))
        best = [
            f"{max(point['selection'] for point in row[n]['points']):.3f}" if n in row else "-"
            for n in counts
        ]
        cells = [stage, str(run.get("homes_version", 1)), str(run["steps"]), *best]
        lines.append(f"| {' | '.join(cells)} | {run['selection']} |")
    return "\n".join(lines)


def models_table(runs: dict[str, Any]) -> str:
    """Return what the same training of shapes reaches with so many models."""
    lines = [
        "| models | steps | objects of validation panoramas | pictures of unseen models | mean |",
        "| ---: | ---: | ---: | ---: | ---: |",
    ]
    for run in sorted(runs.values(), key=lambda run: run["models"]):
        best = max(run["points"], key=lambda point: point["selection"])
        scores = [f"{best[name]:.3f}" for name in ("crops_iou", "unseen_iou", "selection")]
        lines.append(f"| {run['models']} | {run['steps']} | {' | '.join(scores)} |")
    return "\n".join(lines)


def _is_of_sizes(name: str, run: dict[str, Any]) -> bool:
    """Return whether a training is one of several with different numbers of panoramas."""
    return name == f"{run['stage']}-{run['panoramas']}"


def _point(point: dict[str, Any], best: bool) -> str:
    text = f"{point['step']}: {point['selection']:.3f}"
    return f"**{text}**" if best else text


def detector_curve(run: dict[str, Any]) -> str:
    """Return the detector's scores after so many steps, in percent."""
    lines = ["| steps | mask AP50 | box AP50 | BFoV recall | of any category |", "| --- " * 5 + "|"]
    for point in run["points"]:
        precision = " | ".join(f"{100 * point[name]:.1f}" for name in ("mask_ap50", "box_ap50"))
        recall = " | ".join(f"{point[name]:.0%}" for name in ("bfov_recall", "bfov_recall_any"))
        lines.append(f"| {point['step']} | {precision} | {recall} |".replace("%", ""))
    return "\n".join(lines)
