"""Parts that many models share: handles, fronts, legs, feet, knobs."""

import itertools
from collections.abc import Sequence

import numpy as np

from . import _pieces as pieces
from ._pieces import Number
from ._workshop import Finish, Workshop

HANDLES = ("bar", "bow", "knob", "cup", "edge", "none")


def pick(shop: Workshop, options: Sequence, weights: Sequence[float] | None = None):
    """Return one of the options."""
    share = None if weights is None else np.asarray(weights, float) / np.sum(weights)
    return options[int(shop.rng.choice(len(options), p=share))]


def between(shop: Workshop, low: Number, high: Number) -> float:
    """Return a number in the range."""
    return float(shop.rng.uniform(low, high))


def chance(shop: Workshop, share: Number) -> bool:
    """Return True with this probability."""
    return bool(shop.rng.random() < share)


def handle(
    shop: Workshop, finish: Finish, style: str, at, length: Number, *, upright: bool
) -> None:
    """Add a handle on a front whose surface is at ``at[1]``; it stands out towards +y."""
    x, y, z = at
    reach, half = 0.032, length / 2
    a, b = ((0, half) if upright else (half, 0)), ((0, -half) if upright else (-half, 0))
    if style == "bar":
        shop.rod(finish, (x + a[0], y + reach, z + a[1]), (x + b[0], y + reach, z + b[1]), 0.006)
        for s in (-0.75, 0.75):
            p = (x + s * a[0], y - 0.001, z + s * a[1])
            shop.rod(finish, p, (p[0], y + reach, p[2]), 0.0045)
    elif style == "bow":
        t = np.linspace(0, np.pi, 14)
        path = np.stack(
            [x + a[0] * np.cos(t), y + reach * np.sin(t) ** 0.7, z + a[1] * np.cos(t)], 1
        )
        shop.pipe(finish, path, 0.0055)
    elif style == "knob":
        profile = [(0, 0), (0.007, 0), (0.006, 0.012), (0.015, 0.019), (0.014, 0.026), (0, 0.03)]
        shop.add(finish, pieces.turn(pieces.lathe(profile, 18), "x", -np.pi / 2), (x, y, z))
    elif style == "cup":
        cup = pieces.superellipsoid((min(length, 0.1), 0.055, 0.045), 2.0, 2.0, 8)
        shop.add(finish, cup, (x, y, z))
    elif style == "edge":
        low = (x - max(abs(a[0]), 0.006), y - 0.001, z - max(abs(a[1]), 0.006))
        high = (x + max(abs(a[0]), 0.006), y + 0.018, z + max(abs(a[1]), 0.006))
        shop.box(finish, low, high, 0.002)


def front(
    shop: Workshop,
    finish: Finish,
    style: str,
    x: tuple[Number, Number],
    z: tuple[Number, Number],
    *,
    y: Number,
    thick: Number = 0.018,
    pane: Finish | None = None,
) -> float:
    """Add a door or drawer front on the plane ``y``; return the y of its surface."""
    (x0, x1), (z0, z1) = x, z
    if style == "flat" or min(x1 - x0, z1 - z0) < 0.14:
        shop.box(finish, (x0, y, z0), (x1, y + thick, z1), 0.002)
    elif style == "grooved":
        count = max(2, round((x1 - x0) / 0.09))
        edges = np.linspace(x0, x1, count + 1)
        for a, b in itertools.pairwise(edges):
            shop.box(finish, (a, y, z0), (b, y + thick, z1), 0.003)
    else:
        rail = min(0.06, 0.25 * (x1 - x0), 0.25 * (z1 - z0))
        profile = [
            (0, 0),
            (0, thick - 0.002),
            (0.002, thick),
            (rail - 0.006, thick),
            (rail, thick - 0.007),
            (rail, 0),
        ]
        frame = pieces.moulding(x1 - x0, z1 - z0, profile)
        shop.add(finish, frame, ((x0 + x1) / 2, y, (z0 + z1) / 2), crease=30.0)
        depth = 0.004 if style == "glass" else thick - 0.009
        fill = pane if style == "glass" and pane is not None else finish
        shop.box(
            fill,
            (x0 + rail - 0.004, y + 0.001, z0 + rail - 0.004),
            (x1 - rail + 0.004, y + 0.001 + depth, z1 - rail + 0.004),
            0.001,
        )
        if style == "raised":
            inset = rail + 0.03
            shop.box(
                finish,
                (x0 + inset, y + 0.002, z0 + inset),
                (x1 - inset, y + thick - 0.001, z1 - inset),
                0.006,
            )
    return y + thick


def legs(
    shop: Workshop, finish: Finish, style: str, spots, height: Number, *, thick: Number
) -> None:
    """Add a leg below every (x, y) spot, up to ``height``."""
    centre = np.mean(np.asarray(spots), axis=0)
    for x, y in spots:
        out = np.sign(np.array([x, y]) - centre)
        if style == "square":
            h = thick / 2
            shop.box(finish, (x - h, y - h, 0), (x + h, y + h, height), 0.003)
        elif style == "splayed":
            lean = 0.12 * height * out
            foot = (x + lean[0], y + lean[1], 0.0)
            shop.rod(finish, foot, (x, y, height), 0.28 * thick, 0.5 * thick)
        elif style == "turned":
            r = thick / 2
            profile = [
                (0, 0),
                (0.6 * r, 0),
                (0.8 * r, 0.05),
                (0.45 * r, 0.09),
                (0.95 * r, 0.3),
                (0.7 * r, 0.62),
                (1.0 * r, 0.68),
                (0.6 * r, 0.74),
                (r, 0.8),
                (r, 1),
                (0, 1),
            ]
            shop.add(finish, pieces.lathe([(q, s * height) for q, s in profile], 20), (x, y, 0))
        else:
            shop.disc(finish, (x, y, 0), 0.35 * thick, height, 0.45 * thick)


def corners(width: Number, depth: Number, inset: Number) -> list[tuple[float, float]]:
    """Return the four corner spots of a rectangle around the origin."""
    x, y = width / 2 - inset, depth / 2 - inset
    return [(-x, -y), (x, -y), (x, y), (-x, y)]


def dial_knob(shop: Workshop, finish: Finish, at, radius: Number, length: Number = 0.022) -> None:
    """Add a round control knob on a front."""
    x, y, z = at
    shop.wheel(finish, (x, y, z), radius, length)
    shop.box(finish, (x - 0.003, y, z - 0.1 * radius), (x + 0.003, y + length + 0.003, z + radius))
