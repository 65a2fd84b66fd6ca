"""The detector measured on panoramas of a set, with its seam anywhere."""

import time
from collections.abc import Sequence

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene.data._detector_samples import LabelRules
from panoscene.data._detector_truth import SeenObjects, seen_objects
from panoscene.geometry import bfov_from_mask, bfov_iou
from panoscene.models.detector import DetectorStage
from panoscene.scene import Detections, upright_photo
from panoscene.synth.dataset import PanoramaItem

from ._detector_scores import detector_scores

_HIT = 0.5


def evaluate_detector(
    stage: DetectorStage,
    items: Sequence[PanoramaItem],
    *,
    roll: float = 0.0,
    rules: LabelRules | None = None,
) -> dict[str, float]:
    """Return a detector's scores on panoramas, as ``detector_scores``, and on the seam.

    ``seam_recall`` is the share of the objects across the seam that a detection of any category
    covers with an overlap of 0.5 on the sphere, ``seam_objects`` their number. ``seconds`` is
    the mean processor time of the stage for one panorama.

    Args:
        stage: With a low score threshold, for AP wants the doubtful ones too.
        items: Of a rendered set.
        roll: Part of a turn by which the panoramas are rolled first.
        rules: Which objects count.
    """
    found, truth, hits, seconds = [], [], [], 0.0
    for item in items:
        image = upright_photo(item.image(), item.scene().panorama)
        seen = seen_objects(item, rules)
        columns = round(roll * image.shape[-1])
        image, seen = image.roll(columns, -1), _rolled(seen, columns)
        began = time.process_time()
        found.append(stage(image))
        seconds += time.process_time() - began
        truth.append(seen)
        hits.append(_seam_hits(found[-1], seen))
    scores = detector_scores(found, truth)
    across = torch.cat(hits)
    scores["seam_objects"] = float(len(across))
    scores["seam_recall"] = float(across.float().mean()) if len(across) else 0.0
    scores["seconds"] = seconds / max(len(found), 1)
    return scores


def _rolled(seen: SeenObjects, columns: int) -> SeenObjects:
    if not columns or not len(seen.mask):
        return seen
    mask = seen.mask.roll(columns, -1)
    return SeenObjects(mask, bfov_from_mask(mask), seen.category, seen.ignored)


def _seam_hits(found: Detections, seen: SeenObjects) -> Bool[Tensor, " n"]:
    """Return which of the objects with pixels in the first and in the last column are found."""
    across = seen.mask[:, :, 0].any(1) & seen.mask[:, :, -1].any(1) & ~seen.ignored
    overlap: Float[Tensor, "n m"] = bfov_iou(seen.bfov[across], found.bfov)
    return (overlap >= _HIT).any(1)
