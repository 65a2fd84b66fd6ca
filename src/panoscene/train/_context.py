"""Training of the relation graph network, in the paper's three steps."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
from jaxtyping import UInt8
from pydantic import BaseModel, ConfigDict
from torch import Tensor, nn

from panoscene.arrange import PRESETS, ArrangementSettings, optimise_boxes
from panoscene.data import (
    ContextAugmentation,
    ContextSample,
    collate_context,
    context_sample,
    estimates_of,
    noise_of,
    noisy_output,
    read_context_scenes,
    read_estimate_records,
    targets_of,
)
from panoscene.geometry import decode_box_code
from panoscene.models import read_weights, shipped_weights
from panoscene.models.context import (
    CONFIGS,
    ContextNetwork,
    ContextOutput,
    ContextTargets,
    Estimates,
    build_context,
    context_losses,
    fit_calibration,
    joint_losses,
)
from panoscene.models.pose import PoseNetwork, load_pose_stage, pose_losses
from panoscene.models.shape import CONFIGS as SHAPE_CONFIGS
from panoscene.pipeline import PHOTO
from panoscene.synth.dataset import open_dataset

from ._context_arrange import arranged_losses, arrangement_batch
from ._context_scores import (
    arranged,
    box_scores,
    relation_quality,
    relation_scores,
    with_rule,
)
from ._context_views import ViewedScenes, said_by, viewed_scenes
from ._errors import TrainError
from ._panoramas import training_panoramas
from ._pose import birds_eye
from ._precompute_estimates import check_estimates
from ._recipe import TrainRecipe
from ._task import SELECTION, Task

_PICTURES = 2
_THRESHOLDS = (15, 25, 50)


class ContextOptions(BaseModel):
    """Options of the stage in a recipe."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    estimates: Path
    """What ``panoscene precompute --records`` wrote."""
    step: Literal["pose", "relations", "joint"] = "relations"
    """``pose``: boxes only; ``relations``: and relations; ``joint``: with the pose network behind
    its encoder, through the unrolled arrangement."""
    pose: Path | None = None
    """Weights of the pose network, with which the estimates were made; None for those that come
    with the package."""
    augmentation: ContextAugmentation = ContextAugmentation()
    beta: float = 1.0
    """Of smooth L1."""
    box_share: float = 1.0
    """Factor of the losses of refined boxes."""
    relation_share: float = 1.0
    """Factor of the losses of relations."""
    balanced: bool = True
    """Whether true and false answers of a relation weigh alike."""
    relation_features: bool = True
    """Whether pairs know the features of their boxes (Fr)."""
    object_features: bool = True
    """Whether objects know their distances to the room (Fo)."""
    pose_rate: float = 0.1
    """Step ``joint``: learning rate of the pose network, as a share of the other's."""
    pose_share: float = 1.0
    """Step ``joint``: factor of the pose network's own losses."""
    box_losses: bool = True
    """Step ``joint``: whether corners, BFoVs and walls count as in the authors' release."""
    arrange_preset: Literal["photo", "default", "released", "paper"] = "photo"
    """Step ``joint``: settings of the unrolled arrangement; ``photo`` are those of the pipeline,
    with which every step is validated."""
    arrange_steps: int = 10
    """Step ``joint``: of the unrolled arrangement."""


class JointNetwork(nn.Module):
    """The relation graph network, and the pose network behind its encoder.

    Attributes:
        context: The former.
        pose: The latter; its encoder is frozen, for crops are encoded beforehand.
    """

    def __init__(self, context: ContextNetwork, pose: PoseNetwork) -> None:
        super().__init__()
        self.context, self.pose = context, pose
        for module in (pose.backbone, pose.narrow):
            if module is not None:
                module.requires_grad_(requires_grad=False)


