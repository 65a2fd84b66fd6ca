"""Lamps that stand on the floor or on tables, or hang from the ceiling."""

import numpy as np

from . import _materials as m
from . import _pieces as pieces
from ._parts import between, chance, pick
from ._pieces import Number
from ._workshop import Workshop


def _shade(
    shop: Workshop, z: Number, low: Number, high: Number, height: Number, *, at=(0.0, 0.0)
) -> None:
    """Add an open shade from ``z`` upwards with a bulb inside."""
    wall, cloth = 0.003, m.glow(shop)
    profile = [(low, 0), (high, height), (high - wall, height), (low - wall, 0)]
    ring = pieces.loft(np.stack([pieces.circle(r, h, 40) for r, h in profile]), joined=True)
    shop.add(cloth, ring, (at[0], at[1], z), crease=60.0)
    for r, h in ((low, 0.0), (high, height)) if chance(shop, 0.4) else ():
        shop.pipe(m.metal(shop), pieces.circle(r, z + h, 40) + np.array([*at, 0]), 0.003, True, 6)
    shop.light((at[0], at[1], z + 0.45 * height), min(0.09, low))


def _globe(shop: Workshop, at, size: Number) -> None:
    shop.add(m.glow(shop), pieces.superellipsoid((size, size, size), steps=18), at, crease=70.0)
    shop.light(at, 0.6 * size)


def _bowl(shop: Workshop, z: Number, radius: Number, at=(0.0, 0.0), down: bool = False) -> None:
    """Add a metal bowl that throws its light up, or down."""
    height = 0.6 * radius
    t = np.linspace(0, np.pi / 2, 9)
    outer = [(radius * np.sin(a), -height * np.cos(a)) for a in t]
    inner = [(0.96 * radius * np.sin(a), -0.96 * height * np.cos(a) + 0.002) for a in t[::-1]]
    piece = pieces.lathe([*outer, *inner], 36)
    if down:
        piece = pieces.turn(piece, "x", np.pi)
    shop.add(m.metal(shop), piece, (at[0], at[1], z))
    bulb = z - (0.3 if not down else -0.3) * height
    shop.add(
        m.glow(shop, 2.0), pieces.superellipsoid((0.07, 0.07, 0.08), steps=10), (at[0], at[1], bulb)
    )
    shop.light((at[0], at[1], bulb), 0.07)


