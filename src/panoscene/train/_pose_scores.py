"""How good initial boxes are: scores against the truth, and the baselines to beat."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.data import match_detections
from panoscene.eval import IOU_THRESHOLDS, detection_records, score_detection
from panoscene.geometry import OrientedBoxes, direction_from_lonlat, wrap_angle
from panoscene.scene import Detections, Objects, Scene, select_objects

_FARTHEST = 12.0
_LOWEST = 1e-3


def floor_box_objects(
    objects: Objects, mean_size: Float[Tensor, "57 3"], camera_height: float
) -> Objects:
    """Return the trivial baseline: boxes of the category's mean size where the floor is seen.

    The nearest face stands where the ray through the middle of the BFoV's lower edge meets the
    floor, and the box faces the camera. Where that ray does not fall to the floor within 12 m,
    the box is where its mean height fills that of the BFoV, in the direction of its centre.

    Args:
        objects: Detections; their boxes are not looked at.
        mean_size: Metres, of each category.
        camera_height: Metres above the floor.

    Examples:
        >>> from panoscene.scene import MEAN_SIZE, objects_from_boxes
        >>> box = OrientedBoxes(
        ...     torch.tensor([[0.0, 3.0, 0.4]]), torch.tensor([[0.5, 0.5, 0.8]]), torch.zeros(1))
        >>> found = floor_box_objects(objects_from_boxes(box, ["chair"]), MEAN_SIZE, 1.6)
        >>> [round(value, 1) for value in found.boxes.centre[0].abs().tolist()]
        [0.0, 3.0, 0.4]
    """
    lon, lat, _, height = objects.bfov.unbind(-1)
    size = mean_size[objects.category].to(lon)
    fall = height / 2 - lat
    reach = camera_height / fall.clamp(_LOWEST, math.pi / 2 - _LOWEST).tan()
    across = reach + size[:, 1] / 2
    ahead = torch.stack([lon.sin() * across, lon.cos() * across, size[:, 2] / 2], dim=-1)
    half = (height / 2).clamp(_LOWEST, math.pi / 2 - _LOWEST)
    away = (size[:, 2] / 2 / half.tan()).clamp(0.3, _FARTHEST)
    floating = direction_from_lonlat(objects.bfov[:, :2]) * away.unsqueeze(-1)
    floating = floating + floating.new_tensor([0.0, 0.0, camera_height])
    stands = ((fall > _LOWEST) & (reach < _FARTHEST)).unsqueeze(-1)
    boxes = OrientedBoxes(torch.where(stands, ahead, floating), size, wrap_angle(math.pi - lon))
    return replace(objects, boxes=boxes)


def detection_scores(predicted: Sequence[Objects], truth: Sequence[Scene]) -> dict[str, float]:
    """Return the standard mean AP at IoU 0.15, 0.25 and 0.5, over the categories with targets.

    ``ap_*`` ranks objects by their score; ``ranked_ap_*`` by their score times the confidence in
    their distance, which matters where all scores are equal.
    """
    result = {}
    for prefix, ranked in (("ap", False), ("ranked_ap", True)):
        scenes = [
            replace(scene, relations=None, objects=_ranked(objects) if ranked else objects)
            for objects, scene in zip(predicted, truth, strict=True)
        ]
        found = score_detection(detection_records(scenes, list(truth)))
        for threshold, value in zip(IOU_THRESHOLDS, found.mean_average_precision(), strict=True):
            result[f"{prefix}_{round(100 * threshold)}"] = float(value)
    return result


def paired_errors(predicted: Sequence[Objects], truth: Sequence[Scene]) -> dict[str, float]:
    """Return the errors of predictions for the true BFoVs: object k is object k of the truth.

    Medians over all objects: metres between the centres, degrees between the yaws, metres along
    the ray, and of the sizes the mean share that they are off. ``front_back`` is the share of
    yaws off by more than 90 degrees.
    """
    found = _joined([objects.boxes for objects in predicted])
    true = _joined([scene.objects.boxes for scene in truth])
    eye = torch.cat(
        [
            torch.tensor([[0.0, 0.0, scene.panorama.camera_height]]).expand(
                len(scene.objects.category), 3
            )
            for scene in truth
        ]
    ).to(true.centre)
    length = torch.linalg.vector_norm
    yaw = wrap_angle(found.yaw - true.yaw).abs().rad2deg()
    distance = length(found.centre - eye, dim=-1) - length(true.centre - eye, dim=-1)
    size = (found.size - true.size).abs() / true.size
    return {
        "centre_error_m": float(length(found.centre - true.centre, dim=-1).median()),
        "distance_error_m": float(distance.abs().median()),
        "size_error": float(size.mean(dim=-1).median()),
        "yaw_error_deg": float(yaw.median()),
        "front_back": float((yaw > 90).double().mean()),
    }


def matched_errors(predicted: Sequence[Objects], truth: Sequence[Scene]) -> dict[str, float]:
    """Return ``paired_errors`` of detections and the objects that they show.

    Detections show objects by their BFoVs (``match_detections``), whatever their boxes, so two
    methods that place the same detections answer for the same objects. ``shown`` is the share of
    the detections that show one; without any there are no errors.
    """
    pairs: list[tuple[Objects, Scene]] = []
    for objects, scene in zip(predicted, truth, strict=True):
        seen = Detections(objects.bfov, objects.category, objects.score)
        index = match_detections(seen, scene.objects)
        shown = (index >= 0).nonzero().squeeze(1)
        chosen = select_objects(scene.objects, index[shown])
        pairs.append((select_objects(objects, shown), replace(scene, objects=chosen)))
    count = sum(len(objects.category) for objects in predicted)
    shown_count = sum(len(objects.category) for objects, _ in pairs)
    if not shown_count:
        return {"shown": 0.0}
    errors = paired_errors([found for found, _ in pairs], [true for _, true in pairs])
    return {"shown": shown_count / count} | errors


def category_scores(
    predicted: Sequence[Objects], truth: Sequence[Scene]
) -> Float[np.ndarray, "thresholds categories"]:
    """Return the standard AP of each category, ranked as ``ranked_ap_*``."""
    scenes = [
        replace(scene, relations=None, objects=_ranked(objects))
        for objects, scene in zip(predicted, truth, strict=True)
    ]
    return score_detection(detection_records(scenes, list(truth))).average_precision


def _ranked(objects: Objects) -> Objects:
    return replace(objects, score=objects.score * objects.distance_score)


def _joined(boxes: Sequence[OrientedBoxes]) -> OrientedBoxes:
    return OrientedBoxes(
        torch.cat([part.centre for part in boxes]).double(),
        torch.cat([part.size for part in boxes]).double(),
        torch.cat([part.yaw for part in boxes]).double(),
    )
