"""Pool tables, treadmills, guitars, pianos."""

import itertools

import numpy as np

from panoscene.synth.textures import palette

from . import _materials as m
from . import _pieces as pieces
from ._parts import between, chance, corners, legs, pick
from ._pieces import Number
from ._workshop import Finish, Workshop


def pool_table(shop: Workshop) -> None:
    """Make a pool table with cushions, six pockets, legs, and often balls and a cue."""
    width = between(shop, 1.9, 2.7)
    depth, height = 0.56 * width, between(shop, 0.78, 0.84)
    timber, cloth = m.wood(shop), m.textured(shop, "felt", "felt")
    x, y, rail = width / 2, depth / 2, 0.12
    shop.box(
        timber, (-x + 0.03, -y + 0.03, height - 0.22), (x - 0.03, y - 0.03, height - 0.06), 0.006
    )
    shop.box(
        cloth, (-x + rail, -y + rail, height - 0.07), (x - rail, y - rail, height - 0.04), 0.002
    )
    frame = [(0, -0.09), (0, -0.01), (0.012, 0), (rail - 0.04, 0), (rail - 0.04, -0.09)]
    cushion = [
        (rail - 0.045, -0.06),
        (rail - 0.045, 0.0),
        (rail + 0.005, -0.004),
        (rail - 0.008, -0.06),
    ]
    for profile, finish in ((frame, timber), (cushion, cloth)):
        ring = pieces.moulding(width, depth, profile)
        shop.add(finish, pieces.turn(ring, "x", np.pi / 2), (0, 0, height), crease=30.0)
    dark = m.black(shop)
    for px in (-1, 0, 1):
        for py in (-1, 1):
            c = (px * (x - 0.085), py * (y - 0.085 + (0.02 if px == 0 else 0)), height - 0.11)
            shop.disc(dark, c, 0.062, 0.115)
    style = pick(shop, ("square", "turned", "square"))
    spots = corners(width, depth, 0.2)
    if chance(shop, 0.5):
        spots += [(0.0, -y + 0.2), (0.0, y - 0.2)]
    legs(shop, timber, style, spots, height - 0.2, thick=between(shop, 0.11, 0.16))
    _balls(shop, x, y, rail, height)
    shop.support = height - 0.04
    shop.has_front = False


def _balls(shop: Workshop, x: Number, y: Number, rail: Number, height: Number) -> None:
    tones = (
        (0.95, 0.94, 0.9),
        (0.9, 0.75, 0.1),
        (0.1, 0.2, 0.6),
        (0.75, 0.1, 0.1),
        (0.05, 0.05, 0.05),
        (0.1, 0.45, 0.2),
    )
    for tone in tones[: int(shop.rng.integers(0, 7))]:
        place = (
            between(shop, -0.8, 0.8) * (x - rail),
            between(shop, -0.8, 0.8) * (y - rail),
            height - 0.04 + 0.028,
        )
        shop.add(
            m.plain("ball", tone, 0.1),
            pieces.superellipsoid((0.056, 0.056, 0.056), steps=10),
            place,
            crease=70,
        )
    if chance(shop, 0.6):
        z = height + 0.012
        a, b = (-0.6 * x, -0.3 * y, z), (-0.6 * x + 1.2, 0.3 * y, z)
        shop.rod(m.wood(shop), a, b, 0.013, 0.006)


