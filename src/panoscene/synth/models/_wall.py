"""What hangs on walls or fills holes in them."""

import numpy as np

from ._pieces import Number
from . import _materials as m
from . import _pieces as pieces
from ._parts import between, chance, front, pick
from ._workshop import Finish, Workshop


def _frame(
    shop: Workshop, finish: Finish, width: Number, height: Number, wide: Number, deep: Number
):
    """Add a picture frame around the origin, its back at y = 0."""
    style = pick(shop, ("plain", "round", "step", "cove"))
    profile = {
        "plain": [(0, 0), (0, deep), (wide, deep), (wide, 0)],
        "round": [(0, 0), (0, 0.5 * deep), *((wide * (0.5 - 0.5 * np.cos(t)), deep * (0.5 + 0.5 * np.sin(t))) for t in np.linspace(0.3, np.pi - 0.3, 7)), (wide, 0)],
        "step": [(0, 0), (0, deep), (0.35 * wide, deep), (0.4 * wide, 0.7 * deep), (0.85 * wide, 0.55 * deep), (0.9 * wide, 0.4 * deep), (wide, 0.4 * deep), (wide, 0)],
        "cove": [(0, 0), (0, 0.6 * deep), (0.15 * wide, deep), (0.3 * wide, deep), (0.5 * wide, 0.62 * deep), (0.75 * wide, 0.45 * deep), (wide, 0.42 * deep), (wide, 0)],
    }[style]  # fmt: skip
    shop.add(finish, pieces.moulding(width, height, profile), crease=28.0)


def _frame_finish(shop: Workshop) -> Finish:
    if chance(shop, 0.25):
        return m.plain("metal gold leaf", (0.72, 0.55, 0.25), 0.35, 0.9)
    return pick(shop, (m.wood, m.wood, m.paint, m.black, m.metal))(shop)


def picture(shop: Workshop) -> None:
    """Make a framed picture, a canvas or a poster."""
    kind = pick(shop, ("picture_abstract", "picture_scenic", "picture_scenic", "picture_poster"))
    ratio = pick(shop, (1.0, 0.7, 1.4, 0.75, 1.5, 0.62, 1.9))
    area = between(shop, 0.05, 0.7)
    width, height = float(np.sqrt(area * ratio)), float(np.sqrt(area / ratio))
    image = m.picture(shop, kind)
    style = pick(shop, ("mat", "full", "canvas"), (0.45, 0.35, 0.2))
    if style == "canvas":
        _print(shop, image, width, height, 0.001, 0.03)
        return
    wide, deep = between(shop, 0.012, 0.06), between(shop, 0.015, 0.035)
    _frame(shop, _frame_finish(shop), width, height, wide, deep)
    inner = (width - 1.9 * wide, height - 1.9 * wide)
    if style == "mat" and min(inner) > 0.2:
        mat = m.plain("paper", (0.95, 0.94, 0.91), 0.9)
        shop.box(
            mat, (-inner[0] / 2, 0.001, -inner[1] / 2), (inner[0] / 2, 0.008, inner[1] / 2), 0.0005
        )
        margin = between(shop, 0.12, 0.22) * min(inner)
        _print(shop, image, inner[0] - 2 * margin, inner[1] - 2 * margin, 0.001, 0.0095)
    else:
        _print(shop, image, *inner, 0.001, 0.009)


def _print(
    shop: Workshop, image: Finish, width: Number, height: Number, back: Number, face: Number
):
    """Add the picture, cropped in the middle to the shape of the sheet."""
    sheet = pieces.sheet((-width / 2, back, -height / 2), (width / 2, face, height / 2))
    share = np.array([min(1.0, width / height), min(1.0, height / width)])
    if image.material.name.startswith("picture"):
        sheet = sheet._replace(uv=0.5 + (sheet.uv - 0.5) * share)
    shop.add(image, sheet)


