"""Three orthogonal directions that most segments point to: votes first, then least squares."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from ._segments import Segments

MOST_TILT = np.radians(40)
"""The vertical is looked for within this angle of the photo's top."""

_SPACING = np.radians(2.0)
_VOTE_ERROR = np.radians(1.2)
_APART = np.radians(6.0)
_HYPOTHESES = 4
_RIVAL_APART = np.radians(10.0)
_PLANES = 24
_USUAL_TILT = np.radians(45.0)
"""Width of the preference for small tilts: 0.8 remains of the score at 30 degrees."""
_VOTERS = 1200
"""The longest segments, which alone vote; all others join in the refinement."""
_MODEL_ERROR = np.radians(0.15)
"""How far edges of rooms are off their direction, however long they are."""
_COARSE = tuple(np.radians((3.0, 2.0, 1.2, 0.8)))
_FINE = tuple(np.radians((0.8, 0.6, 0.4, 0.4, 0.4)))
"""Residuals beyond these are outliers, in one step of the refinement after the other."""


@dataclass(frozen=True, slots=True)
class Directions:
    """Right, ahead and up of a room in the axes of the photo, with what speaks for them."""

    axes: Float64[np.ndarray, "3 3"]
    """Rows: two horizontal directions along the walls, and up."""
    up_length: float
    """Radians of segments that point up, each weighted by how well it does."""
    level_length: float
    """Radians of segments that point to one of the horizontal directions."""
    count: int
    """Segments that point to one of the three."""
    surplus: float
    """How far the length of these is above what chance gives, in its standard deviations."""
    error: float
    """Standard error of up in radians, from the errors of the segments."""
    rival: float
    """Score of the best vertical that is another one, in parts of the best: 1 is a tie."""


def find_directions(segments: Segments) -> Directions | None:
    """Return the directions that most segments agree on; None without segments."""
    if len(segments) == 0:
        return None
    longest = segments.at(np.argsort(-segments.length, kind="stable")[:_VOTERS])
    found = [_refined(longest, _with_walls(longest, up), _COARSE) for up in _candidates(longest)]
    scores = np.array([_score(longest, axes) for axes in found])
    best = int(scores.argmax())
    others = [axes[2] @ found[best][2] < np.cos(_RIVAL_APART) for axes in found]
    rival = float(scores[others].max(initial=0.0)) / max(float(scores[best]), 1e-12)
    return _described(segments, _refined(segments, found[best], _FINE), rival)


def _score(segments: Segments, axes: Float64[np.ndarray, "3 3"]) -> float:
    """Return how much speaks for the axes: edges in many planes, and a photo not far from upright.

    The root of the length in each of 24 planes about each axis keeps one patterned wall, such as
    tiles laid at 45 degrees, from outvoting the edges all around.
    """
    nearest, _, _ = _nearest(segments, axes)
    first, second = axes[(nearest + 1) % 3], axes[(nearest + 2) % 3]
    angle = np.arctan2((segments.normal * second).sum(1), (segments.normal * first).sum(1))
    plane = (np.mod(angle, np.pi) * (_PLANES / np.pi)).astype(np.int64) % _PLANES
    held = np.bincount(nearest * _PLANES + plane, _held(segments, axes, _COARSE[-1]), 3 * _PLANES)
    tilt = np.arccos(np.clip(axes[2, 2], -1, 1))
    return float(np.sqrt(held).sum() * np.exp(-0.5 * (tilt / _USUAL_TILT) ** 2))


def _candidates(segments: Segments) -> Float64[np.ndarray, "n 3"]:
    """Return directions near the photo's top where the planes of many segments meet."""
    grid = _cap(MOST_TILT, _SPACING)
    residual = (segments.normal @ grid.T).astype(np.float32)
    spread = _VOTE_ERROR**2 + segments.turn_error**2 + segments.shift_error**2
    votes = np.exp(residual**2 * (-0.5 / spread[:, None]).astype(np.float32))
    votes = (segments.length * _VOTE_ERROR / np.sqrt(spread)) @ votes
    chosen = np.zeros((0, 3))
    while len(chosen) < _HYPOTHESES and (votes.max() > 0 or len(chosen) == 0):
        best = grid[votes.argmax()]
        chosen = np.concatenate((chosen, best[None]))
        votes[grid @ best > np.cos(_APART)] = 0
    return chosen


def _cap(reach: float, spacing: float) -> Float64[np.ndarray, "n 3"]:
    """Return evenly spread directions within an angle of the vertical (a Fibonacci spiral)."""
    area = 2 * np.pi * (1 - np.cos(reach))
    count = int(np.ceil(area / spacing**2))
    index = np.arange(count) + 0.5
    z = 1 - (1 - np.cos(reach)) * index / count
    angle = index * np.pi * (3 - np.sqrt(5))
    across = np.sqrt(1 - z * z)
    return np.stack((across * np.cos(angle), across * np.sin(angle), z), axis=1)


