"""Woven and soft things: fabrics, carpets, leather, felt, wicker, and wallpaper."""

import numpy as np
from PIL import Image, ImageDraw, ImageFilter

from ._colours import nudge, palette, shade, wall_colour
from ._noise import Field, axes, enlarge, mix, noise, step
from ._records import Draft


def _weave(size: int, threads: int) -> tuple[Field, np.ndarray]:
    """Return the height (0 to 1) of a plain weave and where the weft is on top."""
    u, v = axes(size)
    x, y = u * threads, v * threads
    over = (np.floor(x) + np.floor(y)) % 2 < 0.5
    across, along = np.sin(np.pi * (x % 1.0)), np.sin(np.pi * (y % 1.0))
    weft, warp = along**0.6 * (0.45 + 0.55 * across), across**0.6 * (0.45 + 0.55 * along)
    return np.where(over, weft, warp).astype(np.float32), over


def _woven(rng, size, colour, metres, threads, *, contrast=0.22) -> Draft:
    """Return a colour picture as a weave with uneven yarn."""
    height, over = _weave(size, threads)
    yarn = np.where(
        over,
        noise(rng, size, 4, threads, 0.5, stretch=(12.0, 1.0)),
        noise(rng, size, 4, threads, 0.5, stretch=(1.0, 12.0)),
    )
    fuzz = noise(rng, size, 60, size * 0.48, 0.2)
    tone = 1.0 - contrast + contrast * height + 0.045 * yarn + 0.03 * fuzz
    picture = np.asarray(colour, np.float32) * tone[..., None]
    depth = 0.25 * metres / threads
    return Draft(picture, depth * height, 0.9 + 0.05 * fuzz, metres)


def weave(rng: np.random.Generator, size: int) -> Draft:
    """Return a plain fabric of one or two yarns."""
    colours = palette(rng)
    first = nudge(rng, colours[int(rng.integers(5))])
    second = first if rng.random() < 0.5 else nudge(rng, shade(first, rng.uniform(0.8, 1.4)))
    threads = int(rng.choice([48, 64, 96]))
    _, over = _weave(size, threads)
    return _woven(rng, size, mix(first, second, over.astype(np.float32)), 0.2, threads)


def _bands(rng: np.random.Generator, size: int, colours, mirrored: bool) -> np.ndarray:
    """Return (size, 3) colours of random bands that repeat."""
    cuts = np.sort(rng.random(int(rng.integers(4, 9))))
    table = np.array([colours[int(k)] for k in rng.integers(0, len(colours), len(cuts) + 1)])
    table[-1] = table[0]
    place = (np.arange(size) + 0.5) / size
    place = np.abs(2.0 * place - 1.0) if mirrored else place
    return table[np.searchsorted(cuts, place)].astype(np.float32)


def stripes(rng: np.random.Generator, size: int) -> Draft:
    """Return a striped fabric."""
    colours = palette(rng)
    picture = np.broadcast_to(_bands(rng, size, colours, False)[None], (size, size, 3))
    return _woven(rng, size, picture, 0.3, 96)


