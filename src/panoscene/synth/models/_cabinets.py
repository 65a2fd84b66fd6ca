"""Carcasses with doors and drawers: kitchen cabinets, counters, chests, shelves."""

import itertools

import numpy as np

from . import _materials as m
from ._parts import HANDLES, between, chance, corners, front, handle, legs, pick
from ._pieces import Number
from ._workshop import Finish, Workshop

_STYLES = ("flat", "flat", "shaker", "raised", "grooved")
GAP = 0.003


def fronts(shop: Workshop, finish: Finish, grip: Finish, style: str, hold: str, *, x, z, y: Number,
           plan: str, upper: bool = False) -> None:  # fmt: skip
    """Fill an opening with fronts.

    The ``plan`` is D (a door), W (two doors), d (a drawer over a door) or the number of drawers.
    """
    (x0, x1), (z0, z1) = x, z
    if plan.isdigit():
        edges = np.linspace(z0, z1, int(plan) + 1)
        if int(plan) == 3 and z1 - z0 > 0.55:
            edges = np.array([z0, z0 + 0.39 * (z1 - z0), z0 + 0.78 * (z1 - z0), z1])
        for a, b in itertools.pairwise(edges):
            top = front(shop, finish, style, (x0 + GAP, x1 - GAP), (a + GAP, b - GAP), y=y)
            length = min(0.5 * (x1 - x0), 0.22)
            where = (a + b) / 2 if hold in ("knob", "cup", "bow") else b - 0.05
            spots = [-0.25, 0.25] if x1 - x0 > 0.75 and hold in ("knob", "cup") else [0.0]
            for s in spots:
                handle(
                    shop,
                    grip,
                    hold,
                    ((x0 + x1) / 2 + s * (x1 - x0), top, where),
                    length,
                    upright=False,
                )
        return
    if plan == "d":
        cut = z1 - min(0.17, 0.3 * (z1 - z0))
        fronts(shop, finish, grip, style, hold, x=x, z=(cut, z1), y=y, plan="1")
        fronts(
            shop,
            finish,
            grip,
            style,
            hold,
            x=x,
            z=(z0, cut),
            y=y,
            plan="D" if x1 - x0 < 0.62 else "W",
            upper=upper,
        )
        return
    if plan == "W":
        middle = (x0 + x1) / 2
        for k, pair in enumerate(((x0, middle), (middle, x1))):
            _door(shop, finish, grip, style, hold, x=pair, z=z, y=y, left=bool(k == 1), upper=upper)
        return
    _door(shop, finish, grip, style, hold, x=x, z=z, y=y, left=chance(shop, 0.5), upper=upper)


def _door(shop, finish, grip, style, hold, *, x, z, y, left, upper) -> None:
    pane = m.glass(shop, 0.25) if style == "glass" else None
    top = front(
        shop, finish, style, (x[0] + GAP, x[1] - GAP), (z[0] + GAP, z[1] - GAP), y=y, pane=pane
    )
    place = x[0] + 0.035 if left else x[1] - 0.035
    height = min(z[0] + 0.12, (z[0] + z[1]) / 2) if upper else max(z[1] - 0.12, (z[0] + z[1]) / 2)
    length = float(np.clip(0.3 * (z[1] - z[0]), 0.1, 0.2))
    handle(shop, grip, "bow" if hold == "cup" else hold, (place, top, height), length, upright=True)


