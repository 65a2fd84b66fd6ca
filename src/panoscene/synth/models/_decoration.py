"""Small things without a label: books, bottles, vases, dishes, sockets, skirting."""

import numpy as np

from panoscene.synth.textures import nudge, palette

from . import _materials as m
from . import _pieces as pieces
from ._parts import between, chance, pick
from ._workshop import Finish, Workshop


def _book(shop: Workshop, spines: Finish, paper: Finish, size, cell: int) -> None:
    """Add an upright book, spine to the front, its lower left rear corner at the origin."""
    thick, deep, tall = size
    cover = pieces.box((0, 0, 0), (thick, deep, tall), 0.0015)
    u, v = 1.0 - cover.vertices[:, 0] / thick, cover.vertices[:, 2] / tall
    spine = np.zeros(len(u), bool)
    spine[8:16] = cover.vertices[8:16, 1] > 0.5 * deep
    uv = np.stack(
        [
            (cell + np.where(spine, 0.02 + 0.96 * u, 0.5)) / 16,
            np.where(spine, 0.01 + 0.98 * v, 0.015),
        ],
        1,
    )
    shop.add(spines, cover._replace(uv=uv))
    shop.box(paper, (0.0025, 0.001, 0.004), (thick - 0.0025, deep - 0.006, tall + 0.0006), 0.0003)


def books(shop: Workshop) -> None:
    """Make a row of books, upright or leaning at the end, or a small stack."""
    spines = m.textured(shop, "book_spines", "books", whole=True)
    paper = m.plain("paper", (0.9, 0.87, 0.8), 0.95)
    count, cells = int(shop.rng.integers(4, 17)), shop.rng.permutation(16)
    base = between(shop, 0.19, 0.26)
    place, lying = 0.0, chance(shop, 0.3)
    for k in range(min(count, 6) if lying else count):
        size = (
            between(shop, 0.014, 0.048),
            between(shop, 0.13, 0.18),
            base * between(shop, 0.82, 1.12),
        )
        first = shop.count()
        _book(shop, spines, paper, size, int(cells[k % 16]))
        if lying:
            shop.shift_since(first, (0, -size[1], 0))
            shop.turn_since(first, "y", np.pi / 2)
            shop.shift_since(first, (-size[2] / 2, 0, size[0] + place))
            shop.turn_since(first, "z", between(shop, -0.12, 0.12))
            place += size[0]
            continue
        shop.shift_since(first, (place, -size[1] + between(shop, -0.008, 0.0), 0))
        place += size[0] + 0.001
        if k == count - 1 and chance(shop, 0.5):
            shop.shift_since(first, (-place, 0, 0))
            shop.turn_since(first, "y", -0.18)
            shop.shift_since(first, (place + size[2] * 0.18, 0, 0))
    shop.support = None


def bottles(shop: Workshop) -> None:
    """Make one to four bottles or flasks."""
    tints = (
        (0.12, 0.25, 0.13),
        (0.3, 0.17, 0.06),
        (0.8, 0.88, 0.88),
        (0.15, 0.25, 0.4),
        (0.92, 0.92, 0.9),
    )
    for k in range(int(shop.rng.integers(1, 5))):
        r, h = between(shop, 0.028, 0.042), between(shop, 0.18, 0.32)
        neck, tint = r * between(shop, 0.28, 0.4), nudge(shop.rng, tints[int(shop.rng.integers(5))])
        shoulder = between(shop, 0.5, 0.68)
        profile = [
            (0, 0),
            (r, 0.002),
            (r, shoulder * h),
            (0.8 * r, (shoulder + 0.07) * h),
            (neck, (shoulder + 0.15) * h),
            (neck, h),
            (0, h),
        ]
        at = (0.095 * k, between(shop, -0.03, 0.03), 0.0)
        shop.add(m.plain("bottle", tint, 0.06), pieces.lathe(profile, 24), at, crease=40.0)
        shop.disc(m.metal(shop), (at[0], at[1], 0.93 * h), 1.15 * neck, 0.08 * h)
        label = nudge(shop.rng, palette(shop.rng)[3])
        shop.add(
            m.plain("paper label", label, 0.8),
            pieces.lathe(
                [(0, 0.15 * h), (1.01 * r, 0.15 * h), (1.01 * r, 0.42 * h), (0, 0.42 * h)], 24
            ),
            at,
        )
    shop.has_front = False


