"""What goes into a pipeline beside the photo, and what comes out."""

from dataclasses import dataclass, field
from typing import Any, Literal

from jaxtyping import Float
from torch import Tensor

from panoscene.arrange import Certificate
from panoscene.models.layout import LayoutPrediction
from panoscene.scene import Detections, Layout, Objects, Relations, Scene


@dataclass(frozen=True, slots=True)
class Given:
    """Records that take the place of stages: ground truth, or another program's output.

    They are in the frame of the upright panorama. Of detections, objects or relations that are
    given none is taken for a double.
    """

    detections: Detections | None = None
    layout: Layout | None = None
    objects: Objects | None = None
    """Boxes for the arrangement to start from; no detector and no pose network is run."""
    relations: Relations | None = None
    """Relations for the arrangement, instead of those that the networks or its first boxes say.
    The finished scene has those of its boxes; which contacts hold, these decide with them."""
    upright_from_photo: tuple[tuple[float, float, float], ...] | None = None
    """Rotation that makes the photo upright; no tilt is looked for."""


FlagCode = Literal[
    "low_resolution",
    "not_full_sphere",
    "tilted",
    "ambiguous_layout",
    "not_indoors",
    "nothing_found",
]


@dataclass(frozen=True, slots=True)
class Flag:
    """Something that a user should know before using a result."""

    code: FlagCode
    """For programs. ``low_resolution``: the photo is small. ``not_full_sphere``: a part of the
    sphere is plain, blurred or stretched.
    ``tilted``: the camera was, and the photo was turned. ``ambiguous_layout``: the room can be read
    in two ways. ``not_indoors``: the walls are uncertain. ``nothing_found``: no object."""
    text: str
    """For people: part of a sentence."""
    numbers: dict[str, float] = field(default_factory=dict[str, float])
    """What it was concluded from, by name; angles in degrees, their names end in ``_deg``."""

    def as_dict(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {"code": self.code, "text": self.text, "numbers": dict(self.numbers)}


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
    flags: tuple[Flag, ...] = ()
    """What the result should not be trusted for; empty when nothing was noticed."""

    @property
    def doubts(self) -> tuple[str, ...]:
        """The flags in words."""
        return tuple(flag.text for flag in self.flags)