def _run(
    shop: Workshop,
    width: Number,
    depth: Number,
    height: Number,
    plinth: Number,
    *,
    plans,
    style=None,
):
    """Add a carcass, its plinth and one column of fronts for every plan; return the finishes."""
    rng = shop.rng
    shell = m.body(shop)
    face = shell if chance(shop, 0.6) else m.body(shop)
    grip, hold = m.metal(shop), pick(shop, HANDLES)
    style = style or pick(shop, _STYLES)
    y = depth / 2 - 0.018
    shop.box(shell, (-width / 2, -depth / 2, plinth), (width / 2, y - 0.001, height))
    if plinth > 0.0:
        shop.box(m.black(shop) if chance(shop, 0.5) else shell, (-width / 2 + 0.001, -depth / 2, 0),
                 (width / 2 - 0.001, y - 0.05, plinth))  # fmt: skip
    share = np.cumsum([0.0, *rng.uniform(0.8, 1.2, len(plans))])
    share = np.linspace(0, 1, len(plans) + 1) if chance(shop, 0.6) else share / share[-1]
    for k, plan in enumerate(plans):
        span = (-width / 2 + width * share[k], -width / 2 + width * share[k + 1])
        fronts(shop, face, grip, style, hold, x=span, z=(plinth, height), y=y, plan=plan)
    return shell, face


def _plans(shop: Workshop, width: Number, options: str = "DdW13422") -> list[str]:
    count = max(1, round(width / between(shop, 0.42, 0.75)))
    return [pick(shop, options) for _ in range(count)]


def _slab(
    shop: Workshop, width: Number, depth: Number, height: Number, thick: Number, *, over: Number
):
    kind = pick(shop, ("stone", "wood", "plain"), (0.5, 0.3, 0.2))
    top = {"stone": m.stone, "wood": m.wood, "plain": m.paint}[kind](shop)
    shop.box(top, (-width / 2 - over, -depth / 2, height),
             (width / 2 + over, depth / 2 + 0.02, height + thick), 0.004)  # fmt: skip
    shop.support = height + thick


def bottom_cabinet(shop: Workshop) -> None:
    """Make a base unit, sideboard or wardrobe."""
    use = pick(shop, ("kitchen", "sideboard", "wardrobe"), (0.55, 0.27, 0.18))
    if use == "wardrobe":
        width, depth, height = (
            between(shop, 0.8, 2.0),
            between(shop, 0.55, 0.65),
            between(shop, 1.8, 2.3),
        )
        _run(
            shop, width, depth, height, between(shop, 0.04, 0.1), plans=_plans(shop, width, "DDWd")
        )
        shop.support = None
        return
    if use == "sideboard":
        width, depth, height = (
            between(shop, 1.0, 2.0),
            between(shop, 0.38, 0.5),
            between(shop, 0.55, 0.85),
        )
        lift = between(shop, 0.1, 0.2)
        shell, _ = _run(shop, width, depth, height, 0.0, plans=_plans(shop, width))
        foot = m.metal(shop) if chance(shop, 0.4) else shell
        shop.shift_all((0.0, 0.0, lift))
        legs(
            shop,
            foot,
            pick(shop, ("splayed", "square", "round")),
            corners(width, depth, 0.07),
            lift,
            thick=0.045,
        )
        shop.support = height + lift
        return
    width, depth, height = (
        between(shop, 0.4, 1.3),
        between(shop, 0.56, 0.62),
        between(shop, 0.8, 0.86),
    )
    _run(shop, width, depth, height, 0.1, plans=_plans(shop, width))
    _slab(shop, width, depth, height, between(shop, 0.025, 0.045), over=0.0)


def bottom_cabinet_no_top(shop: Workshop) -> None:
    """Make a base unit without worktop."""
    width = between(shop, 0.3, 1.2)
    height = between(shop, 0.7, 0.86)
    _run(shop, width, between(shop, 0.5, 0.6), height, 0.1, plans=_plans(shop, width))
    shop.support = height