def mirror(shop: Workshop) -> None:
    """Make a wall mirror: framed, round, oval, frameless or arched."""
    style = pick(shop, ("frame", "frame", "round", "oval", "bare", "arch"))
    glass, rim = m.mirror(), _frame_finish(shop)
    width, height = between(shop, 0.4, 0.9), between(shop, 0.6, 1.4)
    if style == "frame":
        wide = between(shop, 0.015, 0.09)
        _frame(shop, rim, width, height, wide, between(shop, 0.018, 0.035))
        inner = (width / 2 - 0.9 * wide, height / 2 - 0.9 * wide)
        shop.box(glass, (-inner[0], 0.001, -inner[1]), (inner[0], 0.008, inner[1]), 0.0005)
        return
    if style == "bare":
        shop.box(
            m.black(shop),
            (-width / 2 + 0.03, 0, -height / 2 + 0.03),
            (width / 2 - 0.03, 0.015, height / 2 - 0.03),
        )
        shop.box(glass, (-width / 2, 0.015, -height / 2), (width / 2, 0.021, height / 2), 0.003)
        return
    t = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    height = width if style == "round" else height
    outline = 0.5 * np.stack([width * np.cos(t), height * np.sin(t)], axis=1)
    if style == "arch":
        height = max(height, 1.3 * width)
        t = np.linspace(0, np.pi, 33)
        bow = 0.5 * width * np.stack([np.cos(t), np.sin(t)], 1) + (0, (height - width) / 2)
        foot = [(-width / 2, -height / 2), (width / 2, -height / 2)]
        outline = np.concatenate([bow, foot])
    _outline_mirror(shop, glass, rim, outline, between(shop, 0.008, 0.035))


def _outline_mirror(shop: Workshop, glass: Finish, rim: Finish, outline, wide: Number) -> None:
    """Add a mirror of any convex shape in the x-z plane with a rim."""
    inner = outline * (1 - wide / np.abs(outline).max())
    rings = [(outline, 0.0), (outline, 0.022), (inner, 0.022), (inner, 0.0)]
    placed = [np.column_stack([o[:, 0], np.full(len(o), y), o[:, 1]]) for o, y in rings]
    shop.add(rim, pieces.loft(np.stack(placed), joined=True))
    plate = [
        np.column_stack([1.001 * inner[:, 0], np.full(len(inner), y), 1.001 * inner[:, 1]])
        for y in (0.002, 0.01)
    ]
    shop.add(glass, pieces.loft(np.stack(plate)))


def _hand(shop: Workshop, finish: Finish, y: Number, angle: Number, length: Number, width: Number):
    piece = pieces.box((-width / 2, 0, -0.2 * length), (width / 2, 0.002, length), 0.0003)
    shop.add(finish, pieces.turn(piece, "y", -angle), (0, y, 0))


def clock_face(shop: Workshop, radius: Number, y: Number, square: bool = False) -> None:
    """Add a dial with hands around the origin of the x-z plane, its back at ``y``."""
    dial = m.textured(shop, "clock_dial", "dial", whole=True)
    if square:
        shop.add(dial, pieces.sheet((-radius, y, -radius), (radius, y + 0.004, radius)))
    else:
        t = np.linspace(0, 2 * np.pi, 48, endpoint=False)
        disc = pieces.prism(radius * np.stack([np.cos(t), np.sin(t)], 1), 0.0, 0.004)
        disc = pieces.turn(disc, "x", -np.pi / 2)
        uv = 0.5 + 0.5 * np.stack([-disc.vertices[:, 0], disc.vertices[:, 2]], 1) / radius
        shop.add(dial, disc._replace(uv=uv), (0, y, 0))
    light = m.mean_colour(dial).mean() > 0.4
    hands = m.plain("hands", (0.05, 0.05, 0.05) if light else (0.9, 0.9, 0.88), 0.4)
    # the time runs clockwise for someone who looks at the dial, along -y
    time = between(shop, 0.0, 2 * np.pi)
    _hand(shop, hands, y + 0.005, -time, 0.52 * radius, 0.05 * radius)
    _hand(shop, hands, y + 0.008, -(time * 12) % (2 * np.pi), 0.8 * radius, 0.032 * radius)
    shop.wheel(hands, (0, y + 0.004, 0), 0.045 * radius, 0.008)


