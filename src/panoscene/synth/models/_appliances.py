"""Machines of kitchen and laundry."""

import numpy as np

from ._pieces import Number
from . import _materials as m
from . import _pieces as pieces
from ._parts import between, chance, corners, dial_knob, front, handle, legs, pick
from ._workshop import Finish, Workshop


def _case(shop: Workshop, finish: Finish, width, depth, height, low=0.0, bevel=0.006) -> float:
    """Add a casing around x = 0; return the y of its front."""
    shop.box(finish, (-width / 2, -depth / 2, low), (width / 2, depth / 2, height), bevel)
    return depth / 2


def _feet(shop: Workshop, width, depth, height=0.03) -> None:
    legs(shop, m.black(shop), "round", corners(width, depth, 0.06), height, 0.05)


def _strip(shop: Workshop, panel: Finish, x, z, y: Number, knobs: int, side: Number = 0.3) -> None:
    """Add a control strip with a display and knobs or buttons."""
    (x0, x1), (z0, z1) = x, z
    shop.box(panel, (x0, y, z0), (x1, y + 0.012, z1), 0.002)
    middle, reach = (z0 + z1) / 2, min(0.32 * (z1 - z0), 0.022)
    width, top = 0.26 * (x1 - x0), y + 0.012
    place = x0 + (x1 - x0) * side
    shop.add(m.display(shop), pieces.sheet((place - width / 2, top - 0.001, middle - width / 2 * 0.0 - reach),
             (place + width / 2, top + 0.002, middle + reach)))  # fmt: skip
    grip = m.metal(shop) if chance(shop, 0.5) else m.plastic(shop)
    spots = np.linspace(0.55, 0.92, knobs) if side < 0.5 else np.linspace(0.08, 0.45, knobs)
    for s in spots if knobs else ():
        dial_knob(shop, grip, (x0 + s * (x1 - x0), top, middle), reach)
    if not knobs:
        for s in np.linspace(0.6, 0.92, 5):
            shop.wheel(grip, (x0 + s * (x1 - x0), top, middle), 0.008, 0.004)


def dishwasher(shop: Workshop) -> None:
    """Make a dishwasher: one tall flap with a strip of controls above."""
    width, depth = pick(shop, (0.45, 0.598, 0.598)), between(shop, 0.55, 0.62)
    height, coat = between(shop, 0.815, 0.87), m.enamel(shop)
    plinth = between(shop, 0.08, 0.12)
    shell = m.plain("enamel", (0.86, 0.86, 0.86), 0.4)
    y = _case(shop, shell, width, depth, height - 0.002, plinth)
    shop.box(
        m.black(shop),
        (-width / 2 + 0.01, -depth / 2, 0),
        (width / 2 - 0.01, depth / 2 - 0.04, plinth),
    )
    cut = height - between(shop, 0.09, 0.13)
    top = front(
        shop, coat, "flat", (-width / 2, width / 2), (plinth + 0.004, cut - 0.004), y, 0.022
    )
    _strip(
        shop,
        coat if chance(shop, 0.5) else m.black(shop),
        (-width / 2, width / 2),
        (cut, height),
        y,
        pick(shop, (0, 0, 1)),
    )
    style = pick(shop, ("bar", "bow", "edge"))
    handle(shop, m.metal(shop), style, (0, top, cut - 0.06), 0.75 * width, False)
    shop.support = height


def _porthole(
    shop: Workshop, rim: Finish, x: Number, y: Number, z: Number, radius: Number, open_handle=True
):
    """Add a round door with a bowl of dark glass."""
    ring = [
        (radius * 0.70, 0.0),
        (radius, 0.0),
        (radius, 0.022),
        (radius * 0.93, 0.036),
        (radius * 0.74, 0.036),
    ]
    piece = pieces.loft(np.stack([pieces.circle(r, h, 40) for r, h in ring]), joined=True)
    shop.add(rim, pieces.turn(piece, "x", -np.pi / 2), (x, y, z))
    bowl = [
        (0, 0.0),
        (radius * 0.72, 0.0),
        (radius * 0.72, 0.022),
        (radius * 0.5, 0.034),
        (0, 0.04),
    ]
    shop.add(m.dark_glass(shop), pieces.turn(pieces.lathe(bowl, 40), "x", -np.pi / 2), (x, y, z))
    if open_handle:
        shop.box(
            m.metal(shop),
            (x - radius * 0.99, y + 0.03, z - 0.05),
            (x - radius * 0.8, y + 0.045, z + 0.05),
            0.004,
        )


