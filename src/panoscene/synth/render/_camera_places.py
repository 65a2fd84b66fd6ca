"""Chooses where to stand: on free floor, away from furniture and walls, spread over the rooms."""

from collections.abc import Sequence

import numpy as np
import scipy.ndimage
import shapely
import shapely.geometry.base
from jaxtyping import Bool, Float64

from panoscene.synth.homes._records import Home
from panoscene.synth.render._openings import is_passable, wall_depth, wall_frame
from panoscene.synth.render._records import Camera, PlacedModel

_CELL = 0.05
_TO_WALL, _TO_OBJECT, _TO_HIGH = 0.45, 0.35, 0.55
"""Clear metres around the camera: to walls, to furniture below it, and to what reaches as high."""
_LOWEST_TILTED, _HIGHEST_TILTED = 1.2, 1.9
_MOST_TILT = np.radians(5.0)


def sample_cameras(
    home: Home,
    obstacles: Sequence[PlacedModel],
    rng: np.random.Generator,
    count: int = 5,
    *,
    robust: bool = False,
    width: int = 1024,
    height: int = 512,
) -> tuple[Camera, ...]:
    """Return cameras in a home.

    Each stands over free floor: at least 0.45 m from walls, 0.35 m from furniture of any height
    and 0.55 m from what comes near its own height; carpets and lamps overhead do not count.
    Rooms are chosen by their free floor (larger rooms more often, every room at most once before
    the others had their turn when they are of similar size), and cameras of one room stand apart;
    places with much free floor around them are more likely.

    Args:
        home: its rooms and walls.
        obstacles: everything that stands in it.
        rng: source of randomness.
        count: of cameras; fewer are returned only when there is no free floor.
        robust: heights from 1.2 to 1.9 m and tilts up to 5 degrees, instead of 1.6 m and upright.
        width: of the panoramas in pixels.
        height: of the panoramas in pixels.

    Raises:
        ValueError: if ``count`` is negative.
    """
    if count < 0:
        raise ValueError(f"count must not be negative, found {count}")
    lowest, highest = (_LOWEST_TILTED, _HIGHEST_TILTED) if robust else (1.6, 1.6)
    origin, free, rooms = free_floor(home, obstacles, highest, lowest)
    roomy = np.asarray(scipy.ndimage.distance_transform_edt(free)) * _CELL
    left = np.array([float((free & (rooms == k)).sum()) * _CELL**2 for k in range(len(home.rooms))])
    chance = np.where(left > 0.15, np.sqrt(left), 0.0)
    if chance.sum() == 0:
        chance = left
    cameras: list[Camera] = []
    used: list[Float64[np.ndarray, 2]] = []
    while len(cameras) < count and chance.sum() > 0:
        room = int(rng.choice(len(chance), p=chance / chance.sum()))
        chance[room] *= 0.25
        rows, columns = np.nonzero(free & (rooms == room))
        places = origin + (np.stack([columns, rows], axis=1) + rng.random((len(rows), 2))) * _CELL
        picks = places[rng.choice(len(places), size=12, p=_weights(roomy[rows, columns]))]
        apart = np.full(len(picks), 9.0)
        if used:
            apart = np.linalg.norm(picks[:, None] - np.array(used), axis=2).min(axis=1)
        # the first place that is not next to an earlier one, else the farthest
        far = np.flatnonzero(apart > 1.2)
        place = picks[far[0]] if len(far) else picks[int(apart.argmax())]
        used.append(place)
        tilt = rng.uniform(0, _MOST_TILT) if robust else 0.0
        lean = rng.uniform(-np.pi, np.pi)
        cameras.append(
            Camera(
                (float(place[0]), float(place[1]), float(rng.uniform(lowest, highest))),
                float(rng.uniform(-np.pi, np.pi)),
                float(tilt * np.cos(lean)),
                float(tilt * np.sin(lean)),
                room,
                width,
                height,
            )
        )
    return tuple(cameras)