def top_cabinet(shop: Workshop) -> None:
    """Make a wall unit."""
    width, height, depth = (
        between(shop, 0.4, 1.6),
        between(shop, 0.35, 0.95),
        between(shop, 0.3, 0.38),
    )
    style = "glass" if chance(shop, 0.2) else pick(shop, _STYLES)
    shell = m.body(shop)
    face = shell if chance(shop, 0.6) else m.body(shop)
    grip, hold = m.metal(shop), pick(shop, ("bar", "knob", "edge", "none", "bow"))
    y, wall = depth / 2 - 0.018, 0.018
    if style == "glass":
        shop.box(shell, (-width / 2, -depth / 2, 0), (width / 2, -depth / 2 + 0.008, height))
        for x in (-width / 2, width / 2 - wall):
            shop.box(shell, (x, -depth / 2, 0), (x + wall, y, height))
        for z in np.linspace(0, height - wall, 3):
            shop.box(
                shell, (-width / 2 + wall, -depth / 2 + 0.008, z), (width / 2 - wall, y, z + wall)
            )
    else:
        shop.box(shell, (-width / 2, -depth / 2, 0), (width / 2, y - 0.001, height))
    edges = np.linspace(-width / 2, width / 2, max(1, round(width / between(shop, 0.38, 0.6))) + 1)
    for a, b in itertools.pairwise(edges):
        fronts(shop, face, grip, style, hold, x=(a, b), z=(0, height), y=y, plan="D", upper=True)
    if chance(shop, 0.3):
        shop.box(
            shell,
            (-width / 2 - 0.02, -depth / 2, height),
            (width / 2 + 0.02, depth / 2 + 0.02, height + 0.035),
            0.01,
        )
    shop.support = None


def counter(shop: Workshop) -> None:
    """Make a kitchen run, an island or a bar with a long worktop."""
    width, depth = between(shop, 1.2, 2.8), between(shop, 0.6, 0.95)
    height = between(shop, 0.82, 0.9)
    if chance(shop, 0.25):
        height += 0.14
    _run(shop, width, depth, height, 0.1, plans=_plans(shop, width))
    _slab(shop, width, depth, height, between(shop, 0.03, 0.06), over=between(shop, 0.0, 0.04))
    if chance(shop, 0.35):
        rail = m.metal(shop)
        y, z = depth / 2 + 0.07, 0.2
        for x in np.linspace(-width / 2 + 0.15, width / 2 - 0.15, 3):
            shop.rod(rail, (x, depth / 2 - 0.06, z), (x, y, z), 0.009)
        shop.rod(rail, (-width / 2, y, z), (width / 2, y, z), 0.018)


def chest(shop: Workshop) -> None:
    """Make a chest of drawers or a nightstand."""
    small = chance(shop, 0.5)
    width = between(shop, 0.38, 0.6) if small else between(shop, 0.7, 1.3)
    depth = between(shop, 0.35, 0.45) if small else between(shop, 0.4, 0.52)
    height = between(shop, 0.35, 0.55) if small else between(shop, 0.65, 1.1)
    lift = between(shop, 0.04, 0.2)
    plans = [pick(shop, "123" if small else "345")] * (2 if width > 0.95 else 1)
    shell, _ = _run(
        shop,
        width,
        depth,
        height,
        0.0,
        plans=plans,
        style=pick(shop, ("flat", "shaker", "raised", "flat")),
    )
    shop.box(
        shell,
        (-width / 2 - 0.012, -depth / 2, height),
        (width / 2 + 0.012, depth / 2 + 0.012, height + 0.022),
        0.004,
    )
    shop.shift_all((0.0, 0.0, lift))
    legs(
        shop,
        shell,
        pick(shop, ("splayed", "square", "turned", "round")),
        corners(width, depth, 0.045),
        lift,
        thick=0.05,
    )
    shop.support = height + 0.022 + lift


