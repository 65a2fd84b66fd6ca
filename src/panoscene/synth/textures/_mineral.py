"""Stone and what is made of it: marble, granite, tiles, terrazzo, concrete, brick, plaster."""

import numpy as np
from PIL import Image, ImageDraw

from ._colours import from_hex, nudge, palette, shade, wall_colour
from ._noise import Colour, Field, Number, axes, mix, noise, pick, shifted, step
from ._records import Draft

_MARBLES = (
    ("#f1efec", "#8f9296"), ("#ece6da", "#a98f6c"), ("#2b2c2f", "#d8d4cc"), ("#43584c", "#c9d2c4"),
    ("#d9c7b0", "#8c6a4d"), ("#e9e9ea", "#5b6068"), ("#6d4a3f", "#d9c4b4"),
)  # fmt: skip
_GRANITES = (
    ("#2c2d2f", "#8b8d90", "#111214"), ("#a39d95", "#e2ded6", "#3f3c3a"),
    ("#b59a83", "#e3d5c4", "#4d3c33"), ("#d8d5cf", "#f4f2ee", "#8d8a86"),
    ("#3c4a44", "#93a39a", "#161b19"),
)  # fmt: skip
_STONES = ("#cfc8bc", "#b9b2a6", "#8d8a86", "#e6e1d8", "#6f6e6d", "#a79a87", "#4b4c4f", "#d8cdb9")
_CLAYS = ("#a5583f", "#8f4a38", "#b4694b", "#7c4a3c", "#c28a68", "#9c7b66")


def _veins(rng: np.random.Generator, size: int) -> Field:
    bend = noise(rng, size, 1, 40, 2.2)
    fine = noise(rng, size, 1, 60, 2.1)
    u, v = axes(size)
    lines = np.abs(np.sin(np.pi * (2 * u + 1 * v + 0.55 * bend)))
    hair = np.abs(fine + 0.3 * bend)
    depth = 0.45 + 0.55 * step(noise(rng, size, 1, 8, 1.2), -0.8, 1.0)
    return ((1.0 - step(lines, 0.0, 0.16)) * 0.8 + (1.0 - step(hair, 0.0, 0.06)) * 0.35) * depth


def _marble_field(rng: np.random.Generator, size: int):
    base, vein = _MARBLES[int(rng.integers(len(_MARBLES)))]
    light, dark = nudge(rng, from_hex(base), 0.4), from_hex(vein)
    cloud = 0.18 * step(noise(rng, size, 1, 24, 1.6), -1.5, 2.0)
    return mix(light, dark, np.clip(_veins(rng, size) + cloud, 0.0, 0.9))


def marble(rng: np.random.Generator, size: int) -> Draft:
    """Return polished marble."""
    flat = np.zeros((size, size), np.float32)
    return Draft(_marble_field(rng, size), flat, flat + rng.uniform(0.1, 0.25), 1.2)


def granite(rng: np.random.Generator, size: int) -> Draft:
    """Return granite for worktops."""
    base, light, dark = (from_hex(c) for c in _GRANITES[int(rng.integers(len(_GRANITES)))])
    speck = noise(rng, size, 12, size * 0.4, 0.9)
    grit = noise(rng, size, 25, size * 0.45, 0.7)
    cloud = noise(rng, size, 2, 20, 1.0)
    colour = mix(base, light, step(speck + 0.3 * cloud, 0.3, 1.0))
    colour = mix(colour, dark, step(grit - 0.3 * cloud, 0.9, 1.4))
    flat = np.zeros((size, size), np.float32)
    return Draft(colour, flat, flat + rng.uniform(0.12, 0.35), 0.6)


def concrete(rng: np.random.Generator, size: int) -> Draft:
    """Return smoothed concrete."""
    base = nudge(rng, from_hex(("#a7a6a2", "#8f8f8d", "#b9b5ad")[int(rng.integers(3))]))
    cloud, fine = noise(rng, size, 1, 16, 1.2), noise(rng, size, 30, size * 0.48, 0.5)
    holes = step(noise(rng, size, 60, 200, 0.2), 2.9, 3.4)
    tone = 1.0 + 0.05 * cloud + 0.018 * fine - 0.3 * holes
    colour = np.asarray(base, np.float32) * tone[..., None]
    return Draft(colour, 6e-5 * fine - 5e-4 * holes, 0.62 + 0.06 * cloud + 0.3 * holes, 2.0)


