"""Training of the layout network."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, UInt8
from pydantic import BaseModel, ConfigDict, Field
from torch import Tensor, nn

from panoscene.data import LayoutAugmentation, LayoutSample, LayoutSamples, collate_layout
from panoscene.eval import LayoutRecord, layout_record, score_layout
from panoscene.models import read_weights
from panoscene.models.layout import (
    CONFIGS,
    LayoutPrediction,
    LayoutStage,
    build_layout,
    layout_losses,
)
from panoscene.scene import Scene
from panoscene.synth.dataset import open_dataset

from ._errors import TrainError
from ._layout_pictures import layout_picture
from ._panoramas import training_panoramas
from ._recipe import TrainRecipe
from ._task import SELECTION, Task

_PICTURES = 6
_MEASURES = ("iou_2d", "iou_3d", "corner_error", "pixel_error")


class LayoutOptions(BaseModel):
    """Options of the stage in a recipe."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    augmentation: LayoutAugmentation = LayoutAugmentation()
    boundary_weight: float = Field(default=1.0, gt=0)
    """Weight of the boundary's loss; 1 as published."""
    corner_weight: float = Field(default=1.0, gt=0)
    """Weight of the corners' loss; 1 as published."""
    backbone_rate: float = Field(default=1.0, ge=0)
    """Factor of the backbone's learning rate."""
    cached: int = Field(default=512, ge=0)
    """Panoramas that each process keeps in memory."""


@dataclass(frozen=True, slots=True)
class _Seen:
    """A panorama to validate on."""

    truth: Scene
    image: UInt8[Tensor, "3 rows columns"]


class LayoutTask(Task):
    """Rooms of the training part; scores on the validation part."""

    def __init__(self, recipe: TrainRecipe, data: Path) -> None:
        self.options = recipe.stage_options(LayoutOptions)
        self.network_config = CONFIGS[recipe.edition]
        size = (self.network_config.image_height, self.network_config.image_width)
        cached = self.options.cached
        self.samples = LayoutSamples(training_panoramas(data, recipe), size, cached=cached)
        self.validation = LayoutSamples(open_dataset(data, "val")[:], size, cached=0)
        imagenet = recipe.imagenet and recipe.start is None
        self.network = build_layout(self.network_config, imagenet=imagenet)
        self.model = self.network
        if recipe.start is not None:
            read_weights(recipe.start, self.network, stage="layout", edition=recipe.edition)
        self._seen: list[_Seen] = []

    def sample_count(self) -> int:
        return len(self.samples)

    def sample(self, index: int, generator: torch.Generator) -> LayoutSample:
        return self.samples.augmented(index, generator, self.options.augmentation)

    def collate(self, samples: Sequence[Any]) -> LayoutSample:
        return collate_layout(samples)

    def losses(self, model: nn.Module, batch: LayoutSample) -> dict[str, Tensor]:
        return layout_losses(
            model(batch.image),
            batch.boundary,
            batch.corner,
            boundary_weight=self.options.boundary_weight,
            corner_weight=self.options.corner_weight,
        )

    def validate(self, model: nn.Module, limit: int | None) -> dict[str, float]:
        """Return layout scores, by number of corners; ``raw_`` are those of the raw polygon.

        The selection is the mean 3D IoU of the regularised and of the raw polygon.
        """
        del model
        stage = LayoutStage(self.network)
        chosen = self._validation_rooms(limit)
        found = [_predicted(stage, one) for one in chosen]
        records = [
            layout_record(scene_of(prediction, one.truth), one.truth)
            for prediction, one in zip(found, chosen, strict=True)
        ]
        scores = layout_scores(records)
        scores["ambiguous"] = float(np.mean([one.ambiguous for one in found]))
        scores[SELECTION] = (scores["iou_3d"] + scores["raw_iou_3d"]) / 2
        return scores

    def pictures(self, model: nn.Module) -> dict[str, UInt8[np.ndarray, "height width 3"]]:
        """Return panoramas with true and found boundaries, beside the floor plans."""
        del model
        stage = LayoutStage(self.network)
        return {
            one.truth.name: layout_picture(one.image.numpy(), _predicted(stage, one), one.truth)
            for one in self._validation_rooms(_PICTURES)
        }

    def config(self) -> dict[str, Any]:
        return self.network_config.model_dump(mode="json")

    def rate(self, parameter: str) -> float:
        return self.options.backbone_rate if parameter.startswith("backbone.") else 1.0

    def _validation_rooms(self, limit: int | None) -> list[_Seen]:
        count = len(self.validation) if limit is None else min(limit, len(self.validation))
        for index in range(len(self._seen), count):
            scene = self.validation.items[index].scene()
            image = self.validation.photo(index).mul(255).round().to(torch.uint8)
            self._seen.append(_Seen(scene, image))
        return self._seen[:count]


def layout_task(recipe: TrainRecipe) -> LayoutTask:
    """Return the task of a recipe.

    Raises:
        TrainError: The recipe names no data.
    """
    if recipe.data is None:
        raise TrainError("recipe", "data: expected the folder of a rendered set, found none")
    return LayoutTask(recipe, recipe.data)


def scene_of(prediction: LayoutPrediction, truth: Scene) -> Scene:
    """Return the prediction as a scene with the panorama of the truth."""
    return Scene(truth.panorama, prediction.layout, truth.objects, name=truth.name)


def layout_scores(records: Sequence[LayoutRecord]) -> dict[str, float]:
    """Return mean scores by name: ``iou_3d``, ``raw_iou_3d``, ``iou_3d_4`` (4 corners) and so on.

    IoUs are in [0, 1]; corner and pixel errors in percent.
    """
    scores: dict[str, float] = {}
    for row in score_layout(records):
        prefix = "raw_" if row.reading == "raw" else ""
        suffix = "" if row.corners == "overall" else f"_{row.corners}"
        for measure in _MEASURES:
            scores[f"{prefix}{measure}{suffix}"] = float(getattr(row.mean, measure))
        if row.reading == "regularised":
            scores[f"scenes{suffix}"] = float(row.scenes)
    return scores


def _predicted(stage: LayoutStage, one: _Seen) -> LayoutPrediction:
    image: Float[Tensor, "3 rows columns"] = one.image.float() / 255
    return stage(image, camera_height=one.truth.panorama.camera_height)
