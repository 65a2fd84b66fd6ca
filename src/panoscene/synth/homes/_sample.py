"""Homes without furniture: floor plans with doors and windows."""

import numpy as np
import shapely
from jaxtyping import Float

from ._bands import Draft, draft_plan
from ._corners import add_corners, polygon_of
from ._doors import sample_doorways
from ._manhattan import area_of, inset, walls_of
from ._program import AREA, LEAST_WIDTH, sample_program
from ._records import Home, Room, RoomKind
from ._windows import front_door, outer_parts, sample_windows

_ATTEMPTS = 400
_LARGEST_ASPECT: dict[RoomKind, float] = {"hall": 8.0, "open_plan": 2.6}
_USUAL_ASPECT = 2.3
_LOW_CEILING = 2.3
"""Metres."""


def sample_home(seed: int | np.random.Generator, *, rooms: int | None = None) -> Home:
    """Return a home without furniture: an apartment or a one-storey house.

    Rooms have right angles and lie along a hall or around a large room; most have 4 corners, some
    6, 8, 10 or more (L-shapes, shafts, chimney breasts, bays, balconies cut out). All rooms can be
    reached through doorways; the front door and the windows are in outer walls.

    Args:
        seed: number of the home, or a source of randomness from which the number is drawn.
        rooms: 2 to 8; random when None.

    Raises:
        ValueError: if the number of rooms is another one, or the seed is negative.

    Examples:
        >>> home = sample_home(7, rooms=5)
        >>> len(home.rooms), sum(opening.leads_to is None for opening in home.openings) > 3
        (5, True)
    """
    if isinstance(seed, np.random.Generator):
        seed = int(seed.integers(2**31))
    if seed < 0:
        raise ValueError(f"seed must be 0 or more, found {seed}")
    rng = np.random.default_rng([seed, 1])
    needs = sample_program(rng, rooms)
    for attempt in range(_ATTEMPTS):
        if attempt % 30 == 29:  # these rooms do not go together
            needs = sample_program(rng, len(needs))
        home = _try_home(rng, seed, needs)
        if home is not None:
            return home
    raise RuntimeError(f"no floor plan was found for seed {seed}")  # not seen in 100,000 seeds


def _try_home(rng: np.random.Generator, seed: int, needs: list) -> Home | None:
    thickness = float(rng.choice([0.10, 0.12, 0.14, 0.16, 0.20]))
    drafts = draft_plan(rng, needs)
    if not all(_may_be_humane(draft) for draft in drafts):
        return None
    add_corners(rng, drafts)
    outlines = [polygon_of(draft) for draft in drafts]
    clear = [inset(polygon, thickness / 2) for polygon in outlines if polygon is not None]
    if len(clear) < len(drafts) or not all(
        _is_humane(draft.kind, polygon) for draft, polygon in zip(drafts, clear, strict=True)
    ):
        return None
    turn = _random_turn(rng)
    solids = [_turned_rect(np.array(cut), turn) for draft in drafts for cut in _shafts(draft)]
    polygons = [_turned(polygon, turn) for polygon in clear]
    heights = _ceilings(rng, [draft.kind for draft in drafts])
    rooms = [
        Room(draft.kind, polygon, height)
        for draft, polygon, height in zip(drafts, polygons, heights, strict=True)
    ]
    parts = outer_parts(rooms, np.array(solids, dtype=np.float64).reshape(-1, 4), thickness)
    entrance = front_door(rng, parts)
    doors = None if entrance is None else sample_doorways(rng, rooms, thickness, entrance)
    if entrance is None or doors is None:
        return None
    doors = [*doors, entrance]
    windows = sample_windows(rng, rooms, parts, doors)
    lit = {window.room for window in windows}
    if any(
        k not in lit and room.kind not in ("hall", "bathroom", "laundry")
        for k, room in enumerate(rooms)
    ):
        return None
    return Home(seed, tuple(rooms), (*doors, *windows), (), thickness)


