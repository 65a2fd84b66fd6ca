"""Semantic IoU over the sphere: the PanoContext protocol with its 12 labels."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Int64
from torch import Tensor

from panoscene.eval._semantic_labels import (
    BACKGROUND,
    SemanticMethod,
    boxes_around_camera,
    semantic_labels,
    sphere_directions,
)
from panoscene.scene import PANOCONTEXT_12, Scene

SEMANTIC_POINTS = 20_000
"""Directions by default. The paper takes 100,000: three times slower, for a mean IoU that is the
same to about 0.0001 over 250 rooms of 20 objects."""

UNLABELLED = -1
"""Label of a direction in which the target is not known; it does not count."""

_LABELS = len(PANOCONTEXT_12)


@dataclass(frozen=True, slots=True)
class SemanticRecord:
    """How the labels of one prediction agree with the true ones, in counts of directions."""

    name: str
    confusion: Int64[np.ndarray, "12 13"]
    """Directions by true label (row) and predicted label (column), in the order of
    ``PANOCONTEXT_12``; the last column is for a scene without any prediction."""
    boxes_around_camera: int = 0
    """Predicted boxes that could not be drawn because the camera is inside them."""


@dataclass(frozen=True, slots=True)
class SemanticScores:
    """Semantic IoU, pooled over scenes."""

    iou: Float[Tensor, "12"]
    """Of each ``PANOCONTEXT_12`` label in [0, 1]; NaN where no scene shows or predicts it."""
    mean_iou: float | None
    """Mean over the labels that occur, background included (the paper's mIoU)."""
    mean_iou_objects: float | None
    """The same without background. None, like the one above, when no label is left."""
    absent: tuple[str, ...]
    """Labels that occur neither in a target nor in a prediction; no mean counts them."""
    scenes: int
    missing: int
    """Scenes without any prediction: nothing there agrees with the target."""
    boxes_around_camera: int


def semantic_record(
    prediction: Scene | None,
    target: Scene | Int64[Tensor, " labels"],
    directions: Float[Tensor, "n 3"] | None = None,
    method: SemanticMethod = "boxes",
    *,
    name: str = "",
) -> SemanticRecord:
    """Return how the labels of one prediction agree with the true ones.

    Args:
        prediction: What was predicted; None for a missing one.
        target: The true scene, or true labels of the directions: indices into
            ``PANOCONTEXT_12``, -1 where the truth is not known.
        directions: Viewing directions that stand for equal solid angles; by default 20,000 even
            ones, which a target given by labels must agree with.
        method: How scenes become labels; see ``semantic_labels``.
        name: Of the scene; by default the target's own.

    Raises:
        ValueError: true labels are not one for each direction, or out of range.

    Source: paper, Sec. 4, semantic segmentation.

    Examples:
        >>> from panoscene.synth import sample_room
        >>> import numpy as np
        >>> room = sample_room(np.random.default_rng(0), objects=3)
        >>> score_semantic([semantic_record(room, room)]).mean_iou
        1.0
    """
    directions = sphere_directions(SEMANTIC_POINTS) if directions is None else directions
    if isinstance(target, Scene):
        name = name or target.name
        truth = semantic_labels(target, directions, method)
    else:
        truth = _checked(target, len(directions))
    around = 0
    if prediction is None:
        found = torch.full_like(truth, _LABELS)
    else:
        found = semantic_labels(prediction, directions, method)
        around = int(boxes_around_camera(prediction).sum())
    known = truth != UNLABELLED
    pair = truth[known] * (_LABELS + 1) + found[known]
    counts = torch.bincount(pair, minlength=_LABELS * (_LABELS + 1))
    return SemanticRecord(name, counts.reshape(_LABELS, _LABELS + 1).numpy(), around)


def score_semantic(records: Sequence[SemanticRecord]) -> SemanticScores:
    """Return the IoU of each label, pooled over scenes, and its means.

    Examples:
        >>> score_semantic([]).scenes
        0
    """
    confusion = np.zeros((_LABELS, _LABELS + 1))
    for record in records:
        confusion += record.confusion
    iou = label_ious(confusion)
    absent = [name for name, value in zip(PANOCONTEXT_12, iou, strict=True) if np.isnan(value)]
    mean, of_objects = mean_ious(iou)
    return SemanticScores(
        iou=torch.from_numpy(iou).float(),
        mean_iou=mean,
        mean_iou_objects=of_objects,
        absent=tuple(absent),
        scenes=len(records),
        missing=sum(int(record.confusion[:, -1].sum()) > 0 for record in records),
        boxes_around_camera=sum(record.boxes_around_camera for record in records),
    )


def label_ious(confusion: Float[np.ndarray, "12 13"]) -> Float[np.ndarray, "12"]:
    """Return the IoU of each label from added counts of directions; NaN for one that is absent."""
    agreed = confusion.diagonal()
    union = confusion.sum(axis=1) + confusion[:, :_LABELS].sum(axis=0) - agreed
    return np.divide(agreed, union, out=np.full(_LABELS, np.nan), where=union > 0)


def mean_ious(iou: Float[np.ndarray, "12"]) -> tuple[float | None, float | None]:
    """Return the mean over the labels that are there, and the same without background."""
    objects = np.arange(_LABELS) != BACKGROUND
    return _mean_of_known(iou), _mean_of_known(iou[objects])


def _mean_of_known(values: Float[np.ndarray, " n"]) -> float | None:
    known = values[~np.isnan(values)]
    return float(known.mean()) if len(known) else None


def _checked(labels: Int64[Tensor, " labels"], count: int) -> Int64[Tensor, " labels"]:
    if len(labels) != count:
        raise ValueError(f"target: expected {count} labels, one a direction, found {len(labels)}")
    if len(labels) and not UNLABELLED <= int(labels.min()) <= int(labels.max()) < _LABELS:
        raise ValueError(
            f"target: expected labels from -1 to {_LABELS - 1}, "
            f"found {int(labels.min())} to {int(labels.max())}"
        )
    return labels.cpu()
