"""Office chairs, stools, benches."""

import itertools

import numpy as np

from . import _materials as m
from . import _pieces as pieces
from ._parts import between, chance, corners, legs, pick
from ._pieces import Number
from ._workshop import Finish, Workshop


def office_chair(shop: Workshop) -> None:
    """Make a swivel chair on castors."""
    frame = m.black(shop) if chance(shop, 0.6) else m.metal(shop)
    cloth, seat_z = m.upholstery(shop), between(shop, 0.44, 0.52)
    width, depth = between(shop, 0.46, 0.54), between(shop, 0.44, 0.5)
    tall = between(shop, 0.35, 0.75)
    for k in range(5):
        t = 2 * np.pi * k / 5 + np.pi / 2
        d = np.array([np.cos(t), np.sin(t)])
        shop.rod(frame, (*(0.03 * d), 0.11), (*(0.3 * d), 0.075), 0.022, 0.014)
        wheel = pieces.move(pieces.cylinder(0.026, -0.024, 0.024, 16), (0, 0, 0))
        wheel = pieces.turn(pieces.turn(wheel, "x", np.pi / 2), "z", t)
        shop.add(m.black(shop), wheel, (*(0.3 * d), 0.027))
        shop.rod(frame, (*(0.3 * d), 0.04), (*(0.3 * d), 0.08), 0.008)
    shop.disc(frame, (0, 0, 0.08), 0.035, 0.06)
    shop.disc(frame, (0, 0, 0.1), 0.018, seat_z - 0.14)
    shop.box(frame, (-0.11, -0.13, seat_z - 0.07), (0.11, 0.13, seat_z - 0.03), 0.008)
    shop.soft(
        cloth,
        (-width / 2, -depth / 2, seat_z - 0.04),
        (width / 2, depth / 2, seat_z + 0.035),
        0.035,
        (0, 0.02, 0.012),
    )
    _back(shop, frame, cloth, width, depth, seat_z=seat_z, tall=tall)
    if chance(shop, 0.75):
        for s in (-1, 1):
            x, y = s * (width / 2 + 0.035), 0.02
            path = [(s * 0.12, y, seat_z - 0.05), (x, y, seat_z - 0.05), (x, y, seat_z + 0.17)]
            for a, b in itertools.pairwise(path):
                shop.rod(frame, a, b, 0.014)
            shop.soft(
                m.black(shop),
                (x - 0.035, y - 0.12, seat_z + 0.17),
                (x + 0.035, y + 0.13, seat_z + 0.2),
                0.014,
            )
    shop.support = None


def _back(shop: Workshop, frame: Finish, cloth: Finish, width, depth, *, seat_z, tall) -> None:
    """Add a backrest: padded, in ribs, or a net with a head rest."""
    style, low = pick(shop, ("pad", "ribs", "net")), seat_z + (0.14 if tall < 0.5 else 0.05)
    y = -depth / 2 - 0.03
    shop.pipe(
        frame,
        pieces.curve(
            [
                (0, -0.05, seat_z - 0.05),
                (0, y - 0.03, seat_z - 0.02),
                (0, y - 0.055, low + 0.1),
                (0, y - 0.06 - 0.07 * tall, low + 0.55 * tall),
            ],
            16,
        ),
        0.018,
    )
    lean = 0.12
    first = shop.count()
    half = width / 2 - 0.02
    if style == "pad":
        shop.soft(cloth, (-half, -0.035, 0), (half, 0.03, tall), 0.03, (0, 0.02, 0))
    elif style == "ribs":
        for z in np.linspace(0, tall, max(3, round(tall / 0.1)) + 1)[:-1]:
            shop.soft(
                cloth,
                (-half, -0.03, z),
                (half, 0.03, z + tall / max(3, round(tall / 0.1)) - 0.004),
                0.026,
            )
    else:
        shop.add(
            frame,
            pieces.moulding(
                2 * half, tall, [(0, -0.015), (0, 0.015), (0.03, 0.015), (0.03, -0.015)]
            ),
            (0, 0, tall / 2),
        )
        shop.box(
            m.textured(shop, "fabric_weave", "fabric"),
            (-half + 0.02, -0.006, 0.02),
            (half - 0.02, 0.006, tall - 0.02),
            0.001,
        )
        shop.soft(cloth, (-0.13, -0.02, tall + 0.05), (0.13, 0.04, tall + 0.19), 0.028)
        shop.box(frame, (-0.025, -0.018, tall - 0.02), (0.025, -0.004, tall + 0.1))
    shop.turn_since(first, "x", lean)
    shop.shift_since(first, (0, y, low))


