"""The Manhattan room that explains boundary signals best, with no more walls than they ask for.

A first room comes from dynamic programming over columns: every column sees one of some dozen
candidate walls, and to change the wall has a price. It has too many walls where the signals
wobble. So pairs of walls are taken out, each time the pair that is missed least, with the walls
left moved to where most of their columns want them, until four are left; of all rooms on the way
the one of least cost is taken. Corners have a price, less where the network saw one.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int

from panoscene.models.layout._columns import RoomColumns
from panoscene.models.layout._walls import (
    Evidence,
    Rooms,
    Walls,
    column_costs,
    evidence_of,
    rooms_of,
    seen_walls,
)

CANDIDATES = 40
"""Walls that dynamic programming chooses from, at most."""
RATIO = 1.03
"""Between places of a wall that are tried."""
FIRST_PRICE = 4.0
"""Of a change of wall in the first room; less than a corner's, for walls are taken out later."""
MOST_WALLS = 20
"""Of the first room."""
BEHIND = 1e-2
"""Camera heights at which a column is taken to see a wall that is behind it: it fits nowhere."""
GAP = math.radians(2.0)
"""Jump of latitude from which a change of wall hides something."""
TRIED = 3
"""Rooms with two walls less that are looked at closely."""
MANY = 12
"""Walls above which fewer are."""
USUAL_MISFIT = 0.4
"""Misfit of half the columns, up to which corners have their price; above it they cost more."""
MOST_NOISE = 4.0
TURNS = tuple(math.radians(turn) for turn in (-2.0, 2.0, -0.7, 0.7))


@dataclass(frozen=True, slots=True)
class Fit:
    """A Manhattan room and what it costs."""

    walls: Walls
    misfit: float
    price: float
    """Of its corners."""
    noise: float = 1.0
    """Factor by which the signals are noisier than usual."""

    @property
    def cost(self) -> float:
        """Misfit in units of the noise, and price."""
        return self.misfit / self.noise + self.price


def manhattan_fits(columns: RoomColumns) -> list[Fit]:
    """Return the best Manhattan room with each number of walls, cheapest first.

    Empty when no such room has the camera inside.
    """
    evidence = evidence_of(columns)
    best: dict[int, Fit] = {}
    for turn in room_directions(evidence)[:2]:
        axes = axes_of(turn)
        place = first_places(evidence, axes)
        for start in ([] if place is None else [place]) + [cuboid_places(evidence, axes)]:
            for fit in _thinned(start, axes, evidence):
                count = len(fit.walls.place)
                if count not in best or fit.cost < best[count].cost:
                    best[count] = fit
    if not best:
        return []
    noise = _noise(min(best.values(), key=lambda fit: fit.misfit), evidence)
    ranked = sorted((replace(fit, noise=noise) for fit in best.values()), key=lambda fit: fit.cost)
    ranked[0] = _turned(ranked[0], evidence)
    return ranked


def _noise(closest: Fit, evidence: Evidence) -> float:
    """Return how noisy the signals are, from what the room of least misfit leaves."""
    distance, _ = seen_walls(closest.walls.corners()[None], evidence.ray)
    left = float(np.median(column_costs(distance[0], evidence)))
    return min(max(left / USUAL_MISFIT, 1.0), MOST_NOISE)


def axes_of(turn: float) -> Float[np.ndarray, "2 2"]:
    """Return two perpendicular axes, the first at an angle from +x, counter-clockwise."""
    return np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])


def room_directions(evidence: Evidence, *, reach: int = 6) -> list[float]:
    """Return likely directions of the walls, modulo a quarter turn, likeliest first.

    Every chord between two columns a few apart votes for its direction, with its angular width
    on the ceiling and the floor plan's precision as weight: chords along one wall agree.
    """
    point = evidence.ray * evidence.distance[:, None]
    chord = np.roll(point, -reach, axis=0) - point
    length = np.hypot(chord[:, 0], chord[:, 1])
    far = np.hypot(point[:, 0], point[:, 1])
    # a jump from a near to a far wall is no wall; far walls are drawn less well
    ratio = np.roll(far, -reach) / far
    weight = length / (1 + far) * (np.abs(np.log(ratio)) < 0.3)
    direction = np.arctan2(chord[:, 1], chord[:, 0]) % (math.pi / 2)
    bins = 90
    votes = np.zeros(bins)
    np.add.at(votes, (direction / (math.pi / 2) * bins).astype(int) % bins, weight)
    offset = np.arange(bins)
    kernel = np.exp(-0.5 * (np.minimum(offset, bins - offset) / 3.0) ** 2)
    smooth = np.fft.irfft(np.fft.rfft(votes) * np.fft.rfft(kernel), n=bins)
    peak = (smooth >= np.roll(smooth, 1)) & (smooth > np.roll(smooth, -1))
    order = [k for k in np.argsort(-smooth).tolist() if peak[k]]
    found = []
    for k in order:
        if smooth[k] < 0.5 * smooth[order[0]]:
            break
        near = (direction - (k + 0.5) * math.pi / 180 + math.pi / 4) % (math.pi / 2) - math.pi / 4
        close = weight * (np.abs(near) < math.radians(8))
        shift = float((near * close).sum() / max(close.sum(), 1e-12))
        found.append((k + 0.5) * math.pi / 180 + shift)
    return found or [0.0]