def vase(shop: Workshop) -> None:
    """Make a vase, empty or with dry twigs or flowers."""
    r, h = between(shop, 0.05, 0.1), between(shop, 0.16, 0.38)
    shape = pick(
        shop,
        (
            (0.6, 1.0, 0.9, 0.5, 0.6),
            (0.8, 0.9, 1.0, 0.9, 0.55),
            (0.5, 0.6, 0.8, 1.0, 0.9),
            (0.9, 1.0, 0.7, 0.35, 0.4),
        ),
    )
    line = pieces.curve(
        [(0.6 * r, 0, 0), *((q * r, 0, h * (k + 1) / 5) for k, q in enumerate(shape))], 24
    )
    outer = [(float(p[0]), float(p[2])) for p in line]
    inner = [(max(a - 0.005, 0.002), max(z, 0.008)) for a, z in outer[::-1]]
    shop.add(m.glaze(shop), pieces.lathe([(0, 0), *outer, *inner, (0, 0.008)], 36), crease=50.0)
    shop.has_front = False
    if chance(shop, 0.4):
        return
    bloom = m.plain(
        "petal",
        nudge(
            shop.rng,
            pick(
                shop, ((0.85, 0.3, 0.35), (0.95, 0.8, 0.35), (0.95, 0.93, 0.9), (0.6, 0.45, 0.75))
            ),
            2.0,
        ),
        0.8,
    )
    stem = m.plain("stem", pick(shop, ((0.25, 0.4, 0.18), (0.42, 0.32, 0.2))), 0.8)
    for _ in range(int(shop.rng.integers(3, 8))):
        t, lean = between(shop, 0, 2 * np.pi), between(shop, 0.03, 0.13)
        top = (lean * np.cos(t), lean * np.sin(t), h + between(shop, 0.1, 0.28))
        shop.pipe(
            stem,
            pieces.curve([(0, 0, 0.02), (0.15 * top[0], 0.15 * top[1], h), top], 8),
            0.002,
            segments=6,
        )
        size = between(shop, 0.03, 0.06)
        shop.add(bloom, pieces.superellipsoid((size, size, 0.7 * size), steps=8), top, crease=70.0)


