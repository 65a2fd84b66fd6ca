"""Objects of one panorama pasted into another, so that rare ones are seen in many rooms."""

from collections.abc import Sequence
from typing import NamedTuple

import torch
from jaxtyping import Bool, Float, Int
from pydantic import BaseModel, ConfigDict, Field
from torch import Tensor

from panoscene.scene import CATEGORIES
from panoscene.synth.dataset import PanoramaItem

_LEFT = 0.4
"""Visible share of an object behind pasted ones from which on it must still be found."""


class View(NamedTuple):
    """A picture and whose each pixel is."""

    image: Float[Tensor, "3 rows columns"]
    """RGB in [0, 1]."""
    instances: Int[Tensor, "rows columns"]
    """Instance id of each pixel."""


class Pasting(BaseModel):
    """How objects come from other panoramas; they keep their height above the horizon."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    share: float = Field(default=0.5, ge=0, le=1)
    """Of the samples that get objects of another panorama."""
    most_occlusion: float = Field(default=0.2, ge=0, le=1)
    """Objects that are hidden more are not pasted."""
    others: float = Field(default=0.35, ge=0, le=1)
    """Share of the other panorama's objects that come along with the one it was chosen for."""


def donors_by_category(
    items: Sequence[PanoramaItem], most_occlusion: float
) -> dict[int, tuple[int, ...]]:
    """Return which panoramas show an object of each category that may be pasted.

    Args:
        items: The panoramas.
        most_occlusion: Of such an object.

    Raises:
        DatasetError: A file of a panorama is missing or damaged.
    """
    found: dict[int, list[int]] = {}
    for index, item in enumerate(items):
        names = {
            x.category
            for x in item.labels().objects
            if x.in_scene and x.occlusion <= most_occlusion
        }
        for name in names:
            found.setdefault(CATEGORIES.index(name), []).append(index)
    return {category: tuple(found[category]) for category in sorted(found)}


def draw_donor(
    donors: dict[int, tuple[int, ...]], generator: torch.Generator
) -> tuple[int, int] | None:
    """Return a category, all being equally likely, and a panorama that shows it; None of none."""
    if not donors:
        return None
    first, second = torch.rand(2, generator=generator).tolist()
    category = tuple(donors)[int(first * len(donors))]
    return category, donors[category][int(second * len(donors[category]))]


def draw_pasted(
    category: Int[Tensor, " n"],
    whole: Bool[Tensor, " n"],
    wanted: int,
    others: float,
    generator: torch.Generator,
) -> Bool[Tensor, " n"]:
    """Return which objects of a panorama are pasted: those of a category, and some others.

    Args:
        category: Index into ``CATEGORIES``.
        whole: Whether enough of the object is visible.
        wanted: The category.
        others: Share of the other objects.
        generator: Of the choice.
    """
    lucky = torch.rand(len(category), generator=generator) < others
    return whole & ((category == wanted) | lucky)


def paste(here: View, donor: View, pasted: Int[Tensor, " n"], shift: int) -> View:
    """Return a picture and its map of instances with objects of another one in front.

    Args:
        here: The picture.
        donor: The other one, of the same size.
        pasted: Ids of the objects that are taken from it.
        shift: What is added to these ids, so that they differ from those that are there.

    Examples:
        >>> ids = torch.tensor([[1, 2]])
        >>> here, there = View(torch.zeros(3, 1, 2), ids), View(torch.ones(3, 1, 2), ids)
        >>> image, ids = paste(here, there, torch.tensor([2]), 10)
        >>> image[0].tolist(), ids.tolist()
        ([[0.0, 1.0]], [[1, 12]])
    """
    taken = torch.isin(donor.instances, pasted)
    return View(
        torch.where(taken, donor.image, here.image),
        torch.where(taken, donor.instances + shift, here.instances),
    )


def still_visible(
    before: Int[Tensor, "rows columns"],
    after: Int[Tensor, "rows columns"],
    instance: Int[Tensor, " n"],
) -> Bool[Tensor, " n"]:
    """Return which objects of a map of instances are still there to be found in another one.

    Objects that were not visible before count as visible: nothing has changed for them.
    """
    length = int(torch.cat((before.flatten(), after.flatten(), instance)).max()) + 1
    count = torch.bincount(before.flatten(), minlength=length)[instance.long()]
    left = torch.bincount(after.flatten(), minlength=length)[instance.long()]
    return left >= _LEFT * count
