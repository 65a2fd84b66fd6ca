"""Samples for the detector: panoramas turned, mirrored and recoloured, and what is in them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import torch
from jaxtyping import Bool, Float, Int, UInt8
from pydantic import BaseModel, ConfigDict, Field
from torch import Tensor

from panoscene.geometry import pixel_from_direction, sample_panorama
from panoscene.models.detector import (
    DetectorConfig,
    DetectorTargets,
    extended,
    window_directions,
)
from panoscene.scene import CATEGORIES
from panoscene.synth.dataset import PanoramaItem

from ._detector_pasting import (
    Pasting,
    View,
    donors_by_category,
    draw_donor,
    draw_pasted,
    paste,
    still_visible,
)
from ._geometric import Motion, random_motion
from ._photometric import Photometric, augment_photo


class DetectorAugmentation(BaseModel):
    """How training samples differ from the panoramas they are made of."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    mirror: float = Field(default=0.5, ge=0, le=1)
    """Share that is mirrored."""
    roll: bool = True
    """Turn by any angle about the vertical, so that the seam is anywhere."""
    tilt_deg: float = Field(default=2.5, ge=0, le=30)
    """Most by which the camera is tilted."""
    tilted: float = Field(default=0.5, ge=0, le=1)
    """Share that is tilted."""
    photometric: Photometric | None = Photometric()
    """Exposure, white balance, noise, blur and the like; None for none of it."""
    pasting: Pasting | None = None
    """Objects of other panoramas; None for none."""


class LabelRules(BaseModel):
    """Which objects the detector must find; the others may be found or not."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    least_side: float = Field(default=6.0, gt=0)
    """Pixels of the network's picture, for both sides of the box."""
    least_pixels: int = Field(default=24, ge=1)
    """Visible ones in the network's picture."""
    most_occlusion: float = Field(default=0.9, ge=0, le=1)
    """Hidden share of the object."""


class DetectorSample(NamedTuple):
    """One picture and what is in it, or a batch of them."""

    image: Float[Tensor, "*batch 3 rows columns"]
    """RGB in [0, 1], as the network sees it."""
    targets: DetectorTargets | list[DetectorTargets]


@dataclass(frozen=True, slots=True)
class LabelledObjects:
    """The objects of a panorama."""

    instance: Int[Tensor, " n"]
    """Value of each in the map of instances."""
    category: Int[Tensor, " n"]
    """Index into ``CATEGORIES``."""
    counts: Bool[Tensor, " n"]
    """Whether it must be found; the others may be."""
    occlusion: Float[Tensor, " n"]
    """Hidden share of it."""


@dataclass(frozen=True, slots=True)
class _Photo:
    """One panorama in memory."""

    image: UInt8[Tensor, "3 height width"]
    instances: Int[Tensor, "height width"]
    photo_from_upright: Float[Tensor, "3 3"]
    objects: LabelledObjects