def treadmill(shop: Workshop) -> None:
    """Make a treadmill; the runner faces the console, which is at the back."""
    width, length = between(shop, 0.68, 0.88), between(shop, 1.5, 1.95)
    frame, dark, height = m.metal(shop), m.black(shop), between(shop, 1.2, 1.45)
    y = length / 2
    trim = m.paint(shop)
    shop.box(dark, (-width / 2 + 0.08, -y + 0.25, 0.1), (width / 2 - 0.08, y, 0.15), 0.01)
    shop.box(
        m.rubber(shop),
        (-width / 2 + 0.1, -y + 0.25, 0.13),
        (width / 2 - 0.1, y - 0.03, 0.157),
        0.003,
    )
    for s in (-1, 1):
        x = s * (width / 2 - 0.05)
        shop.box(frame, (x - 0.045, -y + 0.2, 0.08), (x + 0.045, y, 0.175), 0.012)
        shop.rod(dark, (x, y - 0.1, 0.0), (x, y - 0.1, 0.1), 0.03)
        shop.box(dark, (x - 0.04, -y, 0.0), (x + 0.04, -y + 0.3, 0.1), 0.012)
        foot, top = (
            (s * (width / 2 - 0.03), -y + 0.3, 0.1),
            (s * (width / 2 - 0.04), -y + 0.12, height - 0.2),
        )
        shop.pipe(
            frame,
            pieces.curve([foot, ((foot[0] + top[0]) / 2, -y + 0.17, 0.55 * height), top], 12),
            0.03,
        )
        grip = [
            (top[0], top[1], height - 0.22),
            (top[0], top[1] + 0.1, height - 0.18),
            (top[0], top[1] + between(shop, 0.3, 0.5), height - 0.28),
        ]
        shop.pipe(dark, pieces.curve(grip, 12), 0.02)
    shop.soft(
        trim,
        (-width / 2 + 0.03, -y + 0.02, 0.06),
        (width / 2 - 0.03, -y + 0.4, between(shop, 0.22, 0.3)),
        0.04,
    )
    first = shop.count()
    wide = width - 0.02
    shop.soft(dark, (-wide / 2, -0.03, 0), (wide / 2, 0.03, between(shop, 0.22, 0.34)), 0.025)
    shop.add(
        m.screen(shop, 0.5, "screen_film"),
        pieces.sheet((-0.3 * wide, 0.026, 0.08), (0.3 * wide, 0.034, 0.2)),
    )
    for k in range(6):
        shop.wheel(trim, ((k - 2.5) * 0.07, 0.028, 0.045), 0.013, 0.008)
    shop.turn_since(first, "x", 0.5)
    shop.shift_since(first, (0, -y + 0.14, height - 0.24))


def _guitar_outline(width: Number, length: Number, waist: Number, points: int = 72) -> np.ndarray:
    """Return the figure of eight of a body around its middle; the neck is at +z."""
    t = np.linspace(-np.pi / 2, 3 * np.pi / 2, points, endpoint=False)
    z = 0.5 * length * np.sin(t)
    s = np.sin(t)
    half = np.cos(t) * (1.0 - 0.12 * s)
    pinch = 1.0 - waist * np.exp(-(((s - 0.15) / 0.33) ** 2))
    return np.stack([0.5 * width * np.sign(half) * np.abs(half) ** 0.75 * pinch, z], axis=1)


def guitar(shop: Workshop) -> None:
    """Make an acoustic or electric guitar that leans on a stand."""
    electric, whole = chance(shop, 0.4), between(shop, 0.94, 1.04)
    body_l, body_w = (
        (0.42, between(shop, 0.31, 0.34)) if electric else (0.49, between(shop, 0.36, 0.41))
    )
    deep = 0.045 if electric else between(shop, 0.09, 0.12)
    coat = (
        m.plain("paint", palette(shop.rng)[int(shop.rng.integers(5))], 0.15)
        if electric
        else m.wood(shop)
    )
    side = m.wood(shop) if not electric else coat
    outline = _guitar_outline(body_w, body_l, 0.28 if electric else 0.24)
    low, dark = 0.06, m.plain("wood ebony", (0.07, 0.05, 0.045), 0.45)
    middle = low + body_l / 2
    first = shop.count()
    shop.add(
        side,
        pieces.turn(pieces.prism(outline, 0, deep), "x", np.pi / 2),
        (0, 0.999 * deep, middle),
        crease=35.0,
    )
    shop.add(
        coat,
        pieces.turn(pieces.prism(0.99 * outline, 0, 0.004), "x", np.pi / 2),
        (0, deep + 0.003, middle),
        crease=35.0,
    )
    face, top, neck_top = deep + 0.003, low + body_l, whole - 0.17
    hole = low + 0.6 * body_l
    if not electric:
        shop.wheel(dark, (0, face - 0.002, hole), 0.048, 0.003)
        ring = [(0.052, 0), (0.058, 0), (0.058, 0.0015), (0.052, 0.0015)]
        rosette = pieces.loft(np.stack([pieces.circle(r, h, 36) for r, h in ring]), joined=True)
        shop.add(dark, pieces.turn(rosette, "x", -np.pi / 2), (0, face - 0.0005, hole))
    else:
        for z in (0.35, 0.5, 0.62):
            shop.box(
                m.plain("metal chrome", (0.82, 0.83, 0.84), 0.12, 1.0),
                (-0.038, face - 0.002, low + z * body_l - 0.01),
                (0.038, face + 0.008, low + z * body_l + 0.01),
                0.003,
            )
        shop.box(
            m.plastic(shop, (0.92, 0.91, 0.87)),
            (-0.1, face - 0.001, low + 0.2 * body_l),
            (-0.045, face + 0.003, low + 0.6 * body_l),
            0.002,
        )
        for z in (0.16, 0.24):
            shop.wheel(dark, (-0.085, face, low + z * body_l), 0.012, 0.016)
    shop.box(
        dark,
        (-0.075, face - 0.001, low + 0.22 * body_l),
        (0.075, face + 0.01, low + 0.22 * body_l + 0.022),
        0.004,
    )
    shop.box(side, (-0.026, face - 0.022, top - 0.06), (0.026, face, neck_top), 0.006)
    shop.box(dark, (-0.027, face, hole + 0.05), (0.027, face + 0.006, neck_top), 0.002)
    shop.box(side, (-0.038, face - 0.024, neck_top - 0.005), (0.038, face - 0.006, whole), 0.005)
    steel = m.plain("metal chrome", (0.82, 0.83, 0.84), 0.12, 1.0)
    for k in range(6):
        x = (k - 2.5) * 0.0085
        shop.rod(
            steel,
            (x, face + 0.011, low + 0.22 * body_l + 0.01),
            (x, face + 0.008, neck_top),
            0.0007,
        )
        s = -1 if k < 3 else 1
        shop.rod(
            steel,
            (s * 0.036, face - 0.015, neck_top + 0.03 + 0.04 * (k % 3)),
            (s * 0.062, face - 0.015, neck_top + 0.03 + 0.04 * (k % 3)),
            0.007,
        )
    shop.turn_since(first, "x", 0.22)
    shop.shift_since(first, (0, 0, 0.03))
    _guitar_stand(shop, deep)


