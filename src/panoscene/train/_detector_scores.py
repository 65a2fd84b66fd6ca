"""Scores of detections: COCO's mask and box AP on the panorama, and recall of BFoVs."""

import contextlib
import io
from collections import defaultdict
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.data._detector_samples import circular_boxes
from panoscene.data._detector_truth import SeenObjects
from panoscene.geometry import bfov_iou
from panoscene.models.detector import box_overlaps
from panoscene.scene import CATEGORIES, Detections

_RECALL_IOU = 0.5
_SURE = 0.3


def detector_scores(found: Sequence[Detections], truth: Sequence[SeenObjects]) -> dict[str, float]:
    """Return scores by name over panoramas; all but the counts are in [0, 1].

    ``mask_ap``, ``mask_ap50``, ``box_ap``, ``box_ap50`` are COCO's, means over the categories
    that are there; ``mask_ap50/chair`` and so on are those of a category. ``bfov_recall`` is the
    share of objects that a detection of their category covers with an overlap of 0.5 on the
    sphere; ``bfov_recall_sure`` counts detections with a score of 0.3 or more,
    ``bfov_recall_any`` those of any category. ``bfov_recall/chair`` and so on are those of a
    category, ``objects/chair`` how many there are of it.

    Args:
        found: Detections with masks, in the size of the truth's.
        truth: Of the same panoramas.
    """
    scores: dict[str, float] = {}
    for kind in ("mask", "box"):
        precision = _coco_precision(found, truth, kind)
        scores |= _average_precision(precision, truth, kind)
    return scores | _recall(found, truth)


def _recall(found: Sequence[Detections], truth: Sequence[SeenObjects]) -> dict[str, float]:
    hits: dict[str, list[Tensor]] = {"": [], "_sure": [], "_any": []}
    for one, seen in zip(found, truth, strict=True):
        wanted = ~seen.ignored
        overlap = bfov_iou(seen.bfov[wanted], one.bfov) >= _RECALL_IOU
        same = seen.category[wanted][:, None] == one.category
        hits["_any"].append(overlap.any(1))
        hits[""].append((overlap & same).any(1))
        hits["_sure"].append((overlap & same & (one.score >= _SURE)).any(1))
    every = {name: torch.cat(values) for name, values in hits.items()}
    scores = {
        f"bfov_recall{name}": float(values.float().mean()) if len(values) else 0.0
        for name, values in every.items()
    }
    category = torch.cat([seen.category[~seen.ignored] for seen in truth])
    for c in category.unique().tolist():
        own = every[""][category == c]
        scores[f"bfov_recall/{CATEGORIES[c]}"] = float(own.float().mean())
        scores[f"objects/{CATEGORIES[c]}"] = float(len(own))
    return scores


def _average_precision(
    precision: np.ndarray, truth: Sequence[SeenObjects], kind: str
) -> dict[str, float]:
    """Return AP and AP50, over categories and of each; precision is (10, 101, categories)."""
    there = torch.cat([seen.category[~seen.ignored] for seen in truth]).unique().tolist()
    by_category = {c: precision[:, :, c].mean(1) for c in there}
    if not there:
        return {f"{kind}_ap": 0.0, f"{kind}_ap50": 0.0}
    every = np.stack(list(by_category.values()))
    scores = {f"{kind}_ap": float(every.mean()), f"{kind}_ap50": float(every[:, 0].mean())}
    return scores | {
        f"{kind}_ap50/{CATEGORIES[c]}": float(values[0]) for c, values in by_category.items()
    }


def _coco_precision(
    found: Sequence[Detections], truth: Sequence[SeenObjects], kind: str
) -> np.ndarray:
    """Return COCO's precision, (10 overlaps, 101 recalls, categories); 0 without an object."""
    from pycocotools.cocoeval import COCOeval  # noqa: PLC0415

    overlaps = [
        overlap_table(one, seen, kind).double().numpy()
        for one, seen in zip(found, truth, strict=True)
    ]

    class Evaluation(COCOeval):
        """COCO's matching and averaging, with overlaps that know the seam."""

        def _prepare(self) -> None:
            self._gts, self._dts = defaultdict(list), defaultdict(list)
            for picture, (one, seen) in enumerate(zip(found, truth, strict=True)):
                rows = zip(seen.category.tolist(), seen.ignored.tolist(), strict=True)
                for k, (category, ignored) in enumerate(rows):
                    note = {"id": k + 1, "ignore": int(ignored), "iscrowd": 0, "area": 1.0}
                    self._gts[picture, category].append(note)
                pairs = zip(one.category.tolist(), one.score.tolist(), strict=True)
                for k, (category, score) in enumerate(pairs):
                    self._dts[picture, category].append({"id": k + 1, "score": score, "area": 1.0})
            self.evalImgs = []

        def computeIoU(self, imgId: Any, catId: Any) -> Any:  # noqa: N802, N803
            targets = [note["id"] - 1 for note in self._gts[imgId, catId]]
            answers = sorted(self._dts[imgId, catId], key=lambda note: -note["score"])
            if not targets or not answers:
                return []
            return overlaps[imgId][[note["id"] - 1 for note in answers]][:, targets]

    with contextlib.redirect_stdout(io.StringIO()):
        evaluation = Evaluation(iouType="segm")
        evaluation.params.imgIds = list(range(len(truth)))
        evaluation.params.catIds = list(range(len(CATEGORIES)))
        evaluation.params.areaRng, evaluation.params.areaRngLbl = [[0, 1e10]], ["all"]  # ty: ignore[invalid-assignment]
        evaluation.params.maxDets = [100]
        evaluation.evaluate()
        evaluation.accumulate()
    return np.maximum(evaluation.eval["precision"][:, :, :, 0, 0], 0.0)  # ty: ignore[invalid-argument-type, not-subscriptable]


def overlap_table(found: Detections, seen: SeenObjects, kind: str) -> Float[Tensor, "found seen"]:
    """Return intersections over unions of masks, or of the boxes around them on the cylinder."""
    if found.mask is None:
        raise ValueError("found: expected detections with masks")
    if not len(found.mask) or not len(seen.mask):
        return torch.zeros(len(found.mask), len(seen.mask))
    if kind == "box":
        one, other = circular_boxes(found.mask), circular_boxes(seen.mask)
        return box_overlaps(one, other, float(seen.mask.shape[-1]))[1]
    one, other = (masks.flatten(1).float() for masks in (found.mask, seen.mask))
    shared = one @ other.T
    return shared / (one.sum(1)[:, None] + other.sum(1) - shared).clamp_min(1.0)
