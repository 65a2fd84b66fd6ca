"""Baskets, bins, cribs, fences."""

import numpy as np

from . import _materials as m
from . import _pieces as pieces
from ._parts import between, chance, pick
from ._pieces import Number
from ._workshop import Finish, Workshop


def _open(
    shop: Workshop, finish: Finish, low, high, height, *, wall, power, depth=1.0, belly=0.0
) -> None:
    """Add an open vessel: outline ``low`` wide at the foot and ``high`` wide at the rim."""
    levels = np.linspace(0, 1, 7)

    def ring(t: Number, z: Number, inset: Number = 0.0) -> np.ndarray:
        wide = low + (high - low) * t + belly * np.sin(np.pi * t) * high
        return pieces.oval(wide - inset, wide * depth - inset, z, power, 48)

    outside = [ring(t, t * height) for t in levels]
    rim = ring(1.0, height + 0.3 * wall, -0.6 * wall)
    inside = [ring(t, max(t * height, wall), 2 * wall) for t in levels[::-1]]
    rings = [*outside, rim, *inside]
    shop.add(finish, pieces.loft(np.stack(rings)), crease=60.0)


def basket(shop: Workshop) -> None:
    """Make a basket: round, rectangular, laundry, with handles, lid or lining."""
    style = pick(shop, ("round", "box", "laundry", "bowl", "box"))
    cane = m.textured(shop, "wicker", "wicker")
    if style == "laundry" and chance(shop, 0.4):
        cane = m.fabric(shop)
    width = between(shop, 0.28, 0.5)
    height = {
        "round": between(shop, 0.25, 0.42),
        "box": between(shop, 0.2, 0.34),
        "laundry": between(shop, 0.5, 0.65),
        "bowl": between(shop, 0.12, 0.2),
    }[style]
    power = 2.0 if style != "box" else 7.0
    depth = between(shop, 0.6, 0.85) if style == "box" else 1.0
    taper = between(shop, 0.72, 0.95)
    _open(
        shop,
        cane,
        taper * width,
        width,
        height,
        wall=0.012,
        power=power,
        depth=depth,
        belly=0.06 if style in ("round", "bowl") else 0.0,
    )
    rim = pieces.oval(width + 0.01, (width + 0.01) * depth, height, power, 56)
    shop.pipe(cane, rim, 0.011, True)
    shop.has_front = False
    hold = pick(shop, ("ears", "arch", "none"))
    if hold == "ears":
        for s in (-1, 1):
            t = np.linspace(0, np.pi, 12)
            path = np.stack(
                [np.full(12, s * 0.5 * width), 0.08 * np.cos(t), height + 0.06 * np.sin(t)], 1
            )
            shop.pipe(m.wood(shop) if chance(shop, 0.3) else cane, path, 0.009)
    elif hold == "arch" and style in ("round", "bowl"):
        t = np.linspace(0, np.pi, 20)
        shop.pipe(
            cane,
            np.stack([0.5 * width * np.cos(t), 0 * t, height + 0.55 * width * np.sin(t)], 1),
            0.011,
        )
    if style == "laundry" and chance(shop, 0.6):
        lid = pieces.loft(
            np.stack(
                [
                    pieces.oval(width * s, width * s * depth, z, power, 48)
                    for s, z in ((1.04, 0), (1.04, 0.02), (0.6, 0.045))
                ]
            )
        )
        shop.add(cane, lid, (0, 0, height + 0.01), crease=60.0)
        shop.add(cane, pieces.superellipsoid((0.05, 0.05, 0.04), steps=8), (0, 0, height + 0.07))
    elif chance(shop, 0.5):
        cloth = m.fabric(shop)
        _open(
            shop,
            cloth,
            taper * width - 0.03,
            width - 0.02,
            height + 0.015,
            wall=0.005,
            power=power,
            depth=depth,
        )
        fill = pieces.superellipsoid((0.8 * width, 0.8 * width * depth, 0.5 * height), 3.0, power)
        shop.add(m.fabric(shop), fill, (0, 0, 0.62 * height), crease=70.0)


