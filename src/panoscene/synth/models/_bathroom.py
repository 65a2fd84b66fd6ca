"""Baths, toilets and showers."""

import numpy as np

from . import _materials as m
from . import _pieces as pieces
from ._parts import between, chance, pick
from ._pieces import Number
from ._workshop import Finish, Workshop


def _chrome() -> Finish:
    return m.plain("metal chrome", (0.82, 0.83, 0.84), 0.1, 1.0)


def _basin(rims) -> pieces.Piece:
    """Return a vessel lofted through (width, depth, z, power) outlines, up outside, down inside."""
    return pieces.loft(np.stack([pieces.oval(w, d, z, p, 56) for w, d, z, p in rims]))


def bathtub(shop: Workshop) -> None:
    """Make a bath: built in, oval free-standing or on feet; its length is the width."""
    style, width = pick(shop, ("built", "oval", "feet", "corner")), between(shop, 1.5, 1.9)
    depth, height, white = between(shop, 0.7, 0.85), between(shop, 0.5, 0.62), m.ceramic(shop)
    power, lift = {
        "built": (14.0, 0.0),
        "oval": (2.6, 0.0),
        "feet": (2.6, 0.14),
        "corner": (30.0, 0.0),
    }[style]
    outside = white if style != "feet" or chance(shop, 0.5) else m.paint(shop)
    base = 0.97 if style in ("built", "corner") else 0.78
    shell = [
        (base * width, base * depth, lift, power),
        (0.985 * width, 0.985 * depth, lift + 0.8 * (height - lift), power),
        (0.985 * width, 0.985 * depth, height - 0.03, power),
    ]
    lower = [
        (0.93 * width, 0.93 * depth, height - 0.03, power),
        (0.93 * width * base, 0.93 * depth * base, lift + 0.02, power),
    ]
    shop.add(
        outside,
        pieces.loft(np.stack([pieces.oval(w, d, z, p, 56) for w, d, z, p in [*shell, *lower]])),
    )
    rim, inner = 0.05, min(power, 5.0)
    bowl = [
        (width, depth, height - 0.035, power),
        (width, depth, height - 0.008, power),
        (width - 0.02, depth - 0.02, height, power),
        (width - 2 * rim, depth - 2 * rim, height, inner),
        (width - 2 * rim - 0.02, depth - 2 * rim - 0.02, height - 0.02, inner),
        (0.72 * width, 0.66 * depth, lift + 0.14, 3.0),
        (0.6 * width, 0.5 * depth, lift + 0.09, 2.5),
        (0.6 * width, 0.5 * depth, lift + 0.07, 2.5),
        (0.76 * width, 0.7 * depth, lift + 0.12, 3.0),
        (width - 2 * rim, depth - 2 * rim, height - 0.035, inner),
    ]
    shop.add(
        white,
        pieces.loft(np.stack([pieces.oval(w, d, z, p, 56) for w, d, z, p in bowl]), joined=True),
    )
    chrome = _chrome()
    for x in (-0.36, 0.36) if style == "feet" else ():
        for y in (-0.28, 0.28):
            shop.add(
                chrome,
                pieces.superellipsoid((0.09, 0.09, 0.2), steps=8),
                (x * width, y * depth, 0.1),
            )
    side = pick(shop, (-1, 1))
    x, y = side * 0.0, -depth / 2 + 0.03
    if style != "built":
        shop.rod(chrome, (x, y, height - 0.01), (x, y, height + 0.2), 0.014)
        shop.pipe(
            chrome,
            pieces.curve(
                [
                    (x, y, height + 0.19),
                    (x, y + 0.02, height + 0.24),
                    (x, y + 0.14, height + 0.22),
                    (x, y + 0.17, height + 0.15),
                ],
                12,
            ),
            0.013,
        )
    else:
        shop.box(
            chrome, (x - 0.1, y - 0.02, height + 0.02), (x + 0.1, y + 0.03, height + 0.06), 0.012
        )
        shop.rod(chrome, (x, y, height - 0.01), (x, y + 0.14, height + 0.03), 0.015)
    for s in (-1, 1):
        shop.disc(chrome, (x + 0.09 * s, y, height - 0.005), 0.02, 0.06)
    shop.disc(chrome, (0.25 * width, 0, lift + 0.088), 0.03, 0.006)


