"""Objects that lie outside the picture: arrows at its border, with name and distance."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import shapely

from panoscene.style import FAINT_INK, GROUP_COLOURS, INK, LABEL, PAPER, THIN, group_of, words
from panoscene.views._page import Page
from panoscene.views._pieces import Bounds, Piece, Plan

FAR_GAP = 17.0
"""Pixels between what is drawn of the room and the middle of the arrows around it."""
_HALF, _SPACE, _TEXT_GAP = 8.0, 12.0, 6.0
MeasureText = Callable[[str], tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Pointer:
    """An arrow at the border of a picture towards one object outside of it, and its text."""

    text: str
    group: str | None
    """Whose colour the arrow has; None for several objects that share a pointer."""
    arrow: tuple[float, float]
    direction: tuple[float, float]
    """Unit vector on the page from the arrow towards the object."""
    place: tuple[float, float]
    """Middle of the text."""
    rotation: float
    strip: shapely.Polygon
    """What arrow and text take."""


@dataclass(slots=True)
class _Wish:
    """A pointer before it has its place along a side."""

    text: str
    group: str | None
    direction: tuple[float, float]
    at: float
    """Where it wants to be along its side."""
    length: float
    distance: float


def far_objects(plan: Plan, content: Bounds) -> frozenset[int]:
    """Return the objects whose middle is outside of what the picture shows."""
    shown = shapely.box(*content).buffer(2.0)
    return frozenset(
        piece.index for piece in plan.pieces if not shown.contains(piece.footprint.centroid)
    )


def place_pointers(
    plan: Plan,
    far: frozenset[int],
    content: Bounds,
    *,
    numbers: Mapping[int, str],
    scale: float,
    measure: MeasureText,
) -> list[Pointer]:
    """Return the pointers to the far objects, around the content without overlap.

    Where a side has no space for all of them, the farthest share one, such as "+3".

    Args:
        plan: the objects.
        far: those outside the picture.
        content: what the picture shows.
        numbers: of objects that have one.
        scale: pixels per metre.
        measure: size of texts.
    """
    sides: dict[str, list[_Wish]] = {"left": [], "right": [], "bottom": [], "top": []}
    for piece in plan.pieces:
        if piece.index in far:
            side, wish = _wish(piece, plan, content, numbers=numbers, scale=scale, measure=measure)
            sides[side].append(wish)
    left, low, right, high = content
    ends = {"left": (low, high), "right": (low, high), "bottom": (left, right),
            "top": (left, right)}  # fmt: skip
    offset = {"left": left - FAR_GAP, "right": right + FAR_GAP, "bottom": low - FAR_GAP,
              "top": high + FAR_GAP}  # fmt: skip
    return [
        _pointer(side, wish, start, offset[side])
        for side, wishes in sides.items()
        for wish, start in _arranged(wishes, *ends[side], measure)
    ]


def _wish(
    piece: Piece,
    plan: Plan,
    content: Bounds,
    *,
    numbers: Mapping[int, str],
    scale: float,
    measure: MeasureText,
) -> tuple[str, _Wish]:
    """Return the side on which the object lies, seen from the middle, and where along it."""
    left, low, right, high = content
    middle = np.array([(left + right) / 2, (low + high) / 2])
    half = np.array([(right - left) / 2, (high - low) / 2])
    away = np.array(piece.footprint.centroid.coords[0]) - middle
    reach = np.abs(away) / half
    border = middle + away / reach.max()
    distance = piece.footprint.distance(plan.floor) / scale
    number = f"{numbers[piece.index]} " if piece.index in numbers else ""
    text = f"{number}{words(piece.category)}, {_metres(distance)}"
    lies = bool(reach[1] >= reach[0])
    side = ("top" if away[1] > 0 else "bottom") if lies else ("right" if away[0] > 0 else "left")
    unit = away / np.linalg.norm(away)
    length = 2 * _HALF + _TEXT_GAP + measure(text)[0]
    return side, _Wish(
        text,
        group_of(piece.category),
        (float(unit[0]), float(unit[1])),
        float(border[0] if lies else border[1]),
        length,
        distance,
    )


def _metres(distance: float) -> str:
    if distance < 10:
        return f"{distance:.1f} m"
    return f"{distance:.0f} m" if distance < 1e4 else f"{distance / 1000:.3g} km"


def _arranged(
    wishes: list[_Wish], low: float, high: float, measure: MeasureText
) -> list[tuple[_Wish, float]]:
    """Return the pointers of one side, each with where it starts."""
    kept = sorted(wishes, key=lambda wish: wish.distance)
    rest: list[_Wish] = []
    while len(kept) > 1 and _total([*kept, *_shared(rest, measure)]) > high - low:
        rest.append(kept.pop())
    kept = sorted([*kept, *_shared(rest, measure)], key=lambda wish: wish.at)
    starts: list[float] = []
    end = low
    for wish in kept:
        start = max(wish.at - wish.length / 2, end)
        starts.append(start)
        end = start + wish.length + _SPACE
    end = max(high, low + _total(kept))
    for k in range(len(kept) - 1, -1, -1):
        starts[k] = min(starts[k], end - kept[k].length)
        end = starts[k] - _SPACE
    return list(zip(kept, starts, strict=True))


def _shared(rest: list[_Wish], measure: MeasureText) -> list[_Wish]:
    """Return one pointer for several objects, none for none."""
    if not rest:
        return []
    text = f"+{len(rest)}"
    direction = np.mean([wish.direction for wish in rest], axis=0)
    direction /= max(float(np.linalg.norm(direction)), 1e-9)
    return [
        _Wish(
            text,
            None,
            (float(direction[0]), float(direction[1])),
            float(np.mean([wish.at for wish in rest])),
            2 * _HALF + _TEXT_GAP + measure(text)[0],
            np.inf,
        )
    ]


def _total(wishes: list[_Wish]) -> float:
    return sum(wish.length + _SPACE for wish in wishes) - _SPACE


def _pointer(side: str, wish: _Wish, start: float, offset: float) -> Pointer:
    along = [start + _HALF, (start + 2 * _HALF + _TEXT_GAP + start + wish.length) / 2]
    stands = side in ("left", "right")
    arrow, place = [(offset, at) if stands else (at, offset) for at in along]
    strip = (
        shapely.box(offset - 10, start, offset + 10, start + wish.length)
        if stands
        else shapely.box(start, offset - 10, start + wish.length, offset + 10)
    )
    rotation = 90.0 if stands else 0.0
    return Pointer(wish.text, wish.group, arrow, wish.direction, place, rotation, strip)


def draw_pointer(page: Page, pointer: Pointer) -> None:
    """Draw arrow and text."""
    fill = FAINT_INK if pointer.group is None else GROUP_COLOURS[pointer.group]
    draw_arrow_head(page, pointer.arrow, pointer.direction, fill)
    page.text(
        *pointer.place,
        pointer.text,
        size=LABEL,
        align="center",
        rotation=pointer.rotation,
        halo=PAPER,
    )


def draw_arrow_head(
    page: Page, middle: tuple[float, float], direction: tuple[float, float], fill: str
) -> None:
    """Draw a triangle that points along a direction."""
    forward = np.array(direction)
    side = np.array([forward[1], -forward[0]])
    centre = np.array(middle)
    tip = centre + _HALF * forward
    base = centre - 0.8 * _HALF * forward
    corners = [tip, base + 0.85 * _HALF * side, base - 0.85 * _HALF * side]
    page.area(shapely.Polygon(corners), fill=fill, edge=INK, width=1.2 * THIN)
