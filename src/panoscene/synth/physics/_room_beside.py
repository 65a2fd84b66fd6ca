"""Finding room beside the place where something was put."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float64

from ._contact import blocked_moves, merged
from ._rest import Rest, rest
from ._solids import Solid, turned

_LIFTED = (0.02, 0.05)
"""Heights at which bodies are taken aside, so that they pass over what is uneven."""
_SPARE = 0.003
_SINK = 0.08


def room_beside(
    body: Solid, others: Mapping[int, Solid], support: Solid, farthest: float
) -> tuple[Solid, Rest] | None:
    """Return a body at the nearest place where it can stand on its support, and how it rests.

    Four ways are tried: to the front, the sides and the back of what it stands on, each just so
    far that it is free; then it is let down. None when no way leads to such a place.

    Args:
        body: What is in something else.
        others: All that it could be in or stand on, by key; the support is one of them.
        support: What it stands on.
        farthest: Longest way in metres.
    """
    right, front, up = turned(support.yaw).T
    ways = (front, right, -right, -front)
    exits = [
        (_exit(body.shifted(height * up), others, way, farthest), height, k)
        for height in _LIFTED
        for k, way in enumerate(ways)
    ]
    for length, _, k in sorted(exits):
        if length > farthest:
            break
        at = body.shifted((length + _SPARE) * ways[k])
        found = rest(at, others)
        key = found.support
        if found.free and found.lift > -_SINK and key is not None and others[key] is support:
            return at.shifted(found.lift * up), found
    return None


def _exit(
    body: Solid, others: Mapping[int, Solid], way: Float64[np.ndarray, " 3"], farthest: float
) -> float:
    """Return how far a body must go along a way until it is free; infinite when too far."""
    vertical = np.array([0.0, 0.0, 1.0])
    frame = np.stack([np.cross(vertical, way), vertical, way])
    found = [blocked_moves(body, other, frame, farthest) for other in others.values()]
    union = merged(np.concatenate([np.zeros((0, 2)), *found]))
    around = union[(union[:, 0] < 0) & (union[:, 1] > 0)]
    if not len(around):
        return 0.0
    length = float(around[0, 1])
    return length if length <= farthest else np.inf