def shelf(shop: Workshop) -> None:
    """Make a bookcase, a ladder shelf or a metal rack."""
    width, height, depth = (
        between(shop, 0.5, 1.4),
        between(shop, 0.8, 2.1),
        between(shop, 0.24, 0.4),
    )
    board, frame = m.body(shop), m.metal(shop)
    style, levels = (
        pick(shop, ("case", "rack", "ladder", "grid")),
        round(height / between(shop, 0.3, 0.42)) + 1,
    )
    z = np.linspace(0.06, height - 0.02, max(levels, 3))
    t, x, y = 0.022, width / 2, depth / 2
    if style in ("case", "grid"):
        for a in (-x, x - t):
            shop.box(board, (a, -y, 0), (a + t, y, height))
        shop.box(board, (-x + t, -y, 0.04), (x - t, -y + 0.006, height - 0.001))
        for level in z:
            shop.box(board, (-x + t, -y + 0.006, level - t / 2), (x - t, y - 0.002, level + t / 2))
        for a in (
            np.linspace(-x, x, max(2, round(width / 0.36)) + 1)[1:-1] if style == "grid" else ()
        ):
            shop.box(board, (a - t / 2, -y + 0.006, z[0]), (a + t / 2, y - 0.004, z[-1]))
        shop.support = height
        return
    for sx in (-1, 1):
        for sy in (-1, 1):
            lean = 0.6 * depth if style == "ladder" and sy > 0 else 0.0
            a, b = (
                (sx * (x - 0.012), sy * (y - 0.012), 0.0),
                (sx * (x - 0.012), sy * (y - 0.012) - lean, height),
            )
            if style == "rack":
                shop.box(
                    frame, (a[0] - 0.012, a[1] - 0.012, 0), (a[0] + 0.012, a[1] + 0.012, height)
                )
            else:
                shop.rod(frame, a, b, 0.013)
    for level in z:
        reach = y - 0.6 * depth * level / height if style == "ladder" else y
        shop.box(board, (-x + 0.004, -y, level - t / 2), (x - 0.004, reach, level + t / 2), 0.003)
    shop.support = float(z[-1]) + t / 2


def console_table(shop: Workshop) -> None:
    """Make a narrow table for a hall."""
    width, depth, height = (
        between(shop, 0.8, 1.5),
        between(shop, 0.28, 0.42),
        between(shop, 0.74, 0.9),
    )
    top, frame = (m.stone if chance(shop, 0.2) else m.wood)(shop), m.metal(shop)
    shop.box(top, (-width / 2, -depth / 2, height - 0.028), (width / 2, depth / 2, height), 0.004)
    style = pick(shop, ("drawers", "metal", "hoops", "plain"))
    if style == "drawers":
        face = m.body(shop) if chance(shop, 0.3) else m.wood(shop)
        low = height - 0.028 - 0.13
        shop.box(
            face,
            (-width / 2 + 0.03, -depth / 2 + 0.02, low),
            (width / 2 - 0.03, depth / 2 - 0.038, height - 0.028),
        )
        edges = np.linspace(-width / 2 + 0.03, width / 2 - 0.03, int(shop.rng.integers(2, 4)))
        for a, b in itertools.pairwise(edges):
            fronts(
                shop,
                face,
                frame,
                "flat",
                pick(shop, ("knob", "cup", "bow")),
                x=(a, b),
                z=(low, height - 0.03),
                y=depth / 2 - 0.038,
                plan="1",
            )
        legs(
            shop,
            face,
            pick(shop, ("turned", "square", "round")),
            corners(width, depth, 0.055),
            low,
            thick=0.045,
        )
    elif style == "hoops":
        for x in (-width / 2 + 0.08, width / 2 - 0.08):
            path = [
                (x, -depth / 2 + 0.03, height - 0.03),
                (x, -depth / 2 + 0.03, 0.012),
                (x, depth / 2 - 0.03, 0.012),
                (x, depth / 2 - 0.03, height - 0.03),
            ]
            for a, b in itertools.pairwise(path):
                shop.rod(frame, a, b, 0.012)
    else:
        legs(
            shop,
            frame if style == "metal" else top,
            "square",
            corners(width, depth, 0.03),
            height - 0.028,
            thick=0.03 if style == "metal" else 0.05,
        )
    if style != "hoops" and chance(shop, 0.6):
        z = between(shop, 0.12, 0.25)
        shop.box(
            top,
            (-width / 2 + 0.02, -depth / 2 + 0.02, z),
            (width / 2 - 0.02, depth / 2 - 0.02, z + 0.02),
        )
    shop.support = height