class ContextTask(Task):
    """Estimates of the training part; scores on the validation part."""

    def __init__(self, recipe: TrainRecipe) -> None:
        if recipe.data is None:
            raise TrainError("recipe", "data: found none, expected the folder of a data set")
        self.options = options = recipe.stage_options(ContextOptions)
        weights = options.pose or shipped_weights("pose")
        check_estimates(options.estimates, recipe.data, recipe.edition, weights)
        records = read_estimate_records(options.estimates)
        self.scenes = read_context_scenes(training_panoramas(recipe.data, recipe), records)
        self.validation = read_context_scenes(open_dataset(recipe.data, "val")[:], records)
        stage = load_pose_stage(recipe.edition, weights)
        self.pose = stage.network
        self._said = said_by(self.pose)
        self.mean_size = self.pose.mean_size.detach().clone()
        has_shapes = self.scenes[0].record.true.shape_code.shape[-1] > 0
        self.shape_config = SHAPE_CONFIGS[recipe.edition] if has_shapes else None
        changes: dict[str, Any] = {
            "relation_features": options.relation_features,
            "object_features": options.object_features,
            "appearance": self.scenes[0].record.true.appearance.shape[-1],
        }
        if not has_shapes:
            changes |= {"codes": 0, "blobs": 0}
        self.network_config = CONFIGS[recipe.edition].model_copy(update=changes)
        self.network = build_context(self.network_config)
        if recipe.start is not None:
            read_weights(recipe.start, self.network, stage="context", edition=recipe.edition)
        self.joint = options.step == "joint"
        self.pose.requires_grad_(requires_grad=self.joint)
        self.model = JointNetwork(self.network, self.pose) if self.joint else self.network
        presets: Mapping[str, ArrangementSettings] = {**PRESETS, PHOTO.name: PHOTO}
        self.settings = presets[options.arrange_preset].model_copy(
            update={"steps": options.arrange_steps, "safe": False}
        )

    def sample_count(self) -> int:
        return len(self.scenes)

    def sample(self, index: int, generator: torch.Generator) -> ContextSample:
        return context_sample(
            self.scenes, index, self.mean_size, generator, augmentation=self.options.augmentation
        )

    def collate(self, samples: Sequence[Any]) -> dict[str, Tensor]:
        return collate_context(samples)

    def losses(self, model: nn.Module, batch: Mapping[str, Tensor]) -> dict[str, Tensor]:
        options, target = self.options, targets_of(batch)
        context = model.context if isinstance(model, JointNetwork) else model
        with torch.set_grad_enabled(self.joint):
            said = self._said(batch)
        estimates = estimates_of(batch, noisy_output(said, noise_of(batch)), self.shape_config)
        output = context(estimates)
        found = context_losses(output, target, beta=options.beta, balanced=options.balanced)
        boxes = set(pose_losses(said, target.code, target.matched))
        losses = {
            name: value * (options.box_share if name in boxes else options.relation_share)
            for name, value in found.items()
            if name in boxes or options.step != "pose"
        }
        if not self.joint:
            return losses
        if options.box_losses:
            losses |= joint_losses(output, target, estimates)
        own = pose_losses(said, target.code, target.matched & batch["valid"], beta=options.beta)
        losses |= {f"pose_{name}": options.pose_share * value for name, value in own.items()}
        return losses | self._arranged_losses(estimates, output, target)

    def _arranged_losses(
        self, estimates: Estimates, output: ContextOutput, target: ContextTargets
    ) -> dict[str, Tensor]:
        """Return L' of the paper: the losses behind the unrolled arrangement."""
        batch = arrangement_batch(estimates, output, self.network.calibration)
        truth = decode_box_code(
            target.code, estimates.bfov, estimates.mean_size, estimates.camera_height[:, None]
        )
        found = optimise_boxes(batch, self.settings)
        matched = target.matched & estimates.valid
        return arranged_losses(found, truth, matched, estimates.camera_height)

    def validate(self, model: nn.Module, limit: int | None) -> dict[str, float]:
        """Return scores with true BFoVs, and (``found_``) with detections, in estimated layouts.

        ``initial_`` are those of the pose network, with the relations that its boxes have;
        ``arranged_`` those after the arrangement. The relations are calibrated first.
        """
        del model
        views = self._views(limit)
        if self.options.step != "pose":
            self._calibrate(views)
        result: dict[str, float] = {}
        quality = []
        for prefix, seen in views.items():
            scenes = seen.refined(self.network, self._said, self.shape_config)
            first = with_rule(seen.initial(self._said, self.shape_config))
            rows = {"": scenes, "initial_": first}
            if self.options.step != "pose":
                rows |= {"arranged_": arranged(scenes, PHOTO)}
            for row, predicted in rows.items():
                scores = box_scores(predicted, seen.truth)
                if row == "initial_" or (self.options.step != "pose" and not row):
                    scores |= relation_scores(predicted, seen.truth)
                result |= {f"{prefix}{row}{name}": value for name, value in scores.items()}
            quality.append(np.mean([result[f"{prefix}ranked_ap_{t}"] for t in _THRESHOLDS]))
            quality.append(result.get(f"{prefix}iou", 0.0))
            if self.options.step != "pose":
                own = {n.removeprefix(prefix): v for n, v in result.items() if n.startswith(prefix)}
                quality.append(relation_quality(own))
        if self.joint:
            result |= self.gradient_norms()
        result[SELECTION] = float(np.mean(quality))
        return result

    def gradient_norms(self) -> dict[str, float]:
        """Return how long the gradients of the losses on arranged boxes are, in both networks."""
        batch = next(iter(self._views(4).values())).batch
        with torch.enable_grad():
            estimates = estimates_of(batch, self._said(batch), self.shape_config)
            output = self.network(estimates)
            found = self._arranged_losses(estimates, output, targets_of(batch))
            total = torch.stack(list(found.values())).sum()
            norms = {}
            for name, network in (("context", self.network), ("pose", self.pose)):
                parts = [p for p in network.parameters() if p.requires_grad]
                slopes = torch.autograd.grad(total, parts, retain_graph=True, allow_unused=True)
                squares = [float(slope.square().sum()) for slope in slopes if slope is not None]
                norms[f"arranged_gradient_{name}"] = float(np.sqrt(np.sum(squares)))
        return norms

    def _calibrate(self, views: Mapping[str, ViewedScenes]) -> None:
        """Make probabilities mean what they say, for all that was seen."""
        judged = [
            (self.network(seen.estimates(self._said, self.shape_config)), targets_of(seen.batch))
            for seen in views.values()
        ]
        self.network.calibrate(fit_calibration(judged))

    def _views(self, limit: int | None) -> dict[str, ViewedScenes]:
        """Return the validation scenes by what is put before the names of their scores."""
        scenes = self.validation[:limit]
        return {
            "": viewed_scenes(scenes, "true", self.mean_size),
            "found_": viewed_scenes(scenes, "found", self.mean_size),
        }

    def pictures(self, model: nn.Module) -> dict[str, UInt8[np.ndarray, "height width 3"]]:
        """Return rooms from above: refined objects, and the truth in outlines."""
        del model
        seen = next(iter(self._views(_PICTURES).values()))
        scenes = seen.refined(self.network, self._said, self.shape_config)
        return {
            truth.name: birds_eye(replace(scene, relations=None), truth)
            for scene, truth in zip(scenes, seen.truth, strict=True)
        }

    def config(self) -> dict[str, Any]:
        return self.network_config.model_dump(mode="json")

    def parts(self) -> dict[str, tuple[nn.Module, dict[str, Any]]]:
        if not self.joint:
            return {}
        return {
            "context": (self.network, self.config()),
            "pose": (self.pose, self.pose.config.model_dump(mode="json")),
        }

    def rate(self, parameter: str) -> float:
        return self.options.pose_rate if parameter.startswith("pose.") else 1.0


def context_task(recipe: TrainRecipe) -> ContextTask:
    """Return the training of the relation graph network that a recipe describes.

    Raises:
        TrainError: The recipe names no data, its options are not those of the stage, or the
            estimates were made with other weights.
        DatasetError: The data set or the estimates are missing or damaged.
        CheckpointError: Weights are missing or for another network.
    """
    return ContextTask(recipe)
