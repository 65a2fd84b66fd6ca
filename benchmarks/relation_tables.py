"""Tables of finished scenes against a rule of geometry, on the test homes and on more homes."""

from pathlib import Path

from panoscene.eval import Measured, ScoreFile, read_scores

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = {"test homes": "results", "more homes": "results/more"}
KINDS = {
    "all": "all",
    "touching": "touching",
    "touching_wall": "touching a wall",
    "on_floor": "on the floor",
    "under_ceiling": "under the ceiling",
    "inside_room": "inside the room",
}
YAWS = {
    "relations.relative_yaw_error_deg": "yaw between objects, mean error in degrees",
    "relations.relative_yaw_wall_error_deg": "yaw to walls, mean error in degrees",
}
BOXES = {
    "detection.ap_15_mean_57": ("AP 15, %", 100),
    "detection.ap_25_mean_57": ("AP 25, %", 100),
    "detection.ap_50_mean_57": ("AP 50, %", 100),
    "plausibility.paper_colliding_pairs": ("colliding pairs a scene", 1),
    "plausibility.out_of_room_volume": ("outside the room, m³ a scene", 1),
}


def relation_texts() -> dict[str, str]:
    """Return both tables, by the markers' name."""
    return {"relations-rule": rule_table(), "relations-boxes": boxes_table()}


def rule_table() -> str:
    """Return the F1 of the rule on the pose network's boxes, and what finished scenes gain."""
    head = "| homes | relation, F1 in percent |"
    for part in ("end to end", "between matched objects"):
        head += f" rule, {part} | finished scene | gain |"
    lines = [head, "| --- | --- |" + " ---: |" * 6]
    for homes in FOLDERS:
        full, rule = _score(homes, "full"), _score(homes, "pose")
        for kind, words in KINDS.items():
            row = [f"{homes}, {full.scenes} panoramas", words]
            for ending in ("_end_to_end", ""):
                name = f"relations.{kind}_f1{ending}"
                row += [_value(score.metrics[name]) for score in (rule, full)]
                row.append(_gain(full.differences["pose"][name]))
            lines.append(f"| {' | '.join(row)} |")
        for name, words in YAWS.items():
            row = [f"{homes}, {full.scenes} panoramas", words, *"---"]
            row += [_value(score.metrics[name], 1) for score in (rule, full)]
            row.append(_gain(full.differences["pose"][name], 1))
            lines.append(f"| {' | '.join(row)} |")
    return "\n".join(lines)


def boxes_table() -> str:
    """Return what the arrangement makes of the refined boxes, and of the pose network's."""
    lines = [
        "| homes | | not arranged | arranged | difference | pose network's boxes, arranged |",
        "| --- | --- |" + " ---: |" * 4,
    ]
    for homes in FOLDERS:
        full, before = _score(homes, "full"), _score(homes, "without-arrangement")
        alone = _score(homes, "pose-arranged")
        for name, (words, factor) in BOXES.items():
            values = [_value(score.metrics[name], factor) for score in (before, full)]
            gain = _gain(full.differences["without-arrangement"][name], factor)
            row = [f"{homes}, {full.scenes} panoramas", words, *values, gain]
            row.append(_value(alone.metrics[name], factor))
            lines.append(f"| {' | '.join(row)} |")
    return "\n".join(lines)


def _score(homes: str, method: str) -> ScoreFile:
    return read_scores(ROOT / FOLDERS[homes] / f"{method}.json")


def _value(measured: Measured, factor: int = 100) -> str:
    if measured.value is None:
        return "-"
    return f"{factor * measured.value:.{1 if factor > 1 else 2}f}"


def _gain(measured: Measured, factor: int = 100) -> str:
    if measured.value is None or measured.low is None or measured.high is None:
        return "-"
    found = (factor * number for number in (measured.value, measured.low, measured.high))
    first, low, high = (f"{number:+.{1 if factor > 1 else 2}f}" for number in found)
    return f"{first} [{low}, {high}]"