def plaid(rng: np.random.Generator, size: int) -> Draft:
    """Return a tartan."""
    colours = palette(rng)
    bands = _bands(rng, size, colours, True)
    twill = (np.add.outer(np.arange(size), np.arange(size)) * 96 // size) % 2 == 0
    picture = np.where(twill[..., None], bands[None], bands[:, None])
    return _woven(rng, size, picture, 0.3, 96)


def velvet(rng: np.random.Generator, size: int) -> Draft:
    """Return a short pile with brushed marks."""
    colour = nudge(rng, palette(rng)[int(rng.integers(3))])
    brushed, fuzz = noise(rng, size, 1, 12, 1.3), noise(rng, size, 80, size * 0.48, 0.2)
    picture = np.asarray(colour, np.float32) * (1.0 + 0.04 * brushed + 0.05 * fuzz)[..., None]
    return Draft(picture, 1.2e-4 * fuzz, 0.75 + 0.06 * brushed, 0.4)


def felt(rng: np.random.Generator, size: int) -> Draft:
    """Return felt, such as on pool tables."""
    colour = [(0.05, 0.36, 0.2), (0.05, 0.28, 0.5), (0.5, 0.07, 0.1), (0.1, 0.4, 0.36)]
    chosen = nudge(rng, colour[int(rng.integers(4))])
    fuzz = noise(rng, size, 40, size * 0.48, 0.4)
    picture = np.asarray(chosen, np.float32) * (1.0 + 0.06 * fuzz)[..., None]
    return Draft(picture, 1e-4 * fuzz, 0.95 + 0.0 * fuzz, 0.5)


def leather(rng: np.random.Generator, size: int) -> Draft:
    """Return grained leather."""
    tones = [(0.30, 0.17, 0.10), (0.09, 0.08, 0.08), (0.52, 0.31, 0.18), (0.78, 0.72, 0.63),
             (0.38, 0.09, 0.08), (0.16, 0.19, 0.24), (0.62, 0.5, 0.38)]  # fmt: skip
    colour = nudge(rng, tones[int(rng.integers(len(tones)))], 1.2)
    pebbles = np.abs(noise(rng, size, 40, 130, 0.4)) ** 0.7
    cloud = noise(rng, size, 1, 10, 1.2)
    tone = 0.88 + 0.14 * step(pebbles, 0.0, 0.8) + 0.02 * cloud
    picture = np.asarray(colour, np.float32) * tone[..., None]
    return Draft(picture, 1.8e-4 * step(pebbles, 0.0, 0.9), 0.42 - 0.08 * step(pebbles, 0, 1), 0.3)


def carpet(rng: np.random.Generator, size: int) -> Draft:
    """Return wall-to-wall carpet: loops, cut pile or ribs."""
    colours = palette(rng)
    colour = nudge(rng, colours[int(rng.integers(5))])
    style = str(rng.choice(["loop", "pile", "rib"]))
    if style == "pile":
        height = noise(rng, size, 40, 220, 0.3)
    else:
        height = 2.0 * _weave(size, 80 if style == "loop" else 48)[0] - 1.0
        height = height + 0.5 * noise(rng, size, 40, 200, 0.3)
    fleck = step(noise(rng, size, 30, 120, 0.3), 0.7, 1.2)
    second = nudge(rng, shade(colour, rng.uniform(0.7, 1.4)))
    picture = mix(colour, second, 0.5 * fleck) * (0.94 + 0.09 * height)[..., None]
    return Draft(picture, 7e-4 * height, 0.97 + 0.0 * height, 0.5)


def wicker(rng: np.random.Generator, size: int) -> Draft:
    """Return basketwork: canes woven around stakes."""
    count = 16
    height, over = _weave(size, count)
    u, v = axes(size)
    tones = [(0.72, 0.54, 0.33), (0.45, 0.29, 0.16), (0.83, 0.73, 0.55), (0.42, 0.4, 0.37)]
    colour = nudge(rng, tones[int(rng.integers(4))], 1.5)
    fibre = np.where(
        over,
        noise(rng, size, 8, 200, 0.4, stretch=(16.0, 1.0)),
        noise(rng, size, 8, 200, 0.4, stretch=(1.0, 16.0)),
    )
    split = np.where(
        over, np.sin(3 * np.pi * (v * count % 1.0)), np.sin(3 * np.pi * (u * count % 1.0))
    )
    tone = 0.25 + 0.75 * step(height, 0.05, 0.9) + 0.07 * fibre + 0.05 * np.abs(split)
    picture = np.asarray(colour, np.float32) * tone[..., None]
    return Draft(picture, 3e-3 * height + 1.5e-4 * fibre, 0.65 + 0.03 * fibre, 0.24)


def _motif(rng: np.random.Generator, size: int) -> Field:
    """Return a mask of an ornament: leaves, petals or rings around the centre."""
    image = Image.new("L", (256, 256), 0)
    draw = ImageDraw.Draw(image)
    petals, style = int(rng.integers(4, 9)), int(rng.integers(3))
    for k in range(petals):
        angle = 2 * np.pi * (k + 0.5) / petals
        t = np.linspace(0, np.pi, 24)
        reach, width = rng.uniform(82, 116) if style == 2 else 104, 26 if style else 40
        x, y = reach * np.sin(t / 2) ** 1.2, width * np.sin(t) * (1 - 0.35 * np.cos(t))
        for side in (-1, 1):
            px = 128 + x * np.cos(angle) - side * y * np.sin(angle)
            py = 128 + x * np.sin(angle) + side * y * np.cos(angle)
            draw.polygon([*zip(px, py, strict=True)], fill=255 if side > 0 or style else 170)
    draw.ellipse((112, 112, 144, 144), fill=80)
    if style == 1:
        draw.ellipse((14, 14, 242, 242), outline=255, width=7)
    image = image.filter(ImageFilter.GaussianBlur(1))
    return enlarge(np.asarray(image), size).astype(np.float32) / 255.0


def wallpaper(rng: np.random.Generator, size: int) -> Draft:
    """Return wallpaper: ornaments, stripes, trellis, dots or grass cloth."""
    ground = wall_colour(rng)
    ink = (
        nudge(rng, shade(ground, rng.uniform(0.72, 0.9))) if rng.random() < 0.6 else palette(rng)[1]
    )
    style = str(rng.choice(["ornament", "stripes", "trellis", "dots", "grass", "ornament"]))
    u, v = axes(size)
    fine = noise(rng, size, 60, size * 0.48, 0.4)
    mask = np.zeros((size, size), np.float32)
    if style == "ornament":
        cell = size // int(rng.choice([4, 8]))
        motif = _motif(rng, cell)
        tile = np.zeros((2 * cell, 2 * cell), np.float32)
        tile[:cell, :cell] = motif
        tile[cell:, cell:] = motif
        mask = np.tile(tile, (size // (2 * cell), size // (2 * cell)))
    elif style == "stripes":
        count, share = int(rng.integers(5, 16)), float(rng.uniform(0.12, 0.55))
        mask = step(share / 2 - np.abs(u * count % 1.0 - 0.5), -0.02, 0.02) * np.ones_like(v)
    elif style == "trellis":
        count = int(rng.integers(4, 9))
        a, b = (u + v) * count % 1.0, (u - v) * count % 1.0
        mask = 1.0 - step(np.minimum(np.abs(a - 0.5), np.abs(b - 0.5)), 0.025, 0.05)
    elif style == "dots":
        count = int(rng.integers(8, 17))
        x, y = u * count % 1.0 - 0.5, v * count % 1.0 - 0.5
        mask = 1.0 - step(np.hypot(x, y), 0.13, 0.17)
    else:
        mask = np.clip(0.5 + 0.3 * noise(rng, size, 8, 300, 0.4, stretch=(24.0, 1.0)), 0, 1)
    colour = mix(ground, ink, mask * rng.uniform(0.6, 1.0)) * (1.0 + 0.008 * fine)[..., None]
    raised = rng.uniform(0.0, 2e-4)
    return Draft(colour, raised * mask + 2e-5 * fine, 0.82 - 0.25 * mask * rng.random(), 1.06)