def cuboid_places(
    evidence: Evidence, axes: Float[np.ndarray, "2 2"], *, part: float = 0.75
) -> Float[np.ndarray, "4"]:
    """Return the walls of a cuboid around the camera: far quantiles of the columns' places."""
    along = evidence.ray @ axes.T * evidence.distance[:, None]
    # clockwise: front (second axis), right (first axis), back, left
    right, left = (
        np.quantile(along[along[:, 0] > 0, 0], part),
        np.quantile(-along[along[:, 0] < 0, 0], part),
    )
    front, back = (
        np.quantile(along[along[:, 1] > 0, 1], part),
        np.quantile(-along[along[:, 1] < 0, 1], part),
    )
    return np.array([right, -back, -left, front])


def first_places(
    evidence: Evidence, axes: Float[np.ndarray, "2 2"]
) -> Float[np.ndarray, " walls"] | None:
    """Return a room with rather too many walls, or None when the columns give none."""
    axis, place = _candidates(evidence, axes)
    if not len(place):
        return None
    facing = _nonzero(evidence.ray @ axes.T).T
    distance = place[:, None] / facing[axis]
    cost = column_costs(np.where(distance > 0, distance, BEHIND), evidence)
    price = FIRST_PRICE
    while True:
        states = _cheapest_ring(cost, evidence, price)
        change = np.nonzero(states != np.roll(states, 1))[0]
        if len(change) <= MOST_WALLS:
            break
        price *= 2
    if len(change) < 3:
        return None
    wall = list(zip(axis.tolist(), place.tolist(), strict=True))
    ring: list[tuple[int, float]] = []
    for here in change.tolist():
        before, after = wall[int(states[here - 1])], wall[int(states[here])]
        lon = evidence.lon[here] - math.pi / len(evidence.lon)
        ray = axes @ np.array([math.sin(lon), math.cos(lon)])
        ring += [*_between(*before, *after, ray), after]
    return _alternating(ring)


def _candidates(
    evidence: Evidence, axes: Float[np.ndarray, "2 2"]
) -> tuple[Int[np.ndarray, " states"], Float[np.ndarray, " states"]]:
    """Return axis and place of the walls that many columns see."""
    grid = 0.1 * RATIO ** np.arange(math.ceil(math.log(160) / math.log(RATIO)))
    axis = np.repeat([0, 0, 1, 1], len(grid))
    place = np.concatenate((grid, -grid, grid, -grid))
    facing = _nonzero(evidence.ray @ axes.T).T
    # a column sees the wall on one side only: both sides share the costs in front of the camera
    ahead = column_costs(grid[:, None] / np.abs(facing[:, None]), evidence)
    behind = column_costs(np.full(len(evidence.ray), BEHIND), evidence)
    near = np.stack((facing, -facing), axis=1) > 0
    cost = np.where(near[:, :, None], ahead[:, None], behind)
    support = np.maximum(0.0, 2.0 - cost).sum(-1).reshape(4, -1)
    padded = np.pad(support, ((0, 0), (2, 2)))
    around = np.stack([padded[:, shift : shift + len(grid)] for shift in range(5)])
    peak = (support >= around.max(0)) & (support > 2.0)
    chosen = np.nonzero(peak.ravel())[0]
    chosen = chosen[np.argsort(-support.ravel()[chosen])][:CANDIDATES]
    return axis[chosen], place[chosen]


def _cheapest_ring(
    cost: Float[np.ndarray, "states columns"], evidence: Evidence, first_price: float
) -> Int[np.ndarray, " columns"]:
    """Return the candidate that each column sees, around the seam (Viterbi's algorithm)."""
    states, columns = cost.shape
    step = len(evidence.corner) // columns
    corner = evidence.corner.reshape(columns, step).max(1)
    price = first_price * (1 - 0.75 * np.maximum(corner, np.roll(corner, 1)))
    total = np.zeros(states)
    came = np.zeros((2 * columns, states), dtype=np.int64)
    own = np.arange(states)
    # twice around: the second lap starts as the first one ended
    for lap in range(2 * columns):
        here = lap % columns
        least = int(total.argmin())
        stays = total <= total[least] + price[here]
        came[lap] = np.where(stays, own, least)
        total = np.where(stays, total, total[least] + price[here]) + cost[:, here]
    path = np.zeros(2 * columns, dtype=np.int64)
    path[-1] = int(total.argmin())
    for lap in range(2 * columns - 1, 0, -1):
        path[lap - 1] = came[lap, path[lap]]
    # the middle of the two laps does not know of their ends
    half = columns // 2
    return np.roll(path[half : half + columns], half)


