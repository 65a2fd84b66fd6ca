"""Things with a drawing on them: clock dials, screens, control strips, book spines, rugs."""

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from ._colours import nudge, palette, shade
from ._noise import Number, axes, mix, noise, step
from ._pictures import as_field, canvas, ink, landscape
from ._records import Draft

_ROMAN = ("XII", "I", "II", "III", "IV", "V", "VI", "VII", "VIII", "IX", "X", "XI")


def dial(rng: np.random.Generator, size: int) -> Draft:
    """Return the face of a clock, without hands; 12 is up."""
    papers = [(0.96, 0.95, 0.92), (0.1, 0.1, 0.11), (0.93, 0.88, 0.75), (0.24, 0.3, 0.36)]
    k = int(rng.choice(4, p=[0.55, 0.15, 0.2, 0.1]))
    paper = nudge(rng, papers[k], 0.5)
    mark = (0.93, 0.92, 0.9) if k in (1, 3) else (0.09, 0.09, 0.1)
    image, draw, unit = canvas(size, paper)
    style = int(rng.integers(4))
    for minute in range(60):
        angle, hour = np.pi * minute / 30, minute % 5 == 0
        inner = (385 if style == 2 else 410) if hour else 440
        width = (14 if style == 2 else 9) if hour else 3
        if style == 3 and not hour:
            continue
        a = np.array([np.sin(angle), -np.cos(angle)])
        line = [*((500 + inner * a) * unit), *((500 + 462 * a) * unit)]
        draw.line(line, fill=ink(mark), width=max(int(width * unit), 1))
    if style in (0, 1):
        font = ImageFont.load_default(size=max(int((105 if style == 0 else 78) * unit), 8))
        for hour in range(12):
            angle = np.pi * hour / 6
            x, y = (500 + 335 * np.sin(angle)) * unit, (500 - 335 * np.cos(angle)) * unit
            text = str(hour or 12) if style == 0 else _ROMAN[hour]
            draw.text((x, y), text, fill=ink(mark), font=font, anchor="mm")
    flat = np.zeros((size, size), np.float32)
    return Draft(as_field(image), flat, flat + 0.5, 0.3)


def _sheen(size: int) -> np.ndarray:
    u, v = axes(size)
    return step(u + v, 0.9, 1.9) * np.ones((size, size), np.float32)


def screen_off(rng: np.random.Generator, size: int) -> Draft:
    """Return a dark glossy screen."""
    dark = nudge(rng, (0.03, 0.032, 0.038), 0.3)
    colour = mix(dark, shade(dark, 1.05), _sheen(size))
    flat = np.zeros((size, size), np.float32)
    return Draft(colour, flat, flat + rng.uniform(0.05, 0.14), 1.0)


def _page(draw: ImageDraw.ImageDraw, rng, unit: Number, box, dark: bool) -> None:
    """Draw a window with lines of text."""
    x0, y0, x1, y1 = box
    paper, text = ((38, 40, 46), (170, 180, 190)) if dark else ((246, 247, 248), (90, 94, 100))
    scaled = [c * unit for c in box]
    draw.rectangle(scaled, fill=paper)
    draw.rectangle(
        [x0 * unit, y0 * unit, x1 * unit, (y0 + 26) * unit],
        fill=(70, 76, 88) if dark else (214, 218, 224),
    )
    for k, tone in enumerate(((236, 100, 90), (240, 190, 80), (110, 200, 100))):
        x = x0 + 14 + 20 * k
        draw.ellipse([x * unit, (y0 + 8) * unit, (x + 11) * unit, (y0 + 19) * unit], fill=tone)
    accents = [(220, 120, 90), (110, 170, 220), (140, 190, 120), (200, 160, 90)]
    for y in np.arange(y0 + 44, y1 - 16, 20):
        x = x0 + 18 + 22 * int(rng.integers(0, 4)) * dark
        for _ in range(int(rng.integers(1, 7))):
            width = rng.uniform(18, 90)
            if x + width > x1 - 18:
                break
            tone = accents[int(rng.integers(4))] if dark and rng.random() < 0.4 else text
            draw.rectangle([x * unit, y * unit, (x + width) * unit, (y + 8) * unit], fill=tone)
            x += width + 10


