# ruff: noqa: PLC0415
# The imports stand inside: who replaces a stage does not wait for its libraries.
"""The composition root: which networks a pipeline consists of."""

from pathlib import Path

from panoscene.arrange import ArrangementSettings
from panoscene.models import Edition

from ._pipeline import Pipeline
from ._stages import Stages


def load(
    edition: Edition = "compact",
    *,
    weights: Path | None = None,
    device: str = "cpu",
    shapes: bool = True,
    level: bool = True,
    settings: ArrangementSettings | str | None = "default",
) -> Pipeline:
    """Return a pipeline with its networks loaded.

    Args:
        edition: ``compact``, whose weights come with the package, or ``paper``.
        weights: folder with detector.safetensors, layout.safetensors, pose.safetensors and
            shape.safetensors; the weights of the package when None.
        device: where the networks run, such as ``cpu`` or ``cuda``.
        shapes: give objects meshes; without, they are boxes.
        level: turn photos upright whose camera was tilted.
        settings: of the arrangement, or a preset's name; None leaves it out.

    Raises:
        CheckpointError: Weights are missing, damaged, or of another network.
    """
    from panoscene.models.detector import load_detector_stage
    from panoscene.models.layout import load_layout_stage
    from panoscene.models.pose import load_pose_stage
    from panoscene.models.shape import load_shape_stage
    from panoscene.models.upright import upright_rotation

    def file(stage: str) -> Path | None:
        return None if weights is None else weights / f"{stage}.safetensors"

    stages = Stages(
        detector=load_detector_stage(edition, file("detector"), device),
        layout=load_layout_stage(edition, file("layout"), device),
        pose=load_pose_stage(edition, file("pose"), device),
        shape=load_shape_stage(edition, file("shape"), device) if shapes else None,
        leveller=upright_rotation if level else None,
    )
    return Pipeline(stages, settings=settings)
