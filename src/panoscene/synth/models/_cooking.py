"""Machines to cook with."""

import numpy as np

from . import _materials as m
from . import _pieces as pieces
from ._appliances import case, feet, strip
from ._parts import between, chance, dial_knob, front, handle, pick
from ._pieces import Number
from ._workshop import Finish, Workshop


def _oven_door(shop: Workshop, coat: Finish, x, z, y: Number) -> None:
    (x0, x1), (z0, z1) = x, z
    top = front(shop, coat, "flat", x, z, y=y, thick=0.025)
    frame = 0.06 + 0.1 * (z1 - z0)
    shop.box(
        m.dark_glass(shop),
        (x0 + frame, top - 0.002, z0 + frame),
        (x1 - frame, top + 0.003, z1 - frame),
        0.002,
    )
    handle(
        shop,
        m.metal(shop),
        pick(shop, ("bar", "bow")),
        (0, top, z1 - 0.035),
        0.8 * (x1 - x0),
        upright=False,
    )


def oven(shop: Workshop) -> None:
    """Make a built-in oven."""
    width, depth, height = (
        between(shop, 0.56, 0.6),
        between(shop, 0.52, 0.58),
        between(shop, 0.45, 0.62),
    )
    coat, shell = m.enamel(shop), m.steel(shop)
    y = case(shop, shell, width - 0.02, depth, height)
    cut = height - between(shop, 0.09, 0.12)
    _oven_door(
        shop,
        coat if chance(shop, 0.5) else m.dark_glass(shop),
        (-width / 2, width / 2),
        (0.01, cut - 0.004),
        y,
    )
    strip(
        shop,
        coat,
        (-width / 2, width / 2),
        (cut, height),
        y,
        knobs=pick(shop, (0, 2, 2, 4)),
        side=0.3,
    )


def microwave(shop: Workshop) -> None:
    """Make a microwave oven: a window on the left, controls on the right."""
    width, depth, height = (
        between(shop, 0.43, 0.56),
        between(shop, 0.32, 0.45),
        between(shop, 0.25, 0.32),
    )
    coat = m.enamel(shop)
    y = case(shop, coat, width, depth, height, low=0.012, bevel=0.008)
    feet(shop, width, depth, 0.014)
    # seen from the front, +x is on the left: the door's side
    split = -width / 2 + between(shop, 0.22, 0.28) * width
    face = coat if chance(shop, 0.4) else m.dark_glass(shop)
    top = front(
        shop,
        face,
        "flat",
        (split + 0.002, width / 2 - 0.003),
        (0.016, height - 0.004),
        y=y,
        thick=0.018,
    )
    shop.box(
        m.dark_glass(shop),
        (split + 0.05, top - 0.001, 0.055),
        (width / 2 - 0.04, top + 0.002, height - 0.045),
        0.001,
    )
    panel = m.black(shop) if chance(shop, 0.6) else coat
    shop.box(panel, (-width / 2 + 0.003, y, 0.016), (split, y + 0.016, height - 0.004), 0.002)
    centre, wide = (split - width / 2) / 2, 0.7 * (split + width / 2)
    shop.add(
        m.display(shop),
        pieces.sheet(
            (centre - wide / 2, y + 0.014, height - 0.08),
            (centre + wide / 2, y + 0.018, height - 0.04),
        ),
    )
    grip = m.plastic(shop)
    if chance(shop, 0.5):
        for z in (0.42, 0.2):
            dial_knob(shop, grip, (centre, y + 0.016, z * height), 0.02)
    else:
        for row in range(4):
            for column in (-1, 0, 1):
                c = (centre + 0.27 * wide * column, 0.05 + row * 0.03)
                shop.box(
                    grip, (c[0] - 0.008, y + 0.014, c[1]), (c[0] + 0.008, y + 0.02, c[1] + 0.018)
                )
    if chance(shop, 0.7):
        handle(
            shop,
            m.metal(shop),
            "bar",
            (split + 0.022, top, height / 2),
            0.72 * height,
            upright=True,
        )
    shop.support = height


def _burners(shop: Workshop, width: Number, depth: Number, z: Number, gas: bool) -> None:
    spots = [(x, y) for x in (-0.25, 0.25) for y in (-0.24, 0.2)]
    if width > 0.68:
        spots = [*((1.25 * x, y) for x, y in spots), (0.0, 0.0)]
    iron = m.plain("iron", (0.03, 0.03, 0.03), 0.6, 0.3)
    pale = m.plain("print", (0.42, 0.42, 0.43), 0.3)
    for x, y in spots:
        r = between(shop, 0.065, 0.105)
        c = (x * width, y * depth, z)
        if gas:
            shop.disc(iron, c, 0.45 * r, 0.014)
            for k in range(4):
                turn = np.pi * (k / 2 + 0.25)
                d = np.array([np.cos(turn), np.sin(turn)])
                a, b = (
                    (c[0] + 0.3 * r * d[0], c[1] + 0.3 * r * d[1], z + 0.026),
                    (c[0] + 1.1 * r * d[0], c[1] + 1.1 * r * d[1], z + 0.026),
                )
                shop.rod(iron, a, b, 0.005)
                shop.rod(iron, b, (b[0], b[1], z), 0.005)
        else:
            ring = [(r - 0.003, 0), (r, 0), (r, 0.0008), (r - 0.003, 0.0008)]
            shop.add(
                pale,
                pieces.loft(np.stack([pieces.circle(q, h, 40) for q, h in ring]), joined=True),
                c,
            )
            if chance(shop, 0.3):
                shop.disc(iron, c, r - 0.008, 0.01)


