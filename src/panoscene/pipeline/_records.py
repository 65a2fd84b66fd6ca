"""What goes into a pipeline beside the photo, and what comes out."""

from dataclasses import dataclass

from jaxtyping import Float
from torch import Tensor

from panoscene.arrange import Certificate
from panoscene.models.layout import LayoutPrediction
from panoscene.scene import Detections, Layout, Objects, Relations, Scene


@dataclass(frozen=True, slots=True)
class Given:
    """Records that take the place of stages: ground truth, or another program's output.

    They are in the frame of the upright panorama.
    """

    detections: Detections | None = None
    layout: Layout | None = None
    objects: Objects | None = None
    """Boxes for the arrangement to start from; no detector and no pose network is run."""
    relations: Relations | None = None
    """Relations for the arrangement, instead of those that follow from its first boxes."""


@dataclass(frozen=True, slots=True)
class Reconstruction:
    """A scene from a photo, and how it came about."""

    scene: Scene
    """The result."""
    initial: Scene
    """The same objects before they were arranged."""
    image: Float[Tensor, "3 height width"]
    """The panorama that the networks saw: upright, RGB in [0, 1]."""
    certificate: Certificate | None
    """What the arrangement improved; None when it was left out."""
    layout: LayoutPrediction | None
    """The layout with the signals that it was read from; None when it was given."""
    timings: dict[str, float]
    """Seconds for each stage that was run, in order."""
    doubts: tuple[str, ...] = ()
    """What the result should not be trusted for, in words; empty when nothing was noticed."""
