"""Which light to ask at a point: a table of chances for every room."""

from dataclasses import dataclass

import numpy as np
import scipy.ndimage
import shapely
from jaxtyping import Float64, Int32

from panoscene.synth.render._lamps import Lamps
from panoscene.synth.render._records import LightSetting, RenderScene

PANE, LAMP, SUN = 0, 1, 2
_CELL = 0.05
_NEXT_ROOM, _SECOND_ROOM = 0.15, 0.03
"""How much a light counts one and two doorways away, against one in the room itself."""


@dataclass(frozen=True, slots=True)
class RoomGrid:
    """The room that each place of the plan belongs to; inside walls the nearest one."""

    cells: Int32[np.ndarray, "rows columns"]
    origin: tuple[float, float]
    cell: float = _CELL


@dataclass(frozen=True, slots=True)
class LightChoice:
    """All lights of a scene: panes first, then lamps that are on, then the sun.

    Without any light there is one lamp that is never asked.
    """

    kind: Int32[np.ndarray, " lights"]
    centre: Float64[np.ndarray, "lights 3"]
    half_u: Float64[np.ndarray, "lights 3"]
    half_v: Float64[np.ndarray, "lights 3"]
    normal: Float64[np.ndarray, "lights 3"]
    """Of a pane; of the sun, the way to it."""
    size: Float64[np.ndarray, " lights"]
    """Area of a pane, radius of a lamp, angular radius of the sun."""
    radiance: Float64[np.ndarray, "lights 3"]
    """Of a lamp; irradiance of the sun; unused for panes, whose light depends on the direction."""
    chance: Float64[np.ndarray, "rooms lights"]
    """Rows sum to 1, or to 0 in a room that no light reaches."""
    accept: Float64[np.ndarray, "rooms lights"]
    alias: Int32[np.ndarray, "rooms lights"]
    """Walker's alias table: pick an entry evenly, keep it with ``accept``, else take ``alias``."""


def room_grid(scene: RenderScene, margin: float = 0.6) -> RoomGrid:
    """Return the room of every 5 cm cell of the plan."""
    corners = np.concatenate(scene.polygons)
    low, high = corners.min(axis=0) - margin, corners.max(axis=0) + margin
    columns, rows = np.ceil((high - low) / _CELL).astype(int)
    x = low[0] + (np.arange(columns) + 0.5) * _CELL
    y = low[1] + (np.arange(rows) + 0.5) * _CELL
    grid_x, grid_y = np.meshgrid(x, y)
    cells = np.full((rows, columns), -1, np.int32)
    for index, polygon in enumerate(scene.polygons):
        cells[shapely.contains_xy(shapely.Polygon(polygon), grid_x, grid_y)] = index
    nearest = np.asarray(
        scipy.ndimage.distance_transform_edt(cells < 0, return_distances=False, return_indices=True)
    )
    return RoomGrid(cells[nearest[0], nearest[1]], (float(low[0]), float(low[1])))


def light_choice(scene: RenderScene, lamps: Lamps, light: LightSetting) -> LightChoice:
    """Return the lights of a scene and how often to ask each one in each room."""
    panes, on = scene.panes, np.flatnonzero(lamps.flux > 0)
    sun = light.sun_irradiance is not None and len(panes) > 0
    zeros = np.zeros((len(on), 3))
    kind = np.array([PANE] * len(panes) + [LAMP] * len(on) + [SUN] * sun, np.int32)
    to_sun = np.zeros((int(sun), 3))
    if sun:
        to_sun[0] = sun_direction(light)
    none = np.zeros((int(sun), 3))
    if not len(kind):
        one = np.zeros((1, 3))
        nobody = np.zeros((len(scene.polygons), 1))
        never = np.zeros(nobody.shape, np.int32)
        dark = np.array([LAMP], np.int32)
        return LightChoice(dark, one, one, one, one, np.ones(1), one, nobody, nobody + 1, never)
    half_u = np.array([p.half_u for p in panes]).reshape(-1, 3)
    half_v = np.array([p.half_v for p in panes]).reshape(-1, 3)
    area = 4 * np.linalg.norm(np.cross(half_u, half_v), axis=1)
    irradiance = np.array(light.sun_irradiance).reshape(1, 3) if sun else none
    return LightChoice(
        kind,
        np.concatenate(
            [np.array([p.centre for p in panes]).reshape(-1, 3), lamps.position[on], none]
        ),
        np.concatenate([half_u, zeros, none]),
        np.concatenate([half_v, zeros, none]),
        np.concatenate([np.array([p.normal for p in panes]).reshape(-1, 3), zeros, to_sun]),
        np.concatenate([area, lamps.radius[on], np.full(int(sun), 0.0075)]),
        np.concatenate([np.zeros((len(panes), 3)), lamps.radiance[on], irradiance]),
        *_table(scene, light, lamps, area=area, to_sun=to_sun),
    )