def _guitar_stand(shop: Workshop, deep: Number) -> None:
    dark = m.black(shop)
    back = -0.14
    shop.rod(dark, (0, back, 0.02), (0, back - 0.02, 0.6), 0.009)
    for s in (-1, 1):
        shop.rod(dark, (0, back, 0.05), (s * 0.19, 0.12, 0.008), 0.009)
        arm = [
            (0, back, 0.12),
            (s * 0.11, back + 0.04, 0.1),
            (s * 0.11, deep + 0.06, 0.085),
            (s * 0.11, deep + 0.07, 0.13),
        ]
        for a, b in itertools.pairwise(arm):
            shop.rod(dark, a, b, 0.008)
    shop.rod(dark, (0, back, 0.05), (0, back - 0.16, 0.008), 0.009)


def piano(shop: Workshop) -> None:
    """Make an upright piano, a grand, or a digital piano; the keys are at the front."""
    style = pick(shop, ("upright", "upright", "grand", "digital"))
    gloss = m.plain("lacquer", (0.02, 0.02, 0.022), 0.08) if chance(shop, 0.55) else m.wood(shop)
    width = between(shop, 1.38, 1.52)
    if style == "grand":
        _grand(shop, gloss, width, between(shop, 1.5, 1.9))
        return
    if style == "digital":
        for s in (-1, 1):
            shop.box(
                gloss,
                (s * (width / 2 - 0.06), -0.16, 0),
                (s * (width / 2 - 0.03), 0.14, 0.64),
                0.004,
            )
        shop.box(gloss, (-width / 2 + 0.04, -0.14, 0.15), (width / 2 - 0.04, -0.12, 0.5))
        shop.box(gloss, (-width / 2, -0.17, 0.62), (width / 2, 0.16, 0.72), 0.006)
        shop.box(gloss, (-width / 2, -0.17, 0.72), (width / 2, -0.02, 0.77), 0.006)
        _keys(shop, width - 0.12, 0.0, 0.155, 0.722)
        shop.box(m.black(shop), (-0.3, -0.165, 0.77), (0.3, -0.155, 0.95), 0.003)
        return
    depth, height, key = between(shop, 0.52, 0.62), between(shop, 1.08, 1.28), 0.7
    back, y = -depth / 2, depth / 2
    shop.box(
        gloss, (-width / 2 + 0.03, back, 0.05), (width / 2 - 0.03, back + 0.3, height - 0.03), 0.003
    )
    for s in (-1, 1):
        shop.box(
            gloss,
            (s * width / 2, back, 0),
            (s * (width / 2 - 0.035), back + 0.34, height - 0.02),
            0.004,
        )
        shop.box(
            gloss,
            (s * width / 2, back + 0.3, key - 0.08),
            (s * (width / 2 - 0.06), y, key + 0.09),
            0.012,
        )
        shop.box(
            gloss,
            (s * (width / 2 - 0.01), y - 0.09, 0),
            (s * (width / 2 - 0.06), y - 0.03, key - 0.08),
            0.004,
        )
        shop.box(gloss, (s * width / 2, back, 0), (s * (width / 2 - 0.07), y - 0.02, 0.05), 0.004)
    shop.box(
        gloss,
        (-width / 2 - 0.012, back - 0.005, height - 0.02),
        (width / 2 + 0.012, back + 0.35, height + 0.005),
        0.006,
    )
    shop.box(gloss, (-width / 2 + 0.06, back + 0.3, key - 0.07), (width / 2 - 0.06, y, key), 0.004)
    _keys(shop, width - 0.14, back + 0.33, y - 0.012, key)
    shop.box(gloss, (-0.34, back + 0.3, key + 0.16), (0.34, back + 0.34, key + 0.18), 0.003)
    brass = m.plain("metal brass", (0.78, 0.6, 0.3), 0.2, 1.0)
    for x in (-0.06, 0, 0.06):
        shop.box(brass, (x - 0.012, back + 0.28, 0.04), (x + 0.012, back + 0.37, 0.052), 0.004)
    shop.support = height + 0.005


