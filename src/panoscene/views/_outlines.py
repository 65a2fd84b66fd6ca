"""Thin dark lines where objects, their faces and the parts of the room meet in a picture."""

import numpy as np
from jaxtyping import Bool, Float, Int32, Int64

from panoscene.style import ALARM, INK
from panoscene.views._light import pad
from panoscene.views._model import Model
from panoscene.views._painter import FINE

_SILHOUETTE, _CREASE, _SHELL_EDGE = 0.95, 0.55, 0.40
"""Strength of lines around objects, between their faces, and between parts of the room."""
_ALARM = 1.0
"""Strength of lines around objects that collide; no other line has it."""


def edges(
    label: Int32[np.ndarray, "rows columns"], *, circular: bool
) -> Bool[np.ndarray, "rows columns"]:
    """Return which pixels have another label among their eight neighbours."""
    padded = pad(label, 1, circular=circular)
    low = high = padded[:, 1:-1]
    low = np.minimum(np.minimum(padded[:, :-2], padded[:, 2:]), low)
    high = np.maximum(np.maximum(padded[:, :-2], padded[:, 2:]), high)
    low = np.minimum(np.minimum(low[:-2], low[2:]), low[1:-1])
    high = np.maximum(np.maximum(high[:-2], high[2:]), high[1:-1])
    return low != high


def outlines(
    facet: Int32[np.ndarray, "fine_rows fine_columns"],
    model: Model,
    alarmed: frozenset[int],
    *,
    circular: bool,
) -> list[tuple[Float[np.ndarray, "rows columns"], str]]:
    """Return how dark lines are in each pixel, and their colour, from the facets in sub-pixels.

    Args:
        facet: of each sub-pixel; -1 for nothing.
        model: what the facets belong to.
        alarmed: objects that are outlined in the colour of collisions.
        circular: whether the last column is next to the first.
    """
    rows, columns = facet.shape
    half = max(1, round(FINE * min(rows // FINE, 1200) / 900))
    # the last entry is for -1, nothing
    face_of = np.full(int(model.facet.max(initial=-1)) + 2, -1, np.int64)
    face_of[model.facet] = np.arange(len(model.facet))
    strength = np.zeros(rows * columns, np.float32)
    borders = []
    alarm = np.isin(model.item, list(alarmed))
    for one, two, step in _borders(facet, circular=circular):
        faces = face_of[facet[one]], face_of[facet[two]]
        borders.append((one, two, step, _line_weight(model, alarm, *faces)))
    for level in map(np.float32, (_SHELL_EDGE, _CREASE, _SILHOUETTE, _ALARM)):
        for one, two, (down, right), weight in borders:
            chosen = weight == level
            for (row, column), outwards in ((one, -1), (two, 1)):
                for k in range(half):
                    i = np.clip(row[chosen] + outwards * k * down, 0, rows - 1)
                    j = column[chosen] + outwards * k * right
                    j = j % columns if circular else j.clip(0, columns - 1)
                    strength[i * columns + j] = level
    drawn = np.flatnonzero(strength)
    i, j = np.divmod(drawn, columns)
    pixel = (i // FINE) * (columns // FINE) + j // FINE
    size = (rows // FINE, columns // FINE)
    found = []
    for chosen, ink in ((strength[drawn] < _ALARM, INK), (strength[drawn] == _ALARM, ALARM)):
        part = strength[drawn[chosen]] / FINE**2
        total = np.bincount(pixel[chosen], part, minlength=size[0] * size[1])
        found.append((total.reshape(size).astype(np.float32), ink))
    return found


_Place = tuple[Int64[np.ndarray, " borders"], Int64[np.ndarray, " borders"]]


def _borders(
    label: Int32[np.ndarray, "rows columns"], *, circular: bool
) -> list[tuple[_Place, _Place, tuple[int, int]]]:
    """Return rows and columns of neighbours with different labels, and the step between them."""
    i, j = np.nonzero(label[:, :-1] != label[:, 1:])
    borders = [((i, j), (i, j + 1), (0, 1))]
    i, j = np.nonzero(label[:-1] != label[1:])
    borders.append(((i, j), (i + 1, j), (1, 0)))
    if circular:
        (i,) = np.nonzero(label[:, -1] != label[:, 0])
        borders.append(((i, np.full_like(i, label.shape[1] - 1)), (i, np.zeros_like(i)), (0, 1)))
    return borders


def _line_weight(
    model: Model,
    alarm: Bool[np.ndarray, " faces"],
    one: Int64[np.ndarray, " n"],
    two: Int64[np.ndarray, " n"],
) -> Float[np.ndarray, " n"]:
    """Return the strength of the line between two triangles; -1 is nothing."""
    items = [np.where(face >= 0, model.item[face], -1) for face in (one, two)]
    alarms = [np.where(face >= 0, alarm[face], False) for face in (one, two)]
    outer = items[0] != items[1]
    weight = np.where(items[0] >= 0, _CREASE, _SHELL_EDGE)
    weight = np.where(outer, _SILHOUETTE, weight)
    return np.where(outer & (alarms[0] | alarms[1]), _ALARM, weight).astype(np.float32)