def _front_loader(shop: Workshop, drawer: bool) -> None:
    width, depth, height = (
        between(shop, 0.58, 0.61),
        between(shop, 0.5, 0.64),
        between(shop, 0.83, 0.87),
    )
    coat = m.plain("enamel", (0.93, 0.93, 0.93), 0.3) if chance(shop, 0.65) else m.enamel(shop)
    y = _case(shop, coat, width, depth, height, 0.02, 0.01)
    _feet(shop, width, depth)
    cut = height - between(shop, 0.11, 0.15)
    panel = coat if chance(shop, 0.5) else (m.black(shop) if chance(shop, 0.5) else m.plastic(shop))
    _strip(
        shop,
        panel,
        (-width / 2 + 0.17 * drawer + 0.006, width / 2 - 0.006),
        (cut, height - 0.01),
        y,
        1,
        pick(shop, (0.3, 0.7)),
    )
    if drawer:
        front(
            shop,
            panel,
            "flat",
            (-width / 2 + 0.006, -width / 2 + 0.17),
            (cut, height - 0.01),
            y,
            0.014,
        )
        handle(
            shop, m.plastic(shop), "edge", (-width / 2 + 0.088, y + 0.014, cut + 0.03), 0.1, False
        )
    radius = between(shop, 0.17, 0.2) if drawer else between(shop, 0.19, 0.23)
    rim = pick(shop, (m.metal, m.plastic, m.black))(shop)
    _porthole(shop, rim, 0.0, y, 0.08 + 0.5 * (cut - 0.08), radius)
    if drawer:
        shop.box(coat, (width / 2 - 0.16, y, 0.05), (width / 2 - 0.05, y + 0.006, 0.14), 0.003)
    else:
        for k in range(5):
            shop.box(
                m.black(shop), (-0.2, y, 0.035 + 0.014 * k), (0.2, y + 0.004, 0.041 + 0.014 * k)
            )
    shop.support = height


def washer(shop: Workshop) -> None:
    """Make a washing machine: front loader, now and then a top loader."""
    if chance(shop, 0.8):
        _front_loader(shop, True)
        return
    width, depth, height = (
        between(shop, 0.4, 0.68),
        between(shop, 0.58, 0.66),
        between(shop, 0.86, 0.95),
    )
    coat = m.plain("enamel", (0.93, 0.93, 0.93), 0.3)
    _case(shop, coat, width, depth, height, 0.02, 0.012)
    _feet(shop, width, depth)
    shop.box(
        m.dark_glass(shop),
        (-0.42 * width, -0.2 * depth, height),
        (0.42 * width, 0.45 * depth, height + 0.012),
        0.008,
    )
    shop.box(
        coat, (-width / 2, -depth / 2, height), (width / 2, -0.24 * depth, height + 0.12), 0.01
    )
    _strip(
        shop,
        m.plastic(shop),
        (-0.48 * width, 0.48 * width),
        (height + 0.025, height + 0.11),
        -0.24 * depth,
        2,
    )
    shop.support = None


def dryer(shop: Workshop) -> None:
    """Make a tumble dryer: a large round door, a grille below, no drawer."""
    _front_loader(shop, False)


def _oven_door(shop: Workshop, coat: Finish, x, z, y: Number) -> None:
    (x0, x1), (z0, z1) = x, z
    top = front(shop, coat, "flat", x, z, y, 0.025)
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
        False,
    )


def oven(shop: Workshop) -> None:
    """Make a built-in oven."""
    width, depth, height = (
        between(shop, 0.56, 0.6),
        between(shop, 0.52, 0.58),
        between(shop, 0.45, 0.62),
    )
    coat, shell = m.enamel(shop), m.steel(shop)
    y = _case(shop, shell, width - 0.02, depth, height)
    cut = height - between(shop, 0.09, 0.12)
    _oven_door(
        shop,
        coat if chance(shop, 0.5) else m.dark_glass(shop),
        (-width / 2, width / 2),
        (0.01, cut - 0.004),
        y,
    )
    _strip(shop, coat, (-width / 2, width / 2), (cut, height), y, pick(shop, (0, 2, 2, 4)), 0.3)


