"""Scores of shapes as tables in Markdown."""

from collections.abc import Mapping, Sequence
from typing import Any

KINDS = {
    "crops": "objects in validation panoramas",
    "unseen": "pictures of unseen models",
    "seen": "pictures of training models",
}
"""Of objects, in words."""
_MEASURES = {
    "chamfer": "Chamfer",
    "f_score": "F-score",
    "normal_consistency": "normals",
    "volume_iou": "IoU",
}
_DIGITS = {"chamfer": 1, "f_score": 2, "normal_consistency": 2, "volume_iou": 2}
_FAIR = "retrieval without the model"
_OTHERS = ("retrieval", _FAIR, "box")


def shape_tables(measured: Mapping[str, Any]) -> dict[str, str]:
    """Return all texts about scores of shapes, by name.

    Args:
        measured: What ``benchmarks/shape_scores.py`` writes.
    """
    scores = measured["scores"]
    return {
        "shape-points": _points(measured["metrics"]),
        "shape-how": _how(measured),
        "shape-meshes": _meshes(scores),
        "shape-better": _better(scores),
        "shape-categories": _categories(scores),
    }


def _points(metrics: Mapping[str, float]) -> str:
    rows = [
        [words, f"{metrics[f'{kind}_iou']:.3f}", f"{metrics[f'{kind}_box_iou']:.3f}"]
        for kind, words in KINDS.items()
    ]
    return _table(["kind", "network", "box"], rows)


def _how(measured: Mapping[str, Any]) -> str:
    """Return how the meshes were scored."""
    left_out = ", ".join(
        f"{found['slabs_left_out']} `{kind}`"
        for kind, found in measured["scores"].items()
        if found.get("slabs_left_out")
    )
    parts = [f"{measured['models']} training models are the library."]
    if "points" in measured:
        parts.insert(0, f"{measured['points']:,} points on each surface.")
    if left_out:
        parts.append(f"Left out, as slabs: {left_out}.")
    return " ".join(parts)


def _meshes(scores: Mapping[str, Any]) -> str:
    """Return the means of each kind and method, and over how many objects they are."""
    head = ["kind", "objects", "method", "Chamfer", "F-score", "normals", "IoU (of n)"]
    rows = []
    for kind, found in scores.items():
        for method, mean in found["mean"].items():
            objects = found["objects"]
            exact = [f"{mean[name]:.3f}" for name in ("f_score", "normal_consistency")]
            overlap = _overlap(_number(mean["volume_iou"], 3), mean)
            rows.append([kind, str(objects), method, _distance(mean, objects), *exact, overlap])
    return _table(head, rows)


def _better(scores: Mapping[str, Any]) -> str:
    """Return in which measures the network is better than what."""
    rows = []
    for kind, found in scores.items():
        means = found["mean"]
        there = [other for other in _OTHERS if other in means]
        rows += [[kind, other, *_split(means["network"], means[other])] for other in there]
    return _table(["kind", "against", "the network is better in", "not better in"], rows)


def _split(network: Mapping[str, Any], other: Mapping[str, Any]) -> tuple[str, str]:
    """Return the measures in which the network is better, and those in which it is not."""
    better, others = [], []
    for name, words in _MEASURES.items():
        own, its = network[name], other[name]
        if own is None or its is None:
            continue
        wins = own < its if name == "chamfer" else own > its
        (better if wins else others).append(words)
    return ", ".join(better) or "-", ", ".join(others) or "-"


def _categories(scores: Mapping[str, Any]) -> str:
    """Return the means of each category: network / retrieval / box, without the very model."""
    head = ["category", "kind", "objects", "Chamfer", "F-score", "normals", "IoU (of n)"]
    names = sorted({name for found in scores.values() for name in found["by_category"]})
    rows = []
    for name in names:
        for kind, found in scores.items():
            methods = found["by_category"].get(name)
            if methods is None:
                continue
            network, box = methods["network"], methods["box"]
            compared = (network, methods.get(_FAIR, methods["retrieval"]), box)
            cells = [
                " / ".join(_number(mean[measure], digits) for mean in compared)
                for measure, digits in _DIGITS.items()
            ]
            cells[-1] = _overlap(cells[-1], network)
            rows.append([name, kind, str(network["objects"]), *cells])
    return _table(head, rows)


def _number(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def _distance(mean: Mapping[str, Any], objects: int) -> str:
    """Return the Chamfer distance; where shapes were missed, also of how many it is the mean."""
    missed = mean.get("missed", 0)
    text = _number(mean["chamfer"], 2)
    return f"{text} (of {objects - missed})" if missed else text


def _overlap(text: str, mean: Mapping[str, Any]) -> str:
    """Return overlaps of volumes with the number of objects that have a volume."""
    return f"{text} (of {mean['volumes']})" if "volumes" in mean else text


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [f"| {' | '.join(cells)} |" for cells in (head, *rows)]
    lines.insert(1, "| --- " * len(head) + "|")
    return "\n".join(lines)
