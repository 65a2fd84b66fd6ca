"""Samples for the layout network: panoramas stretched, rolled and mirrored, and their targets."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import torch
import torch.nn.functional as F
from jaxtyping import Float, UInt8
from pydantic import BaseModel, ConfigDict, Field
from torch import Tensor

from panoscene.data._photometric import Photometric, augment_photo
from panoscene.geometry import (
    boundary_from_layout,
    column_lon,
    corner_signal_from_layout,
)
from panoscene.scene import Scene, upright_photo
from panoscene.synth.dataset import PanoramaItem

LEAST_CLEARANCE = 0.3
"""Metres to the nearest wall below which a room is not shrunk."""


class LayoutAugmentation(BaseModel):
    """How training samples differ from the panoramas they are made of."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    stretch: float = Field(default=2.0, ge=1.0)
    """Most by which the room is stretched or shrunk along either horizontal axis."""
    roll: bool = True
    """Turn by any angle about the vertical."""
    flip: bool = True
    """Mirror left and right, every second time."""
    gamma: float = Field(default=2.0, ge=1.0)
    """Most that brightness is raised to, or 1 over it."""
    photometric: Photometric | None = Photometric()
    """Also exposure, white balance, noise, blur and the like; None for none of it."""


class LayoutSample(NamedTuple):
    """One panorama and what the layout network shall say about it, or a batch of them."""

    image: Float[Tensor, "*batch 3 height width"]
    """Upright, RGB in [0, 1]."""
    boundary: Float[Tensor, "*batch 2 1024"]
    """Latitude in radians, positive up, of the ceiling boundary and of the floor boundary."""
    corner: Float[Tensor, "*batch 1024"]
    """0.96 to the power of the columns to the nearest visible corner."""


@dataclass(frozen=True, slots=True)
class RoomView:
    """A room and the camera in it; the frame is the world's."""

    polygon: Float[Tensor, "corners 2"]
    floor_height: float
    ceiling_height: float
    camera_height: float


class LayoutSamples:
    """The upright panoramas of a set and their rooms, read when they are first needed.

    Attributes:
        items: The panoramas.
        size: Rows and columns of the samples' images.
    """

    def __init__(
        self, items: Sequence[PanoramaItem], size: tuple[int, int], *, cached: int = 512
    ) -> None:
        """Remember what to read.

        Args:
            items: Of a rendered set.
            size: Rows and columns of the network's image.
            cached: How many panoramas are kept in memory at twice that size (1.5 MB each for the
                compact edition).
        """
        self.items = tuple(items)
        self.size = size
        self._cached = cached
        self._photos: dict[int, UInt8[Tensor, "3 rows columns"]] = {}
        self._rooms: dict[int, RoomView] = {}

    def __len__(self) -> int:
        """Return how many panoramas there are."""
        return len(self.items)

    def photo(self, index: int) -> Float[Tensor, "3 rows columns"]:
        """Return an upright panorama, RGB in [0, 1], of at most twice the samples' size."""
        if index not in self._photos:
            item = self.items[index]
            pixels = upright_photo(item.image(), item.scene().panorama)
            rows, columns = 2 * self.size[0], 2 * self.size[1]
            if pixels.shape[-2] > rows:
                pixels = _resized(pixels, (rows, columns))
            stored = pixels.clamp(0, 1).mul(255).round().to(torch.uint8)
            if len(self._photos) >= self._cached:
                return stored.float() / 255
            self._photos[index] = stored
        return self._photos[index].float() / 255

    def room(self, index: int) -> RoomView:
        """Return the room of a panorama."""
        if index not in self._rooms:
            self._rooms[index] = room_view(self.items[index].scene())
        return self._rooms[index]

    def plain(self, index: int) -> LayoutSample:
        """Return a panorama as it is, at the network's size, and its targets."""
        photo = self.photo(index)
        room = self.room(index)
        return LayoutSample(_resized(photo, self.size), *layout_targets(room))

    def augmented(
        self, index: int, generator: torch.Generator, settings: LayoutAugmentation
    ) -> LayoutSample:
        """Return a panorama changed at random, and the targets of the changed room.

        A pure function of its arguments.
        """
        room = self.room(index)
        turn, mirrored, scale = _drawn(room.polygon, generator, settings)
        changed = moved_room(room, turn, mirrored, scale)
        image = moved_photo(self.photo(index), self.size, turn, mirrored, scale)
        exponent = settings.gamma ** (2 * float(torch.rand((), generator=generator)) - 1)
        image = image.clamp(1e-4, 1) ** exponent
        if settings.photometric is not None:
            image = augment_photo(image, generator, settings.photometric)
        return LayoutSample(image, *layout_targets(changed))


def collate_layout(samples: Sequence[LayoutSample]) -> LayoutSample:
    """Return a batch of samples."""
    return LayoutSample(*(torch.stack(parts) for parts in zip(*samples, strict=True)))