def floor_lamp(shop: Workshop) -> None:
    """Make a standard lamp: shade, arc, tripod, uplighter, reading lamp or paper column."""
    metal, height = m.metal(shop), between(shop, 1.35, 1.85)
    style = pick(shop, ("shade", "shade", "arc", "tripod", "up", "reader", "paper", "globes"))
    shop.has_front = style in ("arc", "reader")
    if style == "paper":
        w, z = between(shop, 0.13, 0.19), 0.06
        shop.add(
            m.glow(shop),
            pieces.loft(
                np.stack(
                    [
                        pieces.oval(2 * w, 2 * w, h, pick(shop, (2.0, 9.0)))
                        for h in (z, height - 0.2)
                    ]
                )
            ),
        )
        for h in np.linspace(z, height - 0.2, 5):
            shop.box(
                m.wood(shop), (-w - 0.005, -w - 0.005, h - 0.008), (w + 0.005, w + 0.005, h + 0.008)
            )
        for x in (-w, w):
            for y in (-w, w):
                shop.box(m.wood(shop), (x - 0.01, y - 0.01, 0), (x + 0.01, y + 0.01, height - 0.2))
        shop.light((0, 0, 0.5 * height), 0.12)
        return
    if style == "tripod":
        leg = m.wood(shop) if chance(shop, 0.7) else metal
        top = height - 0.3
        for k in range(3):
            t = 2 * np.pi * k / 3 + np.pi / 2
            shop.rod(
                leg,
                (0.3 * np.cos(t), 0.3 * np.sin(t), 0),
                (0.03 * np.cos(t), 0.03 * np.sin(t), top),
                0.012,
                0.014,
            )
        shop.disc(metal, (0, 0, top - 0.03), 0.05, 0.04)
        _shade(shop, top, between(shop, 0.2, 0.25), between(shop, 0.16, 0.22), 0.28)
        return
    base = between(shop, 0.12, 0.17)
    shop.disc(
        m.stone(shop) if style == "arc" else metal,
        (0, 0, 0),
        base,
        0.05 if style == "arc" else 0.022,
        0.94 * base,
    )
    if style == "arc":
        reach = between(shop, 0.7, 1.1)
        path = pieces.curve(
            [
                (0, 0, 0.04),
                (0, 0.0, 0.9 * height),
                (0, 0.3 * reach, 1.12 * height),
                (0, 0.8 * reach, 1.1 * height),
                (0, reach, 0.93 * height),
            ],
            30,
        )
        shop.pipe(metal, path, 0.011)
        _bowl(shop, 0.93 * height - 0.1, 0.15, (0.0, reach), down=True)
        return
    bend = 0.25 if style == "reader" else 0.0
    shop.rod(metal, (0, 0, 0.02), (0, 0, height - 0.15), 0.011)
    if style == "reader":
        shop.pipe(
            metal,
            pieces.curve(
                [
                    (0, 0, height - 0.16),
                    (0, 0.04, height - 0.02),
                    (0, 0.2, height),
                    (0, bend, height - 0.08),
                ],
                14,
            ),
            0.008,
        )
        _bowl(shop, height - 0.16, 0.085, (0.0, bend), down=True)
    elif style == "up":
        _bowl(shop, height, between(shop, 0.14, 0.2))
    elif style == "globes":
        for k, z in enumerate((height, height - 0.3, height - 0.6)):
            x = 0.14 * (1 if k % 2 else -1)
            shop.rod(metal, (0, 0, z - 0.16), (x, 0, z - 0.1), 0.007)
            _globe(shop, (x, 0.0, z - 0.03), between(shop, 0.13, 0.17))
    else:
        low = between(shop, 0.16, 0.26)
        tall = between(shop, 0.2, 0.34)
        shop.rod(metal, (0, 0, height - 0.16), (0, 0, height - 0.05), 0.008)
        _shade(shop, height - tall, low, low * between(shop, 0.55, 1.0), tall)


def table_lamp(shop: Workshop) -> None:
    """Make a table lamp: a foot with a shade, a globe, a mushroom or a desk lamp."""
    style, height = (
        pick(shop, ("vase", "vase", "turned", "globe", "mushroom", "desk")),
        between(shop, 0.34, 0.6),
    )
    metal = m.metal(shop)
    shop.has_front = style == "desk"
    if style == "desk":
        shop.disc(metal, (0, 0, 0), 0.085, 0.018)
        joint = (0.0, -0.12, 0.26)
        shop.rod(metal, (0, 0, 0.01), joint, 0.007)
        shop.rod(metal, joint, (0, 0.13, 0.42), 0.007)
        shop.add(metal, pieces.superellipsoid((0.025, 0.025, 0.025), steps=8), joint)
        _bowl(shop, 0.34, 0.075, (0.0, 0.16), down=True)
        return
    if style == "globe":
        foot = m.wood(shop) if chance(shop, 0.5) else metal
        size = between(shop, 0.16, 0.26)
        shop.disc(foot, (0, 0, 0), 0.35 * size, 0.06, 0.28 * size)
        _globe(shop, (0.0, 0.0, 0.05 + 0.48 * size), size)
        return
    if style == "mushroom":
        r = between(shop, 0.12, 0.17)
        shop.disc(m.glaze(shop), (0, 0, 0), 0.55 * r, height - 0.6 * r, 0.3 * r)
        t = np.linspace(0, np.pi / 2, 10)
        cap = [(0.001, 0.0), (0.95 * r, 0.0), *((r * np.cos(a), 0.75 * r * np.sin(a)) for a in t)]
        shop.add(m.glow(shop), pieces.lathe(cap, 36), (0, 0, height - 0.75 * r), crease=60.0)
        shop.light((0, 0, height - 0.45 * r), 0.08)
        return
    r, foot = between(shop, 0.06, 0.1), 0.55 * height
    finish = (m.glaze if style == "vase" else m.wood)(shop)
    shape = pick(
        shop,
        (
            (0.7, 1.0, 0.9, 0.4, 0.3),
            (0.9, 0.6, 1.0, 0.5, 0.25),
            (0.5, 0.9, 1.0, 0.8, 0.3),
            (1.0, 0.8, 0.5, 0.35, 0.25),
        ),
    )
    line = pieces.curve(
        [
            (0.7 * r, 0, 0),
            *((r * q, 0, foot * (k + 0.6) / 5) for k, q in enumerate(shape)),
            (0.2 * r, 0, foot),
        ],
        26,
    )
    shop.add(
        finish,
        pieces.lathe([(0, 0), *((float(p[0]), float(p[2])) for p in line), (0, foot)], 32),
        crease=40.0,
    )
    shop.rod(metal, (0, 0, foot), (0, 0, foot + 0.12), 0.006)
    low = between(shop, 1.5, 2.2) * r
    _shade(shop, foot + 0.02, low, low * between(shop, 0.5, 1.0), height - foot - 0.02)


