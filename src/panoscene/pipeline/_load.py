# ruff: noqa: PLC0415
# The imports stand inside: who replaces a stage does not wait for its libraries.
"""The composition root: which networks a pipeline consists of."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any

from panoscene.arrange import ArrangementSettings
from panoscene.models import Edition

from ._pipeline import Pipeline
from ._settings import PHOTO
from ._stages import Stages


def load(
    edition: Edition = "compact",
    *,
    weights: Path | None = None,
    device: str = "cpu",
    shapes: bool = True,
    context: bool = True,
    level: bool = True,
    settings: ArrangementSettings | str | None = PHOTO,
) -> Pipeline:
    """Return a pipeline from photos to scenes.

    Each network of the package is loaded once, when it is first needed: a stage whose result is
    given costs nothing. Weights of one's own are loaded at once, to be sure of them.

    Args:
        edition: ``compact``, whose weights come with the package, or ``paper``.
        weights: folder with detector.safetensors, layout.safetensors, pose.safetensors,
            shape.safetensors and context.safetensors; the weights of the package when None.
        device: where the networks run, such as ``cpu`` or ``cuda``.
        shapes: give objects meshes; without, they are boxes.
        context: refine boxes and predict relations with the relation graph network; without, boxes
            are those of the pose network, and relations follow from them.
        level: turn photos upright whose camera was tilted.
        settings: of the arrangement, or a preset's name; None leaves it out.

    Raises:
        CheckpointError: Weights are missing, damaged, or of another network.
    """
    stages = load_stages(
        edition, weights=weights, device=device, shapes=shapes, context=context, level=level
    )
    return Pipeline(stages, settings=settings)


def load_stages(
    edition: Edition = "compact",
    *,
    weights: Path | None = None,
    device: str = "cpu",
    shapes: bool = True,
    context: bool = True,
    level: bool = True,
) -> Stages:
    """Return the stages of ``load``, to replace some of them: the arguments and errors are its."""

    def lazy(stage: str) -> Any:
        file = None if weights is None else weights / f"{stage}.safetensors"
        found = AtFirstUse(partial(_load_stage, stage, edition, file, device))
        if file is not None:
            found.ready()
        return found

    detector, layout, pose = lazy("detector"), lazy("layout"), lazy("pose")
    # the relation graph network is told of shapes even where nobody wants to see them
    shape = lazy("shape") if shapes or context else None
    reader = None
    if context and shape is not None:
        network = lazy("context")
        reader = AtFirstUse(lambda: _context_reader(pose.ready(), shape.ready(), network.ready()))
    return Stages(
        detector=detector,
        layout=layout,
        pose=pose,
        context=reader,
        shape=shape if shapes else None,
        leveller=AtFirstUse(_leveller) if level else None,
    )


class AtFirstUse:
    """A stage that is loaded when it is first called, once, whichever thread does so."""

    def __init__(self, make: Callable[[], Callable[..., Any]]) -> None:
        self._make = make
        self._made: Callable[..., Any] | None = None
        self._lock = Lock()

    def ready(self) -> Callable[..., Any]:
        """Return the stage, loaded."""
        with self._lock:
            if self._made is None:
                self._made = self._make()
            return self._made

    def __call__(self, *arguments: Any, **options: Any) -> Any:
        """Return what the stage says."""
        return self.ready()(*arguments, **options)


def load_steps(stages: Stages) -> list[Callable[[], object]]:
    """Return what loads the stages that are not loaded yet, in the order of their use.

    Who has nothing to do while the first stages work can take the steps in another thread. An
    error of a step comes again when its stage is used.
    """
    order = (stages.leveller, stages.detector, stages.layout, stages.context or stages.pose)
    return [stage.ready for stage in (*order, stages.shape) if isinstance(stage, AtFirstUse)]


def _load_stage(stage: str, edition: Edition, file: Path | None, device: str) -> Callable[..., Any]:
    if stage == "detector":
        from panoscene.models.detector import load_detector_stage

        return load_detector_stage(edition, file, device)
    if stage == "layout":
        from panoscene.models.layout import load_layout_stage

        return load_layout_stage(edition, file, device)
    if stage == "pose":
        from panoscene.models.pose import load_pose_stage

        return load_pose_stage(edition, file, device)
    if stage == "context":
        from panoscene.models.context import load_context_stage

        return load_context_stage(edition, file, device)
    from panoscene.models.shape import load_shape_stage

    return load_shape_stage(edition, file, device)


def _context_reader(pose: Any, shape: Any, context: Any) -> Callable[..., Any]:
    from ._context import ContextReader

    return ContextReader(pose, shape, context)


def _leveller() -> Callable[..., Any]:
    from panoscene.models.upright import upright_rotation

    return upright_rotation
