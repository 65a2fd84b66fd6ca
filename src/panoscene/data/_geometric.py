"""Panoramas mirrored, rolled and tilted, with everything that is labelled in them."""

import math
from dataclasses import dataclass

import torch
from jaxtyping import Float, Shaped
from torch import Tensor

from panoscene.geometry import rotate_panorama

from ._draw import Draw


@dataclass(frozen=True, slots=True)
class Motion:
    """A panorama mirrored, then turned about the vertical, then tilted.

    Attributes:
        mirror: Whether left and right are exchanged.
        columns: By which the picture moves to the right.
        width: Columns of the panorama that this was made for.
        tilt: Rotation in camera axes that follows; None for none.
    """

    mirror: bool
    columns: int
    width: int
    tilt: Float[Tensor, "3 3"] | None = None

    @property
    def lon(self) -> float:
        """Angle by which directions move to the right, in radians."""
        return 2.0 * math.pi * self.columns / self.width

    @property
    def new_from_old(self) -> Float[Tensor, "3 3"]:
        """Matrix that takes directions and places from before to after; determinant -1 if mirrored.

        About the camera: in world coordinates take the camera's height into account when tilted.
        """
        matrix = self._turn()
        if self.mirror:
            matrix = matrix @ torch.diag(matrix.new_tensor([-1.0, 1.0, 1.0]))
        return matrix if self.tilt is None else self.tilt.to(matrix) @ matrix

    def image(
        self, image: Shaped[Tensor, "channels height width"]
    ) -> Shaped[Tensor, "channels height width"]:
        """Return the panorama after the motion: exactly rolled and mirrored, tilted bilinearly.

        Raises:
            ValueError: The panorama has another width.
        """
        return self._moved(image, "bilinear")

    def labels(self, labels: Shaped[Tensor, "height width"]) -> Shaped[Tensor, "height width"]:
        """Return a map of ids, indices or distances after the motion; nothing is mixed.

        Raises:
            ValueError: The map has another width.
        """
        return self._moved(labels[None], "nearest")[0]

    def directions(self, directions: Float[Tensor, "*batch 3"]) -> Float[Tensor, "*batch 3"]:
        """Return directions of the camera after the motion."""
        return directions @ self.new_from_old.to(directions).mT

    def _moved(self, image: Tensor, mode: str) -> Tensor:
        if image.shape[-1] != self.width:
            raise ValueError(f"image: found {image.shape[-1]} columns, expected {self.width}")
        if self.mirror:
            image = image.flip(-1)
        if self.tilt is None:
            return image.roll(self.columns, dims=-1)
        return rotate_panorama(image, self.tilt.double() @ self._turn(), mode)

    def _turn(self) -> Tensor:
        cos, sin = math.cos(self.lon), math.sin(self.lon)
        return torch.tensor([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]]).double()


def random_motion(
    width: int,
    generator: torch.Generator,
    *,
    mirror: float = 0.5,
    roll: bool = True,
    step: int = 1,
    tilt: float = 0.0,
    tilted: float = 1.0,
) -> Motion:
    """Return a random motion of panoramas of a width.

    Args:
        width: Columns.
        generator: The only source of chance.
        mirror: Share that is mirrored.
        roll: Whether to turn about the vertical.
        step: Columns of which the turn is a multiple.
        tilt: Largest angle about a horizontal axis, in radians.
        tilted: Share that is tilted; the others keep exact pixels.

    Raises:
        ValueError: The width is not a multiple of the step.

    Examples:
        >>> motion = random_motion(64, torch.Generator().manual_seed(0), mirror=0.0)
        >>> image = torch.rand(3, 32, 64)
        >>> bool(torch.equal(motion.image(image), image.roll(motion.columns, -1)))
        True
    """
    if step < 1 or width % step:
        raise ValueError(f"step: found {step}, expected a divisor of the width {width}")
    draw = Draw(generator)
    flip = draw.chance(mirror)
    columns = step * draw.whole(0, width // step) if roll else 0
    rotation = None
    if tilt > 0.0 and draw.chance(tilted):
        rotation = tilt_rotation(draw.uniform(0.0, tilt), draw.uniform(-math.pi, math.pi))
    return Motion(flip, columns, width, rotation)


def tilt_rotation(angle: float, lon: float) -> Float[Tensor, "3 3"]:
    """Return the rotation that lowers what is in front at a longitude by an angle.

    Examples:
        >>> ahead = torch.tensor([0.0, 1.0, 0.0], dtype=torch.float64)
        >>> [round(x, 3) for x in (tilt_rotation(0.1, 0.0) @ ahead).tolist()]
        [0.0, 0.995, -0.1]
    """
    # Rodrigues' formula about the horizontal axis to the left of that longitude
    x, y = -math.cos(lon), math.sin(lon)
    cross = torch.tensor([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]], dtype=torch.float64)
    identity = torch.eye(3, dtype=torch.float64)
    return identity + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross
