"""The two sizes of the relation graph network, and its switches for ablations."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from panoscene._editions import Edition

Count = Annotated[int, Field(ge=1)]


class ContextConfig(BaseModel):
    """What a relation graph network is built from."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    appearance: Count
    """Numbers of an encoded crop, as the pose network gives them."""
    codes: Annotated[int, Field(ge=0)] = 320
    """Numbers that describe a shape's Gaussians; 0 for a network that knows no shapes."""
    blobs: Annotated[int, Field(ge=0)] = 48
    """Gaussians of a shape, mirrored ones included."""
    width: Count
    """Numbers of every node."""
    hidden: Count
    """Width of the heads."""
    steps: Count
    """Rounds of messages; all with the same weights."""
    dropout: Annotated[float, Field(ge=0.0, lt=1.0)]
    """Share of hidden numbers of the heads that training leaves out."""
    deviation: Annotated[float, Field(gt=0.0)] | None = None
    """Standard deviation of new weights; None for PyTorch's own way."""
    norm: bool = False
    """Whether nodes are normalised before they are read."""
    relation_features: bool = True
    """Whether pairs are told relative yaw, separation and collision of their boxes (Fr)."""
    object_features: bool = True
    """Whether objects are told the distances of their corners to floor, ceiling and walls (Fo)."""
    relation_heads: bool = True
    """Whether relations are predicted."""
    room: Literal["walls", "node"] = "walls"
    """What stands for the room: one node for each wall, or a single one, to which all relations
    look the same, as in Im3D; that leaves relations with walls unknown, so it has no heads."""

    @model_validator(mode="after")
    def _heads_need_walls(self) -> "ContextConfig":
        if self.room == "node" and self.relation_heads:
            raise ValueError(
                "relation_heads: found True with a single node for the room, expected False"
            )
        return self


CONFIGS: Mapping[Edition, ContextConfig] = MappingProxyType(
    {
        "paper": ContextConfig(
            appearance=2048, width=512, hidden=256, steps=4, dropout=0.5, deviation=0.01
        ),
        "compact": ContextConfig(
            appearance=256, width=128, hidden=128, steps=3, dropout=0.1, norm=True
        ),
    }
)
"""The network of the paper, and the small one that comes with weights."""
