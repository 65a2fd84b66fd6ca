"""Where pictures of rooms are taken from: the panorama's camera and free cameras."""

import math
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry import camera_from_turned, direction_from_pixel, lonlat_from_direction

WIDEST_DEG = 150.0
"""The widest field of view of a free camera."""
_NEAR = 1e-3
"""Metres; what is nearer to a free camera's plane is not projected."""
Point = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class FreeCamera:
    """A pinhole camera anywhere in the world, without roll."""

    eye: Point
    """Where it is, world frame, metres."""
    target: Point
    """What it looks at: the middle of the picture."""
    fov_deg: float = 40.0
    """Field of view across the picture's width, in degrees."""

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (*self.eye, *self.target))) or self.eye == self.target:
            found = f"{self.eye} and {self.target}"
            raise ValueError(f"eye and target: found {found}, expected two different points")
        if not 0 < self.fov_deg <= WIDEST_DEG:
            raise ValueError(f"fov_deg: found {self.fov_deg}, expected 0 to {WIDEST_DEG:g} degrees")


@dataclass(frozen=True, slots=True)
class Lens:
    """How continuous pixels become rays: of an equirectangular or a pinhole picture."""

    rows: int
    columns: int
    eye: Float[np.ndarray, " 3"]
    world_from_view: Float[np.ndarray, "3 3"] | None = None
    """Columns right, forward and up of a pinhole picture; None for an equirectangular one."""
    reach: float = 1.0
    """Half the width of a pinhole picture on the plane at distance one."""

    @property
    def circular(self) -> bool:
        """Whether the last column is next to the first."""
        return self.world_from_view is None

    def directions(
        self, u: Float[np.ndarray, "*pixels"], v: Float[np.ndarray, "*pixels"]
    ) -> Float[np.ndarray, "*pixels 3"]:
        """Return the unit directions of pixels, world frame."""
        if self.world_from_view is None:
            uv = torch.as_tensor(np.stack([u, v], axis=-1))
            return direction_from_pixel(uv, self.rows, self.columns).numpy()
        pixel = 2 * self.reach / self.columns
        x, z = (u - self.columns / 2) * pixel, (self.rows / 2 - v) * pixel
        part = 1 / np.sqrt(1 + x * x + z * z)
        # faster than a product of matrices as thin as these
        rows = self.world_from_view.astype(x.dtype)
        return np.stack([(right * x + ahead + up * z) * part for right, ahead, up in rows], axis=-1)

    def pixels(
        self, points: Float[np.ndarray, "*points 3"]
    ) -> tuple[Float[np.ndarray, "*points 2"], Float[np.ndarray, "*points"]]:
        """Return pixels of world points in a pinhole picture, and how far they are ahead of it.

        Points behind the camera get pixels of no meaning.
        """
        if self.world_from_view is None:
            raise ValueError("points are projected with pixel_from_direction in a panorama")
        x, ahead, z = np.moveaxis((points - self.eye) @ self.world_from_view, -1, 0)
        pixel = 2 * self.reach / self.columns
        depth = np.maximum(ahead, _NEAR) * pixel
        uv = np.stack([self.columns / 2 + x / depth, self.rows / 2 - z / depth], axis=-1)
        return uv, ahead


def panorama_lens(camera_height: float, height: int) -> Lens:
    """Return the rays of a scene's own camera."""
    if height < 1:
        raise ValueError(f"height: found {height}, expected at least 1 pixel")
    return Lens(height, 2 * height, np.array([0.0, 0.0, camera_height]))


def free_lens(camera: FreeCamera, size_px: tuple[int, int]) -> Lens:
    """Return the rays of a free camera for a picture of that width and height."""
    columns, rows = size_px
    if min(size_px) < 1:
        raise ValueError(f"size_px: found {columns} x {rows}, expected at least 1 x 1 pixels")
    eye = np.array(camera.eye)
    ahead = torch.as_tensor(np.array(camera.target) - eye)
    axes = turned_axes(ahead)
    return Lens(rows, columns, eye, axes, math.tan(math.radians(camera.fov_deg) / 2))


def turned_axes(ahead: Float[Tensor, " 3"]) -> Float[np.ndarray, "3 3"]:
    """Return right, forward and up, as columns, of a camera that looks along a direction."""
    return camera_from_turned(lonlat_from_direction(ahead)).numpy(force=True)


def fitting_camera(
    ahead: Float[Tensor, " 3"],
    points: Float[np.ndarray, "points 3"],
    fov_deg: float,
    size_px: tuple[int, int],
    *,
    margin: float = 0.06,
) -> FreeCamera:
    """Return the nearest camera of a viewing direction that sees all points, amid its picture.

    Args:
        ahead: where it looks.
        points: what has to be in the picture.
        fov_deg: field of view across the width.
        size_px: width and height.
        margin: part of the picture's width and height that stays free on each side.
    """
    right, forward, up = turned_axes(ahead).T
    reach = math.tan(math.radians(fov_deg) / 2) * (1 - 2 * margin)
    eye = np.zeros(3)
    along = points @ forward
    for axis, slope in ((right, reach), (up, reach * size_px[1] / size_px[0])):
        # the planes of the picture's two sides, pushed out until they touch the outermost points
        side = points @ axis
        low, high = (side + slope * along).min(), (side - slope * along).max()
        eye += axis * (low + high) / 2
    depths = []
    for axis, slope in ((right, reach), (up, reach * size_px[1] / size_px[0])):
        side = points @ axis - eye @ axis
        depths.append((along - np.abs(side) / slope).min())
    eye += forward * min(depths)
    target = eye + forward * max(float(np.median((points - eye) @ forward)), 1.0)
    return FreeCamera(tuple(eye.tolist()), tuple(target.tolist()), fov_deg)
