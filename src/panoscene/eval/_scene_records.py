"""Everything measured on one scene."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float

from panoscene.eval._detection_records import DetectionRecord, detection_records
from panoscene.eval._layout_scores import LayoutRecord, layout_record
from panoscene.eval._matched_recall import kept_at_recall
from panoscene.eval._mesh_penetration import PenetrationRecord, penetration_record
from panoscene.eval._plausibility import PlausibilityRecord, plausibility_records
from panoscene.eval._relation_records import RelationRecord
from panoscene.eval._relation_scores import fidelity_record, relation_record
from panoscene.eval._semantic import SemanticRecord, semantic_record
from panoscene.eval._shape_records import ShapeRecord, shape_record
from panoscene.geometry import OrientedBoxes
from panoscene.scene import Layout, Objects, Scene


@dataclass(frozen=True, slots=True)
class SceneRecords:
    """Everything measured on one scene."""

    detection: DetectionRecord
    plausibility: PlausibilityRecord
    relations: RelationRecord | None
    """None for a prediction without relation scores."""
    fidelity: RelationRecord
    layout: LayoutRecord
    semantic: SemanticRecord
    shape: ShapeRecord | None
    penetration: PenetrationRecord | None
    boxes: Float[np.ndarray, "n 7"]
    """Centre, size and yaw of the predicted boxes; numpy, to travel between processes."""
    room: Float[np.ndarray, "corners 2"]
    heights: tuple[float, float]
    """Floor and ceiling of the predicted room."""
    targets: int
    missing: bool


def scene_records(
    predictions: Sequence[Scene | None], targets: Sequence[Scene], *, shapes: bool = False
) -> list[SceneRecords]:
    """Return what there is to measure on scenes; a missing prediction counts as an empty room."""
    filled = [
        empty_scene(target) if prediction is None else prediction
        for prediction, target in zip(predictions, targets, strict=True)
    ]
    detection = detection_records(filled, targets)
    plausibility = plausibility_records(filled)
    return [
        SceneRecords(
            detection=detection[k],
            plausibility=plausibility[k],
            relations=_relations(prediction, target),
            fidelity=fidelity_record(prediction, target),
            layout=layout_record(predictions[k], target),
            semantic=semantic_record(predictions[k], target),
            shape=_shape(prediction, target) if shapes else None,
            penetration=penetration_record(prediction) if shapes else None,
            boxes=_numbers(prediction.objects.boxes),
            room=prediction.layout.floor_polygon.double().numpy(),
            heights=(prediction.layout.floor_height, prediction.layout.ceiling_height),
            targets=len(target.objects.boxes),
            missing=predictions[k] is None,
        )
        for k, (prediction, target) in enumerate(zip(filled, targets, strict=True))
    ]


def records_at_recall(
    records: Sequence[SceneRecords], recall: float
) -> tuple[PlausibilityRecord, ...] | None:
    """Return the plausibility when only the best objects for a recall are kept, or None.

    Recall is that of the first IoU threshold of detection.
    """
    found = np.sort(np.concatenate([r.detection.score[r.detection.hit[0]] for r in records]))[::-1]
    tables = [torch.from_numpy(record.boxes) for record in records]
    kept = kept_at_recall(
        [OrientedBoxes(table[:, :3], table[:, 3:6], table[:, 6]) for table in tables],
        [Layout(torch.from_numpy(r.room), *r.heights) for r in records],
        [record.detection.score for record in records],
        found,
        sum(record.targets for record in records),
        recall,
    )
    return None if kept is None else kept.records


def _numbers(boxes: OrientedBoxes) -> Float[np.ndarray, "n 7"]:
    columns = torch.cat([boxes.centre, boxes.size, boxes.yaw[:, None]], dim=-1)
    return columns.double().numpy()


def empty_scene(target: Scene) -> Scene:
    """Return the target's bare room, for a scene that was not predicted."""
    none = torch.zeros(0)
    objects = Objects(
        OrientedBoxes(torch.zeros(0, 3), torch.zeros(0, 3), none),
        torch.zeros(0, dtype=torch.int64),
        none,
        torch.zeros(0, 4),
        none,
        none,
    )
    return replace(target, objects=objects, relations=None)


def _relations(prediction: Scene, target: Scene) -> RelationRecord | None:
    if prediction.relations is None and len(prediction.objects.boxes):
        return None
    return relation_record(prediction, target)


def _shape(prediction: Scene, target: Scene) -> ShapeRecord | None:
    has_meshes = any(mesh is not None for mesh in target.objects.shapes.mesh)
    if not has_meshes:
        return None
    return shape_record(prediction, target, generator=torch.Generator().manual_seed(0))