def microwave(shop: Workshop) -> None:
    """Make a microwave oven: a window on the left, controls on the right."""
    width, depth, height = (
        between(shop, 0.43, 0.56),
        between(shop, 0.32, 0.45),
        between(shop, 0.25, 0.32),
    )
    coat = m.enamel(shop)
    y = _case(shop, coat, width, depth, height, 0.012, 0.008)
    _feet(shop, width, depth, 0.014)
    # seen from the front, +x is on the left: the door's side
    split = -width / 2 + between(shop, 0.22, 0.28) * width
    face = coat if chance(shop, 0.4) else m.dark_glass(shop)
    top = front(
        shop, face, "flat", (split + 0.002, width / 2 - 0.003), (0.016, height - 0.004), y, 0.018
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
        handle(shop, m.metal(shop), "bar", (split + 0.022, top, height / 2), 0.72 * height, True)
    shop.support = height


def fridge(shop: Workshop) -> None:
    """Make a fridge: one door, freezer above or below, or side by side."""
    style = pick(shop, ("single", "top", "bottom", "pair", "small", "french"))
    width = between(shop, 0.83, 0.93) if style in ("pair", "french") else between(shop, 0.54, 0.72)
    height = between(shop, 0.8, 0.9) if style == "small" else between(shop, 1.5, 2.0)
    depth, coat = between(shop, 0.55, 0.7), m.enamel(shop)
    shell = coat if chance(shop, 0.6) else m.plain("enamel", (0.35, 0.35, 0.36), 0.4)
    y = _case(shop, shell, width, depth, height, 0.03, 0.008)
    _feet(shop, width, depth)
    low, high, x0, x1 = 0.06, height - 0.004, -width / 2 + 0.001, width / 2 - 0.001
    cut = {"top": low + 0.7 * (high - low), "bottom": low + 0.36 * (high - low)}.get(style, high)
    if style == "french":
        cut = low + 0.38 * (high - low)
    doors = (
        [((x0, x1), (low, cut))]
        if style not in ("pair",)
        else [((x0, -0.1 * width), (low, high)), ((-0.1 * width, x1), (low, high))]
    )
    if style in ("top", "bottom"):
        doors.append(((x0, x1), (cut, high)))
    if style == "french":
        doors += [((x0, 0.0), (cut, high)), ((0.0, x1), (cut, high))]
    grip, hold, left = m.metal(shop), pick(shop, ("bar", "bar", "bow", "edge")), chance(shop, 0.5)
    for (a, b), (c, d) in doors:
        shop.box(coat, (a + 0.002, y + 0.002, c + 0.003), (b - 0.002, y + 0.06, d - 0.003), 0.012)
        wide = style == "french" and b - a > 0.6
        length = min(0.5 * (d - c), 0.55) if not wide else 0.6 * (b - a)
        near = (a + b < 0) if style == "pair" else (a < -0.01 and b < 0.01)
        inner = (
            (b - 0.045 if near else a + 0.045)
            if len(doors) > 1 and style in ("pair", "french")
            else (a + 0.045 if left else b - 0.045)
        )
        z = (
            d - 0.07
            if wide
            else (c + 0.55 * length + 0.05 if c > 0.5 else d - 0.55 * length - 0.05)
        )
        handle(shop, grip, hold, ((a + b) / 2 if wide else inner, y + 0.06, z), length, not wide)
    if style in ("pair", "french") and chance(shop, 0.6):
        x = 0.22 * width
        shop.box(m.dark_glass(shop), (x - 0.09, y + 0.058, 1.0), (x + 0.09, y + 0.064, 1.32), 0.003)
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
    y = _case(shop, coat, width, depth, height - 0.012, 0.05)
    _feet(shop, width, depth, 0.05)
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
        shop, coat, "flat", (-width / 2 + 0.004, width / 2 - 0.004), (0.06, drawer - 0.006), y, 0.02
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


def coffee_machine(shop: Workshop) -> None:
    """Make a coffee machine: filter jug, espresso or capsules."""
    style, coat = pick(shop, ("filter", "espresso", "capsule")), m.enamel(shop)
    dark = m.black(shop)
    if style == "filter":
        w, d, h = between(shop, 0.18, 0.22), between(shop, 0.23, 0.28), between(shop, 0.3, 0.37)
        shop.box(coat, (-w / 2, -d / 2, 0), (w / 2, d / 2, 0.045), 0.01)
        shop.box(coat, (-w / 2, -d / 2, 0.04), (w / 2, -d / 2 + 0.1, h - 0.05), 0.01)
        shop.box(coat, (-w / 2, -d / 2, h - 0.12), (w / 2, d / 2 - 0.01, h), 0.014)
        jug = [(0, 0), (0.058, 0), (0.072, 0.05), (0.062, 0.105), (0.045, 0.12), (0, 0.12)]
        shop.add(
            m.plain("coffee", (0.09, 0.05, 0.03), 0.05),
            pieces.lathe(jug, 28),
            (0, d / 2 - 0.078, 0.047),
        )
        shop.disc(dark, (0, d / 2 - 0.078, 0.166), 0.05, 0.012)
        path = pieces.curve(
            [
                (0, d / 2 - 0.02, 0.15),
                (0, d / 2 + 0.03, 0.145),
                (0, d / 2 + 0.03, 0.09),
                (0, d / 2 - 0.01, 0.07),
            ],
            14,
        )
        shop.pipe(dark, path, 0.008)
    elif style == "espresso":
        w, d, h = between(shop, 0.22, 0.32), between(shop, 0.28, 0.36), between(shop, 0.3, 0.38)
        shop.box(coat, (-w / 2, -d / 2, 0.0), (w / 2, d / 2, 0.05), 0.006)
        shop.box(
            m.steel(shop), (-w / 2 + 0.012, 0, 0.05), (w / 2 - 0.012, d / 2 - 0.012, 0.058), 0.002
        )
        shop.box(coat, (-w / 2, -d / 2, 0.05), (w / 2, -0.06 * d, h), 0.008)
        shop.box(coat, (-w / 2, -d / 2, 0.68 * h), (w / 2, 0.3 * d, h), 0.008)
        chrome = m.plain("metal chrome", (0.82, 0.83, 0.84), 0.12, 1.0)
        y = 0.14 * d
        shop.disc(chrome, (0, y, 0.68 * h - 0.045), 0.034, 0.05)
        shop.rod(dark, (0, y + 0.03, 0.68 * h - 0.03), (0, y + 0.17, 0.68 * h - 0.045), 0.011)
        shop.pipe(
            chrome,
            pieces.curve(
                [
                    (-w / 2 + 0.03, 0.28 * d, 0.7 * h),
                    (-w / 2 + 0.01, 0.36 * d, 0.5 * h),
                    (-w / 2 + 0.0, 0.38 * d, 0.3 * h),
                ],
                10,
            ),
            0.005,
        )
        for x in (-0.25, 0.0, 0.25):
            dial_knob(shop, chrome, (x * w, 0.3 * d, 0.85 * h), 0.016, 0.012)
        for x in (-0.2, 0.12):
            cup = [(0, 0), (0.022, 0), (0.035, 0.05), (0.031, 0.05), (0.02, 0.008), (0, 0.008)]
            shop.add(m.glaze(shop), pieces.lathe(cup, 20), (x * w, -0.25 * d, h))
    else:
        w, d, h = between(shop, 0.12, 0.18), between(shop, 0.3, 0.38), between(shop, 0.24, 0.3)
        shop.soft(coat, (-w / 2, -d / 2, 0), (w / 2, 0.1 * d, h - 0.03), 0.03)
        shop.soft(coat, (-0.42 * w, -0.3 * d, 0.62 * h), (0.42 * w, 0.42 * d, h), 0.03)
        shop.box(dark, (-0.4 * w, 0, 0), (0.4 * w, d / 2, 0.035), 0.008)
        shop.disc(dark, (0, 0.3 * d, 0.55 * h), 0.014, 0.03)
        shop.box(m.metal(shop), (-0.3 * w, -0.1 * d, h), (0.3 * w, 0.3 * d, h + 0.012), 0.005)
        shop.soft(
            m.plain("water tank", (0.55, 0.62, 0.66), 0.1),
            (-0.44 * w, -d / 2 - 0.05, 0.02),
            (0.44 * w, -d / 2 + 0.01, 0.9 * h),
            0.02,
        )
