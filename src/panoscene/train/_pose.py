"""Training of the pose network."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import torch
from jaxtyping import UInt8
from pydantic import BaseModel, ConfigDict
from torch import Tensor, nn

from panoscene.data import (
    PoseAugmentation,
    PoseSample,
    PoseScene,
    code_of,
    collate_pose,
    crops_of_photo,
    mean_sizes,
    pose_sample,
    read_pose_scenes,
    read_stage_records,
)
from panoscene.models import read_weights
from panoscene.models.pose import CONFIGS, PoseNetwork, PoseStage, build_pose, pose_losses
from panoscene.scene import Detections, Layout, Objects, Scene
from panoscene.synth.dataset import open_dataset

from ._errors import TrainError
from ._panoramas import training_panoramas
from ._pose_scores import detection_scores, floor_box_objects, paired_errors
from ._recipe import TrainRecipe
from ._task import SELECTION, Task

_PICTURES = 2


class PoseOptions(BaseModel):
    """Options of the stage in a recipe."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    augmentation: PoseAugmentation = PoseAugmentation()
    detections: Path | None = None
    """What ``panoscene precompute`` wrote; None trains on moved true BFoVs alone."""
    frozen_layers: int = 0
    """Layers of the encoder, from the first on, that keep their ImageNet weights."""
    beta: float = 1.0
    """Of smooth L1."""
    backbone_rate: float = 1.0
    """Learning rate of the encoder, as a share of the others'."""
    fixed_norms: bool = False
    """Whether the encoder's batch norms keep their ImageNet statistics."""


@dataclass(frozen=True, slots=True)
class _Seen:
    """A scene to validate on."""

    truth: Scene
    seen: Detections
    layout: Layout
    crops: UInt8[Tensor, "n 3 rows columns"]


class PoseTask(Task):
    """Scenes of the training part; scores on the validation part."""

    def __init__(self, recipe: TrainRecipe) -> None:
        if recipe.data is None:
            raise TrainError("recipe", "data: found none, expected the folder of a data set")
        data = recipe.data
        self.options = recipe.stage_options(PoseOptions)
        self.network_config = CONFIGS[recipe.edition]
        folder = self.options.detections
        found = {} if folder is None else read_stage_records(folder)
        self.scenes = read_pose_scenes(training_panoramas(data, recipe), found)
        if folder is not None and all(scene.found is None for scene in self.scenes):
            reason = "found records of other panoramas only, expected some of the training part"
            raise TrainError(folder, reason)
        self.validation = read_pose_scenes(open_dataset(data, "val")[:], found)
        imagenet = recipe.imagenet and recipe.start is None
        self.network = build_pose(self.network_config, imagenet=imagenet)
        self.model = self.network
        self.mean_size = mean_sizes([scene.scene for scene in self.scenes])
        self.network.mean_size.copy_(self.mean_size)
        if recipe.start is not None:
            read_weights(recipe.start, self.network, stage="pose", edition=recipe.edition)
            self.mean_size = self.network.mean_size.clone()
        freeze_layers(self.network, self.options.frozen_layers)
        self._seen: list[_Seen] | None = None

    def sample_count(self) -> int:
        return len(self.scenes)

    def sample(self, index: int, generator: torch.Generator) -> PoseSample:
        return pose_sample(
            self.scenes[index],
            self.mean_size,
            self.network_config.crop_px,
            generator,
            augmentation=self.options.augmentation,
        )

    def collate(self, samples: Sequence[Any]) -> dict[str, Tensor]:
        return collate_pose(samples)

    def losses(self, model: nn.Module, batch: Mapping[str, Tensor]) -> dict[str, Tensor]:
        if self.options.fixed_norms:
            fix_norms(self.network)
        output = model(
            batch["crops"],
            batch["bfov"],
            batch["category"],
            batch["valid"],
            clues=batch["clues"],
            pictured=batch["pictured"],
        )
        matched = batch["matched"] & batch["valid"]
        return pose_losses(output, code_of(batch), matched, beta=self.options.beta)

    def validate(self, model: nn.Module, limit: int | None) -> dict[str, float]:
        """Return scores with the true BFoVs, without a layout and (``room_``) with the true one.

        ``floor_`` are those of the trivial baseline; ``found_`` those with detections.
        """
        del model
        chosen = self._validation_scenes()[:limit]
        truth = [one.truth for one in chosen]
        result: dict[str, float] = {}
        encoded = self._encoded(chosen)
        for prefix, with_room in (("", False), ("room_", True)):
            objects = self._placed(chosen, encoded, with_room=with_room)
            scores = detection_scores(objects, truth) | paired_errors(objects, truth)
            result |= {prefix + name: value for name, value in scores.items()}
        floor = [
            floor_box_objects(scene.objects, self.mean_size, scene.panorama.camera_height)
            for scene in truth
        ]
        scores = detection_scores(floor, truth) | paired_errors(floor, truth)
        result |= {f"floor_{name}": value for name, value in scores.items()}
        result |= self._found_scores(limit)
        result[SELECTION] = float(
            np.mean([result[f"{prefix}ap_{t}"] for prefix in ("", "room_") for t in (15, 25, 50)])
        )
        return result

    def pictures(self, model: nn.Module) -> dict[str, UInt8[np.ndarray, "height width 3"]]:
        """Return rooms from above: predicted objects, and the truth in outlines."""
        del model
        chosen = self._validation_scenes()[:_PICTURES]
        objects = self._placed(chosen, self._encoded(chosen), with_room=True)
        return {
            one.truth.name: birds_eye(replace(one.truth, objects=found, relations=None), one.truth)
            for one, found in zip(chosen, objects, strict=True)
        }

    def config(self) -> dict[str, Any]:
        return self.network_config.model_dump(mode="json")

    def rate(self, parameter: str) -> float:
        return self.options.backbone_rate if parameter.startswith("backbone.") else 1.0

    def _encoded(self, chosen: Sequence[_Seen]) -> list[Tensor]:
        device = self.network.mean_size.device
        return [self.network.encoded(one.crops.to(device).float() / 255) for one in chosen]

    def _placed(
        self, chosen: Sequence[_Seen], encoded: Sequence[Tensor], *, with_room: bool
    ) -> list[Objects]:
        stage = PoseStage(self.network)
        return [
            stage.placed(
                feature,
                one.seen,
                one.layout if with_room else None,
                one.truth.panorama.camera_height,
            )
            for one, feature in zip(chosen, encoded, strict=True)
        ]

    def _validation_scenes(self) -> list[_Seen]:
        if self._seen is None:
            self._seen = [
                _seen(
                    scene,
                    _true_detections(scene.scene),
                    scene.scene.layout,
                    self.network_config.crop_px,
                )
                for scene in self.validation
            ]
        return self._seen

    def _found_scores(self, limit: int | None) -> dict[str, float]:
        scenes = [scene for scene in self.validation[:limit] if scene.found is not None]
        if not scenes:
            return {}
        chosen = [
            _seen(
                scene,
                scene.found.detections,
                scene.found.layout or scene.scene.layout,
                self.network_config.crop_px,
            )
            for scene in scenes
            if scene.found is not None
        ]
        objects = self._placed(chosen, self._encoded(chosen), with_room=True)
        scores = detection_scores(objects, [one.truth for one in chosen])
        return {f"found_{name}": value for name, value in scores.items()}


