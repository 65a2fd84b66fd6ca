"""What a stage takes and gives; any callable that does so can take its place."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from jaxtyping import Float
from torch import Tensor

from panoscene.models.layout import LayoutPrediction
from panoscene.models.upright import UprightEstimate
from panoscene.scene import Detections, Layout, Objects, Relations, Shapes

from ._clock import Clock


@runtime_checkable
class Leveller(Protocol):
    """Finds how a photo has to be turned to stand upright."""

    def __call__(self, image: Float[Tensor, "3 height width"]) -> UprightEstimate:
        """Return the rotation of a photo, RGB in [0, 1]."""
        ...


@runtime_checkable
class Detector(Protocol):
    """Finds objects in an upright panorama."""

    def __call__(self, image: Float[Tensor, "3 height width"]) -> Detections:
        """Return what is seen in a panorama, RGB in [0, 1]."""
        ...


@runtime_checkable
class LayoutReader(Protocol):
    """Reads the room from an upright panorama."""

    def __call__(
        self, image: Float[Tensor, "3 height width"], *, camera_height: float | None = None
    ) -> LayoutPrediction:
        """Return the room around a camera at that height in metres."""
        ...


@runtime_checkable
class PoseEstimator(Protocol):
    """Places what was detected."""

    def __call__(
        self,
        image: Float[Tensor, "3 height width"],
        detections: Detections,
        layout: Layout | None,
        camera_height: float,
    ) -> Objects:
        """Return an oriented box for each detection, in their order."""
        ...


@runtime_checkable
class ContextEstimator(Protocol):
    """Places what was detected, and says how it is related."""

    def __call__(
        self,
        image: Float[Tensor, "3 height width"],
        detections: Detections,
        layout: Layout,
        camera_height: float,
        *,
        clock: Clock,
    ) -> tuple[Objects, Relations | None]:
        """Return an oriented box for each detection, in their order, and relations if it can.

        ``clock`` is for who consists of parts, to tell how long each takes.
        """
        ...


@runtime_checkable
class ShapeEstimator(Protocol):
    """Gives objects their shapes."""

    def __call__(
        self, image: Float[Tensor, "3 height width"], objects: Objects, *, resolution: int = 64
    ) -> Shapes:
        """Return a mesh for each object, in its canonical space."""
        ...


@dataclass(frozen=True, slots=True)
class Stages:
    """The parts of a pipeline; a part that is None is left out."""

    detector: Detector
    layout: LayoutReader
    pose: PoseEstimator
    shape: ShapeEstimator | None = None
    """Without it, objects have no meshes and are drawn as boxes."""
    leveller: Leveller | None = None
    """Without it, photos are taken as upright."""
    context: ContextEstimator | None = None
    """Without it, boxes are those of the pose stage, and relations follow from them."""