def _weights(clear: Float64[np.ndarray, " n"]) -> Float64[np.ndarray, " n"]:
    """Return how likely cells are chosen: photographers stand in the open, not in corners."""
    weight = 0.1 + clear
    return weight / weight.sum()


def free_floor(
    home: Home,
    obstacles: Sequence[PlacedModel],
    camera_height: float,
    lowest: float | None = None,
) -> tuple[Float64[np.ndarray, "2"], Bool[np.ndarray, "rows columns"], np.ndarray]:
    """Return the map's lower left corner, where a camera may stand, and the room of each cell.

    Args:
        home: its rooms and walls.
        obstacles: everything that stands in it.
        camera_height: of the camera; the greatest one when it varies.
        lowest: the least height when it varies: what is nearly as high is kept from as well.
    """
    lowest = camera_height if lowest is None else lowest
    corners = np.concatenate([room.polygon for room in home.rooms])
    origin = corners.min(axis=0) - 0.5
    columns, rows = np.ceil((corners.max(axis=0) + 0.5 - origin) / _CELL).astype(int)
    x = origin[0] + (np.arange(columns) + 0.5) * _CELL
    y = origin[1] + (np.arange(rows) + 0.5) * _CELL
    grid_x, grid_y = np.meshgrid(x, y)
    room_of = np.full((rows, columns), -1, np.int32)
    for index, room in enumerate(home.rooms):
        room_of[shapely.contains_xy(shapely.Polygon(room.polygon), grid_x, grid_y)] = index
    open_floor = room_of >= 0
    for index, opening in enumerate(home.openings):
        if is_passable(opening):  # nobody stands in a doorway, but it is no wall to keep from
            frame = wall_frame(home.rooms[opening.room].polygon, opening.wall)
            span = np.array([opening.start, opening.start + opening.width])
            ends = np.array([0.0, wall_depth(home, index)])
            gap = frame.place(span[[0, 1, 1, 0]], ends[[0, 0, 1, 1]], 0.0)[:, :2]
            open_floor |= shapely.contains_xy(shapely.Polygon(gap), grid_x, grid_y)
    low, high = np.zeros_like(open_floor), np.zeros_like(open_floor)
    for placed in obstacles:
        bottom, top, outline = _footprint(placed)
        if top < 0.06 or bottom > camera_height + 0.45:
            continue
        grown = outline.buffer(_CELL / 2)
        first = np.floor((np.array(grown.bounds[:2]) - origin) / _CELL).astype(int).clip(0)
        last = np.ceil((np.array(grown.bounds[2:]) - origin) / _CELL).astype(int).clip(0)
        near = np.s_[first[1] : last[1] + 1, first[0] : last[0] + 1]
        inside = shapely.contains_xy(grown, grid_x[near], grid_y[near])
        low[near] |= inside
        high[near] |= inside & (top > lowest - 0.35)
    free = (room_of >= 0) & _farther(~open_floor, _TO_WALL)
    return origin, free & _farther(low, _TO_OBJECT) & _farther(high, _TO_HIGH), room_of


def _farther(taken: Bool[np.ndarray, "rows columns"], distance: float) -> Bool[np.ndarray, "r c"]:
    if not taken.any():
        return np.ones_like(taken)
    return np.asarray(scipy.ndimage.distance_transform_edt(~taken)) * _CELL > distance


def _footprint(placed: PlacedModel) -> tuple[float, float, shapely.geometry.base.BaseGeometry]:
    """Return the lowest and highest point of a model and its convex outline from above."""
    vertices = placed.model.vertices @ placed.world_from_object[:3, :3].T
    vertices = vertices + placed.world_from_object[:3, 3]
    outline = shapely.MultiPoint(vertices[:, :2]).convex_hull
    return float(vertices[:, 2].min()), float(vertices[:, 2].max()), outline
