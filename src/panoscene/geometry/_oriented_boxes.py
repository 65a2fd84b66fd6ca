"""The record of upright boxes that every geometric function takes and returns."""

from dataclasses import dataclass

from jaxtyping import Float
from torch import Tensor


@dataclass(frozen=True, slots=True)
class OrientedBoxes:
    """Upright boxes in the world frame: any batch shape, one yaw each.

    A box's own axes: +x its right, +y its front, +z up. It lives here, and not in
    ``panoscene.scene``, because geometry may not import the vocabulary above it.
    """

    centre: Float[Tensor, "*batch 3"]
    """Box centres in metres."""
    size: Float[Tensor, "*batch 3"]
    """Full extents (width x, depth y, height z) in metres."""
    yaw: Float[Tensor, "*batch"]
    """Rotation about +z in radians, counter-clockwise from above; yaw 0 faces +y."""

    def __getitem__(self, index: object) -> "OrientedBoxes":
        """Return the boxes selected by ``index`` along the batch axes."""
        return OrientedBoxes(self.centre[index], self.size[index], self.yaw[index])  # ty: ignore[invalid-argument-type]

    def __len__(self) -> int:
        """Return the length of the first batch axis."""
        return self.yaw.shape[0]
