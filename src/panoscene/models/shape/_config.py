"""The two sizes of the shape network."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from panoscene._editions import Edition
from panoscene.models._backbone import BackboneName

ANALYTIC = 10
"""Numbers of an element that describe its Gaussian: constant, centre, radii, angles."""
HINTS = 8
"""Numbers that tell the encoder how the object is seen; see ``view_hints``."""
ISO_LEVEL = -0.07
"""Value of the field on the surface; it is lower inside."""

_SIDE = 0.5
"""Of the canonical box, from its centre."""

Positive = Annotated[int, Field(ge=1)]


class ShapeConfig(BaseModel):
    """What a shape network is built from."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    backbone: BackboneName
    levels: tuple[int, ...]
    """Feature maps of the backbone. The last is averaged; the one before, if any, keeps 4 x 4
    places."""
    crop: Positive
    """Rows and columns of an object's picture."""
    features: Positive
    """Of a picture, beside the category."""
    hidden: Positive
    """Width of the layers that make the code."""
    elements: Positive = 32
    symmetric: Annotated[int, Field(ge=0)] = 16
    """The first of the elements; each stands on both sides of the plane x = 0."""
    latent: Positive = 32
    """Numbers of an element that describe detail within its Gaussian."""
    decoder: Positive = 32
    """Width of the local decoder."""
    hints: bool = False
    """Whether the encoder is told the box and from where it is seen."""
    frame: Literal["longest", "box"] = "longest"
    """Unit of length: the object's longest side, or each side of its box for itself."""
    nearest: Positive | None = None
    """Elements that count at a point in training; None for all."""
    spread: bool = False
    """Whether the elements start spread over the box, with some weight."""

    @property
    def width(self) -> int:
        """Return the numbers of an element."""
        return ANALYTIC + self.latent

    @property
    def code(self) -> int:
        """Return the numbers of a shape code."""
        return self.elements * self.width

    @property
    def cut(self) -> bool:
        """Return whether the box cuts the solid off: where the network works in it."""
        return self.frame == "box"

    @property
    def reach(self) -> float:
        """Return how far from the centre, along each axis, the surface is looked for.

        Where the box cuts the solid off, of 32 cells the nodes beside the border lie just within
        its sides: so a thin board that lies on a side has nodes, too.
        """
        return _SIDE * 17 / 16 if self.cut else 0.7

    @property
    def surface_reach(self) -> float:
        """Return how far from the centre, along each axis, vertices may be."""
        return _SIDE if self.cut else self.reach


CONFIGS: dict[Edition, ShapeConfig] = {
    "paper": ShapeConfig(backbone="resnet18", levels=(4,), crop=224, features=1536, hidden=1536),
    "compact": ShapeConfig(
        backbone="tf_efficientnet_lite0",
        levels=(3, 4),
        crop=96,
        features=384,
        hidden=384,
        latent=16,
        decoder=16,
        hints=True,
        frame="box",
        nearest=6,
        spread=True,
    ),
}
"""``paper``: the sizes of the paper. ``compact``: made for two cores."""
