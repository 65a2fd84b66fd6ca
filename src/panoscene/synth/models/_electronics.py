"""Screens, computers and loudspeakers."""

import itertools

import numpy as np

from . import _materials as m
from . import _pieces as pieces
from ._parts import between, chance, pick
from ._pieces import Number
from ._workshop import Finish, Workshop


def _panel(
    shop: Workshop, width: Number, height: Number, low: Number, lit: Number, *, kind: str
) -> Finish:
    """Add a flat screen around x = y = 0 with its lower edge at ``low``; return its casing."""
    case = m.black(shop) if chance(shop, 0.75) else m.silver(shop)
    deep, rim = between(shop, 0.02, 0.05), between(shop, 0.005, 0.02)
    chin = rim * pick(shop, (1.0, 1.0, 1.6, 2.5))
    x = width / 2
    shop.box(case, (-x, -0.015, low), (x, 0.006, low + height), 0.004)
    shop.box(
        case,
        (-0.4 * width, -0.015 - deep, low + 0.15 * height),
        (0.4 * width, -0.013, low + 0.8 * height),
        0.015,
    )
    shop.add(
        m.screen(shop, lit, kind),
        pieces.sheet((-x + rim, 0.004, low + chin), (x - rim, 0.0085, low + height - rim)),
    )
    return case


def monitor(shop: Workshop) -> None:
    """Make a computer monitor on a stand."""
    width = between(shop, 0.46, 0.72)
    height = width * pick(shop, (0.5625, 0.5625, 0.625, 0.43))
    low = between(shop, 0.09, 0.16)
    case = _panel(shop, width, height, low, 0.6, kind="screen_desktop")
    foot = case if chance(shop, 0.6) else m.silver(shop)
    style = pick(shop, ("plate", "disc", "vee"))
    if style == "plate":
        shop.box(foot, (-0.12, -0.12, 0), (0.12, 0.09, 0.012), 0.004)
    elif style == "disc":
        shop.disc(foot, (0, -0.03, 0), 0.11, 0.014)
    else:
        for s in (-1, 1):
            shop.rod(foot, (0, -0.06, 0.012), (s * 0.17, 0.09, 0.012), 0.012)
    shop.box(foot, (-0.03, -0.065, 0.005), (0.03, -0.04, low + 0.45 * height), 0.006)
    shop.support = None


def _tv_size(shop: Workshop) -> tuple[float, float]:
    width = between(shop, 0.75, 1.55)
    return width, 0.57 * width


def standing_tv(shop: Workshop) -> None:
    """Make a television on its foot; now and then an old one with a tube."""
    if chance(shop, 0.12):
        width, height, deep = (
            between(shop, 0.5, 0.7),
            between(shop, 0.42, 0.52),
            between(shop, 0.35, 0.45),
        )
        case = m.plastic(shop)
        shop.soft(case, (-width / 2, -0.1, 0), (width / 2, 0.06, height), 0.02)
        rings = [
            pieces.oval(s * width, s * height, z, 6.0)
            for s, z in ((0.95, 0.1), (0.6, deep - 0.05), (0.5, deep))
        ]
        shop.add(
            case, pieces.turn(pieces.loft(np.stack(rings)), "x", np.pi / 2), (0, 0, height / 2)
        )
        shop.add(
            m.screen(shop, 0.2, "screen_film"),
            pieces.sheet(
                (-0.42 * width, 0.05, 0.16 * height), (0.42 * width, 0.066, 0.92 * height)
            ),
        )
        for x in (-0.3, -0.24, 0.3):
            shop.wheel(m.black(shop), (x * width, 0.058, 0.08 * height), 0.012, 0.01)
        return
    width, height = _tv_size(shop)
    low = between(shop, 0.05, 0.1)
    case = _panel(shop, width, height, low, 0.3, kind="screen_film")
    style = pick(shop, ("feet", "plate", "bar"))
    if style == "feet":
        for s in (-1, 1):
            for y in (-0.11, 0.11):
                shop.rod(
                    case, (s * 0.36 * width, -0.01, low + 0.01), (s * 0.38 * width, y, 0.008), 0.009
                )
    else:
        wide = 0.24 if style == "plate" else 0.33
        shop.box(case, (-wide * width, -0.12, 0), (wide * width, 0.1, 0.014), 0.005)
        shop.box(case, (-0.06, -0.04, 0.01), (0.06, -0.015, low + 0.2), 0.005)