def screen_desktop(rng: np.random.Generator, size: int) -> Draft:
    """Return a computer's desktop with windows."""
    colours = palette(rng)
    image, draw, unit = canvas(size, colours[0])
    if rng.random() < 0.5:
        back = landscape(rng, size)
    else:
        back = mix(colours[0], colours[2], np.clip(0.5 + 0.35 * noise(rng, size, 1, 5, 2.0), 0, 1))
    image.paste(Image.fromarray((255 * np.clip(back, 0, 1)).astype(np.uint8)))
    dark = bool(rng.random() < 0.4)
    for _ in range(int(rng.integers(1, 4))):
        x, y = rng.uniform(30, 330), rng.uniform(40, 260)
        _page(draw, rng, unit, (x, y, x + rng.uniform(420, 620), y + rng.uniform(420, 600)), dark)
    draw.rectangle([0, 950 * unit, size, size], fill=(28, 31, 38))
    for k in range(9):
        x = 30 + 52 * k
        tone = ink(nudge(rng, colours[k % 5], 3))
        draw.rectangle([x * unit, 960 * unit, (x + 34) * unit, 990 * unit], fill=tone)
    flat = np.zeros((size, size), np.float32)
    return Draft(as_field(image), flat, flat + 0.15, 1.0)


def screen_film(rng: np.random.Generator, size: int) -> Draft:
    """Return a television programme: a wide landscape."""
    picture = landscape(rng, size)
    return Draft(picture, np.zeros((size, size), np.float32), np.full((size, size), 0.12), 1.0)


def controls(rng: np.random.Generator, size: int) -> Draft:
    """Return a kitchen machine's display: digits in a dark strip; the strip is the middle third."""
    image, draw, unit = canvas(size, (0.05, 0.05, 0.055))
    glow = [(0.2, 0.9, 0.9), (0.95, 0.35, 0.2), (0.9, 0.95, 1.0), (0.3, 0.95, 0.4)][
        int(rng.integers(4))
    ]
    font = ImageFont.load_default(size=max(int(190 * unit), 8))
    text = f"{int(rng.integers(24)):02d}:{int(rng.integers(60)):02d}"
    draw.text((size / 2, size / 2), text, fill=ink(glow), font=font, anchor="mm")
    for x in (70, 150, 800, 880):
        draw.ellipse(
            [x * unit, 460 * unit, (x + 50) * unit, 540 * unit],
            outline=ink(shade(glow, 0.6)),
            width=int(8 * unit) + 1,
        )
    flat = np.zeros((size, size), np.float32)
    return Draft(as_field(image), flat, flat + 0.15, 0.2)


def book_spines(rng: np.random.Generator, size: int) -> Draft:
    """Return the spines of 16 books side by side."""
    image, draw, unit = canvas(size, (0.3, 0.3, 0.3))
    colours = (*palette(rng), *palette(rng))
    for k in range(16):
        x = 62.5 * k
        cloth = nudge(rng, colours[int(rng.integers(10))], 2.0)
        bright = sum(cloth) > 1.4
        print_tone = (
            ink(shade(cloth, 0.3))
            if bright
            else ink((0.92, 0.84, 0.6) if rng.random() < 0.5 else (0.94, 0.93, 0.9))
        )
        draw.rectangle([x * unit, 0, (x + 62.5) * unit, size], fill=ink(cloth))
        if rng.random() < 0.4:
            band, top = ink(nudge(rng, colours[int(rng.integers(10))], 2)), rng.uniform(60, 250)
            draw.rectangle(
                [x * unit, top * unit, (x + 62.5) * unit, (top + rng.uniform(60, 260)) * unit],
                fill=band,
            )
        for y in rng.choice([50, 70, 880, 900, 930], 2, replace=False):
            draw.rectangle(
                [(x + 4) * unit, y * unit, (x + 58) * unit, (y + 6) * unit], fill=print_tone
            )
        start = rng.uniform(120, 330)
        for width, gap in zip(rng.uniform(60, 170, 3), rng.uniform(14, 26, 3), strict=True):
            inset = 17 if rng.random() < 0.7 else 24
            draw.rectangle(
                [(x + inset) * unit, start * unit, (x + 62 - inset) * unit, (start + width) * unit],
                fill=print_tone,
            )
            start += width + gap
    fine = noise(rng, size, 60, size * 0.48, 0.3)
    colour = as_field(image) * (1.0 + 0.02 * fine)[..., None]
    return Draft(colour, 3e-5 * fine, np.full((size, size), 0.55, np.float32), 0.5)