class DetectorSamples:
    """The panoramas of a set as training samples, read when they are first needed.

    Attributes:
        items: The panoramas.
        config: Of the network.
        rules: Which objects count.
    """

    def __init__(
        self,
        items: Sequence[PanoramaItem],
        config: DetectorConfig,
        rules: LabelRules | None = None,
        *,
        cached: int = 512,
    ) -> None:
        """Remember what to read.

        Args:
            items: Of a rendered set.
            config: Of the network.
            rules: Which objects count.
            cached: How many panoramas are kept in memory (2.5 MB each at 1024 x 512).
        """
        self.items = tuple(items)
        self.config = config
        self.rules = rules or LabelRules()
        self._cached = cached
        self._photos: dict[int, _Photo] = {}
        self._directions = window_directions(config)
        self._donors: dict[float, dict[int, tuple[int, ...]]] = {}

    def __len__(self) -> int:
        """Return how many panoramas there are."""
        return len(self.items)

    def plain(self, index: int) -> DetectorSample:
        """Return a panorama as it is, made upright, and its targets."""
        image, seen = self._moved(index, Motion(False, 0, self.config.width))
        objects = self._photo(index).objects
        targets = window_targets(seen, objects, self.config, self.rules, 0)
        return DetectorSample(extended(image, self.config), targets)

    def augmented(
        self, index: int, generator: torch.Generator, settings: DetectorAugmentation
    ) -> DetectorSample:
        """Return a panorama changed at random, and its targets: a pure function."""
        view = self._moved(index, self._motion(generator, settings))
        seed = int(torch.randint(2**31, (), generator=generator))
        objects = self._photo(index).objects
        if settings.pasting is not None:
            view, objects = self._pasted(view, objects, generator, settings)
        image, seen = view
        if settings.photometric is not None:
            image = augment_photo(image, generator, settings.photometric)
        targets = window_targets(seen, objects, self.config, self.rules, seed)
        return DetectorSample(extended(image, self.config), targets)

    def _motion(self, generator: torch.Generator, settings: DetectorAugmentation) -> Motion:
        return random_motion(
            self.config.width,
            generator,
            mirror=settings.mirror,
            roll=settings.roll,
            tilt=math.radians(settings.tilt_deg),
            tilted=settings.tilted,
        )

    def _moved(self, index: int, motion: Motion) -> View:
        """Return the network's picture of a panorama and the instance id of each pixel."""
        photo = self._photo(index)
        height, width = photo.instances.shape
        # the transpose of a rotation is its inverse, and a row vector times it applies it
        turn = (photo.photo_from_upright @ motion.new_from_old.mT).mT
        uv = pixel_from_direction((self._directions.double() @ turn).float(), height, width)
        image = sample_panorama(photo.image.float().div_(255.0), uv)
        column = uv[..., 0].floor().long() % width
        row = uv[..., 1].floor().long().clamp_(0, height - 1)
        return View(image.clamp_(0.0, 1.0), photo.instances[row, column])

    def _pasted(
        self,
        view: View,
        objects: LabelledObjects,
        generator: torch.Generator,
        settings: DetectorAugmentation,
    ) -> tuple[View, LabelledObjects]:
        """Return a view with objects of another panorama, and all objects."""
        pasting = settings.pasting or Pasting(share=0.0)
        if float(torch.rand((), generator=generator)) >= pasting.share:
            return view, objects
        worst = pasting.most_occlusion
        if worst not in self._donors:
            self._donors[worst] = donors_by_category(self.items, worst)
        drawn = draw_donor(self._donors[worst], generator)
        if drawn is None:
            return view, objects
        wanted, index = drawn
        donor = self._moved(index, self._motion(generator, settings))
        given = self._photo(index).objects
        whole = given.counts & (given.occlusion <= worst)
        chosen = draw_pasted(given.category, whole, wanted, pasting.others, generator)
        shift = int(view.instances.max())
        after = paste(view, donor, given.instance[chosen], shift)
        kept = objects.counts & still_visible(view.instances, after.instances, objects.instance)
        merged = LabelledObjects(
            torch.cat((objects.instance, given.instance[chosen] + shift)),
            torch.cat((objects.category, given.category[chosen])),
            torch.cat((kept, given.counts[chosen])),
            torch.cat((objects.occlusion, given.occlusion[chosen])),
        )
        return after, merged

    def _photo(self, index: int) -> _Photo:
        if index in self._photos:
            return self._photos[index]
        item = self.items[index]
        upright = torch.tensor(item.scene().panorama.upright_from_photo, dtype=torch.float64)
        photo = _Photo(
            item.image().mul(255.0).round().to(torch.uint8),
            item.instance().to(torch.int32),
            upright.mT,
            labelled_objects(item, self.rules),
        )
        if len(self._photos) < self._cached:
            self._photos[index] = photo
        return photo


def labelled_objects(item: PanoramaItem, rules: LabelRules) -> LabelledObjects:
    """Return the objects of a panorama; those in scene.json that are not too hidden count.

    Raises:
        DatasetError: A file of the panorama is missing or damaged.
    """
    labels, worst = item.labels().objects, rules.most_occlusion
    return LabelledObjects(
        torch.tensor([x.instance for x in labels], dtype=torch.int32),
        torch.tensor([CATEGORIES.index(x.category) for x in labels], dtype=torch.long),
        torch.tensor([x.in_scene and x.occlusion <= worst for x in labels], dtype=torch.bool),
        torch.tensor([x.occlusion for x in labels], dtype=torch.float32),
    )


