"""Textures by name and seed, kept while they are in use."""

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from . import _cloth, _drawn, _metal, _mineral, _pictures, _wood
from ._records import Draft, Texture, finish

_Maker = Callable[[np.random.Generator, int], Draft]

_TILEABLE: dict[str, _Maker] = {
    "floor_planks": _wood.planks,
    "floor_herringbone": _wood.herringbone,
    "floor_tiles": _mineral.tile_floor,
    "floor_terrazzo": _mineral.terrazzo,
    "floor_concrete": _mineral.concrete,
    "floor_carpet": _cloth.carpet,
    "wall_paint": _mineral.paint,
    "wall_wallpaper": _cloth.wallpaper,
    "wall_brick": _mineral.brick,
    "wall_plaster": _mineral.plaster,
    "wall_panels": _wood.panels,
    "wall_tiles": _mineral.tile_wall,
    "wood": _wood.board,
    "fabric_weave": _cloth.weave,
    "fabric_stripes": _cloth.stripes,
    "fabric_plaid": _cloth.plaid,
    "fabric_velvet": _cloth.velvet,
    "felt": _cloth.felt,
    "leather": _cloth.leather,
    "marble": _mineral.marble,
    "granite": _mineral.granite,
    "metal_brushed": _metal.brushed,
    "wicker": _cloth.wicker,
}
_WHOLE: dict[str, _Maker] = {
    "book_spines": _drawn.book_spines,
    "picture_abstract": _pictures.abstract,
    "picture_scenic": _pictures.scenic,
    "picture_poster": _pictures.poster,
    "clock_dial": _drawn.dial,
    "screen_off": _drawn.screen_off,
    "screen_desktop": _drawn.screen_desktop,
    "screen_film": _drawn.screen_film,
    "controls": _drawn.controls,
    "rug": _drawn.rug,
}
TEXTURE_KINDS: tuple[str, ...] = (*_TILEABLE, *_WHOLE)
"""All kinds of textures."""
TILEABLE_KINDS: tuple[str, ...] = tuple(_TILEABLE)
"""Those that repeat without a seam; the others are whole pictures."""
FLOOR_KINDS: tuple[str, ...] = tuple(k for k in _TILEABLE if k.startswith("floor_"))
WALL_KINDS: tuple[str, ...] = tuple(k for k in _TILEABLE if k.startswith("wall_"))


_LARGE = 512
"""Pixels; textures from this size on take megabytes each, and fewer are kept."""


def _made(kind: str, seed: int, size: int) -> Texture:
    maker = _TILEABLE.get(kind) or _WHOLE[kind]
    rng = np.random.default_rng([seed, *kind.encode()])
    return finish(maker(rng, size), kind in _TILEABLE)


_kept_large = lru_cache(maxsize=12)(_made)
_kept_small = lru_cache(maxsize=48)(_made)


def make_texture(kind: str, seed: int, size: int = 1024) -> Texture:
    """Return the texture of this kind and seed, ``size`` x ``size`` pixels.

    Any size shows the same design as far as its pixels can; the last dozen are kept in memory,
    and a few dozen below 512 pixels.

    Args:
        kind: one of ``TEXTURE_KINDS``.
        seed: not negative; every seed is another species, pattern and colour.
        size: a power of two from 16 to 4096.

    Raises:
        ValueError: the kind is unknown, or the seed or size is out of range.

    Examples:
        >>> make_texture("wood", 3, size=64).colour.shape
        (64, 64, 3)
    """
    if kind not in TEXTURE_KINDS:
        raise ValueError(f"kind is {kind!r}; expected one of {', '.join(TEXTURE_KINDS)}")
    if seed < 0:
        raise ValueError(f"seed is {seed}; expected 0 or more")
    if size not in (16, 32, 64, 128, 256, 512, 1024, 2048, 4096):
        raise ValueError(f"size is {size}; expected a power of two from 16 to 4096")
    kept = _kept_small if size < _LARGE else _kept_large
    return kept(kind, int(seed), size)