def cooktop(shop: Workshop) -> None:
    """Make a hob: glass or gas."""
    width, depth = pick(shop, (0.3, 0.58, 0.6, 0.76, 0.9)), between(shop, 0.48, 0.53)
    gas = chance(shop, 0.45)
    plate = (m.steel(shop) if chance(shop, 0.6) else m.enamel(shop)) if gas else m.dark_glass(shop)
    thick = 0.012
    shop.box(plate, (-width / 2, -depth / 2, 0), (width / 2, depth / 2, thick), 0.003)
    _burners(shop, width, depth, thick, gas)
    knob = m.metal(shop) if chance(shop, 0.5) else m.black(shop)
    if gas or chance(shop, 0.3):
        for x in np.linspace(-0.12, 0.12, 4):
            shop.disc(
                knob, (x * min(width / 0.6, 1), depth / 2 - 0.035, thick), 0.017, 0.024, 0.014
            )
    else:
        shop.box(
            m.plain("print", (0.6, 0.6, 0.6), 0.3),
            (-0.1, depth / 2 - 0.04, thick - 0.001),
            (0.1, depth / 2 - 0.034, thick + 0.0006),
        )


def stove(shop: Workshop) -> None:
    """Make a cooker: oven below, rings above."""
    width, depth = pick(shop, (0.5, 0.6, 0.6, 0.76, 0.9)), between(shop, 0.58, 0.64)
    height, coat, gas = between(shop, 0.85, 0.92), m.enamel(shop), chance(shop, 0.55)
    y = case(shop, coat, width, depth, height - 0.012, low=0.05)
    feet(shop, width, depth, 0.05)
    shop.box(
        m.dark_glass(shop) if not gas else m.steel(shop),
        (-width / 2, -depth / 2, height - 0.012),
        (width / 2, depth / 2 + 0.02, height),
        0.003,
    )
    _burners(shop, width, depth, height, gas)
    cut, drawer = height - 0.13, 0.22
    panel = coat if chance(shop, 0.6) else m.black(shop)
    shop.box(panel, (-width / 2, y, cut), (width / 2, y + 0.015, height - 0.014), 0.003)
    knob = m.metal(shop) if chance(shop, 0.5) else m.black(shop)
    for s in np.linspace(-0.4, 0.4, 5 if width < 0.7 else 7):
        dial_knob(shop, knob, (s * width, y + 0.015, (cut + height) / 2), 0.021, 0.026)
    _oven_door(shop, coat, (-width / 2 + 0.004, width / 2 - 0.004), (drawer, cut - 0.006), y)
    front(
        shop,
        coat,
        "flat",
        (-width / 2 + 0.004, width / 2 - 0.004),
        (0.06, drawer - 0.006),
        y=y,
        thick=0.02,
    )
    if chance(shop, 0.4):
        shop.box(
            coat,
            (-width / 2, -depth / 2, height),
            (width / 2, -depth / 2 + 0.035, height + between(shop, 0.08, 0.2)),
            0.006,
        )


def range_hood(shop: Workshop) -> None:
    """Make a cooker hood: pyramid, box, slanted glass or slim with a chimney."""
    width, depth = pick(shop, (0.6, 0.6, 0.75, 0.9)), between(shop, 0.45, 0.52)
    coat = m.enamel(shop)
    style, rise = pick(shop, ("pyramid", "box", "glass", "slim", "dome")), between(shop, 0.4, 0.7)
    pipe = (between(shop, 0.2, 0.3), between(shop, 0.2, 0.26))
    rim, back = 0.05, -depth / 2
    if style in ("pyramid", "dome"):
        shop.box(coat, (-width / 2, back, 0), (width / 2, depth / 2, rim), 0.003)
        rings = []
        for t in np.linspace(0, 1, 2 if style == "pyramid" else 9):
            share = t if style == "pyramid" else 1 - np.cos(t * np.pi / 2)
            s = (1 - share) if style == "pyramid" else np.cos(t * np.pi / 2)
            w, d = pipe[0] + (width - pipe[0]) * s, pipe[1] + (depth - pipe[1]) * s
            z = rim + 0.26 * (t if style == "pyramid" else np.sin(t * np.pi / 2))
            rings.append(
                [(-w / 2, back, z), (w / 2, back, z), (w / 2, back + d, z), (-w / 2, back + d, z)]
            )
        shop.add(coat, pieces.loft(np.array(rings)), crease=35.0)
    elif style == "glass":
        outline = np.stack([pieces.oval(width, 1.6 * depth, z, 3.0) for z in (0.05, 0.056)])
        outline[..., 1] = np.clip(outline[..., 1], -0.02, None) - 0.3 * depth
        shop.add(m.glass(shop, 0.3), pieces.loft(outline))
        shop.box(coat, (-0.32 * width, back, 0), (0.32 * width, 0.2 * depth, 0.07), 0.005)
    elif style == "slim":
        shop.box(coat, (-width / 2, back, 0), (width / 2, depth / 2, 0.07), 0.004)
    else:
        shop.box(coat, (-width / 2, back, 0), (width / 2, 0.1 * depth, 0.22), 0.004)
        shop.box(coat, (-width / 2, back, 0), (width / 2, depth / 2, 0.045), 0.004)
    shop.box(coat, (-pipe[0] / 2, back, 0.03), (pipe[0] / 2, back + pipe[1], rise + 0.25), 0.003)
    shop.box(
        m.plain("filter", (0.45, 0.45, 0.45), 0.5, 0.6),
        (-0.4 * width, back + 0.04, -0.004),
        (0.4 * width, 0.1 * depth, 0.004),
    )
    for x in np.linspace(-0.06, 0.06, 4):
        shop.wheel(
            m.black(shop),
            (x, depth / 2 - 0.001 if style != "glass" else 0.2 * depth, 0.025),
            0.007,
            0.004,
        )
