"""Letting meshes down on what is under them, exactly, and measuring the gap below."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float64

from ._contact import TOUCH, UPRIGHT, Intervals, blocked_moves, blocked_on, merged, shared_columns
from ._solids import Solid

_SAME = 1e-6
MOST_LIFT = 0.06
"""Metres that bodies are lifted at most, where nobody says otherwise."""


@dataclass(frozen=True, slots=True)
class Rest:
    """Where a mesh comes to rest when it only moves up or down."""

    lift: float
    """Metres upwards to that place; negative when it hung in the air."""
    support: int | None
    """Key of what it rests on; None for the floor."""
    free: bool
    """Whether that place is free: it is not when the way up is too long."""


_Places = tuple[float, ...]


@dataclass(slots=True)
class Falls:
    """Remembers how far bodies are from each other on the way up and down.

    To settle a room, bodies are let down on the same others again and again, and only their heights
    have changed.
    """

    _known: dict[tuple[int, int], tuple[_Places, float, Intervals]] = field(
        default_factory=dict[tuple[int, int], tuple[_Places, float, Intervals]]
    )

    def blocked(self, pair: tuple[int, int], body: Solid, other: Solid, reach: float) -> Intervals:
        """Return what ``blocked_moves`` says of moves of a body straight up.

        Args:
            pair: Keys of the two; a key always means the same model in the same size.
            body: Moves.
            other: Stays.
            reach: Only moves up to this length are of interest.
        """
        columns = shared_columns(body, other, UPRIGHT, reach)
        if columns is None:
            return np.zeros((0, 2))
        places = (*body.position[:2].tolist(), body.yaw, *other.position[:2].tolist(), other.yaw)
        above = float(body.position[2] - other.position[2])
        known = self._known.get(pair)
        if known is not None and known[0] == places:
            return known[2] + (known[1] - above)
        found = blocked_on(body, other, UPRIGHT, columns)
        self._known[pair] = (places, above, found)
        return found


def rest(
    body: Solid,
    others: Mapping[int, Solid],
    *,
    floor: float = 0.0,
    most_lift: float = MOST_LIFT,
    most_fall: float = 3.0,
    blocked: Callable[[int, Solid, float], Intervals] | None = None,
) -> Rest:
    """Return where a mesh rests: down on the next surface below, or up out of what it is in.

    Args:
        body: What moves.
        others: What it can rest on or bump into, by a key of the caller.
        floor: Height of the floor in metres.
        most_lift: Longest way up that is tried.
        most_fall: Longest way down that is looked at.
        blocked: What is known of the moves that one of the others blocks, by its key.
    """
    reach = max(most_lift, most_fall) + TOUCH
    if blocked is None:
        found = {key: blocked_moves(body, other, UPRIGHT, reach) for key, other in others.items()}
    else:
        found = {key: blocked(key, other, reach) for key, other in others.items()}
    ground = floor - body.low
    union = merged(np.concatenate([np.zeros((0, 2)), *found.values()]))
    start = max(0.0, ground)
    lift, free = _settle(union, start, ground, start + most_lift)
    touched = [key for key, moves in found.items() if _ends_at(moves, lift)]
    return Rest(lift, touched[0] if touched and lift > ground + _SAME else None, free)


def _settle(
    blocked: Float64[np.ndarray, "n 2"], start: float, ground: float, highest: float
) -> tuple[float, bool]:
    """Return the move to a resting place, and whether it is free."""
    around = blocked[(blocked[:, 0] < start) & (blocked[:, 1] > start)]
    if len(around):
        down, up = (float(v) for v in around[0])
        if up <= highest:
            return up, True
        if down < ground or start - down > highest - start:
            return start, False
        start = down
    below = blocked[blocked[:, 1] <= start + _SAME, 1]
    return max(ground, float(below.max())) if len(below) else ground, True


def _ends_at(moves: Float64[np.ndarray, "n 2"], lift: float) -> bool:
    return bool((np.abs(moves[:, 1] - lift) < 10 * TOUCH).any())