def trash_can(shop: Workshop) -> None:
    """Make a bin: open, pedal, swing lid, dome or mesh."""
    style, width = (
        pick(shop, ("open", "pedal", "swing", "dome", "square")),
        between(shop, 0.22, 0.36),
    )
    height = between(shop, 0.28, 0.36) if style == "open" else between(shop, 0.4, 0.7)
    coat = pick(shop, (m.steel, m.plastic, m.paint, m.plastic))(shop)
    dark, power = m.black(shop), 6.0 if style in ("square", "swing") else 2.0
    shop.has_front = style in ("pedal", "swing")
    if style == "open":
        _open(shop, coat, 0.78 * width, width, height, wall=0.006, power=pick(shop, (2.0, 6.0)))
        if chance(shop, 0.5):
            bag = m.plain("bag", (0.9, 0.9, 0.92), 0.4)
            _open(
                shop, bag, 0.78 * width - 0.02, width - 0.004, height + 0.012, wall=0.003, power=2.0
            )
        return
    rings = [
        pieces.oval(s * width, s * width, z, power, 48)
        for s, z in ((0.93, 0), (1.0, 0.02), (1.0, height - 0.06))
    ]
    shop.add(coat, pieces.loft(np.stack(rings)), crease=40.0)
    shop.add(
        dark,
        pieces.loft(
            np.stack([pieces.oval(1.03 * width, 1.03 * width, z, power, 48) for z in (0.0, 0.03)])
        ),
    )
    shop.add(
        dark,
        pieces.loft(
            np.stack(
                [
                    pieces.oval(1.03 * width, 1.03 * width, z, power, 48)
                    for z in (height - 0.075, height - 0.055)
                ]
            )
        ),
    )
    lid = coat if chance(shop, 0.5) else dark
    if style == "swing":
        wedge = np.array(
            [
                [
                    (x, y, z)
                    for x, y, z in (
                        (-w, -0.5 * width, height - 0.056),
                        (-w, 0.5 * width, height - 0.056),
                        (-w, 0, height + 0.12),
                    )
                ]
                for w in (-0.5 * width, 0.5 * width)
            ]
        )
        shop.add(lid, pieces.loft(wedge), crease=30.0)
        shop.box(
            dark,
            (-0.3 * width, 0.22 * width, height + 0.0),
            (0.3 * width, 0.36 * width, height + 0.03),
            0.005,
        )
        return
    t = np.linspace(0, np.pi / 2, 7)
    rise = 0.35 * width if style == "dome" else 0.06
    top = [
        pieces.oval(
            width * np.cos(a), width * np.cos(a), height - 0.056 + rise * np.sin(a), power, 48
        )
        for a in t[:-1]
    ]
    shop.add(lid, pieces.loft(np.stack(top)), crease=60.0)
    if style == "dome":
        shop.wheel(dark, (0, 0.38 * width, height + 0.02), 0.09, 0.06)
    else:
        shop.box(dark, (-0.06, 0.45 * width, 0.0), (0.06, 0.62 * width, 0.02), 0.006)
        shop.box(
            dark, (-0.04, -0.56 * width, height - 0.09), (0.04, -0.47 * width, height - 0.03), 0.004
        )


def crib(shop: Workshop) -> None:
    """Make a cot with bars, mattress and cover; its long side is the front."""
    width, depth, height = (
        between(shop, 1.15, 1.42),
        between(shop, 0.62, 0.76),
        between(shop, 0.8, 1.0),
    )
    timber = m.wood(shop) if chance(shop, 0.5) else m.paint(shop)
    x, y, low = width / 2, depth / 2, between(shop, 0.25, 0.4)
    post, style = 0.045, pick(shop, ("square", "round"))
    for sx in (-1, 1):
        for sy in (-1, 1):
            c = (sx * (x - post / 2), sy * (y - post / 2))
            shop.box(
                timber,
                (c[0] - post / 2, c[1] - post / 2, 0),
                (c[0] + post / 2, c[1] + post / 2, height),
                0.006,
            )
            if chance(shop, 0.3):
                shop.add(
                    timber, pieces.superellipsoid((0.06, 0.06, 0.06), steps=8), (*c, height + 0.02)
                )
    solid = chance(shop, 0.35)
    for sy in (-1, 1):
        _bars(
            shop,
            timber,
            [(-x + post, sy * (y - 0.02)), (x - post, sy * (y - 0.02))],
            low - 0.08,
            height - 0.03,
            style=style,
        )
    for sx in (-1, 1):
        if solid:
            shop.box(
                timber,
                (sx * (x - 0.03), -y + post, low - 0.1),
                (sx * (x - 0.01), y - post, height + 0.03),
                0.006,
            )
        else:
            _bars(
                shop,
                timber,
                [(sx * (x - 0.02), -y + post), (sx * (x - 0.02), y - post)],
                low - 0.08,
                height - 0.03,
                style=style,
            )
    shop.box(timber, (-x + 0.03, -y + 0.03, low - 0.04), (x - 0.03, y - 0.03, low - 0.02))
    white = m.plain("fabric sheet", (0.93, 0.92, 0.9), 0.95)
    shop.soft(white, (-x + 0.04, -y + 0.04, low - 0.02), (x - 0.04, y - 0.04, low + 0.09), 0.03)
    end = pick(shop, (-1, 1))
    shop.soft(
        m.fabric(shop),
        (-end * 0.3 * x, -y + 0.035, low + 0.06),
        (end * 0.9 * x, y - 0.035, low + 0.115),
        0.025,
        (0, 0, 0.01),
    )
    pillow = pieces.turn(pieces.pillow(0.3, 0.4, 0.09), "x", -np.pi / 2)
    shop.add(white, pillow, (-end * (x - 0.24), 0, low + 0.11), crease=75.0)
    shop.support = low + 0.1


