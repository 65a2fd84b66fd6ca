"""What files of scores say of themselves: whose rows they are, and of which targets."""

from collections.abc import Sequence

from panoscene.eval._fov import FOV_DEG
from panoscene.eval._methods import METHODS
from panoscene.eval._rendered_rows import RENDERED, ROWS
from panoscene.eval._results import ScoreFile
from panoscene.scene import CATEGORIES

WHOLE = FOV_DEG[0]
_RARE = 10
"""Categories with fewer targets are called rare."""


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
    return [score for score in scores if score.fov_deg == WHOLE] or list(scores)


def row_named(scores: Sequence[ScoreFile], name: str) -> ScoreFile | None:
    """Return the row of a method of ours, if its simulated input is here, too."""
    if not are_simulated(scores):
        return None
    return next((score for score in scores if score.method == name), None)


def are_simulated(scores: Sequence[ScoreFile]) -> bool:
    """Return whether these are our rows on our sampled rooms, with the simulated input."""
    return scores[0].data.startswith("sampled rooms") and any(
        score.method == "estimates" and score.kind == "input" for score in scores
    )


def are_rendered(scores: Sequence[ScoreFile]) -> bool:
    """Return whether these are the rows of our pipeline on homes that we rendered."""
    return scores[0].data.startswith(RENDERED)


def in_order(scores: Sequence[ScoreFile]) -> list[ScoreFile]:
    """Return scores in the order of our rows, others after them."""
    names = list(ROWS if scores and are_rendered(scores) else METHODS)
    order = {name: place for place, name in enumerate(names)}
    return sorted(scores, key=lambda score: order.get(score.method, len(order)))


def truth_row(scores: Sequence[ScoreFile]) -> ScoreFile | None:
    """Return the row that predicts the very files of the targets, whatever its name."""
    return next((score for score in scores if score.predictions_hash == score.targets_hash), None)


def categories_with(score: ScoreFile, key: str) -> list[str]:
    """Return the categories that have any ``targets`` or ``detections``."""
    return [name for name, row in score.categories.items() if key in row and row[key].value]


def categories_without_targets(score: ScoreFile) -> list[str]:
    """Return the categories that no target has; none if the file has no categories."""
    known = set(categories_with(score, "targets"))
    return [name for name in CATEGORIES if name not in known] if known else []


def detected_categories(scores: Sequence[ScoreFile]) -> str:
    """Return in words how many categories each method detects; empty if unknown."""
    methods: dict[int, list[str]] = {}
    for score in scores:
        if score.categories:
            count = len(categories_with(score, "detections"))
            methods.setdefault(count, []).append(f"`{score.method}`")
    counts = sorted(methods, key=lambda count: -len(methods[count]))
    parts = [f"{count} for {listed(methods[count])}" for count in counts[1:]]
    return "; ".join([f"{counts[0]} here", *parts]) if counts else ""


def lower_released_note(scores: Sequence[ScoreFile]) -> str:
    """Return why the released AP is below the standard one; empty where it is not."""
    for score in scores:
        standard, released = (
            score.metrics.get(f"detection.{start}ap_15_mean_57") for start in ("", "released_")
        )
        values = [None if one is None else one.value for one in (standard, released)]
        if values[0] is None or values[1] is None or values[1] >= values[0]:
            continue
        rows = [score.categories[name] for name in categories_with(score, "targets")]
        pairs = [(row["targets"].value or 0, row["detections"].value or 0) for row in rows]
        rare = [pair for pair in pairs if pair[0] < _RARE]
        more = sum(found > targets for targets, found in pairs)
        more_rare = sum(found > targets for targets, found in rare)
        empty = len(set(categories_with(score, "detections"))) - sum(f > 0 for _, f in pairs)
        if more or empty:
            few = f" ({more_rare} of the {len(rare)} with fewer than {_RARE} targets)"
            return (
                "Why is it lower than the standard here, all the same? In "
                f"`{score.method}`, {more} of {len(pairs)} categories have more detections than "
                f"targets{few if rare else ''}, and {empty} without targets are detected and "
                "count 0."
            )
    return ""


def listed(names: Sequence[str]) -> str:
    """Return names in a sentence.

    Examples:
        >>> listed(["a", "b", "c"])
        'a, b and c'
    """
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))
