"""What goes into the relation graph network: the estimates of the stages before it."""

from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float, Int64
from torch import Tensor

from panoscene.geometry import DISTANCE_BIN_WIDTH, BoxCode, OrientedBoxes, decode_box_code
from panoscene.models.pose import PoseOutput

from ._move import moved

SMALLEST_SIZE = 0.005
"""Metres; boxes are never thinner."""
NEAREST = 0.05
"""Metres; boxes are never centred nearer to the camera."""


@dataclass(frozen=True, slots=True)
class Estimates:
    """What the first stages say of a batch of scenes, padded to n objects and m walls.

    Padded objects hold any finite numbers with a positive BFoV and mean size; a scene without a
    layout has no valid wall.
    """

    bfov: Float[Tensor, "scenes n 4"]
    """(lon, lat, width, height) in radians, upright panorama."""
    category: Int64[Tensor, "scenes n"]
    """Index into ``CATEGORIES``."""
    score: Float[Tensor, "scenes n"]
    """Of the detections, in [0, 1]."""
    valid: Bool[Tensor, "scenes n"]
    """False for padding."""
    output: PoseOutput
    """Of the pose network, batch shape (scenes, n)."""
    appearance: Float[Tensor, "scenes n features"]
    """The pose network's encoded crops; zeros where there is none."""
    shape_code: Float[Tensor, "scenes n codes"]
    """What the shape network says of the Gaussians, flat; zeros where there is none."""
    blob_centre: Float[Tensor, "scenes n blobs 3"]
    """Centres of the Gaussians in the canonical box [-1/2, 1/2]^3; zeros where there are none."""
    mean_size: Float[Tensor, "scenes n 3"]
    """Metres, of each object's category."""
    camera_height: Float[Tensor, " scenes"]
    """Metres above the floor."""
    polygon: Float[Tensor, "scenes m 2"]
    """Floor polygon, counter-clockwise from above, padded by repeating a corner."""
    wall_valid: Bool[Tensor, "scenes m"]
    """False for padding."""
    ceiling: Float[Tensor, " scenes"]
    """Metres above the floor."""

    def boxes(self) -> OrientedBoxes:
        """Return the boxes that the pose network found, batch shape (scenes, n)."""
        return boxes_from_output(self.output, self)

    def to(self, device: torch.device | str) -> "Estimates":
        """Return the same estimates on a device."""
        return moved(self, device)


def boxes_from_output(output: PoseOutput, estimates: Estimates) -> OrientedBoxes:
    """Return the boxes of pose outputs in the likeliest bins, batch shape (scenes, n).

    Differentiable in offsets and residuals. Boxes are at least 5 mm thin, and at least 5 cm away
    from the camera.

    Args:
        output: Initial or refined, batch shape (scenes, n).
        estimates: Of the same objects.
    """
    code = output.code()
    farther = NEAREST / DISTANCE_BIN_WIDTH - code.distance_bin - 0.5
    sound = BoxCode(
        delta=code.delta,
        distance_bin=code.distance_bin,
        distance_residual=torch.maximum(code.distance_residual, farther),
        yaw_bin=code.yaw_bin,
        yaw_residual=code.yaw_residual,
        size_residual=torch.maximum(code.size_residual, SMALLEST_SIZE / estimates.mean_size - 1),
    )
    return decode_box_code(
        sound, estimates.bfov, estimates.mean_size, estimates.camera_height[:, None]
    )