def wall_clock(shop: Workshop) -> None:
    """Make a wall clock: round, square, with a sunburst, or with a pendulum."""
    style, radius = (
        pick(shop, ("round", "round", "square", "sun", "pendulum")),
        between(shop, 0.1, 0.22),
    )
    rim = _frame_finish(shop)
    if style in ("square", "pendulum"):
        _frame(shop, rim, 2.3 * radius, 2.3 * radius, 0.16 * radius, 0.045)
        shop.box(rim, (-1.05 * radius, 0, -1.05 * radius), (1.05 * radius, 0.02, 1.05 * radius))
        clock_face(shop, 1.0 * radius, 0.02, True)
        if style == "pendulum":
            shop.box(rim, (-0.7 * radius, 0, -3.4 * radius), (0.7 * radius, 0.02, -1.1 * radius))
            _pendulum(shop, 0.028, -1.1 * radius, -2.9 * radius, 0.3 * radius)
        return
    ring = [
        (0.98 * radius, 0.0),
        (1.12 * radius, 0.0),
        (1.12 * radius, 0.03),
        (1.06 * radius, 0.04),
        (0.98 * radius, 0.032),
    ]
    piece = pieces.loft(np.stack([pieces.circle(r, z, 48) for r, z in ring]), joined=True)
    shop.add(rim, pieces.turn(piece, "x", -np.pi / 2))
    shop.wheel(rim, (0, 0, 0), 1.0 * radius, 0.018)
    clock_face(shop, 0.99 * radius, 0.018)
    if style == "sun":
        for k in range(24):
            t = 2 * np.pi * k / 24
            reach = radius * (1.9 if k % 2 else 1.55)
            a = (1.1 * radius * np.cos(t), 0.015, 1.1 * radius * np.sin(t))
            shop.rod(rim, a, (reach * np.cos(t), 0.015, reach * np.sin(t)), 0.008, 0.003)


def _pendulum(shop: Workshop, y: Number, top: Number, bottom: Number, radius: Number) -> None:
    brass = m.plain("metal brass", (0.78, 0.6, 0.3), 0.2, 1.0)
    shop.rod(brass, (0, y, top), (0, y, bottom), 0.004)
    shop.wheel(brass, (0, y - 0.005, bottom), radius, 0.012)


def grandfather_clock(shop: Workshop) -> None:
    """Make a longcase clock: plinth, narrow case with pendulum, hood with dial."""
    case, width = m.wood(shop), between(shop, 0.38, 0.52)
    depth, height = between(shop, 0.22, 0.3), between(shop, 1.7, 2.2)
    y, waist, foot, hood = (
        depth / 2,
        0.72 * width,
        between(shop, 0.3, 0.42),
        height - between(shop, 0.5, 0.58),
    )
    shop.box(case, (-width / 2 - 0.02, -y, 0), (width / 2 + 0.02, y + 0.02, 0.09), 0.008)
    shop.box(case, (-width / 2, -y, 0.09), (width / 2, y, foot), 0.004)
    front(
        shop, case, "raised", (-width / 2 + 0.04, width / 2 - 0.04), (0.12, foot - 0.03), y, 0.014
    )
    shop.box(case, (-width / 2 - 0.01, -y, foot), (width / 2 + 0.01, y + 0.01, foot + 0.035), 0.01)
    low, high = foot + 0.035, hood
    for a in (-waist / 2, waist / 2 - 0.03):
        shop.box(case, (a, -y, low), (a + 0.03, y - 0.03, high))
    shop.box(case, (-waist / 2, -y, low), (waist / 2, -y + 0.02, high))
    middle = (low + high) / 2
    glass_door = pieces.moulding(
        waist, high - low, [(0, 0), (0, 0.022), (0.05, 0.022), (0.056, 0.012), (0.056, 0)]
    )
    shop.add(case, glass_door, (0, y - 0.032, middle), crease=30.0)
    shop.box(
        m.glass(shop, 0.15),
        (-waist / 2 + 0.05, y - 0.026, low + 0.05),
        (waist / 2 - 0.05, y - 0.022, high - 0.05),
        0.0005,
    )
    _pendulum(shop, 0.0, high, low + 0.25, 0.065)
    brass = m.plain("metal brass", (0.78, 0.6, 0.3), 0.2, 1.0)
    for x in (-0.07, 0.07):
        shop.disc(brass, (x, -0.03, low + between(shop, 0.2, 0.5)), 0.022, 0.14)
        shop.rod(brass, (x, -0.03, low + 0.3), (x, -0.03, high), 0.0015)
    _hood(shop, case, width, y, hood, height)