def _may_be_humane(draft: Draft) -> bool:
    """Return False for rooms that are far too long or large already before they are cut."""
    rects = np.array(draft.rects)
    extent = np.sort(rects[:, 2:].max(axis=0) - rects[:, :2].min(axis=0))
    area = float((rects[:, 2:] - rects[:, :2]).prod(axis=1).sum())
    low, high = AREA[draft.kind]
    longest = _LARGEST_ASPECT.get(draft.kind, _USUAL_ASPECT)
    return bool(0.72 * low <= area <= 1.75 * high and extent[1] <= longest * (extent[0] + 0.1))


def _is_humane(kind: RoomKind, polygon: Float[np.ndarray, "corners 2"]) -> bool:
    """Return whether a room is neither too small, too large, too narrow nor full of slivers."""
    extent = np.sort(np.ptp(polygon, axis=0))
    area, (low, high) = area_of(polygon), AREA[kind]
    if not 0.72 * low <= area <= 1.4 * high:
        return False
    if extent[1] / extent[0] > _LARGEST_ASPECT.get(kind, _USUAL_ASPECT):
        return False
    if walls_of(polygon).length.min() < 0.22:
        return False
    if kind == "hall":
        return bool(extent[1] <= 11.0)
    shape = shapely.Polygon(polygon)
    narrow = 0.42 * LEAST_WIDTH[kind]
    core = shape.buffer(-narrow, join_style="mitre")
    if core.is_empty or isinstance(core, shapely.MultiPolygon):
        return False
    roomy = shape.buffer(-0.45, join_style="mitre").buffer(0.45, join_style="mitre")
    # nothing but the core and alcoves that one can stand in
    return isinstance(roomy, shapely.Polygon) and roomy.area >= 0.94 * area


def _ceilings(rng: np.random.Generator, kinds: list[RoomKind]) -> list[float]:
    """Return ceiling heights: one for a home, sometimes lower in halls and bathrooms."""
    old = rng.random() < 0.2
    usual = rng.uniform(2.85, 3.4) if old else rng.uniform(2.36, 2.85)
    lowered = rng.random() < 0.3
    heights: list[float] = []
    for kind in kinds:
        height = usual
        if lowered and kind in ("hall", "bathroom", "laundry") and rng.random() < 0.7:
            height = max(_LOW_CEILING, usual - rng.uniform(0.12, 0.4))
        elif rng.random() < 0.04:
            height = float(np.clip(usual + rng.uniform(-0.25, 0.4), _LOW_CEILING, 3.4))
        heights.append(round(float(height), 2))
    return heights


def _shafts(draft: Draft) -> list:
    """Return the solid blocks in a room; larger cuts are balconies, which are open air."""
    return [cut for cut in draft.cuts if min(cut[2] - cut[0], cut[3] - cut[1]) < 1.1]


def _random_turn(rng: np.random.Generator) -> Float[np.ndarray, "2 2"]:
    """Return a quarter turn, mirrored or not."""
    turn = np.linalg.matrix_power(np.array([[0.0, -1.0], [1.0, 0.0]]), int(rng.integers(4)))
    return turn @ np.diag([rng.choice([-1.0, 1.0]), 1.0])


def _turned(
    polygon: Float[np.ndarray, "corners 2"], turn: Float[np.ndarray, "2 2"]
) -> Float[np.ndarray, "corners 2"]:
    """Return a turned polygon, counter-clockwise again if the turn mirrors."""
    result = polygon @ turn.T
    return result if np.linalg.det(turn) > 0 else result[::-1].copy()


def _turned_rect(
    rect: Float[np.ndarray, " 4"], turn: Float[np.ndarray, "2 2"]
) -> Float[np.ndarray, " 4"]:
    points = rect.reshape(2, 2) @ turn.T
    return np.concatenate([points.min(axis=0), points.max(axis=0)])
