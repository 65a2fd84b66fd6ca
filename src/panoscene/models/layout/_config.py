"""What the two editions of the layout network are made of."""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from panoscene._editions import Edition

COLUMNS = 1024
"""Columns of the boundary and corner signals, whatever the size of the network's image."""


class LayoutConfig(BaseModel):
    """Sizes of the layout network."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    backbone: Literal["resnet18", "resnet34", "resnet50", "tf_efficientnet_lite0"]
    image_height: int = Field(multiple_of=32)
    """Rows of the image that the network sees; photos are resized."""
    image_width: int = Field(multiple_of=32)
    squeeze: bool
    """Whether a 1 x 1 convolution precedes the height compression of each level."""
    compression: tuple[tuple[int, ...], ...]
    """For each level of the backbone, the channels after each convolution that halves the
    height."""
    projection: int | None
    """Channels of each level after its rows are laid side by side; None keeps them all."""
    steps: int = 256
    """Steps of the sequence around the room; each gives ``1024 / steps`` columns."""
    cell: Literal["lstm", "gru"]
    hidden: int
    """State of the recurrent layers, per direction."""
    layers: int
    dropout: float = Field(ge=0, lt=1)
    wrap: int = Field(ge=0)
    """Steps by which the ring is continued at both ends, so that the seam is no end for the
    recurrent layers. 0 as published."""
    frozen_stages: int = Field(default=0, ge=0)
    """Stages at the start of the backbone that keep their ImageNet weights; with any, all batch
    normalisation of the backbone keeps its statistics, too."""

    @model_validator(mode="after")
    def _fits(self) -> "LayoutConfig":
        if COLUMNS % self.steps:
            raise ValueError(f"steps: found {self.steps}, expected a divisor of {COLUMNS}")
        if not 0 <= self.wrap <= self.steps:
            raise ValueError(f"wrap: found {self.wrap}, expected at most steps = {self.steps}")
        if len(self.compression) != 4 or not all(self.compression):
            raise ValueError("compression: expected channels for each of 4 levels")
        return self

    def rows(self, level: int) -> int:
        """Return how many rows of a level are left after its height compression."""
        rows = self.image_height // (4 << level)
        for _ in self.compression[level]:
            rows = (rows + 1) // 2
        return rows


def _published(channels: int) -> tuple[int, ...]:
    return (channels // 2, channels // 2, channels // 4, channels // 8)


CONFIGS: dict[Edition, LayoutConfig] = {
    "paper": LayoutConfig(
        backbone="resnet50",
        image_height=512,
        image_width=1024,
        squeeze=False,
        compression=tuple(_published(channels) for channels in (256, 512, 1024, 2048)),
        projection=None,
        cell="lstm",
        hidden=512,
        layers=2,
        dropout=0.5,
        wrap=0,
    ),
    "compact": LayoutConfig(
        backbone="tf_efficientnet_lite0",
        image_height=128,
        image_width=256,
        squeeze=True,
        compression=((32, 32, 32), (48, 48), (64,), (64,)),
        projection=64,
        steps=128,
        cell="lstm",
        hidden=128,
        layers=1,
        dropout=0.1,
        wrap=32,
        frozen_stages=3,
    ),
}
"""The network of each edition."""