def _bars(
    shop: Workshop,
    finish: Finish,
    line,
    low: Number,
    high: Number,
    *,
    style: str,
    gap: Number = 0.085,
):
    """Add a row of upright bars with rails above and below between two places."""
    (x0, y0), (x1, y1) = line
    h = 0.014
    for z in (low, high):
        shop.box(
            finish,
            (min(x0, x1) - h, min(y0, y1) - h, z - 0.02),
            (max(x0, x1) + h, max(y0, y1) + h, z + 0.02),
            0.004,
        )
    count = max(2, int(np.hypot(x1 - x0, y1 - y0) / gap))
    for t in (np.arange(count) + 0.5) / count:
        c = (x0 + t * (x1 - x0), y0 + t * (y1 - y0))
        if style == "square":
            shop.box(
                finish, (c[0] - 0.009, c[1] - 0.009, low), (c[0] + 0.009, c[1] + 0.009, high), 0.002
            )
        else:
            shop.rod(finish, (*c, low), (*c, high), 0.008)


def fence(shop: Workshop) -> None:
    """Make a railing, a room divider or a stair gate."""
    width, height = between(shop, 0.9, 2.0), between(shop, 0.75, 1.1)
    style = pick(shop, ("bars", "glass", "cross", "screen", "pickets"))
    coat = m.metal(shop) if style == "glass" else m.body(shop)
    x = width / 2
    if style == "screen":
        height, leaves = between(shop, 1.5, 1.8), int(shop.rng.integers(3, 5))
        leaf = width / leaves
        cloth = m.fabric(shop)
        for k in range(leaves):
            first = shop.count()
            shop.add(
                coat,
                pieces.moulding(
                    leaf, height, [(0, -0.012), (0, 0.012), (0.03, 0.012), (0.03, -0.012)]
                ),
                (leaf / 2, 0, height / 2),
            )
            shop.box(cloth, (0.025, -0.004, 0.025), (leaf - 0.025, 0.004, height - 0.025), 0.001)
            angle = 0.45 * (1 if k % 2 else -1)
            shop.turn_since(first, "z", angle)
            step = leaf * np.cos(0.45)
            shop.shift_since(
                first,
                (-leaves * step / 2 + k * step, leaf * np.sin(0.45) * (0 if k % 2 == 0 else -1), 0),
            )
        return
    for a in np.linspace(-x, x, 2 + round(width / 1.2)):
        shop.box(coat, (a - 0.025, -0.025, 0), (a + 0.025, 0.025, height), 0.004)
        if chance(shop, 0.3):
            shop.add(
                coat, pieces.superellipsoid((0.07, 0.07, 0.07), steps=8), (a, 0, height + 0.02)
            )
    shop.box(coat, (-x - 0.02, -0.03, height - 0.05), (x + 0.02, 0.03, height), 0.008)
    if style == "glass":
        shop.box(
            m.glass(shop, 0.2), (-x + 0.03, -0.005, 0.08), (x - 0.03, 0.005, height - 0.07), 0.001
        )
        shop.box(coat, (-x, -0.015, 0.05), (x, 0.015, 0.085))
    elif style == "cross":
        for z in np.linspace(0.12, height - 0.16, 4):
            shop.box(coat, (-x, -0.012, z), (x, 0.012, z + 0.035), 0.003)
    elif style == "pickets":
        for z in (0.2, height - 0.2):
            shop.box(coat, (-x, -0.03, z), (x, -0.008, z + 0.06), 0.003)
        for a in np.arange(-x + 0.06, x - 0.03, 0.11):
            shop.box(coat, (a - 0.035, -0.008, 0.05), (a + 0.035, 0.012, height + 0.05), 0.004)
    else:
        _bars(
            shop,
            coat,
            [(-x, 0.0), (x, 0.0)],
            0.08,
            height - 0.03,
            style=pick(shop, ("square", "round")),
            gap=0.1,
        )