def _between(
    axis: int, place: float, next_axis: int, next_place: float, ray: Float[np.ndarray, "2"]
) -> list[tuple[int, float]]:
    """Return the walls that are hidden where one wall follows another along a ray."""
    end, start = place / _away(ray[axis]), next_place / _away(ray[next_axis])
    if axis == next_axis:
        return [(1 - axis, float(min(end, start) * ray[1 - axis]))]
    if abs(math.atan(1 / max(end, 1e-3)) - math.atan(1 / max(start, 1e-3))) < GAP:
        return []
    return [(1 - axis, float(end * ray[1 - axis])), (axis, float(start * ray[axis]))]


def _alternating(ring: list[tuple[int, float]]) -> Float[np.ndarray, " walls"] | None:
    """Return the places of a ring of walls that starts with the first axis."""
    axes = [axis for axis, _ in ring]
    if len(ring) < 4 or any(axes[k] == axes[k - 1] for k in range(len(ring))):
        return None
    first = axes.index(0)
    return np.array([place for _, place in ring[first:] + ring[:first]])


def _thinned(
    place: Float[np.ndarray, " walls"], axes: Float[np.ndarray, "2 2"], evidence: Evidence
) -> list[Fit]:
    """Return the room and what is left of it as walls are taken out, two at a time."""
    fits: list[Fit] = []
    room = _settled(rooms_of(place[None], axes, evidence), axes, evidence)
    while True:
        if math.isfinite(room.misfit[0]):
            fits.append(_fit(room, axes))
        place = room.place[0]
        if len(place) <= 4:
            return fits
        many = len(place) > MANY
        places = np.stack([_without(place, k) for k in range(len(place))])
        fewer = rooms_of(places, axes, evidence)
        tried = fewer.chosen(np.argsort(fewer.cost)[: 1 if many else TRIED])
        tried = _settled(tried, axes, evidence, rounds=1 if many else 3)
        room = tried.chosen(np.array([tried.cost.argmin()]))


def _fit(room: Rooms, axes: Float[np.ndarray, "2 2"], noise: float = 1.0) -> Fit:
    return Fit(Walls(axes, room.place[0]), float(room.misfit[0]), float(room.price[0]), noise)


def _without(place: Float[np.ndarray, " walls"], k: int) -> Float[np.ndarray, " fewer"]:
    """Return the places without wall k and the next one; the first axis still comes first."""
    count = len(place)
    if k == count - 1:
        # the ring then starts with the second axis: move its first wall to the end
        return np.roll(place[1:-1], -1)
    return np.delete(place, [k, k + 1])


def _settled(
    rooms: Rooms, axes: Float[np.ndarray, "2 2"], evidence: Evidence, *, rounds: int = 3
) -> Rooms:
    """Return the rooms with each wall moved to a weighted median of its columns, if that helps."""
    best, here = rooms, rooms
    moving = np.ones(len(rooms.place), dtype=np.bool_)
    for _ in range(rounds):
        moved = rooms_of(_moved(here, axes, evidence), axes, evidence)
        best = best.where(moving & (moved.cost < best.cost), moved)
        moving &= ~np.isclose(moved.place, here.place, atol=1e-3).all(1)
        if not moving.any():
            break
        here = moved
    return best


def _moved(
    rooms: Rooms, axes: Float[np.ndarray, "2 2"], evidence: Evidence
) -> Float[np.ndarray, "rooms walls"]:
    """Return where most of the columns that see a wall want it: their weighted median."""
    facing = evidence.ray @ axes.T
    across = np.where(rooms.wall % 2 == 0, facing[:, 0], facing[:, 1])
    implied = across * evidence.distance
    # change of latitude with the wall's place
    weight = np.abs(across) / (1 + evidence.distance**2)
    order = implied.argsort(1)
    implied, weight, wall = (
        np.take_along_axis(values, order, 1) for values in (implied, weight, rooms.wall)
    )
    mine = wall[:, None, :] == np.arange(rooms.place.shape[1])[:, None]
    total = np.where(mine, weight[:, None, :], 0.0).cumsum(2)
    median = (mine & (total >= total[:, :, -1:] / 2)).argmax(2)
    return np.where(mine.any(2), np.take_along_axis(implied, median, 1), rooms.place)


def _turned(fit: Fit, evidence: Evidence) -> Fit:
    """Return the room turned a little where that fits better."""
    for turn in TURNS:
        axes = fit.walls.axes @ axes_of(turn)
        room = rooms_of(fit.walls.place[None], axes, evidence)
        turned = _fit(_settled(room, axes, evidence), axes, fit.noise)
        if turned.cost < fit.cost:
            fit = turned
    return fit


def _nonzero(values: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    return np.where(np.abs(values) < 1e-6, 1e-6, values)


def _away(value: float) -> float:
    return float(value) if abs(value) > 1e-3 else math.copysign(1e-3, value)