def _keys(shop: Workshop, width: Number, back: Number, front: Number, z: Number) -> None:
    """Add 52 white and 36 black keys."""
    ivory, dark = m.plain("ivory", (0.94, 0.93, 0.89), 0.25), m.black(shop)
    edges = np.linspace(-width / 2, width / 2, 53)
    for k in range(52):
        shop.box(
            ivory, (edges[k] + 0.0008, back, z), (edges[k + 1] - 0.0008, front, z + 0.02), 0.0015
        )
        # seen from the front the bass is on the left, at +x
        if (51 - k) % 7 in (0, 2, 3, 5, 6) and k > 0:
            shop.box(
                dark,
                (edges[k] - 0.006, back, z + 0.012),
                (edges[k] + 0.006, back + 0.62 * (front - back), z + 0.031),
                0.002,
            )


def _grand(shop: Workshop, gloss: Finish, width: Number, length: Number) -> None:
    """Add a grand piano: curved case, lid, three legs, keys."""
    top, low, y = 1.0, 0.7, length / 2
    straight, tail = 0.5 * width, -0.5 * width
    # the straight (bass) side is on the left of the player, who looks along -y: at +x
    edge = pieces.curve(
        [
            (tail, y - 0.3, 0),
            (tail, 0.35 * y, 0),
            (0.55 * tail, -0.25 * y, 0),
            (0.1 * tail, -0.75 * y, 0),
            (0.4 * straight, -y, 0),
            (straight, -0.86 * y, 0),
        ],
        30,
    )
    outline = np.concatenate(
        [[[straight, y - 0.3]], edge[:, :2], [[straight, -0.5 * y], [straight, 0.2 * y]]]
    )
    shop.add(gloss, pieces.prism(outline, low, top), crease=35.0)
    shop.box(gloss, (-width / 2, y - 0.31, low), (width / 2, y, low + 0.07), 0.006)
    for s in (-1, 1):
        shop.box(
            gloss,
            (s * width / 2, y - 0.31, low),
            (s * (width / 2 - 0.05), y - 0.01, low + 0.2),
            0.02,
        )
    _keys(shop, width - 0.12, y - 0.2, y - 0.03, low + 0.07)
    shop.box(
        gloss,
        (-width / 2 + 0.04, y - 0.31, low + 0.07),
        (width / 2 - 0.04, y - 0.2, top - 0.03),
        0.006,
    )
    lid = pieces.prism(np.column_stack([1.01 * outline[:, 0], outline[:, 1]]), 0.0, 0.02)
    if chance(shop, 0.6):
        lid = pieces.move(
            pieces.turn(pieces.move(lid, (-straight, 0, 0)), "y", between(shop, 0.4, 0.55)),
            (straight, 0, 0),
        )
        shop.rod(gloss, (0.7 * tail, 0.2 * y, top), (0.55 * tail, 0.2 * y, top + 0.55), 0.009)
    shop.add(gloss, lid, (0, 0, top), crease=35.0)
    if chance(shop, 0.7):
        shop.box(gloss, (-0.33, y - 0.38, top), (0.33, y - 0.36, top + 0.2), 0.003)
    for spot in ((0.42 * width, y - 0.25), (-0.42 * width, y - 0.25), (0.1 * width, -0.6 * y)):
        legs(shop, gloss, "turned", [spot], low, thick=0.1)
    brass = m.plain("metal brass", (0.78, 0.6, 0.3), 0.2, 1.0)
    shop.box(gloss, (-0.1, y - 0.42, 0.1), (0.1, y - 0.36, low), 0.005)
    for x in (-0.06, 0, 0.06):
        shop.box(brass, (x - 0.012, y - 0.4, 0.07), (x + 0.012, y - 0.28, 0.085), 0.004)