def stool(shop: Workshop) -> None:
    """Make a stool: round, square, bar stool, pouffe or piano stool."""
    style = pick(shop, ("wood", "bar", "bar", "pouffe", "square", "metal"))
    width = between(shop, 0.32, 0.42)
    height = between(shop, 0.62, 0.78) if style == "bar" else between(shop, 0.42, 0.48)
    timber, metal, cloth = m.wood(shop), m.metal(shop), m.upholstery(shop)
    shop.has_front = False
    shop.support = height
    if style == "pouffe":
        if chance(shop, 0.5):
            shop.add(
                cloth,
                pieces.superellipsoid((1.2 * width, 1.2 * width, 0.9 * height), 4.0, 2.0),
                (0, 0, 0.45 * height),
                crease=70.0,
            )
        else:
            shop.soft(
                cloth,
                (-0.6 * width, -0.6 * width, 0.02),
                (0.6 * width, 0.6 * width, 0.9 * height),
                0.05,
                (0, 0, 0.02),
            )
            legs(shop, timber, "square", corners(1.2 * width, 1.2 * width, 0.06), 0.05, thick=0.04)
        shop.support = 0.9 * height
        return
    thick = 0.035
    if style == "square":
        shop.box(
            timber, (-width / 2, -width / 2, height - thick), (width / 2, width / 2, height), 0.006
        )
        legs(
            shop,
            timber,
            pick(shop, ("square", "turned", "splayed")),
            corners(width, width, 0.035),
            height - thick,
            thick=0.042,
        )
    elif style == "bar" and chance(shop, 0.5):
        shop.disc(metal, (0, 0, 0), 0.21, 0.02, 0.19)
        shop.disc(metal, (0, 0, 0.015), 0.025, height - 0.06)
        shop.pipe(metal, pieces.circle(0.15, 0.28, 32), 0.01, True)
        shop.rod(metal, (-0.15, 0, 0.28), (0.15, 0, 0.28), 0.008)
        shop.add(
            cloth,
            pieces.superellipsoid((width, width, 0.09), 4.0, 2.0),
            (0, 0, height - 0.045),
            crease=70.0,
        )
        if chance(shop, 0.5):
            shop.has_front = True
            _low_back(shop, cloth, width, height)
    else:
        seat = cloth if chance(shop, 0.35) else timber
        shop.disc(seat, (0, 0, height - thick), width / 2, thick)
        leg, reach = metal if style == "metal" else timber, 0.3 * width
        spots = [
            (reach * np.cos(t), reach * np.sin(t)) for t in np.pi / 4 + np.arange(4) * np.pi / 2
        ]
        legs(shop, leg, "splayed", spots, height - thick, thick=0.045)
        z, lean = between(shop, 0.3, 0.45) * height, 1.0
        ring = [
            (
                x * (1 + 0.12 * height * 0.6 / reach * lean * 0.7),
                y * (1 + 0.12 * height * 0.6 / reach * lean * 0.7),
                z,
            )
            for x, y in spots
        ]
        for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
            shop.rod(leg, a, b, 0.009)


def _low_back(shop: Workshop, cloth: Finish, width: Number, height: Number) -> None:
    """Add a low round back behind the seat."""
    t = np.linspace(np.pi * 1.1, np.pi * 1.9, 18)
    rings = []
    for a in t:
        d = np.array([np.cos(a), np.sin(a)])
        o, i = 0.52 * width * d, 0.46 * width * d
        rings.append(
            [(*o, height - 0.03), (*o, height + 0.18), (*i, height + 0.18), (*i, height - 0.03)]
        )
    shop.add(cloth, pieces.loft(np.array(rings)), crease=60.0)


def bench(shop: Workshop) -> None:
    """Make a bench: plain, upholstered, with slats, or with a back."""
    width, depth, height = (
        between(shop, 0.9, 1.6),
        between(shop, 0.32, 0.45),
        between(shop, 0.42, 0.48),
    )
    timber, metal = m.wood(shop), m.metal(shop)
    style = pick(shop, ("plain", "padded", "slats", "back", "storage"))
    leg = metal if chance(shop, 0.35) else timber
    shop.support, shop.has_front = height, style in ("back", "storage")
    x, y = width / 2, depth / 2
    if style == "storage":
        shop.box(timber, (-x, -y, 0.03), (x, y, height - 0.06), 0.004)
        shop.soft(m.upholstery(shop), (-x, -y, height - 0.06), (x, y, height), 0.025, (0, 0, 0.01))
        for k in range(2):
            c = (k - 0.5) * width / 2
            shop.box(
                timber,
                (c - 0.22 * width, y, 0.06),
                (c + 0.22 * width, y + 0.014, height - 0.09),
                0.003,
            )
            shop.box(
                metal,
                (c - 0.04, y + 0.01, height - 0.15),
                (c + 0.04, y + 0.03, height - 0.135),
                0.003,
            )
        return
    if style == "slats":
        for a in np.linspace(-y, y - 0.05, max(4, round(depth / 0.075))):
            shop.box(timber, (-x, a, height - 0.03), (x, a + 0.055, height), 0.003)
    elif style == "padded":
        shop.box(timber, (-x, -y, height - 0.1), (x, y, height - 0.06), 0.003)
        shop.soft(m.upholstery(shop), (-x, -y, height - 0.065), (x, y, height), 0.03, (0, 0, 0.012))
    else:
        shop.box(timber, (-x, -y, height - 0.04), (x, y, height), 0.005)
    top = height - (0.1 if style == "padded" else 0.03)
    legs(
        shop,
        leg,
        pick(shop, ("square", "turned", "splayed")),
        corners(width, depth, 0.07),
        top,
        thick=0.055,
    )
    if leg is timber and chance(shop, 0.6):
        shop.box(timber, (-x + 0.08, -0.02, 0.12), (x - 0.08, 0.02, 0.17), 0.003)
    if style == "back":
        for s in (-1, 1):
            shop.rod(
                timber,
                (s * (x - 0.06), -y + 0.04, height - 0.03),
                (s * (x - 0.06), -y - 0.06, height + 0.42),
                0.02,
            )
        for z in (0.15, 0.27, 0.39):
            shop.box(
                timber,
                (-x + 0.02, -y - 0.035 - 0.12 * (z - 0.15), height + z - 0.04),
                (x - 0.02, -y - 0.01 - 0.12 * (z - 0.15), height + z + 0.04),
                0.004,
            )