def ceiling_lamp(shop: Workshop) -> None:
    """Make a ceiling lamp: pendant, disc, globe, chandelier or spots; its top is the ceiling."""
    metal, style = (
        m.metal(shop),
        pick(shop, ("pendant", "pendant", "disc", "globe", "chandelier", "spots", "bowl")),
    )
    drop = between(shop, 0.45, 0.9)
    shop.has_front = False
    if style == "disc":
        r, h = between(shop, 0.17, 0.28), between(shop, 0.06, 0.11)
        shop.disc(metal, (0, 0, -0.02), 1.03 * r, 0.02)
        t = np.linspace(0, np.pi / 2, 7)
        shop.add(
            m.glow(shop),
            pieces.lathe([*((r * np.sin(a), -0.02 - h * np.cos(a)) for a in t), (0, -0.02)], 40),
            crease=60.0,
        )
        shop.light((0, 0, -0.02 - 0.5 * h), 0.12)
        return
    if style == "spots":
        length = between(shop, 0.6, 1.1)
        shop.box(metal, (-length / 2, -0.02, -0.03), (length / 2, 0.02, 0))
        for x in np.linspace(-0.42, 0.42, 4) * length:
            lean = between(shop, -0.06, 0.06)
            shop.rod(metal, (x, 0, -0.03), (x, 0, -0.07), 0.006)
            shop.rod(metal, (x, 0, -0.06), (x + 0.3 * lean, lean, -0.16), 0.03, 0.036)
            tip = (x + 0.31 * lean, 1.03 * lean, -0.163)
            shop.add(m.glow(shop, 2.0), pieces.superellipsoid((0.055, 0.055, 0.02), steps=8), tip)
            shop.light((tip[0], tip[1], tip[2] - 0.03), 0.05)
        return
    shop.disc(metal, (0, 0, -0.03), 0.055, 0.03)
    shop.rod(m.black(shop), (0, 0, -drop), (0, 0, -0.02), 0.004)
    if style == "chandelier":
        shop.add(
            metal,
            pieces.lathe(
                [(0, -0.2), (0.03, -0.16), (0.02, -0.08), (0.05, -0.04), (0.012, 0.06), (0, 0.08)],
                24,
            ),
            (0, 0, -drop),
        )
        arms, r = int(shop.rng.integers(5, 9)), between(shop, 0.24, 0.36)
        for k in range(arms):
            d = np.array([np.cos(2 * np.pi * k / arms), np.sin(2 * np.pi * k / arms)])
            line = [
                (*(s * r * d), -drop + z)
                for s, z in ((0.06, -0.1), (0.5, -0.2), (0.9, -0.15), (1.0, -0.02))
            ]
            shop.pipe(metal, pieces.curve(line, 14), 0.006)
            shop.disc(metal, (*(r * d), -drop - 0.03), 0.025, 0.012)
            shop.add(
                m.glow(shop, 1.5),
                pieces.superellipsoid((0.05, 0.05, 0.09), steps=10),
                (*(r * d), -drop + 0.03),
            )
        shop.light((0, 0, -drop + 0.03), 0.12)
    elif style == "globe":
        size = between(shop, 0.22, 0.42)
        _globe(shop, (0.0, 0.0, -drop - 0.3 * size), size)
    elif style == "bowl":
        _bowl(shop, -drop - 0.06, between(shop, 0.15, 0.24), down=True)
    else:
        r, h = between(shop, 0.15, 0.26), between(shop, 0.16, 0.28)
        _shade(shop, -drop - 0.6 * h, r, r * between(shop, 0.35, 1.0), h)
