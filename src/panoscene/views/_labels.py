"""Where names and numbers go, so that no two of them overlap and each is easily assigned."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from panoscene.style import words
from panoscene.views._pieces import Bounds, Piece, Plan

MeasureText = Callable[[str], tuple[float, float]]
"""Width and height in pixels of a text in the labels' type."""

_PAD = 3.0
"""Pixels kept free around a label."""
_GRID = np.linspace(0.0, 1.0, 9)
_RADII = (13.0, 19.0, 26.0, 34.0, 44.0, 56.0, 70.0, 86.0)
"""Distances in pixels between an object and a number beside it, nearest first."""
_DIRECTIONS = np.stack(
    [np.cos(np.arange(16) * np.pi / 8), np.sin(np.arange(16) * np.pi / 8)], axis=-1
)


@dataclass(frozen=True, slots=True)
class Label:
    """A text at its place on the page."""

    text: str
    x: float
    y: float
    rotation: float = 0.0
    """Degrees counter-clockwise: 0 or 90."""
    leader: tuple[tuple[float, float], tuple[float, float]] | None = None
    """A thin line from beside the text to the object, for texts outside of it."""


def place_names(plan: Plan, measure: MeasureText) -> dict[int, Label]:
    """Return labels with the category, by object, for objects with enough room for theirs."""
    blocked = _marks(plan)
    blocked.append(shapely.Point(plan.camera).buffer(11.0))
    placed: dict[int, Label] = {}
    for position, piece in sorted(enumerate(plan.pieces), key=lambda item: -item[1].footprint.area):
        above = [other.footprint for other in plan.pieces[position + 1 :]]
        label = _name_inside(piece, [*above, *blocked], measure)
        if label is not None:
            placed[piece.index] = label
            blocked.append(_rectangle(label, measure))
    return placed


def place_numbers(
    plan: Plan,
    names: dict[int, Label],
    numbers: dict[int, str],
    measure: MeasureText,
    *,
    bounds: Bounds,
    reserved: Sequence[shapely.Geometry] = (),
) -> dict[int, Label]:
    """Return labels for the numbered objects, inside them where they fit, else beside them.

    Args:
        plan: the objects.
        names: labels that already have their place.
        numbers: text of each object that has no name.
        measure: size of texts.
        bounds: the part of the page that labels may use.
        reserved: shapes that labels must not cover.
    """
    taken = [_rectangle(label, measure) for label in names.values()]
    taken.append(shapely.Point(plan.camera).buffer(11.0))
    taken += reserved
    marks = _marks(plan)
    placed: dict[int, Label] = {}
    beside: list[Piece] = []
    for position, piece in enumerate(plan.pieces):
        if piece.index not in numbers:
            continue
        above = [other.footprint for other in plan.pieces[position + 1 :]]
        label = _number_inside(piece, numbers[piece.index], [*above, *marks, *taken], measure)
        if label is None:
            beside.append(piece)
        else:
            placed[piece.index] = label
            taken.append(_rectangle(label, measure))
    ground = _Ground(plan, bounds)
    # the most crowded first, while there is still space around them
    beside.sort(key=ground.crowding, reverse=True)
    leaders: list[shapely.Geometry] = []
    for piece in beside:
        label = ground.best(piece, numbers[piece.index], taken, leaders, measure)
        placed[piece.index] = label
        taken.append(_rectangle(label, measure))
        if label.leader is not None:
            leaders.append(shapely.LineString(label.leader))
    return placed


def _marks(plan: Plan) -> list[shapely.Geometry]:
    """Return the contacts and the tips of fronts, which labels should not cover."""
    tips = [piece.tip for piece in plan.pieces]
    return [contact.shape for contact in plan.contacts] + [tip for tip in tips if tip.area > 0]


def _name_inside(
    piece: Piece, blocked: Sequence[shapely.Geometry], measure: MeasureText
) -> Label | None:
    """Return the name as near to the middle as it is free, lying rather than standing."""
    name = words(piece.category)
    variants = [(name, 0.0)]
    if " " in name:
        variants.append((_in_two_lines(name), 0.0))
    variants.append((name, 90.0))
    for text, rotation in variants:
        label = _fit(piece, text, rotation, blocked, measure)
        if label is not None:
            return label
    return None


