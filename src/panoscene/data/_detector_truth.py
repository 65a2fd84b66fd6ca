"""What is to be found in a panorama, and how often panoramas with rare objects come."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, Int
from torch import Tensor

from panoscene.geometry import bfov_from_mask, rotate_panorama
from panoscene.synth.dataset import PanoramaItem

from ._detector_samples import LabelRules, labelled_objects


@dataclass(frozen=True, slots=True)
class SeenObjects:
    """What is to be found in one upright panorama."""

    mask: Bool[Tensor, "n height width"]
    bfov: Float[Tensor, "n 4"]
    category: Int[Tensor, " n"]
    ignored: Bool[Tensor, " n"]
    """Objects that may be found or not."""


def seen_objects(item: PanoramaItem, rules: LabelRules | None = None) -> SeenObjects:
    """Return the objects of a panorama with their masks, made upright.

    Those that scene.json has and that are not hidden too much must be found.

    Raises:
        DatasetError: A file of the panorama is missing or damaged.
    """
    objects = labelled_objects(item, rules or LabelRules())
    instances = item.instance().to(torch.int32)
    turn = torch.tensor(item.scene().panorama.upright_from_photo, dtype=torch.float64)
    if not torch.equal(turn, torch.eye(3, dtype=torch.float64)):
        instances = rotate_panorama(instances[None], turn, "nearest")[0]
    mask = instances == objects.instance[:, None, None]
    seen = mask.flatten(1).any(1)
    mask = mask[seen]
    bfov = bfov_from_mask(mask) if len(mask) else torch.zeros(0, 4)
    return SeenObjects(mask, bfov, objects.category[seen], ~objects.counts[seen])


def repeated_items(items: Sequence[PanoramaItem], share: float) -> list[int]:
    """Return indices of panoramas, those with rare categories several times.

    A category that a share f of the panoramas shows is wanted sqrt(share / f) times as often,
    and a panorama comes as often as its rarest category wants, rounded.

    Args:
        items: The panoramas.
        share: Categories in at least this share of them are not rare; 0 for no repetition.
    """
    if share <= 0:
        return list(range(len(items)))
    shown = [{x.category for x in item.labels().objects if x.in_scene} for item in items]
    number = Counter(name for names in shown for name in names)
    order = []
    for index, names in enumerate(shown):
        wanted = [math.sqrt(share * len(items) / number[name]) for name in names]
        order += [index] * max(1, round(max(wanted, default=1.0)))
    return order
