"""All kinds of parametric models, and the function that makes one."""

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from panoscene.synth.assets import CadModel, Placement

from . import _appliances as machines
from . import _bathroom as bath
from . import _cabinets as cabinets
from . import _clocks as clocks
from . import _cooking as cooking
from . import _decoration as deco
from . import _electronics as screens
from . import _hobby as hobby
from . import _lamps as lamps
from . import _openings as openings
from . import _seats as seats
from . import _soft as soft
from . import _vessels as vessels
from . import _wall as wall
from ._workshop import Workshop


class Kind(NamedTuple):
    """How a kind of model is made and where it belongs."""

    make: Callable[[Workshop], None]
    placement: Placement = "floor"
    elevation: float = 0.0
    has_front: bool = True


_LABELLED: dict[str, Kind] = {
    "basket": Kind(vessels.basket, has_front=False),
    "bathtub": Kind(bath.bathtub),
    "bench": Kind(seats.bench),
    "bottom_cabinet": Kind(cabinets.bottom_cabinet),
    "bottom_cabinet_no_top": Kind(cabinets.bottom_cabinet_no_top),
    "carpet": Kind(soft.carpet, has_front=False),
    "chest": Kind(cabinets.chest),
    "coffee_machine": Kind(machines.coffee_machine, "on_top"),
    "console_table": Kind(cabinets.console_table),
    "cooktop": Kind(cooking.cooktop, "on_top"),
    "counter": Kind(cabinets.counter),
    "crib": Kind(vessels.crib),
    "cushion": Kind(soft.cushion, "on_top"),
    "dishwasher": Kind(machines.dishwasher),
    "door": Kind(openings.door, "in_wall"),
    "dryer": Kind(machines.dryer),
    "fence": Kind(vessels.fence, has_front=False),
    "floor_lamp": Kind(lamps.floor_lamp, has_front=False),
    "fridge": Kind(machines.fridge),
    "grandfather_clock": Kind(clocks.grandfather_clock),
    "guitar": Kind(hobby.guitar),
    "heater": Kind(wall.heater, "wall", 0.12),
    "laptop": Kind(screens.laptop, "on_top"),
    "loudspeaker": Kind(screens.loudspeaker),
    "microwave": Kind(cooking.microwave, "on_top"),
    "mirror": Kind(wall.mirror, "wall", 1.0),
    "monitor": Kind(screens.monitor, "on_top"),
    "office_chair": Kind(seats.office_chair),
    "oven": Kind(cooking.oven, elevation=0.15),
    "piano": Kind(hobby.piano),
    "picture": Kind(wall.picture, "wall", 1.3),
    "pool_table": Kind(hobby.pool_table, has_front=False),
    "range_hood": Kind(cooking.range_hood, "wall", 1.55),
    "shelf": Kind(cabinets.shelf),
    "shower": Kind(bath.shower),
    "speaker_system": Kind(screens.speaker_system, "on_top"),
    "standing_tv": Kind(screens.standing_tv, "on_top"),
    "stool": Kind(seats.stool, has_front=False),
    "stove": Kind(cooking.stove),
    "table_lamp": Kind(lamps.table_lamp, "on_top", has_front=False),
    "toilet": Kind(bath.toilet),
    "top_cabinet": Kind(cabinets.top_cabinet, "wall", 1.45),
    "towel_rack": Kind(wall.towel_rack, "wall", 1.0),
    "trash_can": Kind(vessels.trash_can, has_front=False),
    "treadmill": Kind(hobby.treadmill),
    "wall_clock": Kind(clocks.wall_clock, "wall", 1.7),
    "wall_mounted_tv": Kind(screens.wall_mounted_tv, "wall", 1.0),
    "washer": Kind(machines.washer),
    "window": Kind(openings.window, "in_wall", 0.9),
}
_DECORATION: dict[str, Kind] = {
    "books": Kind(deco.books, "on_top"),
    "bottles": Kind(deco.bottles, "on_top", has_front=False),
    "candles": Kind(deco.candles, "on_top", has_front=False),
    "ceiling_lamp": Kind(lamps.ceiling_lamp, "ceiling", has_front=False),
    "curtain": Kind(soft.curtain, "wall", 0.05),
    "dishes": Kind(deco.dishes, "on_top", has_front=False),
    "skirting": Kind(deco.skirting, "wall"),
    "small_box": Kind(deco.small_box, "on_top"),
    "socket": Kind(deco.socket, "wall", 0.3),
    "switch": Kind(deco.switch, "wall", 1.05),
    "towels": Kind(deco.towels, "on_top"),
    "toys": Kind(deco.toys, has_front=False),
    "vase": Kind(deco.vase, "on_top", has_front=False),
}
DECORATION_KINDS: tuple[str, ...] = tuple(_DECORATION)
"""Kinds without a label: their category is empty."""
PARAMETRIC_KINDS: tuple[str, ...] = (*_LABELLED, *_DECORATION)
"""All kinds; the name of a labelled one is its category."""


def make_model(kind: str, seed: int, texture_size: int = 1024) -> CadModel:
    """Return the model ``parametric/<kind>/<seed>``; other seeds are other designs.

    Every model is a union of closed pieces whose faces look outwards. It stands upright with its
    front at +y, and its uv are in tiles of its materials' textures. The last dozens of models are
    kept in memory, so their arrays are read-only.

    Args:
        kind: one of ``PARAMETRIC_KINDS``.
        seed: not negative.
        texture_size: edge of the textures in pixels, a power of two; 0 makes plain colours, which
            is quick and leaves the shape as it is.

    Raises:
        ValueError: the kind is unknown or the seed negative.

    Examples:
        >>> model = make_model("mirror", 7, texture_size=0)
        >>> model.id, model.placement, model.size[1] < 0.1
        ('parametric/mirror/7', 'wall', True)
    """
    if kind not in PARAMETRIC_KINDS:
        raise ValueError(f"kind is {kind!r}; expected one of {', '.join(PARAMETRIC_KINDS)}")
    if seed < 0:
        raise ValueError(f"seed is {seed}; expected 0 or more")
    return _made(kind, int(seed), texture_size)


@lru_cache(maxsize=64)
def _made(kind: str, seed: int, texture_size: int) -> CadModel:
    recipe = _LABELLED.get(kind) or _DECORATION[kind]
    shop = Workshop(np.random.default_rng([seed, *kind.encode()]), texture_size)
    recipe.make(shop)
    category = kind if kind in _LABELLED else ""
    name = f"parametric/{kind}/{seed}"
    model = shop.model(name, category, recipe.placement, recipe.elevation, recipe.has_front)
    for array in (model.vertices, model.normals, model.uv, model.faces, model.face_material):
        array.flags.writeable = False
    return model
