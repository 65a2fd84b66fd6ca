"""Rooms of perpendicular walls as lists of numbers, and how well they explain the columns.

A Manhattan room is a ring of walls that lie across two axes in turn, so one number for each wall,
its place along its axis, is the whole room. Corner k is where walls k and k + 1 cross.
"""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from panoscene.models.layout._columns import RoomColumns

POOLED = 256
"""Columns that rooms are compared in."""
NOISE = math.radians(0.8)
"""Latitude error that costs 1 in a column."""
MOST = math.radians(5.0)
"""Latitude error beyond which a column costs no more."""
CORNER_PRICE = 16.0
"""Of a corner without evidence."""
EVIDENCE = 0.75
"""Part of the price that a certain corner does not pay."""
UNEXPLAINED = 4.0
"""Price of a certain corner that the room has not."""
SHORT, SHORT_PRICE = 0.12, 12.0
"""Length of a wall in camera heights (19 cm) below which it costs up to so much more."""
FAR_AWAY = 1e3
"""Distance in camera heights of a wall that a column does not meet."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """The columns that rooms are compared with, pooled; distances are in camera heights."""

    ceiling: Float[np.ndarray, " columns"]
    floor: Float[np.ndarray, " columns"]
    corner: Float[np.ndarray, " fine"]
    """At every column of the panorama."""
    peaks: Int[np.ndarray, " peaks"]
    """Columns of the panorama where the corner signal peaks."""
    ray: Float[np.ndarray, "columns 2"]
    lon: Float[np.ndarray, " columns"]
    distance: Float[np.ndarray, " columns"]
    above: float


def evidence_of(columns: RoomColumns) -> Evidence:
    """Return the columns for comparison: inverse distances pooled, so that walls stay lines."""
    width = len(columns.floor)
    step = max(width // POOLED, 1)

    def pooled(values: Float[np.ndarray, " fine"]) -> Float[np.ndarray, " columns"]:
        return values.reshape(-1, step).mean(1)

    lon = ((np.arange(width // step) + 0.5) * step / width - 0.5) * 2 * math.pi
    corner = columns.corner.numpy()
    return Evidence(
        ceiling=np.arctan(pooled(np.tan(columns.ceiling.numpy()))),
        floor=np.arctan(pooled(np.tan(columns.floor.numpy()))),
        corner=corner,
        peaks=corner_peaks(corner),
        ray=np.stack((np.sin(lon), np.cos(lon)), axis=-1),
        lon=lon,
        distance=1 / pooled(1 / columns.distance.numpy()),
        above=columns.above,
    )


def corner_peaks(
    corner: Float[np.ndarray, " columns"], *, reach: float = 0.0125, least: float = 0.3
) -> Int[np.ndarray, " peaks"]:
    """Return the columns where the corner signal is highest around, the seam included."""
    window = max(round(reach * len(corner)), 1)
    around = np.stack([np.roll(corner, shift) for shift in range(-window, window + 1)])
    before = around[window + 1 :].max(0)
    return np.nonzero((corner >= around.max(0)) & (corner > before) & (corner > least))[0]


@dataclass(frozen=True, slots=True)
class Walls:
    """A Manhattan room, clockwise from above as longitude runs."""

    axes: Float[np.ndarray, "2 2"]
    """Two perpendicular unit vectors."""
    place: Float[np.ndarray, " walls"]
    """Of each wall along its axis: even walls lie across the first, odd ones across the second."""

    def corners(self) -> Float[np.ndarray, "walls 2"]:
        """Return the corners in the world's axes; corner k ends wall k."""
        return corners_of(self.place[None], self.axes)[0]


def corners_of(
    places: Float[np.ndarray, "rooms walls"], axes: Float[np.ndarray, "2 2"]
) -> Float[np.ndarray, "rooms walls 2"]:
    """Return the corners of several rooms."""
    onward = np.roll(places, -1, axis=1)
    even = np.arange(places.shape[1]) % 2 == 0
    first, second = np.where(even, places, onward), np.where(even, onward, places)
    return first[..., None] * axes[0] + second[..., None] * axes[1]