def _hood(
    shop: Workshop, case: Finish, width: Number, y: Number, hood: Number, height: Number
) -> None:
    """Add the head of a longcase clock with its dial and crown."""
    square = hood + width + 0.04
    shop.box(case, (-width / 2 - 0.015, -y, hood), (width / 2 + 0.015, y + 0.02, hood + 0.03), 0.01)
    shop.box(case, (-width / 2, -y, hood + 0.03), (width / 2, y - 0.015, square), 0.003)
    frame = pieces.moulding(
        width, square - hood - 0.03, [(0, 0), (0, 0.03), (0.04, 0.03), (0.05, 0.015), (0.05, 0)]
    )
    middle = (hood + 0.03 + square) / 2
    shop.add(case, frame, (0, y - 0.016, middle), crease=30.0)
    shop.shift_all((0, 0, -middle))
    clock_face(shop, width / 2 - 0.05, y - 0.014, chance(shop, 0.5))
    shop.shift_all((0, 0, middle))
    shop.box(
        case, (-width / 2 - 0.025, -y, square), (width / 2 + 0.025, y + 0.025, square + 0.035), 0.01
    )
    style, rest = pick(shop, ("flat", "arch", "gable", "horns")), max(height - square - 0.035, 0.05)
    if style in ("arch", "gable"):
        t = np.linspace(0, np.pi, 17 if style == "arch" else 3)
        outline = np.stack([0.5 * width * np.cos(t), rest * np.sin(t)], 1)
        piece = pieces.turn(pieces.prism(outline, 0.0, 2 * y), "x", np.pi / 2)
        shop.add(case, piece, (0, y, square + 0.035), crease=30.0)
    elif style == "horns":
        for s in (-1, 1):
            path = pieces.curve(
                [
                    (s * 0.5 * width, y - 0.03, square + 0.04),
                    (s * 0.3 * width, y - 0.03, square + 0.09),
                    (s * 0.1 * width, y - 0.03, square + 0.5 * rest + 0.09),
                ],
                12,
            )
            shop.pipe(case, path, 0.022)
        shop.add(case, pieces.superellipsoid((0.06, 0.06, 0.09)), (0, y - 0.03, square + 0.08))


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
    for k, (a, b) in enumerate(zip(inner[:-1], inner[1:], strict=True)):
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
        for a, b in zip(edges[:-1], edges[1:], strict=True):
            shop.box(coat, (a, back_y, 0.006), (b, front_y, height), 0.004 if count > 1 else 0.002)
    else:
        pane = m.glass(shop, 0.3) if style in ("glazed", "lights") else coat
        low = 0.5 if style == "glazed" and chance(shop, 0.5) else 0.12
        _leaf(shop, coat, pane, x, (0.006, low), (back_y, front_y), height, rows, columns)
    grip, side = m.metal(shop), pick(shop, (-1, 1))
    for face, s in ((front_y, 1), (back_y, -1)):
        p = side * (x - 0.06)
        shop.box(grip, (p - 0.018, face, 0.94), (p + 0.018, face + s * 0.007, 1.12), 0.002)
        shop.rod(grip, (p, face, 1.05), (p, face + s * 0.05, 1.05), 0.009)
        shop.rod(
            grip, (p, face + s * 0.045, 1.05), (p - side * 0.12, face + s * 0.045, 1.05), 0.009
        )


def _leaf(shop, coat, pane, x, low, y, height, rows, columns) -> None:
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


def heater(shop: Workshop) -> None:
    """Make a radiator: panel, columns or tubes."""
    style, width = pick(shop, ("panel", "columns", "tubes")), between(shop, 0.5, 1.4)
    coat = m.plain("paint white", (0.93, 0.93, 0.92), 0.35) if chance(shop, 0.75) else m.paint(shop)
    height = between(shop, 0.45, 0.75)
    if style == "panel":
        deep = between(shop, 0.06, 0.12)
        shop.box(coat, (-width / 2, 0.02, 0), (width / 2, 0.02 + deep, height), 0.008)
        for x in np.arange(-width / 2 + 0.03, width / 2 - 0.02, 0.034) if chance(shop, 0.7) else ():
            shop.box(
                coat,
                (x - 0.009, 0.018 + deep, 0.04),
                (x + 0.009, 0.03 + deep, height - 0.04),
                0.004,
            )
        slot = m.plain("slot", (0.25, 0.25, 0.25), 0.8)
        for x in np.arange(-width / 2 + 0.03, width / 2 - 0.02, 0.03):
            shop.box(
                slot, (x, 0.03, height - 0.002), (x + 0.018, 0.01 + deep, height + 0.001), 0.0003
            )
    elif style == "columns":
        deep = between(shop, 0.1, 0.15)
        for x in np.arange(-width / 2 + 0.03, width / 2, 0.06):
            for y in (0.035, 0.02 + deep - 0.015):
                shop.rod(coat, (x, y, 0.03), (x, y, height - 0.03), 0.017)
            for z in (0.03, height - 0.03):
                shop.box(
                    coat, (x - 0.028, 0.012, z - 0.03), (x + 0.028, 0.028 + deep, z + 0.03), 0.015
                )
    else:
        for x in (-width / 2, width / 2):
            shop.box(coat, (x - 0.02, 0.03, 0), (x + 0.02, 0.07, height))
        for z in np.arange(0.03, height, 0.055):
            shop.rod(coat, (-width / 2, 0.075, z), (width / 2, 0.075, z), 0.016)
    for x in (-0.35, 0.35):
        shop.box(coat, (x * width - 0.015, 0, 0.1), (x * width + 0.015, 0.035, height - 0.1))
    valve = m.plastic(shop, (0.9, 0.9, 0.89))
    shop.rod(coat, (width / 2 - 0.01, 0.06, 0.06), (width / 2 + 0.04, 0.06, 0.06), 0.01)
    shop.rod(valve, (width / 2 + 0.035, 0.06, 0.06), (width / 2 + 0.1, 0.06, 0.06), 0.022)


