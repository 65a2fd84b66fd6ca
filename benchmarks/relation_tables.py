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
PERCENT, PLAIN = 100, 1
BOXES = {
    **{
        f"detection.{definition}ap_{share}_mean_{classes}": (
            f"AP {share}{words}, {classes} cat., %",
            PERCENT,
        )
        for definition, words in (("", ""), ("released_", " as released"))
        for classes in (57, 11)
        for share in (15, 25, 50)
    },
    "plausibility.paper_colliding_pairs": ("colliding pairs a scene", PLAIN),
    "plausibility.out_of_room_volume": ("outside the room, m³ a scene", PLAIN),
}


def relation_texts() -> dict[str, str]:
    """Return the tables, by the markers' name."""
    return {
        "relations-found": rule_table("_end_to_end"),
        "relations-matched": rule_table(""),
        "relations-boxes": boxes_table(),
    }


def rule_table(ending: str) -> str:
    """Return the F1 of the rule on the pose network's boxes, and what finished scenes gain.

    Args:
        ending: of the metrics: ``_end_to_end``, or nothing for those between matched objects.
    """
    head = ("homes", "relation, F1 in percent", "rule", "finished scene", "gain")
    lines = _head((*head, "rule on the finished scene's boxes"), 2)
    for homes in FOLDERS:
        full, rule = _score(homes, "full"), _score(homes, "pose")
        metrics = {f"relations.{kind}_f1{ending}": (KINDS[kind], PERCENT) for kind in KINDS}
        metrics |= {} if ending else {name: (words, PLAIN) for name, words in YAWS.items()}
        for name, (words, factor) in metrics.items():
            boxes = name.replace("relations.", "fidelity.")
            values = [_value(score.metrics[name], factor) for score in (rule, full)]
            values += [_gain(full.differences["pose"][name], factor)]
            lines.append(_row(homes, full, words, *values, _value(full.metrics[boxes], factor)))
    return "\n".join(lines)


def boxes_table() -> str:
    """Return what the arrangement makes of the refined boxes, and of the pose network's."""
    head = ("homes", "boxes", "not arranged", "arranged", "difference")
    lines = _head((*head, "pose network's, arranged"), 2)
    for homes in FOLDERS:
        full, before, alone = (
            _score(homes, name) for name in ("full", "without-arrangement", "pose-arranged")
        )
        for name, (words, factor) in BOXES.items():
            values = [_value(score.metrics[name], factor) for score in (before, full)]
            values += [_gain(full.differences["without-arrangement"][name], factor)]
            lines.append(_row(homes, full, words, *values, _value(alone.metrics[name], factor)))
    return "\n".join(lines)


def _head(names: tuple[str, ...], left: int) -> list[str]:
    return [f"| {' | '.join(names)} |", "|" + " --- |" * left + " ---: |" * (len(names) - left)]


def _row(homes: str, score: ScoreFile, *cells: str) -> str:
    return f"| {homes}, {score.scenes} panoramas | {' | '.join(cells)} |"


def _score(homes: str, method: str) -> ScoreFile:
    return read_scores(ROOT / FOLDERS[homes] / f"{method}.json")


def _value(measured: Measured, factor: int) -> str:
    if measured.value is None:
        return "-"
    return f"{factor * measured.value:.{1 if factor == PERCENT else 2}f}"


def _gain(measured: Measured, factor: int) -> str:
    if measured.value is None or measured.low is None or measured.high is None:
        return "-"
    found = (factor * number for number in (measured.value, measured.low, measured.high))
    first, low, high = (f"{number:+.2f}" for number in found)
    return f"{first} [{low}, {high}]"
