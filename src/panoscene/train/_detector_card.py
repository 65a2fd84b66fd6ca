"""The model card of the compact detector, in Markdown."""

from collections.abc import Mapping
from typing import Any

from panoscene.style import words

_SCORES = {
    "mask_ap": "mask AP",
    "mask_ap50": "mask AP50",
    "box_ap": "box AP",
    "box_ap50": "box AP50",
    "bfov_recall": "BFoV recall",
    "bfov_recall_sure": "BFoV recall, score 0.3 or more",
    "bfov_recall_any": "BFoV recall, any category",
}
_OF_CATEGORY = {
    "mask_ap50": "mask AP50",
    "box_ap50": "box AP50",
    "bfov_recall": "BFoV recall",
}


def detector_card(
    metrics: Mapping[str, float], recipe: Mapping[str, Any], *, panoramas: int
) -> str:
    """Return the model card of a trained compact detector.

    Args:
        metrics: On the part ``val``, as ``detector_scores`` names them.
        recipe: It was trained with, as in the header of its weights.
        panoramas: How many it was trained on.

    Examples:
        >>> card = detector_card({"mask_ap50": 0.25}, {"steps": 9, "batch_size": 2}, panoramas=7)
        >>> "| mask AP50 | 25.0 |" in card
        True
    """
    steps, batch = recipe.get("steps", 0), recipe.get("batch_size", 0)
    scores = [
        f"| {name} | {100 * metrics[key]:.1f} |" for key, name in _SCORES.items() if key in metrics
    ]
    earlier = (
        [
            "- It went on from weights of earlier trainings, which are not published and of which "
            "configs/compact/detector.yaml tells: recipe and seed alone do not give these weights."
        ]
        if recipe.get("start")
        else []
    )
    return "\n".join(
        (
            "# Detector, compact edition",
            "",
            "Finds the objects in an upright indoor panorama: category (one of 57), bounding field "
            "of view, score, mask of the visible pixels.",
            "",
            "| | |",
            "| --- | --- |",
            "| network | Mask R-CNN on tf_efficientnet_lite0, pyramid of 64 channels |",
            "| input | RGB panorama; read as 256 x 768 pixels, 51 degrees above to 69 degrees "
            "below the horizon |",
            "| start weights | EfficientNet-Lite0 trained on ImageNet, Apache-2.0 |",
            f"| trained on | {panoramas} panoramas of our own synthetic homes, part `train` |",
            f"| training | at most {steps} steps of {batch}, on one core; the best were kept |",
            "| licence | Apache-2.0, as the code; the furniture's licences are in ATTRIBUTION of "
            "the data set |",
            "",
            "## Scores",
            "",
            "Percent, on part `val` of the same data set: rooms in other homes. AP is COCO's, the "
            "mean over the categories that are there; AP50 counts an overlap of 50 %. The weights "
            "were chosen by mask AP50 on this part, and many of its categories have one or two "
            "objects: expect somewhat less elsewhere.",
            "",
            "| score | % |",
            "| --- | --- |",
            *scores,
            "",
            "## Scores of each category",
            "",
            "Percent. Of one or two objects a score says little.",
            "",
            *_category_table(metrics),
            "",
            "## Limits",
            "",
            "- It has seen rendered rooms only. On photos it misses more and is less sure.",
            *earlier,
            "- Rare categories and objects below some 10 pixels at 1024 columns are mostly missed.",
            "- Nothing is found near the zenith and the nadir.",
            "- A mirror shows objects twice, and so does the detector.",
            "",
        )
    )


def _category_table(metrics: Mapping[str, float]) -> list[str]:
    """Return a row for each category that has a mask AP50, best first."""
    first = next(iter(_OF_CATEGORY))
    there = [key.partition("/")[2] for key in metrics if key.startswith(f"{first}/")]
    there.sort(key=lambda name: (-metrics[f"{first}/{name}"], name))
    lines = [
        f"| category | objects | {' | '.join(_OF_CATEGORY.values())} |",
        f"| --- | ---: |{' ---: |' * len(_OF_CATEGORY)}",
    ]
    for name in there:
        shares = [metrics.get(f"{key}/{name}") for key in _OF_CATEGORY]
        cells = ["" if share is None else f"{100 * share:.1f}" for share in shares]
        count = metrics.get(f"objects/{name}")
        number = "" if count is None else f"{count:.0f}"
        lines.append(f"| {words(name)} | {number} | {' | '.join(cells)} |")
    return lines
