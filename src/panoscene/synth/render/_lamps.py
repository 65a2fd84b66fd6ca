"""Which lamps there are in a scene, how bright each is and in which colour."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64

from panoscene.synth.assets import CadModel, LightSource
from panoscene.synth.render._records import LightSetting, PlacedModel, RenderScene

_FLUX = {"floor": 950.0, "wall": 500.0, "on_top": 420.0, "in_wall": 400.0, "ceiling": 1500.0}
"""Lumens of a lamp by where it is mounted."""


@dataclass(frozen=True, slots=True)
class Lamps:
    """The lamps of a scene; the arrays run over them."""

    position: Float64[np.ndarray, "lamps 3"]
    radius: Float64[np.ndarray, " lamps"]
    flux: Float64[np.ndarray, " lamps"]
    """Lumens; 0 for those that are off."""
    colour: Float64[np.ndarray, "lamps 3"]
    """Linear, with a luminance of 1."""
    room: Int64[np.ndarray, " lamps"]
    owner: Int64[np.ndarray, " lamps"]
    """Index of the placed model it belongs to."""

    @property
    def radiance(self) -> Float64[np.ndarray, "lamps 3"]:
        """Linear colour of the bulbs' surfaces, in 1000 cd/m2."""
        area = 4.0 * np.pi**2 * self.radius**2
        return (self.flux / area / 1000.0)[:, None] * self.colour


def colour_of_kelvin(kelvin: Float64[np.ndarray, " n"]) -> Float64[np.ndarray, "n 3"]:
    """Return the linear sRGB colour, of luminance 1, of black bodies from 1700 to 15000 K.

    The chromaticity is the cubic fit of Kim et al. to the Planckian locus (US patent 7024034).

    Examples:
        >>> colour_of_kelvin(np.array([2700.0])).round(1).tolist()
        [[1.9, 0.8, 0.2]]
    """
    t = 1000.0 / np.clip(kelvin, 1700.0, 15000.0)
    low = -0.2661239 * t**3 - 0.2343589 * t**2 + 0.8776956 * t + 0.179910
    high = -3.0258469 * t**3 + 2.1070379 * t**2 + 0.2226347 * t + 0.240390
    x = np.where(t >= 0.25, low, high)
    warm = -1.1063814 * x**3 - 1.34811020 * x**2 + 2.18555832 * x - 0.20219683
    middle = -0.9549476 * x**3 - 1.37418593 * x**2 + 2.09137015 * x - 0.16748867
    cold = 3.0817580 * x**3 - 5.87338670 * x**2 + 3.75112997 * x - 0.37001483
    y = np.where(t >= 1000.0 / 2222.0, warm, np.where(t >= 0.25, middle, cold))
    xyz = np.stack([x / y, np.ones_like(x), (1.0 - x - y) / y], axis=-1)
    rgb = xyz @ _RGB_FROM_XYZ.T
    rgb = np.maximum(rgb, 0.0)
    return rgb / (rgb @ LUMINANCE)[:, None]


LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
"""Of linear sRGB."""
_RGB_FROM_XYZ = np.array(
    [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
)


def lamps_of(scene: RenderScene, light: LightSetting) -> Lamps:
    """Return the lamps of a scene, switched as the setting says.

    Rooms without a window pane have a lamp on, and at dusk and night every room has.
    """
    rng = np.random.default_rng([light.seed, 1])
    owner = [k for k, placed in enumerate(scene.placed) for _ in placed.model.lights]
    sources = [(p, source) for p in scene.placed for source in p.model.lights]
    count = len(sources)
    position = np.array([_world(p, _within(p.model, s)) for p, s in sources]).reshape(count, 3)
    radius = np.array([np.clip(s.diameter / 2, 0.02, 0.3) for _, s in sources])
    room = np.array([p.room for p, _ in sources], dtype=np.int64)
    share = np.array([_FLUX[p.model.placement] / len(p.model.lights) ** 0.7 for p, _ in sources])
    areas = np.array([_area(polygon) for polygon in scene.polygons])
    large = np.array([p.model.placement == "ceiling" for p, _ in sources], dtype=bool)
    fitting = np.where(large, np.clip(areas[room] / 14.0, 0.6, 1.8), 1.0) if count else share
    flux = share * fitting * rng.uniform(0.75, 1.3, count)
    flux *= _switched_on(scene, light, rng, np.array(owner, dtype=np.int64), room)
    # lamps of a room are mostly of one kind, now and then one differs
    of_room = rng.uniform(*light.kelvin, len(scene.polygons))
    own = rng.uniform(*light.kelvin, len(scene.placed))
    mixed = rng.random(len(scene.placed)) < 0.3
    index = np.array(owner, dtype=np.int64)
    kelvin = np.where(mixed[index], own[index], of_room[room]) if count else np.zeros(0)
    return Lamps(position, radius, flux, colour_of_kelvin(kelvin), room, index)


def _within(model: CadModel, source: LightSource) -> tuple[float, float, float]:
    """Return where a bulb is: catalogues have some that hang in the air above their lamp."""
    place = np.array(source.position)
    reach = np.maximum(np.array(model.size) / 2 - source.diameter / 2, 0.0)
    if (np.abs(place) - reach).max() > _STICKS_OUT:
        place = place.clip(-reach, reach)
    x, y, z = place.tolist()
    return x, y, z


_STICKS_OUT = 0.02
"""Metres by which bulbs may reach out of the box around their model."""


def _switched_on(
    scene: RenderScene,
    light: LightSetting,
    rng: np.random.Generator,
    owner: Int64[np.ndarray, " lamps"],
    room: Int64[np.ndarray, " lamps"],
) -> Bool[np.ndarray, " lamps"]:
    """Return which lamps are lit; those of one model together."""
    lit = rng.random(len(scene.placed)) < light.lamps_on
    order = rng.permutation(len(owner))
    daylight = {pane.room for pane in scene.panes} if light.kind in ("sunny", "overcast") else set()
    for index in range(len(scene.polygons)):
        mine = [k for k in order if room[k] == index]
        if index not in daylight and mine and not lit[owner[mine]].any():
            ceiling = [k for k in mine if scene.placed[owner[k]].model.placement == "ceiling"]
            lit[owner[(ceiling or mine)[0]]] = True
    return lit[owner]


def _world(placed: PlacedModel, position: tuple[float, float, float]) -> np.ndarray:
    return (placed.world_from_object @ np.array([*position, 1.0]))[:3]


def _area(polygon: Float64[np.ndarray, "corners 2"]) -> float:
    x, y = polygon.T
    return float(abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2)