def terrazzo(rng: np.random.Generator, size: int) -> Draft:
    """Return polished terrazzo: stone chips in cement."""
    colours = palette(rng)
    base = np.array(shade(colours[3], 1.3)) * 0.5 + 0.45
    image = Image.new("RGB", (size, size), tuple(int(255 * c) for c in base))
    draw, scale = ImageDraw.Draw(image), size / 1024
    for _ in range(int(rng.integers(900, 1500))):
        x, y = rng.random(2) * size
        reach = scale * rng.gamma(2.2, 5.0) + 2.0 * scale
        angle = np.sort(rng.random(int(rng.integers(4, 8)))) * 2 * np.pi
        ring = reach * rng.uniform(0.6, 1.1, len(angle))
        points = np.stack([x + ring * np.cos(angle), y + ring * np.sin(angle)], 1)
        tone = nudge(rng, colours[int(rng.integers(5))], 1.5)
        fill = tuple(int(255 * c) for c in tone)
        for dx in (-size, 0, size):
            for dy in (-size, 0, size):
                if (
                    x + dx + reach >= 0
                    and x + dx - reach < size
                    and (y + dy + reach >= 0 and y + dy - reach < size)
                ):
                    draw.polygon([(px + dx, py + dy) for px, py in points], fill=fill)
    colour = np.asarray(image, np.float32) / 255.0
    colour *= (1.0 + 0.03 * noise(rng, size, 40, size * 0.48, 0.4))[..., None]
    flat = np.zeros((size, size), np.float32)
    return Draft(colour, flat, flat + rng.uniform(0.15, 0.35), 1.0)


def _grid(size: int, across: int, up: int, bond: Number):
    """Return index, distance to the nearest edge (tiles of the picture) of a grid of pieces."""
    u, v = axes(size)
    row = np.floor(v * up).astype(np.int32)
    along = (u * across + np.float32(bond) * (row % 2).astype(np.float32)) % across
    index = row * across + along.astype(np.int32)
    x, y = along % 1.0, v * up % 1.0
    edge = np.minimum(np.minimum(x, 1 - x) / across, np.minimum(y, 1 - y) / up)
    return index, edge


def _tiled(rng, size, metres, index, edge, *, colour, spread, gap, gloss, rise=0.0012) -> Draft:
    """Return pieces with joints of grout between them."""
    count = int(index.max()) + 1
    colour = colour * (1.0 + pick(rng.normal(0.0, spread, count), index))[..., None]
    pixel = metres / size
    body = step(edge, gap / 2, gap / 2 + max(1.5 * pixel, 0.0008))
    grout_tone = nudge(rng, from_hex(("#d8d5cf", "#a9a7a2", "#6c6a68")[int(rng.integers(3))]))
    grit = noise(rng, size, 60, size * 0.48, 0.3)
    grout = np.asarray(grout_tone, np.float32) * (1.0 + 0.06 * grit)[..., None]
    height = rise * step(edge, gap / 2, gap / 2 + 0.003)
    colour = grout + (colour - grout) * body[..., None]
    return Draft(colour, height + 1e-4 * grit * (1 - body), 0.85 + (gloss - 0.85) * body, metres)