def toilet(shop: Workshop) -> None:
    """Make a toilet with its cistern, or wall-hung with a flush plate."""
    white, hung = m.ceramic(shop), chance(shop, 0.3)
    seat = white if chance(shop, 0.7) else m.wood(shop)
    width, length, height = (
        between(shop, 0.35, 0.39),
        between(shop, 0.46, 0.54),
        between(shop, 0.39, 0.43),
    )
    square = pick(shop, (2.3, 2.6, 4.0))
    back = -0.5 * length

    def ring(w: Number, d: Number, z: Number, y: Number = 0.0) -> np.ndarray:
        outline = pieces.oval(w, d, z, square, 48)
        outline[:, 1] += y
        return outline

    low = 0.1 if hung else 0.0
    foot = [
        ring(0.6 * width, 0.62 * length, low, -0.12),
        ring(0.58 * width, 0.6 * length, low + 0.08, -0.12),
        ring(0.75 * width, 0.8 * length, 0.6 * height, -0.06),
    ]
    bowl = [
        ring(width, length, height - 0.04),
        ring(width, length, height),
        ring(0.74 * width, 0.78 * length, height, 0.02),
        ring(0.6 * width, 0.6 * length, height - 0.12, 0.02),
        ring(0.3 * width, 0.3 * length, height - 0.2),
        ring(0.0, 0.0, height - 0.21),
    ]
    shop.add(white, pieces.loft(np.stack([*foot, *bowl])), crease=60.0)
    shop.box(
        white, (-0.36 * width, back - 0.12, low), (0.36 * width, back + 0.2, height - 0.005), 0.02
    )
    lid = pieces.loft(np.stack([ring(1.02 * width, 1.0 * length, z, 0.0) for z in (0.0, 0.018)]))
    opened = chance(shop, 0.25)
    loop = [
        ring(1.02 * width, length, 0.0),
        ring(1.02 * width, length, 0.018),
        ring(0.68 * width, 0.72 * length, 0.018, 0.02),
        ring(0.68 * width, 0.72 * length, 0.0, 0.02),
    ]
    shop.add(seat, pieces.loft(np.stack(loop), joined=True), (0, 0, height + 0.004))
    if opened:
        flap = pieces.move(lid, (0, 0.5 * length, 0))
        shop.add(seat, pieces.turn(flap, "x", np.radians(91)), (0, back + 0.085, height + 0.024))
    else:
        shop.add(seat, lid, (0, 0, height + 0.023))
    y = back - 0.12
    if hung:
        plate = m.metal(shop) if chance(shop, 0.5) else white
        shop.box(white, (-0.2, y - 0.1, 0.0), (0.2, y + 0.005, 1.12), 0.004)
        shop.box(plate, (-0.12, y, 0.9), (0.12, y + 0.015, 1.06), 0.004)
        shop.box(plate, (-0.05, y + 0.01, 0.94), (0.05, y + 0.02, 1.02), 0.004)
        return
    tall = between(shop, 0.3, 0.4)
    wide = between(shop, 0.36, 0.42)
    shop.soft(
        white, (-wide / 2, y - 0.04, height - 0.02), (wide / 2, y + 0.15, height + tall), 0.025
    )
    shop.soft(
        white,
        (-wide / 2 - 0.008, y - 0.045, height + tall),
        (wide / 2 + 0.008, y + 0.16, height + tall + 0.035),
        0.012,
    )
    shop.disc(_chrome(), (0, y + 0.055, height + tall + 0.034), 0.028, 0.008)