def _number_inside(
    piece: Piece, text: str, blocked: Sequence[shapely.Geometry], measure: MeasureText
) -> Label | None:
    return _fit(piece, text, 0.0, blocked, measure, pad=1.5)


def _fit(
    piece: Piece,
    text: str,
    rotation: float,
    blocked: Sequence[shapely.Geometry],
    measure: MeasureText,
    *,
    pad: float = _PAD,
) -> Label | None:
    """Return the free place for a text inside a footprint that is nearest to its middle."""
    width, height = measure(text)
    if rotation:
        width, height = height, width
    width, height = width + 2 * pad, height + 2 * pad
    left, low, right, high = piece.footprint.bounds
    if right - left < width or high - low < height:
        return None
    centre = np.array(piece.footprint.centroid.coords[0])
    x = left + width / 2 + _GRID * (right - left - width)
    y = low + height / 2 + _GRID * (high - low - height)
    places = np.concatenate([centre[None], np.stack(np.meshgrid(x, y), -1).reshape(-1, 2)])
    rectangles = _boxes(places, width, height)
    free = shapely.contains(piece.footprint.buffer(0.5), rectangles)
    if blocked:
        near = [shape for shape in blocked if shapely.intersects(shape, piece.footprint)]
        free &= ~shapely.intersects(shapely.union_all(near), rectangles)
    if not free.any():
        return None
    distance = np.linalg.norm(places - centre, axis=1)
    best = places[int(np.argmin(np.where(free, distance, np.inf)))]
    return Label(text, float(best[0]), float(best[1]), rotation)


class _Ground:
    """What lies under possible places of numbers beside their objects."""

    def __init__(self, plan: Plan, bounds: Bounds) -> None:
        self._footprints = np.array([piece.footprint for piece in plan.pieces])
        self._marks = np.array(_marks(plan))
        self._walls = np.array(shapely.get_parts(plan.walls))
        self._bounds = shapely.box(*bounds)

    def crowding(self, piece: Piece) -> float:
        """Return how much of an object's surroundings is covered by others."""
        around = shapely.box(*piece.footprint.buffer(20.0).bounds)
        return float(shapely.area(shapely.intersection(self._footprints, around)).sum())

    def best(
        self,
        piece: Piece,
        text: str,
        taken: Sequence[shapely.Geometry],
        leaders: Sequence[shapely.Geometry],
        measure: MeasureText,
    ) -> Label:
        """Return the label at the free place with the least below it, near the object.

        In a scene so full that no place is free, the label comes where the least is covered.
        """
        width, height = measure(text)
        anchor = shapely.get_coordinates(piece.footprint.centroid)[0]
        lowest, best = np.inf, anchor
        for radius in _RADII:
            if lowest <= radius:  # farther away nothing is better
                break
            place = _places_around(piece.footprint, anchor, radius)
            cost = radius + self._cost(
                piece, anchor, place, size=(width, height), taken=taken, leaders=leaders
            )
            if cost.min() < lowest:
                lowest, best = cost.min(), place[int(np.argmin(cost))]
        x, y = best.tolist()
        return Label(text, x, y, leader=_leader(piece, anchor, (x, y), width, height))

    def _cost(
        self,
        piece: Piece,
        anchor: np.ndarray,
        place: np.ndarray,
        *,
        size: tuple[float, float],
        taken: Sequence[shapely.Geometry],
        leaders: Sequence[shapely.Geometry],
    ) -> np.ndarray:
        """Return how bad it is, in pixels of distance, to write at each place."""
        width, height = size
        rectangles = _boxes(place, width + 2 * _PAD + 4.0, height + 2 * _PAD)
        lines = _lines(place, anchor)
        reach = shapely.box(*shapely.total_bounds(rectangles))
        others = self._footprints[self._footprints != piece.footprint]
        own = np.array([piece.footprint])
        labels, web = np.array(taken), np.array(leaders)
        return (
            60.0 * _cover(rectangles, others, reach)
            + 60.0 * _cover(rectangles, own, reach)
            + 120.0 * _cover(rectangles, self._walls, reach)
            + 160.0 * _cover(rectangles, self._marks, reach)
            + 0.6 * _length(lines, others, reach)
            + 150.0 * (_length(lines, labels, reach) > 0)
            + 150.0 * _meets(lines, web, reach)
            + 1e3 * _meets(rectangles, web, reach)
            + 1e4 * _cover(rectangles, labels, reach)
            + 30.0 * _meets(_boxes(place, width + 26.0, height), labels, reach)
            + 1e5 * ~shapely.contains(self._bounds, rectangles)
        )


