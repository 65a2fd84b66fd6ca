"""Pictures, mirrors, heaters and towel racks: what hangs on walls."""

from collections.abc import Sequence

import numpy as np

from . import _materials as m
from . import _pieces as pieces
from ._parts import between, chance, pick
from ._pieces import Number
from ._workshop import Finish, Workshop


def frame(
    shop: Workshop, finish: Finish, width: Number, height: Number, wide: Number, *, deep: Number
):
    """Add a picture frame around the origin, its back at y = 0."""
    style = pick(shop, ("plain", "round", "step", "cove"))
    t = np.linspace(0.3, np.pi - 0.3, 7)
    arch = [*zip(wide * (0.5 - 0.5 * np.cos(t)), deep * (0.5 + 0.5 * np.sin(t)), strict=True)]

    def scaled(shape: Sequence[tuple[Number, Number]]) -> list[tuple[Number, Number]]:
        return [(wide * x, deep * y) for x, y in shape]

    profile = {
        "plain": [(0, 0), (0, deep), (wide, deep), (wide, 0)],
        "round": [(0, 0), (0, 0.5 * deep), *arch, (wide, 0)],
        "step": scaled(
            [(0, 0), (0, 1), (0.35, 1), (0.4, 0.7), (0.85, 0.55), (0.9, 0.4), (1, 0.4), (1, 0)]
        ),
        "cove": scaled(
            [(0, 0), (0, 0.6), (0.15, 1), (0.3, 1), (0.5, 0.62), (0.75, 0.45), (1, 0.42), (1, 0)]
        ),
    }[style]
    shop.add(finish, pieces.moulding(width, height, profile), crease=28.0)


def frame_finish(shop: Workshop) -> Finish:
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
        _print(shop, image, width, height, 0.001, face=0.03)
        return
    wide, deep = between(shop, 0.012, 0.06), between(shop, 0.015, 0.035)
    frame(shop, frame_finish(shop), width, height, wide, deep=deep)
    inner = (width - 1.9 * wide, height - 1.9 * wide)
    if style == "mat" and min(inner) > 0.2:
        mat = m.plain("paper", (0.95, 0.94, 0.91), 0.9)
        shop.box(
            mat, (-inner[0] / 2, 0.001, -inner[1] / 2), (inner[0] / 2, 0.008, inner[1] / 2), 0.0005
        )
        margin = between(shop, 0.12, 0.22) * min(inner)
        _print(shop, image, inner[0] - 2 * margin, inner[1] - 2 * margin, 0.001, face=0.0095)
    else:
        _print(shop, image, inner[0], inner[1], 0.001, face=0.009)


def _print(
    shop: Workshop, image: Finish, width: Number, height: Number, back: Number, *, face: Number
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
    glass, rim = m.mirror(), frame_finish(shop)
    width, height = between(shop, 0.4, 0.9), between(shop, 0.6, 1.4)
    if style == "frame":
        wide = between(shop, 0.015, 0.09)
        frame(shop, rim, width, height, wide, deep=between(shop, 0.018, 0.035))
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
    strips = [[k, k + 1, count - 2 - k, count - 1 - k] for k in range(half - 1)]
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
