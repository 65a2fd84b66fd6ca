"""Pictures to hang on walls, drawn from a seed."""

import numpy as np
from PIL import Image, ImageDraw, ImageFilter

from ._colours import nudge, palette, shade
from ._noise import Colour, Number, Picture, axes, mix, noise, step
from ._records import Draft


def ink(colour: Colour) -> tuple[int, int, int]:
    """Return a colour for the drawing library."""
    red, green, blue = (int(np.clip(255 * c, 0, 255)) for c in colour)
    return red, green, blue


def canvas(size: int, colour: Colour) -> tuple[Image.Image, ImageDraw.ImageDraw, float]:
    """Return an image, its pen and the number of pixels of a thousandth of its edge."""
    image = Image.new("RGB", (size, size), ink(colour))
    return image, ImageDraw.Draw(image), size / 1000.0


def as_field(image: Image.Image) -> Picture:
    """Return the image's colours in [0, 1]."""
    return np.asarray(image, np.float32) / 255.0


def _ridge(rng: np.random.Generator, size: int, roughness: Number) -> np.ndarray:
    k = np.arange(1, 40)
    phase = rng.random(39) * 2 * np.pi
    x = np.linspace(0, 1, size)[:, None]
    waves = rng.normal(0, 1, 39) * k**-roughness * np.sin(2 * np.pi * k * x * 0.7 + phase)
    return waves.sum(axis=1)


def landscape(rng: np.random.Generator, size: int) -> Picture:
    """Return hills or mountains under a sky, sometimes over water."""
    skies = [
        ((0.35, 0.55, 0.78), (0.87, 0.91, 0.93)),
        ((0.25, 0.25, 0.45), (0.96, 0.62, 0.38)),
        ((0.62, 0.68, 0.72), (0.9, 0.88, 0.84)),
        ((0.13, 0.2, 0.36), (0.72, 0.55, 0.6)),
    ]
    top, bottom = skies[int(rng.integers(len(skies)))]
    u, v = axes(size)
    picture = mix(top, bottom, (1.0 - v) * np.ones_like(u) * 1.3)
    clouds = noise(rng, size, 2, 80, 1.7, stretch=(4.0, 1.0))
    picture = mix(picture, shade(bottom, 1.5), 0.55 * step(clouds, 0.2, 1.8) * step(v, 0.4, 0.8))
    sun = np.hypot(u - rng.uniform(0.2, 0.8), v - rng.uniform(0.6, 0.85))
    picture = mix(picture, (1.0, 0.95, 0.82), 0.9 * np.exp(-((sun / 0.05) ** 2)))
    horizon, layers = rng.uniform(0.4, 0.6), int(rng.integers(3, 6))
    near = nudge(rng, [(0.13, 0.22, 0.14), (0.2, 0.17, 0.12), (0.1, 0.16, 0.2)][layers % 3], 2)
    grass = noise(rng, size, 10, 300, 0.9, stretch=(1.0, 2.0))
    for k in range(layers):
        share = k / (layers - 1)
        crest = (
            horizon - 0.34 * share + (0.07 - 0.03 * share) * _ridge(rng, size, 1.4 - 0.3 * share)
        )
        tone = np.array(bottom) * (1 - share) * 0.85 + np.array(near) * (0.15 + 0.85 * share)
        body = mix(tuple(tone), tuple(tone * 1.35), np.clip(0.4 + 0.3 * grass, 0, 1))
        picture = mix(picture, body, step(crest[None, :] - v, 0.0, 0.004))
    if rng.random() < 0.5:
        shore = rng.uniform(0.2, 0.3)
        wave = noise(rng, size, 8, 200, 0.8, stretch=(1.0, 8.0)).T
        water = mix(shade(top, 0.8), shade(bottom, 0.95), np.clip(0.5 + 0.35 * wave, 0, 1))
        picture = mix(picture, water, step(shore - v, 0.0, 0.003) * np.ones_like(u))
    return picture


def _blocks(rng: np.random.Generator, size: int) -> Picture:
    colours = palette(rng)
    image, draw, unit = canvas(size, (0.94, 0.93, 0.9))
    boxes = [(0.0, 0.0, 1000.0, 1000.0)]
    for _ in range(int(rng.integers(6, 14))):
        areas = np.array([(b[2] - b[0]) * (b[3] - b[1]) for b in boxes])
        x0, y0, x1, y1 = boxes.pop(int(rng.choice(len(boxes), p=areas / areas.sum())))
        cut = rng.uniform(0.25, 0.75)
        if x1 - x0 > y1 - y0:
            m = x0 + cut * (x1 - x0)
            boxes += [(x0, y0, m, y1), (m, y0, x1, y1)]
        else:
            m = y0 + cut * (y1 - y0)
            boxes += [(x0, y0, x1, m), (x0, m, x1, y1)]
    line = ink((0.08, 0.08, 0.09)) if rng.random() < 0.6 else ink(colours[3])
    for box in boxes:
        fill = ink(colours[int(rng.integers(5))]) if rng.random() < 0.6 else None
        draw.rectangle(
            [c * unit for c in box], fill=fill, outline=line, width=max(int(7 * unit), 1)
        )
    return as_field(image)