def _rug_bands(rng, size, colours) -> np.ndarray:
    """Return an oriental rug: borders around a field with a medallion and repeated figures."""
    u, v = axes(size)
    x, y = np.abs(2 * u - 1) * np.ones_like(v), np.abs(2 * v - 1) * np.ones_like(u)
    rim = np.maximum(x, y)
    picture = np.ones((size, size, 3), np.float32) * np.asarray(colours[0], np.float32)
    count = int(rng.integers(12, 22))
    figure = np.cos(np.pi * count * x) * np.cos(np.pi * count * y)
    picture = mix(picture, colours[2], 0.85 * step(figure, 0.55, 0.65))
    diamond = x * rng.uniform(0.9, 1.4) + y
    for reach, k in ((0.72, 1), (0.62, 3), (0.5, 4), (0.32, 2), (0.2, 0), (0.1, 3)):
        wobble = 0.035 * np.cos(2 * np.pi * 9 * (x - y))
        picture = mix(picture, colours[k], 1.0 - step(diamond + wobble, reach - 0.004, reach))
    for reach, k in ((0.70, 3), (0.72, 4), (0.90, 1), (0.92, 3), (0.95, 0)):
        picture = mix(picture, colours[k], step(rim, reach - 0.003, reach))
    along = np.where(x > y, y, x)
    band = (rim > 0.74) & (rim < 0.88)
    flower = np.hypot((along * 11 % 1.0 - 0.5) * 1.0, (rim - 0.81) * 7) < 0.34
    return np.where((band & flower)[..., None], np.asarray(colours[2], np.float32), picture)


def _rug_modern(rng, size, colours) -> np.ndarray:
    """Return a geometric rug: zigzag, diamonds, arcs or a plain one with a border."""
    u, v = axes(size)
    style, count = int(rng.integers(5)), int(rng.integers(3, 8))
    if style == 0:
        field = (v * count * 2 + np.abs((u * count) % 1.0 - 0.5) * 1.2) % 1.0 * 4
    elif style == 1:
        field = (np.abs(u * count % 1.0 - 0.5) + np.abs(v * count % 1.0 - 0.5)) * 4
    elif style == 2:
        field = (np.hypot(u * 4 % 1.0, v * 4 % 1.0) * 5) % 4
    elif style == 3:
        field = np.where(np.maximum(np.abs(2 * u - 1), np.abs(2 * v - 1)) > 0.9, 1.5, 0.5)
    else:
        field = (v * count * 2 + 0.0 * u) % 4
    lines = np.asarray([colours[int(k)] for k in rng.permutation(5)[:4]], np.float32)
    return lines[np.clip(field, 0, 3.99).astype(np.int64) * np.ones((size, size), np.int64)]


def rug(rng: np.random.Generator, size: int) -> Draft:
    """Return a whole rug, oriental, geometric or plain."""
    colours = palette(rng)
    style = rng.random()
    if style < 0.35:
        order = [colours[k] for k in (0, 1, 2, 3, 4)]
        deep = [
            nudge(rng, c, 2.0)
            for c in (
                (0.42, 0.08, 0.08),
                (0.1, 0.14, 0.28),
                (0.78, 0.62, 0.4),
                (0.9, 0.84, 0.7),
                (0.2, 0.3, 0.24),
            )
        ]
        picture = _rug_bands(rng, size, deep if rng.random() < 0.45 else order)
    elif style < 0.85:
        picture = _rug_modern(rng, size, colours)
    else:
        picture = np.ones((size, size, 3), np.float32) * np.asarray(
            colours[int(rng.integers(5))], np.float32
        )
    pile = noise(rng, size, 60, size * 0.48, 0.2)
    wear = noise(rng, size, 2, 30, 1.2)
    picture = picture * (1.0 + 0.06 * pile + 0.03 * wear)[..., None]
    return Draft(picture, 8e-4 * pile, 0.97 + 0.0 * pile, 2.0)
