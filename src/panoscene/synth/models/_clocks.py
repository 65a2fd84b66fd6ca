"""Clocks on walls and floors."""

import numpy as np

from . import _materials as m
from . import _pieces as pieces
from ._parts import between, chance, front, pick
from ._pieces import Number
from ._wall import frame, frame_finish
from ._workshop import Finish, Workshop


def _hand(
    shop: Workshop, finish: Finish, y: Number, angle: Number, length: Number, *, width: Number
):
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
    light = sum(m.mean_colour(dial)) > 1.2
    hands = m.plain("hands", (0.05, 0.05, 0.05) if light else (0.9, 0.9, 0.88), 0.4)
    # the time runs clockwise for someone who looks at the dial, along -y
    time = between(shop, 0.0, 2 * np.pi)
    _hand(shop, hands, y + 0.005, -time, 0.52 * radius, width=0.05 * radius)
    _hand(shop, hands, y + 0.008, -(time * 12) % (2 * np.pi), 0.8 * radius, width=0.032 * radius)
    shop.wheel(hands, (0, y + 0.004, 0), 0.045 * radius, 0.008)


def wall_clock(shop: Workshop) -> None:
    """Make a wall clock: round, square, with a sunburst, or with a pendulum."""
    style, radius = (
        pick(shop, ("round", "round", "square", "sun", "pendulum")),
        between(shop, 0.1, 0.22),
    )
    rim = frame_finish(shop)
    if style in ("square", "pendulum"):
        frame(shop, rim, 2.3 * radius, 2.3 * radius, 0.16 * radius, deep=0.045)
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
        shop,
        case,
        "raised",
        (-width / 2 + 0.04, width / 2 - 0.04),
        (0.12, foot - 0.03),
        y=y,
        thick=0.014,
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
    _hood(shop, case, width, y, hood, height=height)


def _hood(
    shop: Workshop, case: Finish, width: Number, y: Number, hood: Number, *, height: Number
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
