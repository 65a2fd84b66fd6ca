"""Names of furniture where they fit, numbers where they do not."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import shapely

from panoscene.exports._plan_openings import Opening
from panoscene.style import words

LABEL_MM, SMALLEST_MM, NUMBER_MM = 2.8, 2.1, 2.3
"""Heights of type on paper: of names, of names in narrow pieces, of numbers."""
CHARACTER = 0.61
"""Mean width of a character, as a share of the size of type; the font of the reader may differ."""
LINE = 1.2
"""Height of a line of text, as a share of the size of type."""
_STEPS = (0.5, 0.35, 0.65, 0.22, 0.78)


@dataclass(frozen=True, slots=True)
class Label:
    """A name or a number in the plan."""

    piece: int
    """Place in the list of furniture."""
    text: tuple[str, ...]
    """Its lines."""
    place: tuple[float, float]
    """Its middle."""
    size: float
    """Of the type, in metres."""
    upright: bool = False
    """Written from bottom to top."""
    number: int | None = None
    """In a circle, explained in the key."""

    @property
    def shape(self) -> shapely.Polygon:
        """What it takes of the plan."""
        wide, high = text_size(self.text, self.size)
        if self.number is not None:
            wide = high = 1.7 * self.size
        if self.upright:
            wide, high = high, wide
        x, y = self.place
        return shapely.box(x - wide / 2, y - high / 2, x + wide / 2, y + high / 2)


def text_size(lines: tuple[str, ...], size: float) -> tuple[float, float]:
    """Return width and height of lines of text of a size of type."""
    return max(map(len, lines)) * CHARACTER * size, len(lines) * LINE * size


def place_labels(
    pieces: list[tuple[str, shapely.Polygon]],
    area_place: tuple[float, float],
    openings: tuple[Opening, ...],
    marks: Sequence[shapely.Polygon],
    scale: int,
) -> tuple[tuple[Label, ...], tuple[str, ...]]:
    """Return labels that neither overlap nor leave their piece, and the key of the numbers.

    Args:
        pieces: Category and footprint, what is higher later.
        area_place: Where the area is written.
        openings: Doors, whose swings are no place for text.
        marks: Other places that text must not cover.
        scale: 1 : scale is the size on paper.
    """
    unit = scale / 1000
    x, y = area_place
    wide, high = 11.0 * unit, 4.5 * unit
    taken = [shapely.box(x - wide, y - high, x + wide, y + high), *marks]
    taken += [opening.swing for opening in openings if opening.leaves]
    labels: dict[int, Label] = {}
    # small pieces have the least choice
    order = sorted(range(len(pieces)), key=lambda k: pieces[k][1].area)
    waiting: list[int] = []
    for k in order:
        category, shape = pieces[k]
        above = [other for _, other in pieces[k + 1 :] if other.intersects(shape)]
        label = _name(k, words(category), shape, [*taken, *above], unit)
        if label is None:
            waiting.append(k)
        else:
            labels[k] = label
            taken.append(label.shape)
    key: list[str] = []
    for k in sorted(waiting):
        category, shape = pieces[k]
        above = [other for _, other in pieces[k + 1 :] if other.intersects(shape)]
        name = words(category)
        if name not in key:
            key.append(name)
        labels[k] = _number(k, key.index(name) + 1, shape, (taken, above), unit)
        taken.append(labels[k].shape)
    return tuple(labels[k] for k in sorted(labels)), tuple(key)


def _name(
    piece: int, name: str, shape: shapely.Polygon, taken: list[shapely.Geometry], unit: float
) -> Label | None:
    """Return a name that fits into a footprint beside what is taken, if there is one."""
    obstacles = shapely.unary_union(taken)
    inside = shape.buffer(-0.4 * unit)
    split = tuple(name.split(" ", 1))
    texts = [(name,), split] if len(split) > 1 else [(name,)]
    for size_mm, text, upright in product((LABEL_MM, 2.4, SMALLEST_MM), texts, (False, True)):
        for place in _places(shape):
            label = Label(piece, text, place, size_mm * unit, upright)
            if inside.covers(label.shape) and not obstacles.intersects(label.shape):
                return label
    return None


def _number(
    piece: int,
    number: int,
    shape: shapely.Polygon,
    taken: tuple[Sequence[shapely.Geometry], Sequence[shapely.Geometry]],
    unit: float,
) -> Label:
    """Return a number in the footprint, or as near to its middle as it is free."""
    size = NUMBER_MM * unit
    texts, above = (shapely.unary_union(shapes) for shapes in taken)
    middle = (shape.centroid.x, shape.centroid.y)
    rings = [
        (middle[0] + r * size * np.cos(a), middle[1] + r * size * np.sin(a))
        for r in (1.0, 1.8, 2.6, 3.4)
        for a in np.linspace(0, 2 * np.pi, 12, endpoint=False)
    ]
    candidates = [
        Label(piece, (str(number),), place, size, number=number)
        for place in [*_places(shape), *rings]
    ]
    clear = [label for label in candidates if not texts.intersects(label.shape)]
    best = [label for label in clear if not above.intersects(label.shape)]
    return (best or clear or candidates)[0]


def _places(shape: shapely.Polygon) -> list[tuple[float, float]]:
    """Return places in a rectangle, the middle first."""
    origin, right, _, up = np.array(shape.exterior.coords)[:4]
    return [
        tuple((origin + across * (right - origin) + along * (up - origin)).tolist())
        for across, along in sorted(
            product(_STEPS, _STEPS), key=lambda p: (p[0] - 0.5) ** 2 + (p[1] - 0.5) ** 2
        )
    ]