def _with_walls(segments: Segments, up: Float64[np.ndarray, "3"]) -> Float64[np.ndarray, "3 3"]:
    """Return up and the two horizontal directions that most other segments point to."""
    right, ahead, _ = photo_axes(up)
    # where the plane of a segment meets the horizon
    x, y = segments.normal @ ahead, -(segments.normal @ right)
    slanted = np.abs(segments.normal @ up) > np.sin(np.radians(5))
    weight = segments.length * np.hypot(x, y) * slanted
    bins = 180
    angle = np.mod(np.arctan2(y, x), np.pi / 2) * (bins / (np.pi / 2))
    votes = np.bincount(angle.astype(np.int64) % bins, weight, bins)
    near = np.exp(-0.5 * (np.arange(-6, 7) / 2.0) ** 2)
    votes = np.convolve(np.concatenate((votes[-6:], votes, votes[:6])), near, "valid")
    yaw = (votes.argmax() + 0.5) * (np.pi / 2) / bins
    along = np.cos(yaw) * right + np.sin(yaw) * ahead
    return np.stack((along, np.cross(up, along), up))


def photo_axes(up: Float64[np.ndarray, "3"]) -> Float64[np.ndarray, "3 3"]:
    """Return right, ahead and up as rows, ahead being level and above the photo's middle."""
    ahead = np.array([0.0, 1.0, 0.0]) - up[1] * up
    ahead /= np.linalg.norm(ahead)
    return np.stack((np.cross(ahead, up), ahead, up))


def _refined(
    segments: Segments, axes: Float64[np.ndarray, "3 3"], scales: tuple[float, ...]
) -> Float64[np.ndarray, "3 3"]:
    """Return the axes turned to where they fit the segments best: least squares, reweighted."""
    for scale in scales:
        nearest, off, variance = _nearest(segments, axes)
        weight = _trust(off, scale**2 + variance) / (variance + _MODEL_ERROR**2)
        turn = np.linalg.solve(*_equations(np.cross(axes[nearest], segments.normal), off, weight))
        # the nearest rotation
        left, _, right = np.linalg.svd(axes + np.cross(turn, axes))
        axes = left @ right
    return axes


def _equations(
    lever: Float64[np.ndarray, "n 3"],
    off: Float64[np.ndarray, " n"],
    weight: Float64[np.ndarray, " n"],
) -> tuple[Float64[np.ndarray, "3 3"], Float64[np.ndarray, "3"]]:
    """Return the normal equations of a small turn; a faint wish not to turn is in them."""
    weighted = lever * weight[:, None]
    return weighted.T @ lever + np.eye(3), -(off @ weighted)


def _nearest(
    segments: Segments, axes: Float64[np.ndarray, "3 3"]
) -> tuple[np.ndarray, Float64[np.ndarray, " n"], Float64[np.ndarray, " n"]]:
    """Return the axis each segment points to, how far it is off, and the variance of that."""
    residual = segments.normal @ axes.T
    nearest = np.abs(residual).argmin(axis=1)
    axis = axes[nearest]
    shift = segments.shift_error * (segments.middle * axis).sum(1)
    turn = segments.turn_error * (segments.bearing * axis).sum(1)
    return nearest, residual[np.arange(len(residual)), nearest], shift**2 + turn**2


def _trust(
    residual: Float64[np.ndarray, " n"], spread: Float64[np.ndarray, " n"]
) -> Float64[np.ndarray, " n"]:
    """Return the weights of Geman and McClure: 1 for what fits, towards 0 for outliers."""
    return (spread / (spread + residual**2)) ** 2


def _held(
    segments: Segments, axes: Float64[np.ndarray, "3 3"], scale: float
) -> Float64[np.ndarray, " n"]:
    """Return the length of each segment, weighted by how well it points to its axis."""
    _, off, variance = _nearest(segments, axes)
    return _trust(off, scale**2 + variance) * segments.length


def _described(segments: Segments, axes: Float64[np.ndarray, "3 3"], rival: float) -> Directions:
    scale = _FINE[-1]
    nearest, off, variance = _nearest(segments, axes)
    trust = _trust(off, scale**2 + variance)
    held = trust * segments.length
    up: Bool[np.ndarray, " n"] = nearest == 2
    # of segments in random places: their products with an axis are spread evenly over [-1, 1],
    # so the mean weight is 3 pi/4 and its mean square 15 pi/32 times the width of the kernel
    width = np.sqrt(scale**2 + variance)
    chance = float(segments.length @ width) * 0.75 * np.pi
    deviation = float(np.sqrt(segments.length**2 @ width * (15 / 32) * np.pi))
    lever = np.cross(axes[nearest], segments.normal)
    information, _ = _equations(lever, off, trust / (variance + _MODEL_ERROR**2))
    # turning about the vertical does not move it
    covariance = axes @ np.linalg.inv(information) @ axes.T
    return Directions(
        axes,
        float(held[up].sum()),
        float(held[~up].sum()),
        int((trust > 0.25).sum()),
        (float(held.sum()) - chance) / deviation,
        float(np.sqrt(covariance[0, 0] + covariance[1, 1])),
        rival,
    )
