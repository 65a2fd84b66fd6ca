"""Wood: one board's grain, boards, plank floors, herringbone and panelled walls."""

from typing import NamedTuple

import numpy as np

from ._colours import from_hex, nudge, wall_colour
from ._noise import Colour, Field, Number, axes, mix, noise, pick, shifted, step
from ._records import Draft


class Species(NamedTuple):
    """How the wood of a tree looks."""

    light: str
    dark: str
    rings: float
    """Rings across a metre of board."""
    contrast: float
    pores: float


SPECIES: dict[str, Species] = {
    "oak": Species("#c9a06a", "#9c7340", 16, 0.55, 0.8),
    "pale_oak": Species("#d9c3a0", "#b99f78", 16, 0.45, 0.6),
    "ash": Species("#dcc8a4", "#b4976a", 13, 0.7, 0.5),
    "beech": Species("#d8ac7c", "#c08f5f", 18, 0.3, 0.35),
    "birch": Species("#e3cfa9", "#cdb489", 10, 0.3, 0.1),
    "pine": Species("#e0bd82", "#bf8a4a", 11, 0.75, 0.05),
    "walnut": Species("#7d573a", "#4a3020", 14, 0.65, 0.6),
    "teak": Species("#a4713f", "#74491f", 15, 0.55, 0.5),
    "cherry": Species("#b0704a", "#8c4f30", 13, 0.45, 0.2),
    "mahogany": Species("#7e3f28", "#562616", 17, 0.45, 0.5),
    "wenge": Species("#4b3a30", "#2a201b", 26, 0.6, 0.7),
    "grey_oak": Species("#a59a8c", "#7d7266", 16, 0.5, 0.7),
}


def species(rng: np.random.Generator) -> Species:
    """Return one kind of wood."""
    return list(SPECIES.values())[int(rng.integers(len(SPECIES)))]


def grain(
    rng: np.random.Generator, size: int, metres: Number, wood: Species
) -> tuple[Field, Field]:
    """Return tone (0 light, 1 dark) and pores (0 or 1) of boards whose fibres run along u."""
    _, v = axes(size)
    bend = noise(rng, size, 1, 7, 1.4, stretch=(3.0, 1.0)) + 0.12 * noise(
        rng, size, 4, 40, 1.5, stretch=(9, 1)
    )
    count = max(round(wood.rings * metres), 2)
    phase = (v * count + 1.3 * bend) % 1.0
    late = phase**2.2 * step(1.0 - phase, 0.0, 0.14)
    fibre = noise(rng, size, 20, size * 0.48, 0.55, stretch=(28.0, 1.0))
    streak = noise(rng, size, 2, 30, 1.0, stretch=(9.0, 1.0))
    tone = 0.30 + wood.contrast * (1.15 * late - 0.25) + 0.075 * fibre + 0.11 * streak
    dashes = noise(rng, size, 60, size * 0.48, 0.15, stretch=(14.0, 1.0)) + 0.5 * (late - 0.4)
    return np.clip(tone, 0.0, 1.2), step(dashes, 1.55, 2.3) * wood.pores


def coloured(tone: Field, pores: Field, light: Colour, dark: Colour):
    """Return the picture of a grain between two colours."""
    picture = mix(light, dark, tone)
    return picture * (1.0 - 0.38 * pores)[..., None]


def board(rng: np.random.Generator, size: int) -> Draft:
    """Return an unbroken wooden surface, fibres along u."""
    wood, metres = species(rng), 1.2
    tone, pores = grain(rng, size, metres, wood)
    light, dark = nudge(rng, from_hex(wood.light), 0.7), nudge(rng, from_hex(wood.dark), 0.7)
    gloss = rng.uniform(0.32, 0.6)
    return Draft(
        coloured(tone, pores, light, dark),
        -1.6e-4 * pores - 5e-5 * tone,
        gloss + 0.08 * tone + 0.2 * pores,
        metres,
    )