def collate_detector(samples: Sequence[DetectorSample]) -> DetectorSample:
    """Return a batch of samples."""
    targets = [one for s in samples for one in _listed(s.targets)]
    return DetectorSample(torch.stack([s.image for s in samples]), targets)


def window_targets(
    instances: Int[Tensor, "rows columns"],
    objects: LabelledObjects,
    config: DetectorConfig,
    rules: LabelRules,
    seed: int,
) -> DetectorTargets:
    """Return what the detector shall find in a picture, from the map of its instances.

    Args:
        instances: Instance id of each pixel of the picture, before any extension.
        objects: Of the panorama.
        config: Of the network: how it sees the seam.
        rules: Which of them do not have to be found after all.
        seed: Of the choices in the losses.
    """
    masks = instances == objects.instance[:, None, None]
    seen = masks.flatten(1).any(1)
    masks = masks[seen]
    instance, category, counts = (
        values[seen] for values in (objects.instance, objects.category, objects.counts)
    )
    boxes = circular_boxes(masks)
    side = (boxes[:, 2:] - boxes[:, :2]).amin(-1)
    counts = counts & (side >= rules.least_side)
    counts = counts & (masks.flatten(1).sum(1) >= rules.least_pixels)
    index = torch.arange(len(boxes))
    if config.seam != "circular":
        boxes, index, whole = _flat_boxes(boxes, config)
        counts = counts[index] & whole
    return DetectorTargets(
        boxes[counts],
        category[index][counts],
        instance[index][counts],
        instances,
        boxes[~counts],
        seed,
    )


def circular_boxes(masks: Bool[Tensor, "n rows columns"]) -> Float[Tensor, "n 4"]:
    """Return the tightest boxes around masks on a cylinder: what is left of the widest gap.

    The left edge is on the picture; the right one may be beyond it. Masks must not be empty.

    Examples:
        >>> mask = torch.zeros(1, 2, 8, dtype=torch.bool)
        >>> mask[:, 0, [0, 7]] = True
        >>> circular_boxes(mask).tolist()
        [[7.0, 0.0, 9.0, 1.0]]
    """
    rows, columns = masks.shape[-2:]
    row = masks.any(-1).int()
    top = row.argmax(-1)
    bottom = rows - row.flip(-1).argmax(-1)
    column = masks.any(-2)
    place = torch.arange(2 * columns)
    last = torch.where(column.repeat(1, 2), place, -1).cummax(-1).values
    gap = place[columns:] - last[:, columns - 1 : -1]
    gap = torch.where(column, gap, 0)
    widest, left = gap.max(-1)
    return torch.stack((left, top, left + columns - widest + 1, bottom), -1).float()


def _flat_boxes(
    boxes: Float[Tensor, "n 4"], config: DetectorConfig
) -> tuple[Float[Tensor, "m 4"], Int[Tensor, " m"], Bool[Tensor, " m"]]:
    """Return boxes in a picture with edges, the box each comes from, and whether it is whole."""
    end = config.width * (1.5 if config.seam == "extend" else 1.0)
    shift = torch.tensor([-1.0, 0.0, 1.0])[:, None, None] * config.width
    copies = boxes + shift * torch.tensor([1.0, 0.0, 1.0, 0.0])
    left, right = copies[..., 0].clamp(0, end), copies[..., 2].clamp(0, end)
    share = (right - left) / (copies[..., 2] - copies[..., 0]).clamp_min(1e-6)
    copies = torch.stack((left, copies[..., 1], right, copies[..., 3]), -1).flatten(0, 1)
    index = torch.arange(len(boxes)).repeat(3)
    here = (right - left).flatten() >= 1.0
    # without extension there is nowhere to see the object whole: its parts are what is to be found
    whole = (share.flatten() > 0.999) | (config.seam == "none")
    return copies[here], index[here], whole[here]


def _listed(targets: DetectorTargets | list[DetectorTargets]) -> list[DetectorTargets]:
    return targets if isinstance(targets, list) else [targets]
