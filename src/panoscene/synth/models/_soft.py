"""Cloth: carpets, cushions, curtains."""

import numpy as np

from . import _materials as m
from . import _pieces as pieces
from ._parts import between, chance, pick
from ._pieces import Number
from ._workshop import Workshop


def carpet(shop: Workshop) -> None:
    """Make a rug: rectangular with fringes, a runner, round or oval."""
    style = pick(shop, ("wide", "wide", "square", "runner", "round", "oval"))
    width = {
        "wide": between(shop, 1.6, 3.0),
        "square": between(shop, 1.2, 2.2),
        "runner": between(shop, 1.8, 3.0),
    }.get(style, between(shop, 1.0, 2.2))
    depth = {
        "wide": width * between(shop, 0.6, 0.75),
        "square": width,
        "runner": between(shop, 0.6, 0.9),
        "oval": 0.65 * width,
    }.get(style, width)
    thick, plain = between(shop, 0.008, 0.02), chance(shop, 0.25)
    cloth = (
        m.textured(shop, "floor_carpet", "carpet")
        if plain
        else m.textured(shop, "rug", "rug", whole=True)
    )
    power = 2.0 if style in ("round", "oval") else 60.0
    if power > 2.0:
        piece = pieces.box((-width / 2, -depth / 2, 0), (width / 2, depth / 2, thick), 0.004)
    else:
        piece = pieces.loft(
            np.stack([pieces.oval(width, depth, z, power, 72) for z in (0.0, thick)])
        )
    if not plain:
        uv = 0.5 + 0.999 * piece.vertices[:, :2] / np.array([width, depth])
        piece = piece._replace(uv=uv)
    shop.add(cloth, piece, crease=60.0)
    if power > 2.0 and chance(shop, 0.4):
        fringe = m.plain("fringe", (0.9, 0.86, 0.76), 0.95)
        for x in np.arange(-depth / 2 + 0.01, depth / 2, 0.022):
            for s in (-1, 1):
                shop.box(
                    fringe,
                    (s * width / 2, x - 0.004, 0),
                    (s * (width / 2 + 0.06), x + 0.004, 0.004),
                    0.0005,
                )


def cushion(shop: Workshop) -> None:
    """Make a cushion that stands on its edge, its face to the front."""
    width = between(shop, 0.36, 0.56)
    height = width if chance(shop, 0.65) else between(shop, 0.28, 0.38)
    thick, cloth = between(shop, 0.11, 0.18), m.fabric(shop)
    if chance(shop, 0.1):
        bolster = pieces.turn(
            pieces.superellipsoid((height * 0.6, height * 0.6, width), 7.0, 2.0), "y", np.pi / 2
        )
        shop.add(cloth, bolster, crease=70.0)
        return
    piece = pieces.pillow(width, height, thick, between(shop, 0.03, 0.09))
    shop.add(cloth, piece, crease=75.0)
    if chance(shop, 0.35):
        trim = m.plain("fabric piping", m.mean_colour(cloth, 0.5), 0.9)
        seam = np.abs(piece.vertices[:, 1]) < 1e-9
        rim = piece.vertices[seam]
        order = np.argsort(np.arctan2(rim[:, 2], rim[:, 0]))
        rim = np.unique(np.round(rim[order], 6), axis=0)
        rim = rim[np.argsort(np.arctan2(rim[:, 2], rim[:, 0]))]
        shop.pipe(trim, rim, 0.005, joined=True, segments=8)


def curtain(shop: Workshop) -> None:
    """Make curtains on a rod: two sides, one side, or nets."""
    width, height = between(shop, 1.2, 2.6), between(shop, 2.0, 2.6)
    rod, style = (
        m.metal(shop) if chance(shop, 0.6) else m.wood(shop),
        pick(shop, ("pair", "pair", "one", "drawn")),
    )
    cloth = m.textured(
        shop, pick(shop, ("fabric_weave", "fabric_velvet", "fabric_stripes")), "fabric"
    )
    top = height - 0.03
    shop.rod(rod, (-width / 2 - 0.1, 0, top + 0.02), (width / 2 + 0.1, 0, top + 0.02), 0.013)
    for s in (-1, 1):
        shop.add(
            rod,
            pieces.superellipsoid((0.05, 0.05, 0.05), steps=8),
            (s * (width / 2 + 0.11), 0, top + 0.02),
        )
        shop.rod(
            rod,
            (s * (width / 2 + 0.03), -0.09, top + 0.02),
            (s * (width / 2 + 0.03), 0, top + 0.02),
            0.008,
        )
    share = between(shop, 0.16, 0.28)
    spans = {
        "pair": [(-0.5, -0.5 + share), (0.5 - share, 0.5)],
        "one": [(-0.5, -0.5 + 1.5 * share)],
        "drawn": [(-0.5, 0.0), (0.0, 0.5)],
    }[style]
    for a, b in spans:
        _folds(shop, cloth, a * width, b * width, between(shop, 0.02, 0.15), high=top)


def _folds(shop: Workshop, cloth, x0: Number, x1: Number, low: Number, *, high: Number) -> None:
    """Add hanging cloth in folds between two places on the rod."""
    count = max(24, int((x1 - x0) / 0.012))
    x, phase = np.linspace(x0, x1, count), between(shop, 0, 6.0)
    pitch, deep = between(shop, 0.09, 0.13), between(shop, 0.022, 0.04)
    wave = np.sin(2 * np.pi * (x - x0) / pitch + phase + 0.7 * np.sin(9 * x))
    levels, rings = np.linspace(low, high, 5), []
    gather = 0.75 + 0.25 * np.cos(np.linspace(0, np.pi / 2, 5))
    for k in range(count):
        y = deep * wave[k] * gather
        front = [(x[k], a + 0.003, z) for a, z in zip(y, levels, strict=True)]
        back = [(x[k], a - 0.003, z) for a, z in zip(y, levels, strict=True)]
        rings.append([*front, *back[::-1]])
    shop.add(cloth, pieces.loft(np.array(rings)), crease=60.0)