def shower(shop: Workshop) -> None:
    """Make a shower: tray, glass walls, riser with head; the open or glazed side is the front."""
    width, depth, height = (
        between(shop, 0.8, 1.3),
        between(shop, 0.75, 0.95),
        between(shop, 1.95, 2.1),
    )
    chrome, style = m.metal(shop), pick(shop, ("box", "walk-in", "round", "corner"))
    tray, pane = m.ceramic(shop), m.glass(shop, 0.16)
    low, x, y = between(shop, 0.03, 0.14), width / 2, depth / 2
    if style == "round":
        depth = width = max(0.8, depth)
        x = y = width / 2
        t = np.linspace(0, np.pi / 2, 14)
        arc = np.stack([x - 2 * x * 0.45 * (1 - np.cos(t)), y - 2 * y * 0.45 * (1 - np.sin(t))], 1)
        outline = np.concatenate([[[-x, -y], [x, -y]], arc, [[-x, y]]])
        shop.add(tray, pieces.prism(outline, 0, low))
        ring = outline[2:-1] * 0.97
        path = np.column_stack([ring, np.full(len(ring), low)])
        _curved_pane(shop, pane, path, height)
        _straight_pane(
            shop,
            pane,
            chrome,
            (0.97 * x, -y),
            (0.97 * x, float(path[0, 1])),
            low=low,
            height=height,
        )
        _straight_pane(
            shop,
            pane,
            chrome,
            (-x, 0.97 * y),
            (float(path[-1, 0]), 0.97 * y),
            low=low,
            height=height,
        )
        for z in (low, height):
            shop.pipe(chrome, path + np.array([0, 0, z - low]), 0.013)
    else:
        shop.box(tray, (-x, -y, 0), (x, y, low), 0.012)
        shop.box(
            m.plain("drain", (0.75, 0.75, 0.74), 0.3),
            (-x + 0.05, -y + 0.05, low - 0.002),
            (x - 0.05, y - 0.05, low + 0.001),
        )
        shop.disc(chrome, (0, 0, low), 0.045, 0.004)
        if style != "walk-in":
            for s in (-1, 1) if style == "box" else (1,):
                _straight_pane(
                    shop,
                    pane,
                    chrome,
                    (s * (x - 0.012), -y),
                    (s * (x - 0.012), y),
                    low=low,
                    height=height,
                )
        reach = x - 0.012 if style != "walk-in" else 0.25 * x
        _straight_pane(
            shop, pane, chrome, (-x + 0.012, y - 0.012), (reach, y - 0.012), low=low, height=height
        )
        if style != "walk-in":
            split = pick(shop, (-0.1, 0.0, 0.2)) * x
            shop.box(
                chrome, (split - 0.012, y - 0.026, low), (split + 0.012, y + 0.002, height), 0.002
            )
            shop.rod(chrome, (split + 0.06, y + 0.03, 0.9), (split + 0.06, y + 0.03, 1.2), 0.01)
            for z in (0.93, 1.17):
                shop.rod(chrome, (split + 0.06, y - 0.02, z), (split + 0.06, y + 0.03, z), 0.006)
    if chance(shop, 0.4) and style != "round":
        shop.box(
            m.textured(shop, "wall_tiles", "stone"), (-x, -y - 0.03, 0), (x, -y, height), 0.002
        )
    _riser(shop, chrome, -y, height)


def _straight_pane(shop, pane, chrome, a, b, *, low, height) -> None:
    """Add an upright pane with rails between two places."""
    (x0, y0), (x1, y1) = a, b
    t = 0.004
    shop.box(
        pane,
        (min(x0, x1) - t, min(y0, y1) - t, low),
        (max(x0, x1) + t, max(y0, y1) + t, height),
        0.0005,
    )
    for z in (low, height - 0.03):
        shop.box(
            chrome,
            (min(x0, x1) - 0.012, min(y0, y1) - 0.012, z),
            (max(x0, x1) + 0.012, max(y0, y1) + 0.012, z + 0.03),
            0.002,
        )
    for p in (a, b):
        shop.box(
            chrome, (p[0] - 0.012, p[1] - 0.012, low), (p[0] + 0.012, p[1] + 0.012, height), 0.002
        )


def _curved_pane(shop: Workshop, pane: Finish, path: np.ndarray, height: Number) -> None:
    outer, inner = path[:, :2], path[:, :2] * 0.99
    low = path[0, 2]
    rings = [
        [(*outer[k], low), (*outer[k], height), (*inner[k], height), (*inner[k], low)]
        for k in range(len(path))
    ]
    shop.add(pane, pieces.loft(np.array(rings)), crease=60.0)


def _riser(shop: Workshop, chrome: Finish, y: Number, height: Number) -> None:
    """Add tap, pipe and head on the back wall."""
    top = min(height + 0.1, 2.15)
    shop.box(chrome, (-0.12, y, 1.02), (0.12, y + 0.05, 1.08), 0.015)
    for s in (-1, 1):
        shop.rod(chrome, (s * 0.12, y + 0.025, 1.05), (s * 0.17, y + 0.025, 1.05), 0.024)
    shop.rod(chrome, (0, y + 0.03, 1.05), (0, y + 0.03, top), 0.011)
    if chance(shop, 0.6):
        shop.pipe(
            chrome,
            pieces.curve(
                [(0, y + 0.03, top - 0.01), (0, y + 0.08, top + 0.04), (0, y + 0.35, top + 0.02)],
                14,
            ),
            0.011,
        )
        shop.disc(chrome, (0, y + 0.35, top - 0.02), between(shop, 0.09, 0.14), 0.014)
    hand = (0.06, y + 0.09, 1.75)
    shop.rod(chrome, (0.0, y + 0.04, 1.68), hand, 0.012, 0.016)
    shop.add(chrome, pieces.superellipsoid((0.09, 0.05, 0.09), steps=10), hand)
    shop.pipe(
        chrome,
        pieces.curve(
            [hand, (0.16, y + 0.07, 1.3), (0.12, y + 0.06, 0.8), (0.02, y + 0.03, 1.02)], 24
        ),
        0.006,
    )