def room_view(scene: Scene) -> RoomView:
    """Return the room of a scene."""
    layout = scene.layout
    return RoomView(
        layout.floor_polygon.double(),
        layout.floor_height,
        layout.ceiling_height,
        scene.panorama.camera_height,
    )


def layout_targets(
    room: RoomView,
) -> tuple[Float[Tensor, "2 1024"], Float[Tensor, " 1024"]]:
    """Return the boundary and the corner signal of a room.

    Examples:
        >>> square = torch.tensor([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])
        >>> boundary, corner = layout_targets(RoomView(square, 0.0, 2.6, 1.6))
        >>> boundary.shape, corner.shape
        (torch.Size([2, 1024]), torch.Size([1024]))
    """
    boundary = boundary_from_layout(
        room.polygon, room.floor_height, room.ceiling_height, room.camera_height
    )
    return torch.stack(boundary).float(), corner_signal_from_layout(room.polygon).float()


def moved_room(room: RoomView, turn: float, mirrored: bool, scale: tuple[float, float]) -> RoomView:
    """Return the room that ``moved_photo`` shows: turned, then mirrored, then stretched.

    Args:
        room: The room.
        turn: Angle in radians about the vertical; positive moves the picture to the right.
        mirrored: Whether left and right are exchanged.
        scale: Factors along x and y.

    Source: HorizonNet, Sec. 3.4 (panoramic stretch).
    """
    cos, sin = math.cos(turn), math.sin(turn)
    # lon runs clockwise from above: what was at lon is at lon + turn
    rotation = room.polygon.new_tensor([[cos, sin], [-sin, cos]])
    polygon = room.polygon @ rotation.T
    polygon = polygon * polygon.new_tensor([-scale[0] if mirrored else scale[0], scale[1]])
    if mirrored:
        polygon = polygon.flip(0)
    return RoomView(polygon, room.floor_height, room.ceiling_height, room.camera_height)


def moved_photo(
    photo: Float[Tensor, "3 height width"],
    size: tuple[int, int],
    turn: float,
    mirrored: bool,
    scale: tuple[float, float],
) -> Float[Tensor, "3 rows columns"]:
    """Return the photo as if the room had been turned, then mirrored, then stretched.

    Exactly what a camera would see if every point (x, y, z) around it had moved like that; each
    pixel is looked up once.

    Args:
        photo: An upright panorama.
        size: Rows and columns of the result.
        turn: Angle in radians about the vertical; positive moves the picture to the right.
        mirrored: Whether left and right are exchanged.
        scale: Factors along x and y.

    Source: HorizonNet, Sec. 3.4 (panoramic stretch).
    """
    rows, columns = size
    lon = column_lon(columns, dtype=photo.dtype)
    x = torch.sin(lon) / (-scale[0] if mirrored else scale[0])
    y = torch.cos(lon) / scale[1]
    # the direction before is (x, y, tan lat): its lon is the same all along a column
    u = (torch.atan2(x, y) - turn) / (2 * math.pi) + 0.5
    lat = math.pi * (0.5 - (torch.arange(rows, dtype=photo.dtype) + 0.5) / rows)
    v = 0.5 - torch.atan(torch.tan(lat)[:, None] / torch.hypot(x, y)) / math.pi
    # a column of the other side at each side, so that the seam is none
    width = photo.shape[-1]
    wrapped = torch.cat((photo[..., -1:], photo, photo[..., :1]), dim=-1)
    u = (u % 1 * width + 1) / (width + 2)
    grid = torch.stack((u.expand_as(v), v), dim=-1) * 2 - 1
    return F.grid_sample(
        wrapped[None], grid[None], mode="bilinear", padding_mode="border", align_corners=False
    )[0]


def _drawn(
    polygon: Float[Tensor, "corners 2"], generator: torch.Generator, settings: LayoutAugmentation
) -> tuple[float, bool, tuple[float, float]]:
    """Return turn, whether mirrored, and the two scales."""
    random = torch.rand(6, generator=generator).tolist()
    turn = 2 * math.pi * random[0] if settings.roll else 0.0
    mirrored = settings.flip and random[1] < 0.5
    factors = [1 + (settings.stretch - 1) * part for part in random[2:4]]
    # a room is not pressed against its camera
    nearest = float(polygon.norm(dim=-1).amin())
    scale = [
        1 / factor if part < 0.5 and nearest / factor > LEAST_CLEARANCE else factor
        for factor, part in zip(factors, random[4:], strict=True)
    ]
    return turn, mirrored, (scale[0], scale[1])


def _resized(
    image: Float[Tensor, "3 height width"], size: tuple[int, int]
) -> Float[Tensor, "3 rows columns"]:
    if tuple(image.shape[-2:]) == size:
        return image
    smaller = image.shape[-2] > size[0]
    return F.interpolate(
        image[None], size=size, mode="bilinear", align_corners=False, antialias=smaller
    )[0].clamp(0, 1)