def _places_around(footprint: shapely.Polygon, anchor: np.ndarray, radius: float) -> np.ndarray:
    """Return points all around on the outline of the object grown by a radius."""
    ring = shapely.buffer(footprint, radius, quad_segs=4).exterior
    far = anchor + _DIRECTIONS * (footprint.length + radius)
    rays = _lines(far, anchor)
    # a ray from inside a convex outline meets it once
    return shapely.get_coordinates(shapely.intersection(ring, rays))


def _lines(places: np.ndarray, anchor: np.ndarray) -> np.ndarray:
    """Return the line between each place and the anchor."""
    ends = np.stack([places, np.broadcast_to(anchor, places.shape)], axis=1)
    return np.asarray(shapely.linestrings(ends))


def _leader(
    piece: Piece, anchor: np.ndarray, place: tuple[float, float], width: float, height: float
) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Return the line from beside a text to a little inside the object; None if there is no space.

    It ends inside, so that it is clear which object is meant.
    """
    edge = shapely.get_coordinates(shapely.shortest_line(shapely.Point(place), piece.footprint))[-1]
    inward = anchor - edge
    end = edge + inward * min(1.0, 4.0 / max(float(np.linalg.norm(inward)), 1e-9))
    text = _boxes(np.array([place]), width + 2.0, height + 2.0)[0]
    points = shapely.get_coordinates(shapely.LineString([place, end]).difference(text))
    if len(points) != 2:
        return None
    (a, b), (c, d) = points.tolist()
    return (a, b), (c, d)


def _near(shapes: np.ndarray, reach: shapely.Geometry) -> np.ndarray:
    return shapes[shapely.intersects(shapes, reach)] if len(shapes) else shapes


def _cover(rectangles: np.ndarray, shapes: np.ndarray, reach: shapely.Geometry) -> np.ndarray:
    """Return the share of each rectangle that lies on the shapes; parts on two count twice."""
    near = _near(shapes, reach)
    if not len(near):
        return np.zeros(len(rectangles))
    shared = shapely.area(shapely.intersection(rectangles[:, None], near[None, :])).sum(1)
    return shared / shapely.area(rectangles)


def _length(lines: np.ndarray, shapes: np.ndarray, reach: shapely.Geometry) -> np.ndarray:
    """Return the length of each line over the shapes."""
    near = _near(shapes, reach)
    if not len(near):
        return np.zeros(len(lines))
    return shapely.length(shapely.intersection(lines[:, None], near[None, :])).sum(1)


def _meets(items: np.ndarray, shapes: np.ndarray, reach: shapely.Geometry) -> np.ndarray:
    """Return whether each item meets any of the shapes."""
    near = _near(shapes, reach)
    if not len(near):
        return np.zeros(len(items), dtype=bool)
    met = np.asarray(shapely.intersects(items[:, None], near[None, :]))
    return np.any(met, axis=1)


def _in_two_lines(name: str) -> str:
    """Return the words on two lines of nearly equal length."""
    parts = name.split(" ")
    splits = [(" ".join(parts[:k]), " ".join(parts[k:])) for k in range(1, len(parts))]
    return "\n".join(min(splits, key=lambda lines: max(map(len, lines))))


def _rectangle(label: Label, measure: MeasureText) -> shapely.Geometry:
    width, height = measure(label.text)
    if label.rotation:
        width, height = height, width
    return _boxes(np.array([[label.x, label.y]]), width + _PAD, height + _PAD)[0]


def _boxes(places: np.ndarray, width: float, height: float) -> np.ndarray:
    x, y = places[:, 0], places[:, 1]
    return shapely.box(x - width / 2, y - height / 2, x + width / 2, y + height / 2)
