"""What was found in the upright photo, in the frame of the photo that the user has."""

from dataclasses import replace

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry import (
    bfov_from_directions,
    bfov_from_mask,
    camera_from_turned,
    direction_from_lonlat,
    rotate_panorama,
)
from panoscene.scene import Detections

_SAMPLES = 9
"""Points on each side of a BFoV."""


def detections_in_photo(
    detections: Detections, upright_from_photo: Float[Tensor, "3 3"]
) -> Detections:
    """Return detections of the upright photo as they are in the tilted one.

    Args:
        detections: In the upright photo.
        upright_from_photo: The rotation, as ``UprightEstimate.rotation``.

    Convention:
        - masks are turned with it; a BFoV is the smallest one around the turned mask or, without
          one, around the turned BFoV, and then larger than it was
        - world-frame records (boxes, layout) need no such thing: they stand upright

    Examples:
        >>> bfov = torch.tensor([[0.0, 0.0, 0.2, 0.1]])
        >>> ahead = Detections(bfov, torch.tensor([3]), torch.ones(1))
        >>> a_quarter_left = torch.tensor([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        >>> detections_in_photo(ahead, a_quarter_left).bfov[0]
        tensor([1.5708, 0.0000, 0.2000, 0.1000])
    """
    if torch.equal(upright_from_photo, torch.eye(3).to(upright_from_photo)):
        return detections
    photo_from_upright = upright_from_photo.mT
    outline = _outlines(detections.bfov) @ photo_from_upright.mT.to(detections.bfov)
    bfov = detections.bfov.clone()
    if len(bfov):
        bfov = bfov_from_directions(outline)
    mask = detections.mask
    if mask is None or not len(mask):
        return replace(detections, bfov=bfov)
    mask = rotate_panorama(mask, photo_from_upright, mode="nearest")
    seen = mask.flatten(1).any(1)
    if bool(seen.any()):
        bfov[seen] = bfov_from_mask(mask[seen]).to(bfov)
    return replace(detections, bfov=bfov, mask=mask)


def _outlines(bfov: Float[Tensor, "n 4"]) -> Float[Tensor, "n points 3"]:
    """Return directions on the outline of each BFoV."""
    side = torch.linspace(-0.5, 0.5, _SAMPLES, dtype=bfov.dtype, device=bfov.device)
    far = torch.full_like(side, 0.5)
    x = torch.cat((side, side, far, -far))
    y = torch.cat((far, -far, side, side))
    turned = direction_from_lonlat(torch.stack((x, y), dim=-1) * bfov[:, None, 2:])
    return turned @ camera_from_turned(bfov[:, :2]).mT