def wall_mounted_tv(shop: Workshop) -> None:
    """Make a television on a wall bracket."""
    width, height = _tv_size(shop)
    _panel(shop, width, height, 0.0, 0.3, kind="screen_film")
    shop.box(m.black(shop), (-0.15, -0.09, 0.3 * height), (0.15, -0.02, 0.7 * height), 0.004)
    if chance(shop, 0.3):
        shop.box(m.black(shop), (-0.4 * width, -0.05, -0.14), (0.4 * width, 0.04, -0.06), 0.015)


def laptop(shop: Workshop) -> None:
    """Make an open laptop."""
    width = between(shop, 0.29, 0.38)
    depth, angle = 0.68 * width, np.radians(between(shop, 95, 122))
    case = pick(shop, (m.black, m.steel, m.plastic, m.silver))(shop)
    dark = m.black(shop)
    shop.box(case, (-width / 2, -depth / 2, 0), (width / 2, depth / 2, 0.016), 0.004)
    key = width / 16
    for row in range(5):
        for k in range(13):
            # seen from the front, +x is on the left
            x, y = (k - 6) * 1.08 * key, -0.36 * depth + row * 1.1 * key
            if row == 4 and 3 < k < 9:
                continue
            shop.add(
                dark,
                pieces.box(
                    (x - key / 2, y - key / 2, 0.015), (x + key / 2, y + key / 2, 0.018), 0.0007
                ),
            )
    y = -0.36 * depth + 4.4 * key
    shop.box(dark, (-3 * key, y - key / 2, 0.015), (3 * key, y + key / 2, 0.018), 0.0007)
    shop.box(
        m.plain("touchpad", (0.3, 0.3, 0.31), 0.35),
        (-0.14 * width, 0.2 * depth, 0.0155),
        (0.14 * width, 0.45 * depth, 0.0168),
        0.0005,
    )
    first, high = shop.count(), 0.98 * depth
    shop.box(case, (-width / 2, -0.008, 0), (width / 2, 0.0, high), 0.003)
    shop.box(
        dark, (-width / 2 + 0.003, -0.001, 0.004), (width / 2 - 0.003, 0.001, high - 0.003), 0.0004
    )
    shop.add(
        m.screen(shop, 0.75),
        pieces.sheet((-width / 2 + 0.008, 0.0, 0.016), (width / 2 - 0.008, 0.0022, high - 0.01)),
    )
    shop.turn_since(first, "x", float(angle - np.pi / 2))
    shop.shift_since(first, (0, -depth / 2 + 0.003, 0.014))


def _cone(shop: Workshop, x: Number, y: Number, z: Number, radius: Number) -> None:
    """Add a loudspeaker's membrane in its ring."""
    ring = [(0.9 * radius, 0), (1.08 * radius, 0), (1.08 * radius, 0.006), (0.95 * radius, 0.01)]
    piece = pieces.loft(np.stack([pieces.circle(r, h, 36) for r, h in ring]), joined=True)
    shop.add(
        m.plain("metal ring", (0.35, 0.35, 0.36), 0.35, 0.8),
        pieces.turn(piece, "x", -np.pi / 2),
        (x, y, z),
    )
    bowl = [
        (0, 0),
        (0.95 * radius, 0),
        (0.93 * radius, 0.008),
        (0.8 * radius, 0.008),
        (0.33 * radius, 0.001),
        (0.28 * radius, 0.004),
        (0, 0.01),
    ]
    shop.add(m.rubber(shop), pieces.turn(pieces.lathe(bowl, 36), "x", -np.pi / 2), (x, y, z))


