"""How good boxes and relations in context are, beside the pose network and the geometric rule."""

from collections.abc import Sequence
from dataclasses import replace

import torch
from jaxtyping import Int64
from torch import Tensor

from panoscene.arrange import ArrangementSettings, arrange_scenes
from panoscene.data import match_detections
from panoscene.eval import (
    IOU_THRESHOLDS,
    detection_records,
    plausibility_records,
    relation_record,
    score_detection,
    score_plausibility,
    score_relations,
)
from panoscene.geometry import OrientedBoxes, paired_box_iou
from panoscene.pipeline._relations import held_relations
from panoscene.scene import (
    Detections,
    Objects,
    Relations,
    Scene,
    relations_from_boxes,
    select_objects,
)

from ._pose_scores import paired_errors

_RELATION_SCORES = ("f1", "precision", "tpr", "accuracy", "bin_error_deg", "error_deg")
_COLLISIONS = (
    "paper_colliding_pairs", "paper_hitting_object", "paper_hitting_wall", "paper_hitting_floor",
    "paper_hitting_ceiling", "collision_rate", "out_of_room_share",
)  # fmt: skip
ATTACHMENT = ("touching_f1", "touching_wall_f1", "on_floor_f1")
"""Scores whose mean stands for the relations that hold or do not."""
TURNS = ("relative_yaw_error_deg", "relative_yaw_wall_error_deg")
"""Errors whose mean stands for the relative yaws."""


def box_scores(predicted: Sequence[Scene], truth: Sequence[Scene]) -> dict[str, float]:
    """Return mean AP of both definitions at IoU 0.15, 0.25 and 0.5, and the collisions.

    ``ap_*`` ranks objects by their score, ``ranked_ap_*`` by their score times the confidence in
    their distance, which matters where all scores are equal; ``released_ap_*`` is the authors'
    definition. Collisions are judged in the layout of the prediction. The rest is about the
    objects whose BFoV shows a true one, whatever its category: ``iou`` is the mean oriented 3D IoU
    with it, ``centre_error_m`` and so on are those of ``paired_errors``.
    """
    plain = [replace(scene, relations=None) for scene in predicted]
    ranked = [replace(scene, objects=_ranked(scene.objects)) for scene in plain]
    result: dict[str, float] = {}
    for prefix, scenes in (("", plain), ("ranked_", ranked)):
        found = score_detection(detection_records(scenes, list(truth)))
        means = {"ap": found.mean_average_precision()}
        if not prefix:
            means["released_ap"] = found.mean_released_average_precision()
        for name, values in means.items():
            for threshold, value in zip(IOU_THRESHOLDS, values, strict=True):
                result[f"{prefix}{name}_{round(100 * threshold)}"] = float(value)
    physical = score_plausibility(plausibility_records(plain))
    result |= {name: physical[name] or 0.0 for name in _COLLISIONS}
    return result | _paired_scores(predicted, truth)


def _paired_scores(predicted: Sequence[Scene], truth: Sequence[Scene]) -> dict[str, float]:
    pairs = []
    for scene, target in zip(predicted, truth, strict=True):
        index = _target_index(scene, target)
        shown = (index >= 0).nonzero().squeeze(1)
        chosen = select_objects(target.objects, index[shown])
        pairs.append((select_objects(scene.objects, shown), replace(target, objects=chosen)))
    if not any(len(objects.category) for objects, _ in pairs):
        return {}
    overlap = [paired_box_iou(found.boxes, true.objects.boxes) for found, true in pairs]
    errors = paired_errors([found for found, _ in pairs], [true for _, true in pairs])
    return {"iou": float(torch.cat(overlap).mean())} | errors


def relation_scores(predicted: Sequence[Scene], truth: Sequence[Scene]) -> dict[str, float]:
    """Return F1, precision, recall, accuracy and yaw errors of relations between matched objects.

    Objects are matched by their BFoVs (``match_detections``), not by their boxes: so two methods
    with different boxes of the same detections answer for the same relations.
    """
    records = [
        relation_record(_as_seen(scene, target), target, iou_threshold=0.0, same_category=False)
        for scene, target in zip(predicted, truth, strict=True)
    ]
    scores = score_relations(records)
    return {
        name: float(value)
        for name, value in scores.items()
        if value is not None and name.endswith(_RELATION_SCORES)
    }


def with_rule(scenes: Sequence[Scene]) -> list[Scene]:
    """Return scenes with the relations that their boxes have: the geometric rule."""
    return [replace(scene, relations=_rule(scene.objects.boxes, scene)) for scene in scenes]


def with_oracle(scenes: Sequence[Scene], truth: Sequence[Scene]) -> list[Scene]:
    """Return scenes with the true relations of what they found, and its own of all else."""
    return [
        replace(scene, relations=_rule(_true_boxes(scene, target), scene))
        for scene, target in zip(scenes, truth, strict=True)
    ]


def arranged(scenes: Sequence[Scene], settings: ArrangementSettings | str) -> list[Scene]:
    """Return scenes after the arrangement of the pipeline; they keep their own relations."""
    held = [replace(scene, relations=held_relations(scene)) for scene in scenes]
    found = arrange_scenes(held, settings)
    return [
        replace(result.scene, relations=scene.relations)
        for result, scene in zip(found, scenes, strict=True)
    ]


def relation_quality(scores: dict[str, float]) -> float:
    """Return one number in [0, 1] for all relations: attachment and relative yaws count alike.

    The mean of ``ATTACHMENT``, and of how much better than a random guess the ``TURNS`` are.
    """
    holds = sum(scores.get(name, 0.0) for name in ATTACHMENT) / len(ATTACHMENT)
    turns = sum(1 - scores.get(name, 90.0) / 90 for name in TURNS) / len(TURNS)
    return (holds + max(turns, 0.0)) / 2


def _as_seen(scene: Scene, target: Scene) -> Scene:
    """Return the scene with the true box in place of every one that shows a true object.

    So what is matched does not depend on the boxes; those of nothing are put out of the way.
    """
    boxes, known = _true_boxes(scene, target), (_target_index(scene, target) >= 0).unsqueeze(-1)
    nowhere = boxes.centre.new_tensor([0.0, 0.0, -1e3])
    boxes = replace(boxes, centre=torch.where(known, boxes.centre, nowhere))
    return replace(scene, objects=replace(scene.objects, boxes=boxes))


def _true_boxes(scene: Scene, target: Scene) -> OrientedBoxes:
    """Return the true boxes of what shows a true object, and the scene's own of all else."""
    index = _target_index(scene, target)
    own, truth = scene.objects.boxes, target.objects.boxes
    if not len(truth):
        return own
    known, true = index >= 0, truth[index.clamp(min=0)]
    return OrientedBoxes(
        torch.where(known.unsqueeze(-1), true.centre, own.centre),
        torch.where(known.unsqueeze(-1), true.size, own.size),
        torch.where(known, true.yaw, own.yaw),
    )


def _rule(boxes: OrientedBoxes, scene: Scene) -> Relations:
    height = scene.panorama.camera_height
    return relations_from_boxes(boxes, scene.layout, height, inside="any_corner")


def _target_index(scene: Scene, target: Scene) -> Int64[Tensor, " n"]:
    objects = scene.objects
    seen = Detections(objects.bfov, objects.category, objects.score)
    return match_detections(seen, target.objects)


def _ranked(objects: Objects) -> Objects:
    return replace(objects, score=objects.score * objects.distance_score)
