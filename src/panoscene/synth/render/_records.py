"""What is rendered and what comes out. Metres, radians; x and y in the plan of the home, z up."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from jaxtyping import Float, Float32, Float64, Int32, UInt8

from panoscene.synth.assets import CadModel, Material

PartKind = Literal["wall", "floor", "ceiling", "skirting", "frame", "sill", "door", "lamp"]
LightKind = Literal["sunny", "overcast", "dusk", "night"]


@dataclass(frozen=True, slots=True)
class Finish:
    """What a part of a room is covered with."""

    material: Material
    tile: tuple[float, float] = (1.0, 1.0)
    """Metres that one copy of the texture covers: along the wall and up it, or along x and y."""


@dataclass(frozen=True, slots=True)
class RoomFinish:
    """How the parts of one room look."""

    floor: Finish
    walls: tuple[Finish, ...]
    """One for each wall, or one for all of them."""
    ceiling: Finish
    trim: Finish
    """Of skirting, door frames and window sills."""


@dataclass(frozen=True, slots=True)
class ShellPart:
    """A piece of the building: triangles of one material with an instance id of their own."""

    kind: PartKind
    instance: int
    room: int
    """Index of the room that it is seen from."""
    index: int
    """Of the wall in the room's polygon for walls and skirting, of the opening in the home for
    frames, sills and doors, else 0."""
    vertices: Float64[np.ndarray, "vertices 3"]
    uv: Float64[np.ndarray, "vertices 2"]
    """In copies of the texture."""
    faces: Int32[np.ndarray, "faces 3"]
    """Counter-clockwise seen from inside the room."""
    material: Material


@dataclass(frozen=True, slots=True)
class PlacedModel:
    """A model at its place, recoloured and ready to be drawn."""

    model: CadModel
    world_from_object: Float64[np.ndarray, "4 4"]
    """From the object frame to the home's: turns and moves it, and scales it by its size jitter."""
    instance: int
    """Id in the instance map, above 0."""
    room: int = 0


@dataclass(frozen=True, slots=True)
class WindowPane:
    """The hole of a window: daylight comes in through it, and its label is exact.

    It is a rectangle in the plane of the glass; what is beyond it is the outside.
    """

    instance: int
    room: int
    centre: tuple[float, float, float]
    half_u: tuple[float, float, float]
    """From the centre to the middle of a vertical edge."""
    half_v: tuple[float, float, float]
    """From the centre to the middle of the upper edge."""
    normal: tuple[float, float, float]
    """Of unit length, into the room."""


@dataclass(frozen=True, slots=True)
class RenderScene:
    """Everything that can be seen and everything that gives light in one home."""

    parts: tuple[ShellPart, ...]
    placed: tuple[PlacedModel, ...]
    panes: tuple[WindowPane, ...]
    polygons: tuple[Float64[np.ndarray, "_ 2"], ...]
    """Inner floor polygons of the rooms."""
    heights: tuple[float, ...]
    """Of the rooms' ceilings."""
    links: tuple[tuple[int, int], ...] = field(default=())
    """Pairs of rooms that light passes between: through an opening or a door that is not shut."""


@dataclass(frozen=True, slots=True)
class Camera:
    """Where a panorama is taken. The image's centre column looks along ``yaw``."""

    position: tuple[float, float, float]
    """In the home's frame; the third number is the height above the floor."""
    yaw: float = 0.0
    """Counter-clockwise from above; 0 looks along the home's +y."""
    pitch: float = 0.0
    """Up, of the image's centre: a turn about the camera's own right."""
    roll: float = 0.0
    """Clockwise as the photographer sees it: a turn about the line of sight."""
    room: int = 0
    width: int = 1024
    height: int = 512


@dataclass(frozen=True, slots=True)
class LightSetting:
    """Sky, sun, lamps and how the photograph is exposed.

    Radiance is in 1000 cd/m2, irradiance in 1000 lux and flux in lumens, so that lamps, sky and
    sun are in the proportions of real rooms.
    """

    kind: LightKind
    seed: int
    """Chooses the outside, which lamps are on and how warm each one is."""
    sun_azimuth: float
    """Clockwise from the home's +y, as lon is."""
    sun_elevation: float
    sun_irradiance: tuple[float, float, float] | None
    """Linear, on a surface that faces the sun; None when there is no direct sun."""
    sky_radiance: float
    """Mean of the upper half of the outside."""
    lamps_on: float
    """Chance that a lamp is lit. In a home without daylight at least one lamp of every room is."""
    kelvin: tuple[float, float]
    """Range of the lamps' colour temperatures."""
    exposure: float = 0.0
    """Stops above what a camera would choose by itself."""
    adaptation: float = 0.75
    """How far the white balance follows the colour of the light: 0 is daylight film, 1 is grey."""
    tint: tuple[float, float] = (0.0, 0.0)
    """Errors of the white balance: warmer, and greener, in stops."""


@dataclass(frozen=True, slots=True)
class RenderedPanorama:
    """A panorama with its labels. Labels come from one exact ray through each pixel's centre."""

    rgb: UInt8[np.ndarray, "height width 3"]
    """sRGB."""
    distance: Float32[np.ndarray, "height width"]
    """Metres along the ray; 0 where there is nothing."""
    instance: Int32[np.ndarray, "height width"]
    """Id of what is seen; 0 where there is nothing."""
    normal: Float32[np.ndarray, "height width 3"]
    """Unit shading normal in the camera's frame, turned to the camera; 0 where there is nothing."""
    albedo: UInt8[np.ndarray, "height width 3"]
    """sRGB."""
    radiance: Float[np.ndarray, "height width 3"]
    """Linear light before the exposure, in 1000 cd/m2."""
    camera: Camera