def _laid(rng, size, metres, wood, index, *, edge, across=None, gap=0.0006) -> Draft:
    """Return wooden pieces: every piece (its index) has its own cut, every edge a joint."""
    tone, pores = grain(rng, size, metres, wood)
    count = int(index.max()) + 1
    rows = pick(rng.integers(0, size, count).astype(np.float32), index).astype(np.int32)
    columns = pick(rng.integers(0, size, count).astype(np.float32), index).astype(np.int32)
    tone, pores = shifted(tone, rows, columns, across), shifted(pores, rows, columns, across)
    spread = rng.uniform(0.04, 0.15)
    tone = tone + pick(rng.normal(0.0, spread, count), index)
    light, dark = nudge(rng, from_hex(wood.light), 0.7), nudge(rng, from_hex(wood.dark), 0.7)
    colour = coloured(tone, pores, light, dark)
    colour *= (1.0 + pick(rng.normal(0.0, 0.35 * spread, count), index))[..., None]
    pixel = metres / size
    joint = 1.0 - step(edge, gap, gap + 0.8 * pixel)
    round_over = -6e-4 * (1.0 - step(edge, 0.0, 0.004))
    colour *= (1.0 - rng.uniform(0.25, 0.65) * joint)[..., None]
    gloss = rng.uniform(0.28, 0.55)
    return Draft(
        colour,
        round_over - 8e-5 * pores,
        gloss + 0.10 * pores + 0.06 * tone + 0.35 * joint,
        metres,
    )


def _plank_grid(rng, size, rows, length):
    """Return the index of the plank and the distance to its edge in tiles, at every pixel."""
    u, v = axes(size)
    row = np.floor(v * rows).astype(np.int32)
    start = np.cumsum(rng.uniform(0.22, 0.45, rows)).astype(np.float32) % 1.0
    along = (u + start[row]) % 1.0 * length
    index = row * length + along.astype(np.int32)
    across = (v * rows) % 1.0
    to_end = np.minimum(along % 1.0, 1.0 - along % 1.0) / length
    to_side = np.minimum(across, 1.0 - across) / rows
    return index, np.minimum(to_end, to_side)


def planks(rng: np.random.Generator, size: int) -> Draft:
    """Return a plank floor, boards along u."""
    metres = 2.4
    index, edge = _plank_grid(rng, size, int(rng.integers(12, 22)), int(rng.integers(2, 4)))
    return _laid(rng, size, metres, species(rng), index, edge=edge * metres)


def herringbone(rng: np.random.Generator, size: int) -> Draft:
    """Return a parquet floor in herringbone."""
    ratio, repeats = int(rng.integers(4, 7)), 2
    units = 2 * ratio * repeats
    metres = units * rng.uniform(0.065, 0.09)
    u, v = axes(size)
    i, j = np.floor(u * units).astype(np.int64), np.floor(v * units).astype(np.int64)
    place = (i - j) % (2 * ratio)
    across = place >= ratio
    along = np.where(across, 2 * ratio - 1 - place, place)
    first_i, first_j = (
        np.where(across, i, i - along) % units,
        np.where(across, j - along, j) % units,
    )
    index = (first_i * units + first_j) * 2 + across
    x, y = (
        np.where(across, v * units % 1.0, u * units % 1.0) + along,
        np.where(across, u * units % 1.0, v * units % 1.0),
    )
    edge = np.minimum(np.minimum(x, ratio - x), np.minimum(y, 1.0 - y)) * metres / units
    return _laid(rng, size, metres, species(rng), index, edge=edge, across=across)


def panels(rng: np.random.Generator, size: int) -> Draft:
    """Return a wall of upright boards, in wood or painted."""
    metres, count = 1.2, int(rng.integers(7, 14))
    u, v = axes(size)
    index = np.floor(u * count).astype(np.int64) * np.ones((size, 1), np.int64)
    place = (u * count) % 1.0 * np.ones_like(v)
    edge = np.minimum(place, 1.0 - place) * metres / count
    draft = _laid(
        rng,
        size,
        metres,
        species(rng),
        index,
        edge=edge,
        across=np.ones((size, size), bool),
        gap=0.003,
    )
    if rng.random() < 0.5:
        colour = np.asarray(wall_colour(rng), np.float32)
        tone = draft.colour.mean(axis=-1, keepdims=True)
        colour = colour * (0.94 + 0.1 * tone) * step(edge, 0.0005, 0.004)[..., None] ** 0.25
        draft = draft._replace(colour=colour, roughness=0.5 + 0.2 * draft.height * 0.0)
    return draft._replace(height=3.0 * draft.height)