def tile_floor(rng: np.random.Generator, size: int) -> Draft:
    """Return floor tiles: stone, ceramic, marble or a chequerboard."""
    count, edge_length = int(rng.integers(2, 5)) * 2, float(rng.choice([0.2, 0.3, 0.4, 0.6]))
    count = 4 if edge_length > 0.35 else count
    metres = count * edge_length
    bond = 0.5 if rng.random() < 0.2 else 0.0
    style = str(rng.choice(["stone", "ceramic", "marble", "chequer", "bond"]))
    rows = count * 2 if style == "bond" else count
    index, edge = _grid(size, count, rows, 0.5 if style == "bond" else bond)
    table = int(index.max()) + 1
    rows_of, columns_of = (
        pick(rng.integers(0, size, table).astype(np.float32), index).astype(np.int64)
        for _ in range(2)
    )
    if style == "marble":
        field = _marble_field(rng, size)
        colour = np.stack([shifted(field[..., c], rows_of, columns_of) for c in range(3)], -1)
    else:
        cloud = noise(rng, size, 2, 60, 1.1) + 0.4 * noise(rng, size, 60, size * 0.48, 0.5)
        cloud = shifted(cloud, rows_of, columns_of)
        base = nudge(rng, from_hex(_STONES[int(rng.integers(len(_STONES)))]))
        other = from_hex(("#26272a", "#5a4a42", "#3c4f4a")[int(rng.integers(3))])
        if style == "chequer":
            across = (index % count + index // count) % 2
            base = mix((0.93, 0.92, 0.89), other, across.astype(np.float32))
        grade = 0.045 if style in ("stone", "bond") else 0.014
        colour = np.asarray(base, np.float32) * (1.0 + grade * cloud)[..., None]
    gloss = float(rng.uniform(0.12, 0.4))
    return _tiled(
        rng, size, metres, index, edge * metres, colour=colour, spread=0.025, gap=0.003, gloss=gloss
    )


def tile_wall(rng: np.random.Generator, size: int) -> Draft:
    """Return glazed bathroom or kitchen tiles."""
    style = str(rng.choice(["square", "subway", "large", "mosaic", "upright"]))
    across, up, metres = {
        "square": (8, 8, 1.2), "subway": (6, 12, 1.2), "large": (4, 2, 1.2),
        "mosaic": (24, 24, 0.72), "upright": (12, 4, 0.9),
    }[style]  # fmt: skip
    index, edge = _grid(size, across, up, 0.5 if style == "subway" else 0.0)
    table = int(index.max()) + 1
    if style == "mosaic":
        colours = np.array([nudge(rng, c, 1.5) for c in palette(rng)[1:4]])
        colour = pick(colours[rng.integers(0, 3, table)], index)
    else:
        white = rng.random() < 0.5
        tone = (0.93, 0.93, 0.91) if white else palette(rng)[int(rng.integers(1, 4))]
        colour = np.asarray(nudge(rng, tone, 0.5), np.float32) * np.ones((size, size, 1))
    wave = noise(rng, size, 4, 24, 1.0)
    draft = _tiled(
        rng,
        size,
        metres,
        index,
        edge * metres,
        colour=colour,
        spread=0.011,
        gap=0.0025,
        gloss=0.12,
        rise=0.0015,
    )
    tilt = pick(rng.normal(0.0, 2e-4, table), index) + 4e-5 * wave
    return draft._replace(height=draft.height + tilt)


def brick(rng: np.random.Generator, size: int) -> Draft:
    """Return a brick wall, bare or whitewashed."""
    metres, across, up = 1.0, 4, 14
    index, edge = _grid(size, across, up, 0.5)
    edge = edge * metres + 0.0012 * noise(rng, size, 8, 80, 1.0)
    rough, cloud = noise(rng, size, 30, size * 0.45, 0.8), noise(rng, size, 3, 40, 1.2)
    clay = np.array([nudge(rng, from_hex(c), 1.2) for c in rng.choice(_CLAYS, 2)])
    share = pick(rng.random(int(index.max()) + 1), index)
    colour = (
        mix(tuple(clay[0]), tuple(clay[1]), share) * (1.0 + 0.07 * rough + 0.06 * cloud)[..., None]
    )
    draft = _tiled(
        rng,
        size,
        metres,
        index,
        edge,
        colour=colour,
        spread=0.09,
        gap=0.011,
        gloss=0.85,
        rise=0.005,
    )
    height = draft.height + 5e-4 * rough * step(edge, 0.004, 0.008)
    if rng.random() < 0.4:
        paint = np.asarray(nudge(rng, (0.93, 0.92, 0.9), 0.3), np.float32)
        worn = 0.06 + 0.1 * step(rough + cloud, 2.2, 3.0)
        colour = draft.colour * worn[..., None] + paint * (1.0 - worn)[..., None]
        draft = draft._replace(colour=colour)
    return draft._replace(height=height)


def plaster(rng: np.random.Generator, size: int) -> Draft:
    """Return rough or trowelled plaster."""
    rough = rng.random() < 0.5
    colour: Colour = wall_colour(rng)
    if rough:
        height = 7e-4 * noise(rng, size, 20, 160, 0.7)
    else:
        height = 1.2e-3 * np.abs(noise(rng, size, 2, 30, 1.5, stretch=(2.0, 1.0)))
        height += 8e-5 * noise(rng, size, 40, size * 0.45, 0.6)
    cloud = noise(rng, size, 1, 24, 1.3)
    tone = 1.0 + 0.009 * cloud + 0.008 * height / height.std()
    picture = np.asarray(colour, np.float32) * tone[..., None]
    return Draft(picture, height, 0.88 + 0.02 * cloud, 1.5)


def paint(rng: np.random.Generator, size: int) -> Draft:
    """Return a painted wall with the faint orange peel of a roller."""
    colour = wall_colour(rng)
    peel = noise(rng, size, 60, 320, 0.7)
    cloud = noise(rng, size, 1, 10, 1.2)
    picture = np.asarray(colour, np.float32) * (1.0 + 0.004 * cloud + 0.003 * peel)[..., None]
    return Draft(picture, 5e-5 * peel, 0.8 + 0.03 * cloud, 1.5)
