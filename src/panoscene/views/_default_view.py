"""A good place to look into a room from."""

import math
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, Int64

from panoscene.geometry import box_corners, direction_from_lonlat, polygon_turn
from panoscene.scene import Scene
from panoscene.views._cameras import FreeCamera, fitting_camera, free_lens
from panoscene.views._model import front_marks, is_seen
from panoscene.views._rays import RayCaster, checked_surfaces, join_surfaces

_FOV_DEG = 34.0
_LOOK_DOWN_DEG = 38.0
_AROUND = 12
"""Directions that are tried."""
_COLUMNS = 80
"""Of the small pictures that tell which direction shows most."""
_CORNER = 0.2
"""How much more a view from a corner is worth than one along the walls."""
_FAR = 2.0
"""Metres outside the room from which an object need not be in the picture."""


def default_view(
    scene: Scene, *, size_px: tuple[int, int] = (1024, 768), look_down_deg: float = _LOOK_DOWN_DEG
) -> FreeCamera:
    """Return a camera high outside the room that shows most of its objects and their fronts.

    All of the room is in the picture, and all objects but those more than 2 m outside. Of twelve
    directions around it takes the one in which the objects hide each other least.

    Args:
        scene: what to look at.
        size_px: width and height of the picture to come.
        look_down_deg: how far below the horizon it looks, in degrees.

    Raises:
        ValueError: as ``render_view``, or a look down that is not within 90 degrees.
    """
    if not -90 <= look_down_deg <= 90:
        raise ValueError(f"look_down_deg: found {look_down_deg}, expected -90 to 90 degrees")
    points = _extent(scene)
    lat, turn = -math.radians(look_down_deg), -polygon_turn(scene.layout.floor_polygon)
    shown = _Shown(scene)
    best, most = None, -1.0
    for lon in (np.arange(_AROUND) + 0.37) * (2 * math.pi / _AROUND):
        ahead = direction_from_lonlat(torch.tensor([lon, lat], dtype=torch.float64))
        camera = fitting_camera(ahead, points, _FOV_DEG, size_px)
        worth = _worth(shown, camera, size_px) * (1 + _CORNER * abs(math.sin(2 * (lon + turn))))
        if worth > most:
            best, most = camera, worth
    if best is None:
        raise ValueError("size_px: found no camera for a picture of that size")
    return best


def _extent(scene: Scene) -> Float[np.ndarray, "points 3"]:
    """Return the corners that have to be in the picture."""
    layout = scene.layout
    polygon = layout.floor_polygon.double().numpy(force=True)
    heights = (layout.floor_height, layout.ceiling_height)
    room = np.concatenate([np.column_stack([polygon, np.full(len(polygon), z)]) for z in heights])
    corners = box_corners(scene.objects.boxes).double().numpy(force=True).reshape(-1, 3)
    low, high = room.min(0) - _FAR, room.max(0) + _FAR
    return np.concatenate([room, corners[((corners >= low) & (corners <= high)).all(-1)]])


class _Shown:
    """What cameras see of the objects of one scene; the objects are sorted for rays only once."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        surfaces = checked_surfaces(scene)
        self._objects = tuple(surface for surface in surfaces if surface.kind == "object")
        self._room = tuple(surface for surface in surfaces if surface.kind != "object")
        self._sorted: dict[tuple[int, ...], _Targets] = {}

    def along(self, eye: Float[np.ndarray, " 3"], rays: Float[np.ndarray, "n 3"]) -> "_Seen":
        """Return the objects that rays from a camera hit first, and whether at their fronts."""
        start = np.ascontiguousarray(np.broadcast_to(eye.astype(np.float32), rays.shape))
        targets = self._targets(eye)
        room = RayCaster(join_surfaces([s for s in self._room if is_seen(s, self._scene, eye)]))
        face, distance = targets.caster.first_and_distance(start, rays)
        face = face[(face >= 0) & (distance < room.first_and_distance(start, rays)[1])]
        return targets.item[face], targets.front[face]

    def _targets(self, eye: Float[np.ndarray, " 3"]) -> "_Targets":
        seen = [surface for surface in self._objects if is_seen(surface, self._scene, eye)]
        key = tuple(surface.index for surface in seen)
        if key not in self._sorted:
            soup = join_surfaces(seen)
            item = np.array(key, np.int64)[soup.surface]
            mark = front_marks(self._scene, soup.normal, item)[2]
            self._sorted[key] = _Targets(RayCaster(soup), item, mark < 0)
        return self._sorted[key]


_Seen = tuple[Int64[np.ndarray, " hits"], Bool[np.ndarray, " hits"]]


@dataclass(frozen=True, slots=True)
class _Targets:
    """Triangles of objects."""

    caster: RayCaster
    item: Int64[np.ndarray, " faces"]
    """Index of the object."""
    front: Bool[np.ndarray, " faces"]
    """Whether it is on the front of a box."""


def _worth(shown: _Shown, camera: FreeCamera, size_px: tuple[int, int]) -> float:
    """Return how much a camera shows of the objects: what is seen of each, and fronts twice."""
    columns = _COLUMNS
    rows = max(1, round(columns * size_px[1] / size_px[0]))
    lens = free_lens(camera, (columns, rows))
    v, u = np.meshgrid(np.arange(rows) + 0.5, np.arange(columns) + 0.5, indexing="ij")
    item, front = shown.along(lens.eye, lens.directions(u.ravel(), v.ravel()).astype(np.float32))
    pixels = np.bincount(item, np.where(front, 2.0, 1.0), minlength=1)
    # a large object counts for less than several small ones of the same size together
    return float(np.sqrt(pixels).sum())