def dishes(shop: Workshop) -> None:
    """Make plates, a bowl of fruit, or cups."""
    style, china = (
        pick(shop, ("plates", "fruit", "cups", "setting")),
        m.glaze(shop) if chance(shop, 0.5) else m.ceramic(shop),
    )
    shop.has_front = False
    if style in ("plates", "setting"):
        r = between(shop, 0.1, 0.14)
        plate = [(0, 0), (0.6 * r, 0), (r, 0.018), (r, 0.021), (0.62 * r, 0.005), (0, 0.005)]
        for k in range(int(shop.rng.integers(2, 7)) if style == "plates" else 1):
            shop.add(china, pieces.lathe(plate, 36), (0, 0, 0.008 * k), crease=40.0)
        if style == "setting":
            steel = m.plain("metal chrome", (0.82, 0.83, 0.84), 0.12, 1.0)
            for x in (-r - 0.03, r + 0.025, r + 0.05):
                shop.box(steel, (x - 0.006, -0.09, 0), (x + 0.006, 0.09, 0.003))
            glass = [(0, 0), (0.03, 0), (0.034, 0.1), (0.032, 0.1), (0.027, 0.006), (0, 0.006)]
            shop.add(m.glass(shop, 0.25), pieces.lathe(glass, 24), (-r - 0.02, -r - 0.01, 0))
        return
    if style == "fruit":
        r = between(shop, 0.11, 0.15)
        bowl = [
            (0, 0),
            (0.45 * r, 0),
            (0.85 * r, 0.035),
            (r, 0.075),
            (0.97 * r, 0.077),
            (0.8 * r, 0.04),
            (0.4 * r, 0.008),
            (0, 0.008),
        ]
        shop.add(china, pieces.lathe(bowl, 36), crease=50.0)
        tones = ((0.75, 0.15, 0.1), (0.9, 0.55, 0.1), (0.5, 0.65, 0.15), (0.95, 0.82, 0.25))
        for k in range(6):
            t, size = k * 1.05, between(shop, 0.065, 0.08)
            d = 0.5 * r if k < 5 else 0.0
            at = (d * np.cos(t), d * np.sin(t), 0.055 if k < 5 else 0.1)
            tone = nudge(shop.rng, tones[int(shop.rng.integers(4))], 1.5)
            shop.add(
                m.plain("fruit", tone, 0.4),
                pieces.superellipsoid((size, size, 0.92 * size), steps=10),
                at,
                crease=70.0,
            )
        return
    size, high = between(shop, 0.85, 1.1), between(shop, 0.8, 1.2)
    for k in range(int(shop.rng.integers(1, 5))):
        at = (0.115 * (k % 2), 0.12 * (k // 2), 0.0)
        shape = [(0, 0), (0.028, 0), (0.038, 0.04), (0.04, 0.085)]
        shape += [(0.037, 0.085), (0.034, 0.04), (0.024, 0.006), (0, 0.006)]
        cup = [(r * size, z * high) for r, z in shape]
        shop.add(china, pieces.lathe(cup, 28), at, crease=50.0)
        t = np.linspace(-np.pi / 2, np.pi / 2, 10)
        x, z = 0.037 * size + 0.022 * np.cos(t), high * (0.045 + 0.024 * np.sin(t))
        ear = np.stack([at[0] + x, np.full(10, at[1]), z], 1)
        shop.pipe(china, ear, 0.0045, segments=8)


def small_box(shop: Workshop) -> None:
    """Make a cardboard, cloth or tin box, or a stack of two."""
    z = 0.0
    for _ in range(pick(shop, (1, 1, 2))):
        w, d, h = between(shop, 0.16, 0.36), between(shop, 0.14, 0.28), between(shop, 0.09, 0.2)
        side = pick(shop, (m.fabric, m.paint, m.wood))(shop)
        side = (
            m.plain("cardboard", nudge(shop.rng, (0.68, 0.52, 0.35)), 0.9)
            if chance(shop, 0.35)
            else side
        )
        shop.box(side, (-w / 2, -d / 2, z), (w / 2, d / 2, z + h - 0.02), 0.003)
        shop.box(
            side,
            (-w / 2 - 0.004, -d / 2 - 0.004, z + h - 0.045),
            (w / 2 + 0.004, d / 2 + 0.004, z + h),
            0.003,
        )
        if chance(shop, 0.5):
            shop.box(
                m.metal(shop),
                (-0.035, d / 2, z + 0.3 * h),
                (0.035, d / 2 + 0.007, z + 0.52 * h),
                0.002,
            )
        z += h
    shop.support = z


def towels(shop: Workshop) -> None:
    """Make a stack of folded towels."""
    z = 0.0
    for _ in range(int(shop.rng.integers(2, 5))):
        h = between(shop, 0.045, 0.065)
        w, d = between(shop, 0.28, 0.33), between(shop, 0.2, 0.24)
        shop.soft(
            m.textured(shop, "fabric_velvet", "fabric"),
            (-w / 2, -d / 2, z),
            (w / 2, d / 2, z + h),
            0.45 * h,
            (0, 0, 0.003),
        )
        z += h - 0.003


def candles(shop: Workshop) -> None:
    """Make candles on a plate or on sticks."""
    shop.has_front = False
    wax, stick = m.plain("wax", nudge(shop.rng, (0.93, 0.9, 0.82), 1.5), 0.6), m.metal(shop)
    tall = chance(shop, 0.5)
    for k in range(int(shop.rng.integers(1, 4))):
        at, r = (
            (0.09 * k, between(shop, -0.02, 0.02), 0.0),
            0.011 if tall else between(shop, 0.025, 0.04),
        )
        low = between(shop, 0.08, 0.2) if tall else 0.01
        foot = [
            (0, 0),
            (0.04, 0),
            (0.036, 0.008),
            (0.007, 0.014),
            (0.007, low - 0.01),
            (0.017, low),
            (0, low),
        ]
        shop.add(
            stick,
            pieces.lathe(
                foot if tall else [(0, 0), (1.25 * r, 0), (1.25 * r, 0.01), (0, 0.01)], 24
            ),
            at,
        )
        high = low + between(shop, 0.06, 0.2)
        shop.disc(wax, (at[0], at[1], low), r, high - low)
        shop.rod(m.black(shop), (at[0], at[1], high), (at[0], at[1], high + 0.01), 0.0012)


def socket(shop: Workshop) -> None:
    """Make a wall socket with one to three places."""
    plate = m.plain("plastic white", nudge(shop.rng, (0.93, 0.93, 0.92), 0.2), 0.35)
    count, hole = int(shop.rng.integers(1, 4)), m.plain("plastic grey", (0.78, 0.78, 0.77), 0.5)
    side, thick, well = between(shop, 0.076, 0.088), between(shop, 0.006, 0.011), 0.0208
    square, upright = chance(shop, 0.3), chance(shop, 0.2)
    for k in range(count):
        first = shop.count()
        shop.box(plate, (-0.0355, 0, -side / 2), (0.0355, thick, side / 2), 0.003)
        rim = between(shop, 0.025, 0.028)
        if square:
            frame = [(0, 0), (0, 0.004), (rim - well * 0.8, 0.004), (rim - well * 0.8, 0)]
            shop.add(plate, pieces.moulding(2 * rim, 2 * rim, frame), (0, thick, 0))
        ring = [(0.0, 0.0), (rim, 0.0), (rim, 0.004), (well, 0.004), (well, 0.0015), (0, 0.0015)]
        shop.add(plate, pieces.turn(pieces.lathe(ring, 28), "x", -np.pi / 2), (0, thick, 0))
        shop.wheel(hole, (0, thick + 0.0005, 0), well, 0.0014)
        for s in (-1, 1):
            shop.wheel(m.black(shop), (0.0095 * s, thick + 0.001, 0), 0.0025, 0.0014)
        shop.shift_since(first, (0, 0, -0.071 * k) if upright else (0.071 * k, 0, 0))


def switch(shop: Workshop) -> None:
    """Make a light switch with one to three rockers, or a round dimmer."""
    plate = m.plain("plastic white", nudge(shop.rng, (0.93, 0.93, 0.92), 0.2), 0.35)
    if chance(shop, 0.2):
        plate = m.metal(shop)
    half, thick, inner = between(shop, 0.038, 0.045), between(shop, 0.006, 0.01), 0.029
    for k in range(int(shop.rng.integers(1, 4))):
        z = -0.071 * k
        shop.box(plate, (-half, 0, z - 0.0405), (half, thick, z + 0.0405), 0.003)
        if chance(shop, 0.15):
            shop.wheel(plate, (0, thick - 0.001, z), 0.02, 0.018)
            continue
        first = shop.count()
        shop.box(plate, (-inner, -0.002, -inner), (inner, 0.004, inner), 0.002)
        shop.turn_since(first, "x", pick(shop, (-1, 1)) * between(shop, 0.05, 0.09))
        shop.shift_since(first, (0, thick + 0.0005, z))


def skirting(shop: Workshop) -> None:
    """Make a metre of skirting board; it is meant to be stretched along the wall."""
    height, deep = between(shop, 0.05, 0.14), between(shop, 0.012, 0.02)
    coat = (
        m.plain("paint white", nudge(shop.rng, (0.93, 0.93, 0.92), 0.3), 0.4)
        if chance(shop, 0.65)
        else m.wood(shop)
    )
    shapes = (
        [(0, 0), (1, 0), (1, 0.94), (0.85, 1), (0, 1)],
        [(0, 0), (1, 0), (1, 0.72), (0.8, 0.8), (0.55, 0.84), (0.4, 0.95), (0.3, 1), (0, 1)],
        [(0, 0), (1, 0), (1, 0.8), (0.9, 0.9), (0.6, 0.97), (0.2, 1), (0, 1)],
    )
    shape = np.array(shapes[int(shop.rng.integers(3))]) * (deep, height)
    rings = [np.column_stack([np.full(len(shape), x), shape]) for x in (-0.5, 0.5)]
    shop.add(coat, pieces.loft(np.stack(rings)), crease=30.0)


def toys(shop: Workshop) -> None:
    """Make a teddy bear, or building blocks and a ball, for a child's room."""
    shop.has_front = chance(shop, 0.4)
    if shop.has_front:
        _bear(shop, between(shop, 0.75, 1.3), between(shop, 0.9, 1.15))
        return
    colours = ((0.85, 0.2, 0.2), (0.2, 0.45, 0.8), (0.95, 0.8, 0.2), (0.25, 0.65, 0.35))
    for k in range(int(shop.rng.integers(5, 12))):
        tone, e = nudge(shop.rng, colours[int(shop.rng.integers(4))]), between(shop, 0.04, 0.06)
        first = shop.count()
        shop.box(m.plain("paint toy", tone, 0.35), (-e / 2, -e / 2, 0), (e / 2, e / 2, e), 0.003)
        shop.turn_since(first, "z", between(shop, -0.5, 0.5))
        shop.shift_since(first, (0.075 * (k % 3), 0.075 * (k // 3 % 2), 0.06 * (k // 6)))
    r = between(shop, 0.06, 0.12)
    ball = m.plain("plastic ball", nudge(shop.rng, colours[int(shop.rng.integers(4))], 3.0), 0.3)
    shop.add(ball, pieces.superellipsoid((2 * r, 2 * r, 2 * r)), (-r - 0.06, 0.03, r), crease=70.0)


def _bear(shop: Workshop, size: float, plump: float) -> None:
    """Add a sitting teddy bear."""
    fur = m.plain("fabric plush", nudge(shop.rng, (0.55, 0.38, 0.22), 3.0), 0.98)
    light = m.plain("fabric plush", nudge(shop.rng, (0.75, 0.6, 0.42), 2.0), 0.98)
    dark = m.black(shop)
    single = [
        (fur, (0.2, 0.16, 0.22), (0, 0, 0.12)),
        (fur, (0.16, 0.14, 0.14), (0, 0.01, 0.29)),
        (light, (0.06, 0.08, 0.055), (0, 0.07, 0.275)),
        (dark, (0.024, 0.02, 0.016), (0, 0.108, 0.285)),
    ]
    double = [
        (fur, (0.055, 0.03, 0.055), (0.06, 0, 0.355)),
        (fur, (0.07, 0.18, 0.08), (0.075, 0.12, 0.045)),
        (light, (0.055, 0.012, 0.06), (0.075, 0.208, 0.045)),
        (fur, (0.06, 0.08, 0.15), (0.115, 0.04, 0.15)),
        (dark, (0.014, 0.012, 0.014), (0.032, 0.078, 0.31)),
    ]
    mirrored = [(f, d, (-x, y, z)) for f, d, (x, y, z) in double]
    for finish, (w, d, h), (x, y, z) in (*single, *double, *mirrored):
        extent = (w * size * plump, d * size * plump, h * size)
        at = (x * size * plump, y * size, z * size)
        shop.add(finish, pieces.superellipsoid(extent, steps=12), at, crease=70.0)