def pose_task(recipe: TrainRecipe) -> PoseTask:
    """Return the training of the pose network that a recipe describes.

    Raises:
        TrainError: The recipe names no data, or its options are not those of the stage.
        DatasetError: The data set is missing or damaged.
        CheckpointError: The ImageNet weights are not there.
    """
    return PoseTask(recipe)


def freeze_layers(network: PoseNetwork, count: int) -> None:
    """Keep the encoder's first layers as they are; their gradients are not even computed.

    Args:
        network: Changed in place.
        count: 1 is the stem with its norm, and so on.
    """
    layers: list[nn.Module] = []
    for child in network.backbone.network.children():
        layers += list(child) if isinstance(child, nn.Sequential) else [child]
    # the stem is a kernel and its norm
    for layer in layers[: count + 1 if count else 0]:
        layer.requires_grad_(requires_grad=False)


def fix_norms(network: PoseNetwork) -> None:
    """Let the encoder's batch norms use their stored statistics, which stay as they are."""
    for module in network.backbone.modules():
        if isinstance(module, nn.BatchNorm2d):
            module.eval()


def birds_eye(scene: Scene, reference: Scene) -> UInt8[np.ndarray, "height width 3"]:
    """Return the picture of a room from above, with the boxes of another scene in outlines."""
    from PIL import Image  # noqa: PLC0415

    from panoscene.views import draw_birds_eye  # noqa: PLC0415

    with TemporaryDirectory() as folder:
        path = Path(folder) / "room.png"
        draw_birds_eye(scene, path, reference=reference, relations=False)
        with Image.open(path) as picture:
            return np.asarray(picture.convert("RGB"))


def _seen(scene: PoseScene, seen: Detections, layout: Layout, crop_px: int) -> _Seen:
    photo_from_upright = torch.tensor(scene.scene.panorama.upright_from_photo).T
    crops = crops_of_photo(scene.item.image(), seen.bfov, crop_px, photo_from_upright)
    return _Seen(scene.scene, seen, layout, (crops.clamp(0, 1) * 255).round().to(torch.uint8))


def _true_detections(scene: Scene) -> Detections:
    objects = scene.objects
    return Detections(objects.bfov, objects.category, objects.score)
