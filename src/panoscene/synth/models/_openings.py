"""Windows and doors, which fill holes in walls."""

import itertools

import numpy as np

from . import _materials as m
from . import _pieces as pieces
from ._parts import between, chance, pick
from ._workshop import Workshop


def window(shop: Workshop) -> None:
    """Make a window: casements, cross bars, sill, handles; the room is at +y."""
    width, height = between(shop, 0.6, 2.2), between(shop, 0.9, 1.6)
    deep, wide = between(shop, 0.07, 0.1), between(shop, 0.05, 0.075)
    white = m.plain("paint white", (0.93, 0.93, 0.92), 0.4)
    coat = pick(shop, (white, white, m.wood(shop), m.black(shop), m.paint(shop)))
    shop.add(coat, pieces.moulding(width, height, [(0, 0), (0, deep), (wide, deep), (wide, 0)]))
    panes, bars = max(1, round(width / between(shop, 0.5, 0.9))), pick(shop, (0, 0, 0, 1, 2, 3))
    inner = np.linspace(-width / 2 + wide - 0.012, width / 2 - wide + 0.012, panes + 1)
    tall, rail = height - 2 * wide + 0.024, between(shop, 0.04, 0.06)
    pane, grip = m.glass(shop), m.metal(shop)
    for k, (a, b) in enumerate(itertools.pairwise(inner)):
        centre, span = (a + b) / 2, b - a
        sash = [
            (0.001, 0.2 * deep),
            (0.001, deep + 0.012),
            (rail - 0.008, deep + 0.012),
            (rail, 0.6 * deep),
            (rail, 0.2 * deep),
        ]
        shop.add(coat, pieces.moulding(span, tall, sash), (centre, 0, 0))
        x, z = span / 2 - rail + 0.004, tall / 2 - rail + 0.004
        shop.box(pane, (centre - x, 0.5 * deep, -z), (centre + x, 0.5 * deep + 0.006, z), 0.0005)
        for line in np.linspace(-z, z, bars + 2)[1:-1]:
            shop.box(
                coat,
                (centre - x, 0.42 * deep, line - 0.011),
                (centre + x, 0.7 * deep, line + 0.011),
            )
        if bars > 1:
            shop.box(coat, (centre - 0.011, 0.42 * deep, -z), (centre + 0.011, 0.7 * deep, z))
        side = centre + (0.5 * span - 0.5 * rail) * (1 if k % 2 == 0 and panes > 1 else -1)
        face = deep + 0.011
        shop.box(grip, (side - 0.012, face, -0.03), (side + 0.012, face + 0.008, 0.03), 0.003)
        shop.rod(grip, (side, face, 0), (side, face + 0.035, 0), 0.008)
        shop.box(
            grip, (side - 0.009, face + 0.028, -0.11), (side + 0.009, face + 0.04, 0.012), 0.004
        )
    if chance(shop, 0.7):
        sill = coat if chance(shop, 0.6) else m.stone(shop)
        reach = between(shop, 0.06, 0.14)
        shop.box(
            sill,
            (-width / 2 - 0.05, 0, -height / 2 - 0.03),
            (width / 2 + 0.05, deep + reach, -height / 2),
            0.006,
        )


def door(shop: Workshop) -> None:
    """Make a door in its frame: flat, panelled, glazed or boarded; handles on both sides."""
    leaf, height = between(shop, 0.72, 0.95), between(shop, 1.98, 2.12)
    wide, deep = between(shop, 0.05, 0.09), between(shop, 0.1, 0.13)
    coat = m.wood(shop) if chance(shop, 0.5) else m.paint(shop)
    trim = coat if chance(shop, 0.6) else m.plain("paint white", (0.93, 0.93, 0.92), 0.4)
    half, y = leaf / 2 + 0.003, deep / 2
    for s in (-1, 1):
        shop.box(trim, (s * half, -y, 0), (s * (half + wide), y, height + 0.005), 0.003)
    shop.box(
        trim, (-half - wide, -y, height + 0.005), (half + wide, y, height + wide + 0.005), 0.003
    )
    x, thick, style = (
        leaf / 2,
        0.04,
        pick(shop, ("flat", "panels", "panels", "glazed", "boards", "lights")),
    )
    front_y = y - 0.012
    back_y = front_y - thick
    columns = 2 if style == "panels" and chance(shop, 0.6) else 1
    rows = {
        "flat": 1,
        "panels": int(shop.rng.integers(2, 4)),
        "glazed": 1,
        "boards": 1,
        "lights": 4,
    }[style]
    if style in ("flat", "boards"):
        count = 1 if style == "flat" else 7
        edges = np.linspace(-x, x, count + 1)
        for a, b in itertools.pairwise(edges):
            shop.box(coat, (a, back_y, 0.006), (b, front_y, height), 0.004 if count > 1 else 0.002)
    else:
        pane = m.glass(shop, 0.3) if style in ("glazed", "lights") else coat
        low = 0.5 if style == "glazed" and chance(shop, 0.5) else 0.12
        _leaf(
            shop,
            coat,
            pane,
            x,
            (0.006, low),
            y=(back_y, front_y),
            height=height,
            rows=rows,
            columns=columns,
        )
    grip, side = m.metal(shop), pick(shop, (-1, 1))
    for face, s in ((front_y, 1), (back_y, -1)):
        p = side * (x - 0.06)
        shop.box(grip, (p - 0.018, face, 0.94), (p + 0.018, face + s * 0.007, 1.12), 0.002)
        shop.rod(grip, (p, face, 1.05), (p, face + s * 0.05, 1.05), 0.009)
        shop.rod(
            grip, (p, face + s * 0.045, 1.05), (p - side * 0.12, face + s * 0.045, 1.05), 0.009
        )


def _leaf(shop, coat, pane, x, low, *, y, height, rows, columns) -> None:
    """Add a leaf of stiles and rails with panels or panes between."""
    stile, (back, face), (floor, kick) = 0.1, y, low
    for s in (-1, 1):
        shop.box(coat, (s * (x - stile), back, floor), (s * x, face, height), 0.002)
    edges = np.linspace(kick, height - 0.1, rows + 1)
    shop.box(coat, (-x + stile, back, floor), (x - stile, face, kick), 0.002)
    for a in (*(e - 0.03 for e in edges[1:-1]), edges[-1]):
        top = height if a == edges[-1] else a + 0.06
        shop.box(coat, (-x + stile, back, a), (x - stile, face, top), 0.002)
    if columns == 2:
        shop.box(coat, (-0.04, back, kick), (0.04, face, height - 0.1), 0.002)
    inset = 0.012
    shop.box(pane, (-x + stile, back + inset, kick), (x - stile, face - inset, height - 0.1), 0.001)
