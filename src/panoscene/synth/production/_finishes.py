"""What rooms are covered with: floors, walls, ceilings and trim that go together."""

from collections.abc import Sequence

import numpy as np

from panoscene.synth.assets import Material
from panoscene.synth.homes import Home, Room, RoomKind
from panoscene.synth.render import Finish, RoomFinish
from panoscene.synth.textures import make_texture, nudge, wall_colour

_WET: tuple[RoomKind, ...] = ("bathroom", "laundry")
_WARM: tuple[RoomKind, ...] = ("bedroom", "child", "hobby")
_DRY_FLOORS = ("floor_planks", "floor_herringbone", "floor_carpet", "floor_tiles", "floor_concrete")
_DRY_SHARES = (0.62, 0.18, 0.06, 0.09, 0.05)
_WET_FLOORS = ("floor_tiles", "floor_terrazzo", "floor_concrete")
_WET_SHARES = (0.78, 0.16, 0.06)
_ACCENTS = ("wall_wallpaper", "wall_panels", "wall_brick", "wall_plaster", "wall_paint")
_ACCENT_SHARES = (0.42, 0.14, 0.1, 0.1, 0.24)
_WHITES = ((0.94, 0.94, 0.93), (0.95, 0.945, 0.93), (0.92, 0.92, 0.915))


def sample_finishes(
    home: Home, rng: np.random.Generator, texture_size: int = 1024
) -> tuple[RoomFinish, ...]:
    """Return how every room of a home is covered.

    A home has one floor in its dry rooms, mostly, and one kind of trim. Bathrooms and laundries
    are tiled; in other rooms all walls are painted alike, now and then with an accent wall or a
    wallpaper.

    Args:
        home: Its rooms and their kinds.
        rng: Source of randomness.
        texture_size: Edge of the textures in pixels; a power of two.
    """
    common = _floor(rng, _DRY_FLOORS, _DRY_SHARES, texture_size)
    tiled = _floor(rng, _WET_FLOORS, _WET_SHARES, texture_size)
    usual = wall_colour(rng)
    trim = _trim(rng, texture_size)
    found = []
    for room in home.rooms:
        floor = common
        if room.kind in _WET or (room.kind == "kitchen" and rng.random() < 0.6):
            floor = tiled
        elif room.kind in _WARM and rng.random() < 0.25:
            floor = _floor(rng, ("floor_carpet", "floor_planks"), (0.6, 0.4), texture_size)
        white = _WHITES[int(rng.integers(len(_WHITES)))]
        ceiling = Finish(Material("ceiling", nudge(rng, white, 0.2), 0.95))
        found.append(RoomFinish(floor, _walls(room, usual, rng, texture_size), ceiling, trim))
    return tuple(found)


def _floor(
    rng: np.random.Generator, kinds: Sequence[str], shares: Sequence[float], size: int
) -> Finish:
    return _textured(str(rng.choice(kinds, p=shares)), rng, size)


def _trim(rng: np.random.Generator, size: int) -> Finish:
    if rng.random() < 0.78:
        white = _WHITES[int(rng.integers(len(_WHITES)))]
        return Finish(Material("trim", white, float(rng.uniform(0.3, 0.55))))
    return _textured("wood", rng, size)


def _walls(
    room: Room, usual: tuple[float, float, float], rng: np.random.Generator, size: int
) -> tuple[Finish, ...]:
    if room.kind in _WET and rng.random() < 0.75:
        return (_textured("wall_tiles", rng, size),)
    colour = usual if rng.random() < 0.55 else wall_colour(rng)
    painted = _painted(colour, rng, size)
    corners = len(room.polygon)
    chance = {"living": 0.3, "bedroom": 0.35, "child": 0.35, "open_plan": 0.25}.get(room.kind, 0.12)
    if rng.random() >= chance:
        return (painted,)
    accent = _textured(str(rng.choice(_ACCENTS, p=_ACCENT_SHARES)), rng, size)
    if rng.random() < 0.35:
        return (accent,)
    lengths = np.linalg.norm(np.roll(room.polygon, -1, axis=0) - room.polygon, axis=1)
    chosen = int(rng.choice(np.argsort(-lengths)[: min(3, corners)]))
    return tuple(accent if wall == chosen else painted for wall in range(corners))


def _painted(colour: tuple[float, float, float], rng: np.random.Generator, size: int) -> Finish:
    """Return a wall paint of a colour, with the fine shape that a roller leaves."""
    texture = make_texture("wall_paint", int(rng.integers(8)), size)
    material = Material(
        "wall paint", colour, 0.9, roughness_map=texture.roughness, normal_map=texture.normal
    )
    return Finish(material, (texture.metres, texture.metres))


def _textured(kind: str, rng: np.random.Generator, size: int) -> Finish:
    texture = make_texture(kind, int(rng.integers(400)), size)
    material = Material(
        kind, (1.0, 1.0, 1.0), 0.6, texture=texture.colour, roughness_map=texture.roughness,
        normal_map=texture.normal,
    )  # fmt: skip
    return Finish(material, (texture.metres, texture.metres))
