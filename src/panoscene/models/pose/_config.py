"""The two sizes of the pose network."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, model_validator

from panoscene._editions import Edition
from panoscene.models._backbone import BackboneName

Count = Annotated[int, Field(ge=1)]


class PoseConfig(BaseModel):
    """What a pose network is built from."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    backbone: BackboneName
    """Encoder of the crops."""
    crop_px: Annotated[int, Field(ge=32)]
    """Rows and columns of a crop."""
    pool: Count
    """Side of the window, moved by one, that averages the encoder's last feature map."""
    features: Count | None = None
    """Width of an object's feature; None is the flattened map itself."""
    groups: Count
    """Of the relational attention."""
    key_channels: Count
    """Of each group's queries and keys."""
    hidden: Count = 128
    """Width of the heads."""
    dropout: Annotated[float, Field(ge=0.0, lt=1.0)]
    """Share of hidden numbers that training leaves out."""
    clues: bool
    """Whether the network is also told what geometry alone says of the distance: where the rays
    of the BFoV meet the floor and the room, and how far away the mean size would look as large."""

    @model_validator(mode="after")
    def _whole_groups(self) -> "PoseConfig":
        if self.features is not None and self.features % self.groups:
            raise ValueError(
                f"features: found {self.features}, expected a multiple of {self.groups} groups"
            )
        return self


CONFIGS: Mapping[Edition, PoseConfig] = MappingProxyType(
    {
        "paper": PoseConfig(
            backbone="resnet34",
            crop_px=256,
            pool=7,
            groups=16,
            key_channels=64,
            dropout=0.5,
            clues=False,
        ),
        "compact": PoseConfig(
            backbone="tf_efficientnet_lite0",
            crop_px=96,
            pool=2,
            features=256,
            groups=8,
            key_channels=32,
            dropout=0.1,
            clues=True,
        ),
    }
)
"""The network of the paper, and the small one that comes with weights."""
