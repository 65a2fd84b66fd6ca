"""Training of the detector."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import UInt8
from pydantic import BaseModel, ConfigDict, Field
from torch import Tensor, nn

from panoscene.data._detector_samples import (
    DetectorAugmentation,
    DetectorSample,
    DetectorSamples,
    LabelRules,
    collate_detector,
)
from panoscene.data._detector_truth import SeenObjects, repeated_items, seen_objects
from panoscene.models import read_weights
from panoscene.models.detector import (
    CONFIGS,
    DetectorStage,
    Seam,
    build_detector,
    load_coco_weights,
)
from panoscene.scene import Detections, upright_photo
from panoscene.synth.dataset import open_dataset

from ._detector_pictures import detector_picture
from ._detector_scores import detector_scores
from ._errors import TrainError
from ._panoramas import training_panoramas
from ._recipe import TrainRecipe
from ._task import SELECTION, Task

_PICTURES = 6
_SCORE = 0.02  # of detections that are scored; AP wants the doubtful ones too
_SHOWN = 0.3


class DetectorOptions(BaseModel):
    """Options of the stage in a recipe."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    augmentation: DetectorAugmentation = DetectorAugmentation()
    rules: LabelRules = LabelRules()
    seam: Seam | None = None
    """How the network sees the seam; None for what its edition does."""
    coco: Path | None = None
    """File of torchvision's Mask R-CNN trained on COCO, for the paper's edition to start from."""
    rare_share: float = Field(default=0.0, ge=0, le=1)
    """Panoramas with a category that fewer than this share have come more often."""
    proposal_weight: float = Field(default=1.0, gt=0)
    box_weight: float = Field(default=1.0, gt=0)
    mask_weight: float = Field(default=1.0, gt=0)
    validation_height: int = Field(default=512, gt=0)
    """Rows of the masks that are compared."""
    cached: int = Field(default=512, ge=0)
    """Panoramas that each process keeps in memory."""


@dataclass(frozen=True, slots=True)
class _Seen:
    """A panorama to validate on."""

    name: str
    image: UInt8[Tensor, "3 height width"]
    truth: SeenObjects


class DetectorTask(Task):
    """Objects of the training part; AP and recall on the validation part."""

    def __init__(self, recipe: TrainRecipe, data: Path) -> None:
        self.options = recipe.stage_options(DetectorOptions)
        config = CONFIGS[recipe.edition]
        if self.options.seam is not None:
            config = config.model_copy(update={"seam": self.options.seam})
        self.network_config = config
        train = training_panoramas(data, recipe)
        self.order = repeated_items(train, self.options.rare_share)
        self.samples = DetectorSamples(
            train, config, self.options.rules, cached=self.options.cached
        )
        self.validation = open_dataset(data, "val")[:]
        others = recipe.start is not None or self.options.coco is not None
        self.network = build_detector(config, imagenet=recipe.imagenet and not others)
        self.model = self.network
        if self.options.coco is not None:
            load_coco_weights(self.network, self.options.coco)
        if recipe.start is not None:
            read_weights(recipe.start, self.network, stage="detector", edition=recipe.edition)
        self._seen: list[_Seen] = []

    def sample_count(self) -> int:
        return len(self.order)

    def sample(self, index: int, generator: torch.Generator) -> DetectorSample:
        item = self.order[index]
        return self.samples.augmented(item, generator, self.options.augmentation)

    def collate(self, samples: Sequence[Any]) -> DetectorSample:
        return collate_detector(samples)

    def losses(self, model: nn.Module, batch: DetectorSample) -> dict[str, Tensor]:
        terms = model(batch.image, batch.targets)
        options = self.options
        return terms | {
            "objectness": options.proposal_weight * terms["objectness"],
            "proposal_box": options.proposal_weight * terms["proposal_box"],
            "box": options.box_weight * terms["box"],
            "mask": options.mask_weight * terms["mask"],
        }

    def validate(self, model: nn.Module, limit: int | None) -> dict[str, float]:
        """Return COCO's AP of masks and boxes and recall of BFoVs; the selection is mask AP50."""
        del model
        chosen = self._validation(limit)
        found = [self._found(one, _SCORE) for one in chosen]
        scores = detector_scores(found, [one.truth for one in chosen])
        scores[SELECTION] = scores["mask_ap50"]
        return scores

    def pictures(self, model: nn.Module) -> dict[str, UInt8[np.ndarray, "height width 3"]]:
        """Return panoramas with what was found, above what is there."""
        del model
        made = {}
        for one in self._validation(_PICTURES):
            seen = one.truth
            wanted = ~seen.ignored
            truth = Detections(
                seen.bfov[wanted],
                seen.category[wanted],
                torch.ones(int(wanted.sum())),
                seen.mask[wanted],
            )
            made[one.name] = detector_picture(
                one.image.float() / 255, self._found(one, _SHOWN), truth
            )
        return made

    def config(self) -> dict[str, Any]:
        return self.network_config.model_dump(mode="json")

    def _found(self, one: _Seen, score: float) -> Detections:
        height = one.image.shape[-2]
        stage = DetectorStage(self.network, score_threshold=score, mask_height=height)
        return stage(one.image.float() / 255)

    def _validation(self, limit: int | None) -> list[_Seen]:
        count = len(self.validation) if limit is None else min(limit, len(self.validation))
        for item in self.validation[len(self._seen) : count]:
            photo = upright_photo(item.image(), item.scene().panorama)
            image = photo.clamp(0, 1).mul(255).round().to(torch.uint8)
            truth = seen_objects(item, self.options.rules)
            self._seen.append(_Seen(item.name, image, truth))
        return self._seen[:count]


def detector_task(recipe: TrainRecipe) -> DetectorTask:
    """Return the task of a recipe.

    Raises:
        TrainError: The recipe names no data.
    """
    if recipe.data is None:
        raise TrainError("recipe", "data: expected the folder of a rendered set, found none")
    return DetectorTask(recipe, recipe.data)
