"""Machines of kitchen and laundry."""

import numpy as np

from . import _materials as m
from . import _pieces as pieces
from ._parts import between, chance, corners, dial_knob, front, handle, legs, pick
from ._pieces import Number
from ._workshop import Finish, Workshop


def case(shop: Workshop, finish: Finish, width, depth, height, *, low=0.0, bevel=0.006) -> float:
    """Add a casing around x = 0; return the y of its front."""
    shop.box(finish, (-width / 2, -depth / 2, low), (width / 2, depth / 2, height), bevel)
    return depth / 2


def feet(shop: Workshop, width, depth, height=0.03) -> None:
    legs(shop, m.black(shop), "round", corners(width, depth, 0.06), height, thick=0.05)


def strip(
    shop: Workshop, panel: Finish, x, z, y: Number, *, knobs: int, side: Number = 0.3
) -> None:
    """Add a control strip with a display and knobs or buttons."""
    (x0, x1), (z0, z1) = x, z
    shop.box(panel, (x0, y, z0), (x1, y + 0.012, z1), 0.002)
    middle, reach = (z0 + z1) / 2, min(0.32 * (z1 - z0), 0.022)
    width, top = 0.26 * (x1 - x0), y + 0.012
    place = x0 + (x1 - x0) * side
    shop.add(
        m.display(shop),
        pieces.sheet(
            (place - width / 2, top - 0.001, middle - reach),
            (place + width / 2, top + 0.002, middle + reach),
        ),
    )
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
    y = case(shop, shell, width, depth, height - 0.002, low=plinth)
    shop.box(
        m.black(shop),
        (-width / 2 + 0.01, -depth / 2, 0),
        (width / 2 - 0.01, depth / 2 - 0.04, plinth),
    )
    cut = height - between(shop, 0.09, 0.13)
    top = front(
        shop, coat, "flat", (-width / 2, width / 2), (plinth + 0.004, cut - 0.004), y=y, thick=0.022
    )
    strip(
        shop,
        coat if chance(shop, 0.5) else m.black(shop),
        (-width / 2, width / 2),
        (cut, height),
        y,
        knobs=pick(shop, (0, 0, 1)),
    )
    style = pick(shop, ("bar", "bow", "edge"))
    handle(shop, m.metal(shop), style, (0, top, cut - 0.06), 0.75 * width, upright=False)
    shop.support = height


def _porthole(
    shop: Workshop,
    rim: Finish,
    x: Number,
    y: Number,
    z: Number,
    *,
    radius: Number,
    open_handle=True,
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
    y = case(shop, coat, width, depth, height, low=0.02, bevel=0.01)
    feet(shop, width, depth)
    cut = height - between(shop, 0.11, 0.15)
    panel = coat if chance(shop, 0.5) else (m.black(shop) if chance(shop, 0.5) else m.plastic(shop))
    strip(
        shop,
        panel,
        (-width / 2 + 0.17 * drawer + 0.006, width / 2 - 0.006),
        (cut, height - 0.01),
        y,
        knobs=1,
        side=pick(shop, (0.3, 0.7)),
    )
    if drawer:
        front(
            shop,
            panel,
            "flat",
            (-width / 2 + 0.006, -width / 2 + 0.17),
            (cut, height - 0.01),
            y=y,
            thick=0.014,
        )
        handle(
            shop,
            m.plastic(shop),
            "edge",
            (-width / 2 + 0.088, y + 0.014, cut + 0.03),
            0.1,
            upright=False,
        )
    radius = between(shop, 0.17, 0.2) if drawer else between(shop, 0.19, 0.23)
    rim = pick(shop, (m.metal, m.plastic, m.black))(shop)
    _porthole(shop, rim, 0.0, y, 0.08 + 0.5 * (cut - 0.08), radius=radius)
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
    case(shop, coat, width, depth, height, low=0.02, bevel=0.012)
    feet(shop, width, depth)
    shop.box(
        m.dark_glass(shop),
        (-0.42 * width, -0.2 * depth, height),
        (0.42 * width, 0.45 * depth, height + 0.012),
        0.008,
    )
    shop.box(
        coat, (-width / 2, -depth / 2, height), (width / 2, -0.24 * depth, height + 0.12), 0.01
    )
    strip(
        shop,
        m.plastic(shop),
        (-0.48 * width, 0.48 * width),
        (height + 0.025, height + 0.11),
        -0.24 * depth,
        knobs=2,
    )
    shop.support = None


def dryer(shop: Workshop) -> None:
    """Make a tumble dryer: a large round door, a grille below, no drawer."""
    _front_loader(shop, False)


def fridge(shop: Workshop) -> None:
    """Make a fridge: one door, freezer above or below, or side by side."""
    style = pick(shop, ("single", "top", "bottom", "pair", "small", "french"))
    width = between(shop, 0.83, 0.93) if style in ("pair", "french") else between(shop, 0.54, 0.72)
    height = between(shop, 0.8, 0.9) if style == "small" else between(shop, 1.5, 2.0)
    depth, coat = between(shop, 0.55, 0.7), m.enamel(shop)
    shell = coat if chance(shop, 0.6) else m.plain("enamel", (0.35, 0.35, 0.36), 0.4)
    y = case(shop, shell, width, depth, height, low=0.03, bevel=0.008)
    feet(shop, width, depth)
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
        handle(
            shop,
            grip,
            hold,
            ((a + b) / 2 if wide else inner, y + 0.06, z),
            length,
            upright=not wide,
        )
    if style in ("pair", "french") and chance(shop, 0.6):
        x = 0.22 * width
        shop.box(m.dark_glass(shop), (x - 0.09, y + 0.058, 1.0), (x + 0.09, y + 0.064, 1.32), 0.003)
    shop.support = height


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
