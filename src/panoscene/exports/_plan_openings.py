"""Doors and windows as openings of the walls they lie in."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import shapely
from jaxtyping import Float

from panoscene.style import WALL_THICKNESS

MOST_AWAY = 0.35
"""Metres between a door's or window's nearer side and the wall it belongs to, at most."""
MOST_TURNED = math.radians(25)
NARROWEST = 0.05
DOUBLE_FROM = 1.3
"""Metres of width from which a door has two leaves."""


@dataclass(frozen=True, slots=True)
class Leaf:
    """A leaf of a door, open at a right angle."""

    hinge: Float[np.ndarray, " 2"]
    tip: Float[np.ndarray, " 2"]
    """Where the leaf ends when it is open."""
    closed: Float[np.ndarray, " 2"]
    """Where it ends when it is closed."""

    def arc(self, steps: int = 24) -> Float[np.ndarray, "points 2"]:
        """Return points on the quarter circle from closed to open."""
        angle = np.linspace(0.0, math.pi / 2, steps)[:, None]
        across, ahead = self.closed - self.hinge, self.tip - self.hinge
        return self.hinge + np.cos(angle) * across + np.sin(angle) * ahead


@dataclass(frozen=True, slots=True)
class Opening:
    """A door or a window in a wall."""

    name: str
    """Of the object."""
    kind: Literal["door", "window"]
    wall: int
    start: float
    """Metres from the wall's first corner to the opening."""
    end: float
    inner: Float[np.ndarray, "2 2"]
    """Its ends on the inner face of the wall."""
    outwards: Float[np.ndarray, " 2"]
    """Unit vector out of the room."""
    leaves: tuple[Leaf, ...]
    """Of a door; none of a window."""

    @property
    def width(self) -> float:
        """Metres between the jambs."""
        return self.end - self.start

    def line(self, share: float) -> Float[np.ndarray, "2 2"]:
        """Return the line across the opening at a share of the wall's thickness from inside."""
        return self.inner + share * WALL_THICKNESS * self.outwards

    @property
    def gap(self) -> shapely.Polygon:
        """What it takes out of the wall, and a little more on both faces."""
        return shapely.Polygon([*self.line(-0.05), *self.line(1.05)[::-1]])

    @property
    def swing(self) -> shapely.Geometry:
        """The floor that the leaves sweep; nothing for a window."""
        return shapely.unary_union(
            [shapely.Polygon([leaf.hinge, *leaf.arc()]) for leaf in self.leaves]
        )


def find_openings(
    corners: Float[np.ndarray, "corners 2"],
    pieces: list[tuple[str, str, Float[np.ndarray, "4 2"]]],
) -> tuple[tuple[Opening, ...], list[int]]:
    """Return the openings, and which of the pieces are none.

    Args:
        corners: Inner faces of the walls, counter-clockwise.
        pieces: Name, category and footprint of each object; doors and windows can become openings.
    """
    openings: list[Opening] = []
    rest: list[int] = []
    for index, (name, category, footprint) in enumerate(pieces):
        opening = None
        if category in {"door", "window"}:
            kind: Literal["door", "window"] = "door" if category == "door" else "window"
            opening = _opening(corners, name, kind, footprint)
        if opening is None:
            rest.append(index)
        else:
            openings.append(opening)
    return tuple(openings), rest


def _opening(
    corners: Float[np.ndarray, "corners 2"],
    name: str,
    kind: Literal["door", "window"],
    footprint: Float[np.ndarray, "4 2"],
) -> Opening | None:
    """Return the opening in the nearest wall that the piece is parallel to, if there is one."""
    ends = np.roll(corners, -1, axis=0)
    length = np.linalg.norm(ends - corners, axis=1)
    along = (ends - corners) / length[:, None]
    # the longer side of the piece lies along its wall, whichever way it faces
    sides = footprint[[1, 2]] - footprint[[0, 1]]
    side = sides[int(np.argmax(np.linalg.norm(sides, axis=1)))]
    side = side / max(float(np.linalg.norm(side)), 1e-9)
    shape = shapely.Polygon(footprint)
    lines = shapely.linestrings(np.stack([corners, ends], axis=1))
    away = shapely.distance(lines, shape)
    place = np.einsum("ijk,ik->ij", footprint[None] - corners[:, None], along)
    start, end = np.maximum(place.min(1), 0.0), np.minimum(place.max(1), length)
    fits = (np.abs(along @ side) > math.cos(MOST_TURNED)) & (away <= MOST_AWAY)
    fits &= end - start > NARROWEST
    if not fits.any():
        return None
    wall = int(np.argmin(np.where(fits, shapely.distance(lines, shape.centroid), np.inf)))
    first, last = float(start[wall]), float(end[wall])
    inner = corners[wall] + np.array([[first], [last]]) * along[wall]
    outwards = np.array([along[wall, 1], -along[wall, 0]])
    leaves: tuple[Leaf, ...] = ()
    if kind == "door":
        left_is_nearer = first <= length[wall] - last
        leaves = _leaves(inner if left_is_nearer else inner[::-1], -outwards)
    return Opening(name, kind, wall, first, last, inner, outwards, leaves)


def _leaves(ends: Float[np.ndarray, "2 2"], inwards: Float[np.ndarray, " 2"]) -> tuple[Leaf, ...]:
    """Return one leaf hinged at the first of the ends, or two that meet in the middle."""
    width = float(np.linalg.norm(ends[1] - ends[0]))
    if width < DOUBLE_FROM:
        return (Leaf(ends[0], ends[0] + width * inwards, ends[1]),)
    middle = ends.mean(0)
    return tuple(Leaf(end, end + width / 2 * inwards, middle) for end in ends)