def seen_walls(
    corners: Float[np.ndarray, "rooms walls 2"], ray: Float[np.ndarray, "columns 2"]
) -> tuple[Float[np.ndarray, "rooms columns"], Int[np.ndarray, "rooms columns"]]:
    """Return how far the first wall is in each column, and which one it is.

    Corner k ends wall k. Where no wall is met the distance is ``FAR_AWAY``.
    """
    x, y = corners[..., 0], corners[..., 1]
    side = ray[:, 0] * y[..., None] - ray[:, 1] * x[..., None]
    right = side > 0
    # few rays meet a wall: only those are divided
    met = np.nonzero(right != np.roll(right, 1, axis=1))
    room, end, column = met
    start = end - 1
    area = x[room, start] * y[room, end] - y[room, start] * x[room, end]
    there = area / (side[met] - side[room, start, column])
    distance = np.full(side.shape, FAR_AWAY)
    distance[met] = np.where(there > 1e-6, there, FAR_AWAY)
    wall = distance.argmin(1)
    return np.take_along_axis(distance, wall[:, None], 1)[:, 0], wall


def column_costs(
    distance: Float[np.ndarray, "*rooms columns"], evidence: Evidence
) -> Float[np.ndarray, "*rooms columns"]:
    """Return how badly walls at some distance explain each column; 1 for an error of ``NOISE``."""
    floor = np.abs(np.arctan(-1 / distance) - evidence.floor)
    ceiling = np.abs(np.arctan(evidence.above / distance) - evidence.ceiling)
    return (np.minimum(floor, MOST) + np.minimum(ceiling, MOST)) / (2 * NOISE)


@dataclass(frozen=True, slots=True)
class Rooms:
    """Manhattan rooms of the same axes and number of walls, and what they cost."""

    place: Float[np.ndarray, "rooms walls"]
    wall: Int[np.ndarray, "rooms columns"]
    """Which wall each column sees."""
    misfit: Float[np.ndarray, " rooms"]
    """Of the columns; infinite for a room that the camera is not inside."""
    price: Float[np.ndarray, " rooms"]
    """Of the corners, and of those that the network saw and the room has not."""

    @property
    def cost(self) -> Float[np.ndarray, " rooms"]:
        """Misfit and price."""
        return self.misfit + self.price

    def chosen(self, which: Int[np.ndarray, " chosen"]) -> "Rooms":
        """Return some of the rooms."""
        return Rooms(self.place[which], self.wall[which], self.misfit[which], self.price[which])

    def where(self, better: Bool[np.ndarray, " rooms"], other: "Rooms") -> "Rooms":
        """Return these rooms, and the others in place of those that they are better than."""
        rows = better[:, None]
        return Rooms(
            np.where(rows, other.place, self.place),
            np.where(rows, other.wall, self.wall),
            np.where(better, other.misfit, self.misfit),
            np.where(better, other.price, self.price),
        )


def rooms_of(
    places: Float[np.ndarray, "rooms walls"], axes: Float[np.ndarray, "2 2"], evidence: Evidence
) -> Rooms:
    """Return rooms and what they cost."""
    corners = corners_of(places, axes)
    distance, wall = seen_walls(corners, evidence.ray)
    misfit = column_costs(distance, evidence).sum(-1)
    lon = np.arctan2(corners[..., 0], corners[..., 1])
    far = np.hypot(corners[..., 0], corners[..., 1])
    width = len(evidence.corner)
    column = ((lon / (2 * math.pi) + 0.5) * width).astype(int) % width
    # a corner is seen when nothing in its column is much nearer
    first = np.take_along_axis(distance, column * distance.shape[-1] // width, axis=1)
    seen = first > 0.9 * far
    found = np.where(seen, evidence.corner[column], 0.0)
    price = (CORNER_PRICE * (1 - EVIDENCE * found)).sum(-1)
    length = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)
    price = price + SHORT_PRICE * np.maximum(1 - length / SHORT, 0.0).sum(-1)
    if len(evidence.peaks):
        apart = np.abs(column[:, :, None] - evidence.peaks)
        apart = np.minimum(apart, width - apart) + width * ~seen[..., None]
        missed = apart.min(1) > width // 64
        price = price + UNEXPLAINED * (missed * evidence.corner[evidence.peaks]).sum(-1)
    outside = (distance >= FAR_AWAY).any(-1) | ~_around(corners)
    return Rooms(places, wall, np.where(outside, np.inf, misfit), price)


def _around(corners: Float[np.ndarray, "rooms walls 2"]) -> Bool[np.ndarray, " rooms"]:
    """Return whether the corners go once clockwise around the camera."""
    lon = np.arctan2(corners[..., 0], corners[..., 1])
    step = np.roll(lon, -1, axis=-1) - lon
    step = (step + math.pi) % (2 * math.pi) - math.pi
    return np.abs(step.sum(-1) - 2 * math.pi) < 1e-6
