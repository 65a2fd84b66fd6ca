"""Scenes to validate the relation graph network on, as one batch, and back to scenes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.data import ContextScene, collate_context, estimates_of, plain_context_sample
from panoscene.models.context import (
    ContextNetwork,
    ContextStage,
    Estimates,
)
from panoscene.models.context import objects_of as objects_in
from panoscene.models.pose import PoseNetwork, PoseOutput
from panoscene.models.shape import ShapeConfig
from panoscene.scene import Layout, Objects, Scene

View = Literal["true", "found"]
"""True BFoVs, or detections."""
Said = Callable[[Mapping[str, Tensor]], PoseOutput]
"""What the pose network says of a batch."""


def said_by(pose: PoseNetwork) -> Said:
    """Return what lets a pose network place the objects of a batch, whose crops are encoded."""

    def said(batch: Mapping[str, Tensor]) -> PoseOutput:
        valid = batch["valid"]
        # dropout would make the initial poses others than those of the pipeline
        pose.to(valid.device).eval()
        return pose.placed(
            batch["appearance"][valid], batch["bfov"], batch["category"], valid,
            clues=batch["clues"] if pose.config.clues else None,
        )  # fmt: skip

    return said


@dataclass(frozen=True, slots=True)
class ViewedScenes:
    """What the first stages see of some scenes, and the truth."""

    truth: list[Scene]
    layouts: list[Layout]
    batch: dict[str, Tensor]

    def estimates(self, said: Said, shape: ShapeConfig | None) -> Estimates:
        """Return what the relation graph network is given."""
        return estimates_of(self.batch, said(self.batch), shape)

    def initial(self, said: Said, shape: ShapeConfig | None) -> list[Scene]:
        """Return the scenes as the pose network sees them, without relations."""
        estimates = self.estimates(said, shape)
        return [
            self._scene(k, objects=objects_in(estimates.output, estimates, k))
            for k in range(len(self.truth))
        ]

    def refined(
        self, network: ContextNetwork, said: Said, shape: ShapeConfig | None
    ) -> list[Scene]:
        """Return the scenes as the relation graph network sees them."""
        training = network.training
        found = ContextStage(network)(self.estimates(said, shape))
        network.train(training)
        return [
            replace(self._scene(k, objects=objects), relations=relations)
            for k, (objects, relations) in enumerate(found)
        ]

    def _scene(self, index: int, objects: Objects) -> Scene:
        layout = self.layouts[index]
        return replace(self.truth[index], layout=layout, objects=objects, relations=None)


def viewed_scenes(
    scenes: Sequence[ContextScene],
    view: View,
    mean_size: Float[Tensor, "57 3"],
    *,
    true_layout: bool = False,
) -> ViewedScenes:
    """Return scenes as they are, in the estimated layout where there is one.

    Args:
        scenes: Of the validation part.
        view: What is seen of them.
        mean_size: Metres, of each category: that of the pose network.
        true_layout: Take the true layout instead.

    Raises:
        ValueError: There are no scenes.
    """
    if not scenes:
        raise ValueError("scenes: found none, expected at least one")
    layouts = [
        one.scene.layout if true_layout else one.record.layout or one.scene.layout for one in scenes
    ]
    samples = [
        plain_context_sample(one, getattr(one.record, view), layout, mean_size)
        for one, layout in zip(scenes, layouts, strict=True)
    ]
    with torch.inference_mode(mode=False):
        batch = collate_context(samples)
    return ViewedScenes([one.scene for one in scenes], layouts, batch)