def loudspeaker(shop: Workshop) -> None:
    """Make a box with one to four membranes, on a shelf or floor-standing."""
    tall = chance(shop, 0.4)
    width = between(shop, 0.17, 0.28)
    height = between(shop, 0.8, 1.15) if tall else width * between(shop, 1.4, 1.8)
    deep, case = between(shop, 0.2, 0.34), m.body(shop)
    shop.box(case, (-width / 2, -deep / 2, 0), (width / 2, deep / 2, height), 0.006)
    y = deep / 2
    if chance(shop, 0.5):
        shop.box(
            m.black(shop),
            (-width / 2 + 0.008, y - 0.002, 0.008),
            (width / 2 - 0.008, y + 0.003, height - 0.008),
            0.002,
        )
    radius = 0.38 * width
    _cone(shop, 0, y + 0.002, height - 0.45 * radius - 0.03, 0.32 * radius)
    z = height - 0.9 * radius - 0.06
    for _ in range(int(shop.rng.integers(1, 4)) if tall else 1):
        r = min(radius, 0.5 * (z - 0.03)) if not tall else 0.8 * radius
        _cone(shop, 0, y + 0.002, z - r, r)
        z -= 2.25 * r
    if tall:
        shop.box(
            m.black(shop),
            (-width / 2 - 0.02, -y - 0.02, -0.02),
            (width / 2 + 0.02, y + 0.02, 0),
            0.004,
        )
    shop.support = height


def speaker_system(shop: Workshop) -> None:
    """Make a stereo: a bar, a compact set with two boxes, or a tower of units."""
    style = pick(shop, ("bar", "set", "set", "radio"))
    if style == "bar":
        width = between(shop, 0.6, 1.1)
        shop.soft(
            m.black(shop),
            (-width / 2, -0.05, 0),
            (width / 2, 0.045, between(shop, 0.06, 0.1)),
            0.02,
        )
        for x in np.linspace(-0.42, 0.42, 6):
            _cone(shop, x * width, 0.044, 0.035, 0.024)
        return
    if style == "radio":
        width, height = between(shop, 0.3, 0.5), between(shop, 0.15, 0.22)
        shop.soft(m.body(shop), (-width / 2, -0.08, 0), (width / 2, 0.08, height), 0.025)
        for s in (-1, 1):
            _cone(shop, s * 0.32 * width, 0.079, 0.48 * height, 0.3 * height)
        shop.add(
            m.display(shop),
            pieces.sheet(
                (-0.13 * width, 0.078, 0.45 * height), (0.13 * width, 0.084, 0.7 * height)
            ),
        )
        for x in (-0.08, 0, 0.08):
            shop.wheel(m.silver(shop), (x * width, 0.078, 0.22 * height), 0.012, 0.014)
        path = [
            (-0.4 * width, 0, height - 0.01),
            (-0.4 * width, 0, height + 0.05),
            (0.4 * width, 0, height + 0.05),
            (0.4 * width, 0, height - 0.01),
        ]
        for a, b in itertools.pairwise(path):
            shop.rod(m.silver(shop), a, b, 0.008)
        return
    case, unit = m.body(shop), m.silver(shop)
    width, height, deep = (
        between(shop, 0.15, 0.2),
        between(shop, 0.24, 0.32),
        between(shop, 0.18, 0.24),
    )
    for s in (-1, 1):
        x = s * (width / 2 + 0.17)
        shop.box(case, (x - width / 2, -deep / 2, 0), (x + width / 2, deep / 2, height), 0.004)
        _cone(shop, x, deep / 2, 0.32 * height, 0.34 * width)
        _cone(shop, x, deep / 2, 0.76 * height, 0.17 * width)
    count = int(shop.rng.integers(1, 4))
    tall = between(shop, 0.08, 0.1)
    for k in range(count):
        z = k * (tall + 0.006)
        shop.box(unit, (-0.15, -deep / 2, z + 0.006), (0.15, deep / 2 - 0.01, z + tall), 0.004)
        shop.add(
            m.display(shop),
            pieces.sheet(
                (-0.06, deep / 2 - 0.012, z + 0.45 * tall), (0.06, deep / 2 - 0.006, z + 0.8 * tall)
            ),
        )
        for x in (-0.12, 0.11):
            shop.wheel(
                m.black(shop), (x, deep / 2 - 0.012, z + 0.5 * tall), 0.02 if x > 0 else 0.014, 0.02
            )