def _rings(rng: np.random.Generator, size: int) -> Picture:
    colours = palette(rng)
    image, draw, unit = canvas(size, shade(colours[3], 1.2))
    for _ in range(int(rng.integers(7, 18))):
        x, y, r = rng.uniform(80, 920), rng.uniform(80, 920), rng.gamma(3.0, 55.0) + 20
        fill, arc = ink(nudge(rng, colours[int(rng.integers(5))])), rng.random()
        box = [(x - r) * unit, (y - r) * unit, (x + r) * unit, (y + r) * unit]
        if arc < 0.5:
            draw.ellipse(box, fill=fill)
        elif arc < 0.8:
            start = rng.choice([0, 90, 180, 270])
            draw.pieslice(box, start, start + 180, fill=fill)
        else:
            draw.ellipse(box, outline=fill, width=int(max(14 * unit, 1)))
    return as_field(image)


def _waves(rng: np.random.Generator, size: int) -> Picture:
    colours = palette(rng)
    field = noise(rng, size, 1, 14, 2.2)
    level = np.floor((field + 3.0) * rng.uniform(1.5, 4.0)).astype(np.int64)
    table = np.array([nudge(rng, colours[int(k)]) for k in rng.integers(0, 5, 32)], np.float32)
    stroke = noise(rng, size, 10, 300, 0.7, stretch=(6.0, 1.0))
    return table[np.clip(level, 0, 31)] * (1.0 + 0.05 * stroke)[..., None]


def _field_painting(rng: np.random.Generator, size: int) -> Picture:
    colours = palette(rng)
    u, v = axes(size)
    picture = np.ones((size, size, 3), np.float32) * np.asarray(colours[3], np.float32)
    rag, stroke = noise(rng, size, 4, 120, 1.2), noise(rng, size, 8, 300, 0.9, stretch=(10.0, 1.0))
    edges = np.sort(rng.uniform(0.1, 0.9, 2))
    for low, high, k in ((0.07, edges[0], 0), (edges[0], edges[1], 1), (edges[1], 0.93, 4)):
        inside = np.minimum.reduce(
            [v - low - 0.02 + 0 * u, high - 0.02 - v + 0 * u, u - 0.08 + 0 * v, 0.92 - u + 0 * v]
        )
        share = step(inside + 0.006 * rag, -0.01, 0.02) * (0.85 + 0.08 * stroke)
        picture = mix(picture, colours[k], np.clip(share, 0, 1))
    return picture


def _botanical(rng: np.random.Generator, size: int) -> Picture:
    image, draw, unit = canvas(size, nudge(rng, (0.95, 0.93, 0.88), 0.5))
    green = nudge(
        rng, [(0.2, 0.36, 0.24), (0.33, 0.42, 0.3), (0.16, 0.24, 0.3)][int(rng.integers(3))], 2
    )
    stems = int(rng.integers(1, 4))
    for s in range(stems):
        x0, lean = 500 + (s - (stems - 1) / 2) * 260, rng.normal(0, 60)
        t = np.linspace(0, 1, 30)
        xs, ys = x0 + lean * t**2, 900 - 780 * t
        draw.line(
            [(x * unit, y * unit) for x, y in zip(xs, ys, strict=True)],
            fill=ink(green),
            width=int(8 * unit) + 1,
        )
        for k in range(4, 29, 2):
            for side in (-1, 1):
                length, angle = rng.uniform(110, 170) * (1.15 - t[k]), side * rng.uniform(0.6, 1.0)
                w = np.linspace(0, np.pi, 14)
                along = length * (1 - np.cos(w)) / 2
                out = np.concatenate([np.sin(w), -np.sin(w)[::-1]]) * length * 0.16
                along = np.concatenate([along, along[::-1]])
                px = xs[k] + along * np.sin(angle) + out * np.cos(angle)
                py = ys[k] - along * np.cos(angle) + out * np.sin(angle)
                draw.polygon(
                    [(x * unit, y * unit) for x, y in zip(px, py, strict=True)],
                    fill=ink(nudge(rng, green, 1.2)),
                )
    return as_field(image)