def towel_rack(shop: Workshop) -> None:
    """Make towel rails on the wall, a ladder, or a ring, with or without towels."""
    style, metal = pick(shop, ("rails", "rails", "ladder", "ring", "shelf")), m.metal(shop)
    width, cloth = between(shop, 0.4, 0.75), None
    if style == "ring":
        width = between(shop, 0.16, 0.22)
        shop.wheel(metal, (0, 0, 0), 0.028, 0.012)
        shop.rod(metal, (0, 0, 0), (0, 0.05, 0), 0.009)
        ring = pieces.turn(
            pieces.tube(pieces.circle(width / 2, 0, 40), 0.006, 10, True), "x", np.pi / 2
        )
        shop.add(metal, ring, (0, 0.05, -width / 2), crease=60.0)
        _towel(shop, 0.9 * width, 0.05, -width, between(shop, 0.3, 0.45))
        return
    count = {
        "rails": int(shop.rng.integers(1, 4)),
        "ladder": int(shop.rng.integers(6, 11)),
        "shelf": 5,
    }[style]
    bars = []
    for k in range(count):
        bar = (
            0.06 + (0.075 * k if style != "ladder" else 0.0),
            0.0 - (0.1 * k if style == "ladder" else 0.06 * k * (style == "rails")),
        )
        bar = (0.04 + 0.045 * k, 0.0) if style == "shelf" else bar
        bars.append(bar)
        shop.rod(metal, (-width / 2, bar[0], bar[1]), (width / 2, bar[0], bar[1]), 0.0085)
    for s in (-1, 1):
        x = s * width / 2
        if style == "ladder":
            shop.rod(metal, (x, 0.06, 0.05), (x, 0.06, bars[-1][1] - 0.05), 0.014)
            for z in (0.0, bars[-1][1]):
                shop.rod(metal, (x, 0, z), (x, 0.06, z), 0.009)
        else:
            shop.wheel(metal, (x, 0, 0), 0.026, 0.012)
            shop.rod(metal, (x, 0, 0), (x, bars[-1][0], bars[-1][1]), 0.01)
    if chance(shop, 0.65):
        y, z = bars[-1 if style != "ladder" else 1]
        cloth = min(0.8 * width, between(shop, 0.25, 0.5))
        _towel(shop, cloth, y, z, between(shop, 0.3, 0.6))


def _towel(shop: Workshop, width: Number, y: Number, z: Number, drop: Number) -> None:
    """Add a towel folded over a rail at (y, z)."""
    cloth = m.fabric(shop)
    t, r = np.linspace(0, np.pi, 9), 0.016
    inner, outer = r - 0.006, r + 0.006
    back = 0.75 * drop

    def line(q: Number) -> list[tuple[float, float]]:
        arc = [(y + q * np.cos(a), z + q * np.sin(a)) for a in t]
        return [(y + q, z - drop), *arc, (y - q, z - back)]

    section = np.array([*line(outer), *line(inner)[::-1]])
    count = len(section)
    rings = np.stack(
        [np.column_stack([np.full(count, x), section]) for x in (-width / 2, width / 2)]
    )
    half = count // 2
    strips = []
    for k in range(half - 1):
        strips.append([k, k + 1, count - 2 - k, count - 1 - k])
    lids = np.array([[q[0], q[1], q[2]] for q in strips] + [[q[0], q[2], q[3]] for q in strips])
    side = np.arange(count)
    after = (side + 1) % count
    wall = np.concatenate(
        [
            np.stack([side, after, after + count], 1),
            np.stack([side, after + count, side + count], 1),
        ]
    )
    vertices = rings.reshape(-1, 3)
    faces = np.concatenate([wall, lids[:, ::-1], lids + count])
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(section, axis=0), axis=1))])
    uv = np.column_stack([vertices[:, 0], np.tile(length, 2)])
    shop.add(cloth, pieces.outward(pieces.Piece(vertices, uv, faces)), crease=60.0)
