"""What a furniture model is, wherever it comes from; numpy only."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from jaxtyping import Float32, Int16, Int32, UInt8

MaterialKind = Literal["opaque", "glass", "mirror", "light"]
Placement = Literal["floor", "wall", "on_top", "in_wall", "ceiling"]


@dataclass(frozen=True, slots=True)
class Material:
    """How a part of a model looks. Colours are sRGB in [0, 1]."""

    name: str
    colour: tuple[float, float, float] = (0.7, 0.7, 0.7)
    """Of the surface; multiplied with the texture where there is one."""
    roughness: float = 0.7
    """0 is a mirror, 1 is chalk."""
    metallic: float = 0.0
    opacity: float = 1.0
    """Below 1 for glass and gauze."""
    kind: MaterialKind = "opaque"
    emission: float = 0.0
    """Radiance of a ``light`` relative to a white lamp shade that is switched on (1)."""
    texture: UInt8[np.ndarray, "height width 3"] | None = None
    """sRGB; u runs right and v up, from the lower left corner; it repeats."""
    roughness_map: UInt8[np.ndarray, "rows columns"] | None = None
    normal_map: UInt8[np.ndarray, "ny nx 3"] | None = None
    """Tangent space, +z out of the surface, 128 is 0."""


@dataclass(frozen=True, slots=True)
class LightSource:
    """A lamp inside a model."""

    position: tuple[float, float, float]
    """Object frame, metres."""
    diameter: float = 0.08
    colour: tuple[float, float, float] = (1.0, 0.85, 0.65)
    """Relative, linear."""


@dataclass(frozen=True, slots=True)
class CadModel:
    """One furniture model in the object frame: metres, +x its right, +y its front, +z up.

    The origin is the centre of the bounding box. Faces are counter-clockwise from outside as far
    as the source knows; renderers show both sides.
    """

    id: str
    """Unique, such as ``sweethome3d/Scopia/34`` or ``parametric/mirror/7``."""
    base: str
    """The model it was made from: recoloured, rescaled and cut copies share it, so that a split
    by base never shows a test shape in training."""
    category: str
    """One of the 57 categories, or "" for decoration that gets no label."""
    vertices: Float32[np.ndarray, "vertices 3"]
    normals: Float32[np.ndarray, "vertices 3"]
    """Unit normals of the vertices, on the outer side."""
    uv: Float32[np.ndarray, "vertices 2"]
    faces: Int32[np.ndarray, "faces 3"]
    face_material: Int16[np.ndarray, " faces"]
    """Index into ``materials``."""
    materials: tuple[Material, ...]
    size: tuple[float, float, float]
    """Width, depth, height in metres: the extent of the vertices."""
    placement: Placement = "floor"
    elevation: float = 0.0
    """Usual height in metres of the lower edge above what it stands on, or above the floor for
    what hangs on a wall."""
    support_height: float | None = None
    """Height above the lower edge on which things can stand; None when nothing can."""
    lights: tuple[LightSource, ...] = field(default=())
    has_front: bool = True
    """False where every side is as good: round tables, plants, lamps."""
    licence: str = ""
    creator: str = ""
    source: str = ""
    """Where it is from: library and name, or the generator and its seed."""