def _skyline(rng: np.random.Generator, size: int) -> Picture:
    dusk = rng.random() < 0.5
    top, bottom = (
        ((0.12, 0.16, 0.32), (0.95, 0.6, 0.4)) if dusk else ((0.75, 0.75, 0.75), (0.95, 0.95, 0.94))
    )
    u, v = axes(size)
    image = Image.fromarray((255 * mix(top, bottom, (1 - v) * np.ones_like(u))).astype(np.uint8))
    draw, unit = ImageDraw.Draw(image), size / 1000
    for layer in range(3):
        tone = shade(bottom, 0.55 - 0.22 * layer)
        x = -20.0
        while x < 1000:
            width, height = rng.uniform(45, 120), rng.uniform(150, 560) * (1 - 0.2 * layer)
            draw.rectangle(
                [x * unit, (930 - height) * unit, (x + width) * unit, 1000 * unit], fill=ink(tone)
            )
            for wy in np.arange(950 - height, 900, 24):
                for wx in np.arange(x + 8, x + width - 12, 18):
                    if rng.random() < 0.3:
                        lit = (0.98, 0.85, 0.5) if dusk else shade(tone, 1.4)
                        draw.rectangle(
                            [wx * unit, wy * unit, (wx + 8) * unit, (wy + 11) * unit], fill=ink(lit)
                        )
            x += width + rng.uniform(0, 12)
    return as_field(image)


def _still_life(rng: np.random.Generator, size: int) -> Picture:
    colours = palette(rng)
    u, v = axes(size)
    picture = mix(shade(colours[0], 0.8), colours[1], (0.4 + 0.5 * v) * np.ones_like(u))
    picture = mix(picture, shade(colours[2], 0.9), step(0.3 - v, -0.01, 0.01) * np.ones_like(u))
    fruits = [
        (0.75, 0.2, 0.14),
        (0.88, 0.62, 0.18),
        (0.5, 0.6, 0.2),
        (0.9, 0.75, 0.3),
        (0.4, 0.15, 0.3),
    ]
    for x in np.sort(rng.uniform(0.15, 0.85, int(rng.integers(4, 8)))):
        r, colour = rng.uniform(0.07, 0.13), nudge(rng, fruits[int(rng.integers(5))], 1.5)
        y = rng.uniform(0.12, 0.26) + r
        d = np.hypot(u - x, (v - y) * 1.06) / r
        shadow = np.hypot((u - x - 0.4 * r) / 1.3, (v - y + r) / 0.3) / r
        picture = mix(picture, (0.08, 0.06, 0.05), 0.5 * (1 - step(shadow, 0.5, 1.2)))
        light = np.hypot(u - x + 0.35 * r, v - y - 0.4 * r) / r
        ball = mix(shade(colour, 1.5), shade(colour, 0.35), step(light, 0.0, 1.7))
        picture = mix(picture, ball, 1.0 - step(d, 0.97, 1.0))
    stroke = noise(rng, size, 8, 200, 0.7, stretch=(3.0, 1.0))
    return picture * (1.0 + 0.04 * stroke)[..., None]


_ABSTRACT = (_blocks, _rings, _waves, _field_painting)
_FIGURES = (landscape, landscape, _botanical, _skyline, _still_life)


def _as_print(rng: np.random.Generator, size: int, picture: Picture) -> Draft:
    tone = 0.35 + 0.45 * rng.random()
    fibre = noise(rng, size, 60, size * 0.48, 0.4)
    return Draft(picture, 4e-5 * fibre, np.full((size, size), tone, np.float32), 1.0)


def abstract(rng: np.random.Generator, size: int) -> Draft:
    """Return an abstract painting."""
    return _as_print(rng, size, _ABSTRACT[int(rng.integers(len(_ABSTRACT)))](rng, size))


def scenic(rng: np.random.Generator, size: int) -> Draft:
    """Return a landscape, a skyline, leaves or fruit."""
    return _as_print(rng, size, _FIGURES[int(rng.integers(len(_FIGURES)))](rng, size))


def poster(rng: np.random.Generator, size: int) -> Draft:
    """Return a child's or student's poster: planets, animals' shapes or stars."""
    colours = palette(rng)
    image, draw, unit = canvas(size, shade(colours[0], 0.7))
    for _ in range(160):
        x, y, r = *(rng.random(2) * 1000), rng.uniform(1, 4)
        draw.ellipse(
            [(x - r) * unit, (y - r) * unit, (x + r) * unit, (y + r) * unit], fill=(250, 246, 225)
        )
    for _ in range(int(rng.integers(3, 6))):
        x, y, r = *rng.uniform(150, 850, 2), rng.uniform(50, 150)
        tone = nudge(rng, colours[int(rng.integers(1, 5))], 2)
        draw.ellipse(
            [(x - r) * unit, (y - r) * unit, (x + r) * unit, (y + r) * unit], fill=ink(tone)
        )
        draw.ellipse(
            [
                (x - 1.7 * r) * unit,
                (y - 0.3 * r) * unit,
                (x + 1.7 * r) * unit,
                (y + 0.3 * r) * unit,
            ],
            outline=ink(shade(tone, 1.5)),
            width=int(9 * unit) + 1,
        )
    return _as_print(rng, size, as_field(image.filter(ImageFilter.GaussianBlur(0.6 * unit))))
