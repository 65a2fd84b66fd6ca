"""Pictures for walls, floor and ceiling: the panorama, seen from its camera, laid on the room."""

import io
import math
from dataclasses import dataclass

import numpy as np
import shapely
import torch
from jaxtyping import Bool, Float, UInt8
from PIL import Image
from torch import Tensor

from panoscene.geometry import (
    corner_visible,
    lonlat_from_direction,
    pixel_from_direction,
    polygon_contains,
    sample_panorama,
    wall_distance,
)
from panoscene.scene import Layout, Scene, Surface

LARGEST_SIDE, SMALLEST_SIDE = 1024, 16
"""Texels; sides are powers of two, which every viewer and engine can shrink well."""
JPEG_QUALITY = 88
_HIDDEN = 1e-3
"""A texel is hidden when a wall is nearer to the camera by more than this part of its distance."""


@dataclass(frozen=True, slots=True)
class TexturePlane:
    """The rectangle of the world that a texture covers."""

    origin: Float[Tensor, "3"]
    """World place of the upper left corner of the picture."""
    right: Float[Tensor, "3"]
    """World vector from the left to the right edge of the picture, in metres."""
    down: Float[Tensor, "3"]
    """World vector from the upper to the lower edge."""

    def texture_uv(self, vertices: Float[Tensor, "vertices 3"]) -> Float[Tensor, "vertices 2"]:
        """Return glTF texture coordinates: (0, 0) upper left, (1, 1) lower right."""
        offset = vertices.double() - self.origin
        axes = torch.stack([edge / (edge @ edge) for edge in (self.right, self.down)], dim=-1)
        return offset @ axes

    def size_px(self, texture_px_per_metre: float) -> tuple[int, int]:
        """Return columns and rows of the picture."""
        lengths = [float(edge.norm()) * texture_px_per_metre for edge in (self.right, self.down)]
        columns, rows = (2 ** round(math.log2(max(length, SMALLEST_SIDE))) for length in lengths)
        return min(columns, LARGEST_SIDE), min(rows, LARGEST_SIDE)

    def texels(self, columns: int, rows: int) -> Float[Tensor, "{rows} {columns} 3"]:
        """Return the world places of the texels' centres."""
        across = (torch.arange(columns, dtype=torch.float64) + 0.5) / columns
        along = (torch.arange(rows, dtype=torch.float64) + 0.5) / rows
        row = self.origin + along[:, None, None] * self.down
        return row + across[None, :, None] * self.right


def texture_plane(surface: Surface, layout: Layout) -> TexturePlane:
    """Return the rectangle around a part of the room, upright and not mirrored seen from inside."""
    vertices = surface.vertices.double()
    if surface.kind == "wall":
        low_start, low_end, high_end, _ = vertices
        return TexturePlane(high_end, low_start - low_end, low_end - high_end)
    polygon = shapely.Polygon(layout.floor_polygon.double().tolist())
    envelope = shapely.get_coordinates(shapely.oriented_envelope(polygon))[:4]
    if shapely.LinearRing(envelope).is_ccw:
        envelope = envelope[::-1]
    corner = torch.from_numpy(envelope.copy())
    # the envelope runs clockwise: its first two edges are right and down seen from above
    right, down = corner[1] - corner[0], corner[2] - corner[1]
    origin = corner[0]
    if surface.kind == "ceiling":
        origin, right = corner[1], -right
    level = vertices[0, 2:]
    flat = torch.zeros(1, dtype=torch.float64)
    return TexturePlane(
        torch.cat([origin, level]), torch.cat([right, flat]), torch.cat([down, flat])
    )


def halvings(image: Float[Tensor, "3 height width"]) -> list[Float[Tensor, "3 _ _"]]:
    """Return the panorama, and the panorama averaged to a half of its sides, a quarter, ..."""
    levels = [image]
    while levels[-1].shape[-1] % 4 == 0 and levels[-1].shape[-2] % 2 == 0 and len(levels) < 5:
        levels.append(torch.nn.functional.avg_pool2d(levels[-1][None], 2)[0])
    return levels


def reproject(
    levels: list[Float[Tensor, "3 _ _"]],
    plane: TexturePlane,
    scene: Scene,
    texture_px_per_metre: float,
) -> Float[Tensor, "3 rows columns"]:
    """Return the panorama as it falls on a rectangle of the world.

    What another wall hides from the camera gets the mean colour of what is seen of the rectangle,
    or of the whole panorama where nothing is.

    Args:
        levels: The panorama and its ``halvings``; the one is taken that has about one pixel for
            each texel.
        plane: The rectangle.
        scene: Where the camera is, and which walls hide what.
        texture_px_per_metre: How fine the picture becomes.
    """
    columns, rows = plane.size_px(texture_px_per_metre)
    place = plane.texels(columns, rows)
    ray = (place - place.new_tensor([0.0, 0.0, scene.panorama.camera_height])).to(levels[0].dtype)
    image = levels[_level(levels, ray, float(plane.right.norm()) / columns)]
    height, width = image.shape[-2:]
    picture = sample_panorama(image, pixel_from_direction(ray, height, width))
    seen = _seen(place, scene.layout)
    if seen is None or bool(seen.all()):
        return picture
    flat = picture[:, seen] if bool(seen.any()) else image.flatten(1)
    return torch.where(seen, picture, flat.mean(dim=1)[:, None, None])


def jpeg(picture: Float[Tensor, "3 rows columns"]) -> bytes:
    """Return a picture with values in [0, 1] as a JPEG file."""
    levels = (picture.clamp(0, 1) * 255).round().to(torch.uint8)
    pixels: UInt8[np.ndarray, "rows columns 3"] = levels.permute(1, 2, 0).numpy(force=True)
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, format="JPEG", quality=JPEG_QUALITY)
    return stream.getvalue()


def _level(
    levels: list[Float[Tensor, "3 _ _"]], ray: Float[Tensor, "rows columns 3"], texel: float
) -> int:
    """Return the level with about one pixel for each texel, which is ``texel`` metres wide."""
    distance = max(float(ray[::8, ::8].norm(dim=-1).median()), 1e-6)
    pixels = texel / distance * levels[0].shape[-1] / (2 * math.pi)
    return min(max(round(math.log2(pixels)), 0), len(levels) - 1)


def _seen(
    texels: Float[Tensor, "rows columns 3"], layout: Layout
) -> Bool[Tensor, "rows columns"] | None:
    """Return what no wall hides from the camera; None where that is everything.

    A camera outside the room sees nothing of the kind; then all is taken as seen.
    """
    polygon = layout.floor_polygon.double()
    inside = bool(polygon_contains(polygon.new_zeros(1, 2), polygon).all())
    # who sees all corners of a room sees all of it
    if not inside or bool(corner_visible(polygon).all()):
        return None
    upright = bool((texels[0, :, :2] == texels[-1, :, :2]).all())
    place = texels[:1] if upright else texels
    lon = lonlat_from_direction(place)[..., 0]
    free = wall_distance(polygon, lon.flatten()).view_as(lon)
    seen = place[..., :2].norm(dim=-1) <= free * (1 + _HIDDEN)
    return seen.expand(texels.shape[:2])