def sun_direction(light: LightSetting) -> Float64[np.ndarray, "3"]:
    """Return the unit vector to the sun."""
    across = np.cos(light.sun_elevation)
    return np.array([
        across * np.sin(light.sun_azimuth),
        across * np.cos(light.sun_azimuth),
        np.sin(light.sun_elevation),
    ])  # fmt: skip


def _table(
    scene: RenderScene,
    light: LightSetting,
    lamps: Lamps,
    *,
    area: Float64[np.ndarray, " panes"],
    to_sun: Float64[np.ndarray, "suns 3"],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return chances and the alias table: chances grow with the light a source sends in."""
    on, sun = np.flatnonzero(lamps.flux > 0), len(to_sun) > 0
    rooms = len(scene.polygons)
    near = np.zeros((rooms, rooms))
    for a, b in scene.links:
        near[a, b] = near[b, a] = 1.0
    reach = np.maximum(_NEXT_ROOM * near, _SECOND_ROOM * (near @ near > 0))
    np.fill_diagonal(reach, 1.0)
    pane_room = np.array([p.room for p in scene.panes], dtype=np.int64)
    sky = (1.5 * light.sky_radiance * area) ** 0.6
    bulbs = (lamps.flux[on] / 1000.0) ** 0.6
    weights = [sky * reach[:, pane_room], bulbs * reach[:, lamps.room[on]]]
    if sun:
        normals = np.array([p.normal for p in scene.panes])
        lit = np.maximum(-(normals @ to_sun[0]), 0.0) * area
        # windows that face away from the sun still open the way for rays at a slant: none
        ahead = (reach[:, pane_room] * lit).sum(axis=1) > 1e-3
        others = sum(w.sum(axis=1) for w in weights)
        weights.append(np.where(ahead, 0.25 * others, 0.0)[:, None])
    chance = np.concatenate(weights, axis=1)
    total = chance.sum(axis=1, keepdims=True)
    chance = np.divide(chance, total, out=np.zeros_like(chance), where=total > 0)
    accept, alias = np.ones_like(chance), np.zeros(chance.shape, np.int32)
    for room in range(rooms):
        accept[room], alias[room] = alias_table(chance[room])
    return chance, accept, alias


def alias_table(
    chance: Float64[np.ndarray, " n"],
) -> tuple[Float64[np.ndarray, " n"], Int32[np.ndarray, " n"]]:
    """Return Walker's table for a distribution: how often an entry is kept, and what replaces it.

    Examples:
        >>> accept, alias = alias_table(np.array([0.75, 0.25]))
        >>> accept.tolist(), alias.tolist()
        ([1.0, 0.5], [0, 0])
    """
    count = len(chance)
    accept, alias = np.ones(count), np.arange(count, dtype=np.int32)
    scaled = chance * count
    small = [k for k in range(count) if scaled[k] < 1.0]
    large = [k for k in range(count) if scaled[k] >= 1.0]
    while small and large:
        k, donor = small.pop(), large[-1]
        accept[k], alias[k] = scaled[k], donor
        scaled[donor] -= 1.0 - scaled[k]
        if scaled[donor] < 1.0:
            small.append(large.pop())
    return accept, alias
