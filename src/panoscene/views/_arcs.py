"""Straight lines of the world as curves of the panorama: sampled, cut at the seam and the poles."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int64

STEP = np.deg2rad(0.5)
"""Largest angle at the camera between neighbouring samples of a line."""
LON_STEP = np.deg2rad(1.0)
"""Largest difference in lon between neighbouring samples; it counts near the poles."""
_RADIAL = 1e-9
"""Radians at the camera below which a line is a point, or passes through the camera."""
_JUMP = 0.1
"""Difference in lon between samples that only a line through a pole has."""
_SEAM = 1e-9


@dataclass(frozen=True, slots=True)
class Samples:
    """Places along k lines, line after line, each from its start to its end."""

    line: Int64[np.ndarray, " samples"]
    """The line that each sample is on."""
    place: Float[np.ndarray, "samples 3"]
    """Seen from the camera, in metres."""
    lon: Float[np.ndarray, " samples"]
    lat: Float[np.ndarray, " samples"]


def sample_lines(start: Float[np.ndarray, "lines 3"], end: Float[np.ndarray, "lines 3"]) -> Samples:
    """Return samples of straight lines, dense enough to draw them as polylines.

    A line is an arc of a great circle. It is sampled at equal angles, and where it meets every
    full degree of lon, so that it is smooth next to the poles, and at the seam exactly. Lines
    through the camera, and lines straight away from it, are left out: they are points.

    Args:
        start: in metres, from the camera, with the axes of the world.
        end: likewise.
    """
    first, last = _unit(start), _unit(end)
    cosine = (first * last).sum(-1)
    angle = np.arctan2(np.linalg.norm(np.cross(first, last), axis=-1), cosine)
    seen = np.flatnonzero((angle > _RADIAL) & (angle < np.pi - _RADIAL))
    first, last, angle, cosine = first[seen], last[seen], angle[seen], cosine[seen]
    across = _unit(last - cosine[:, None] * first)
    phi = np.concatenate([_even_angles(angle), _lon_angles(first, across, angle)], axis=1)
    phi.sort(axis=1)
    row, column = np.nonzero(np.isfinite(phi))
    phi = phi[row, column]
    direction = np.cos(phi)[:, None] * first[row] + np.sin(phi)[:, None] * across[row]
    near = np.linalg.norm(start[seen], axis=-1)[row] * np.sin(phi)
    far = np.linalg.norm(end[seen], axis=-1)[row] * np.sin(angle[row] - phi)
    share = (near / (near + far))[:, None]
    line = seen[row]
    return Samples(
        line=line,
        place=start[line] + share * (end[line] - start[line]),
        lon=np.arctan2(direction[:, 0], direction[:, 1]),
        lat=np.arctan2(direction[:, 2], np.hypot(direction[:, 0], direction[:, 1])),
    )


def _even_angles(angle: Float[np.ndarray, " lines"]) -> Float[np.ndarray, "lines most"]:
    """Return equally spaced angles from 0 to the whole one, NaN behind the last."""
    count = np.ceil(angle / STEP).astype(int)
    index = np.arange(count.max(initial=0) + 1)
    even = angle[:, None] * index / np.maximum(count, 1)[:, None]
    return np.where(index <= count[:, None], np.minimum(even, angle[:, None]), np.nan)


def _lon_angles(
    first: Float[np.ndarray, "lines 3"],
    across: Float[np.ndarray, "lines 3"],
    angle: Float[np.ndarray, " lines"],
) -> Float[np.ndarray, "lines planes"]:
    """Return the angle at which each line meets each plane of constant lon, NaN where it does not.

    A plane holds lon and lon + pi; of the great circle it is met once in half a turn.
    """
    lon = np.arange(0.0, np.pi - LON_STEP / 2, LON_STEP)
    normal = np.stack([np.cos(lon), -np.sin(lon)])
    met = np.arctan2(-first[:, :2] @ normal, across[:, :2] @ normal) % np.pi
    return np.where((met > 0) & (met < angle[:, None]), met, np.nan)


def cut_curves(
    lon: Float[np.ndarray, " samples"],
    lat: Float[np.ndarray, " samples"],
    visible: Bool[np.ndarray, " samples"],
) -> list[tuple[bool, Float[np.ndarray, "points 2"]]]:
    """Return the pieces of one sampled line: whether each is visible, and its lon, lat.

    It is cut where its visibility changes, at the seam, where one piece ends at pi and the next
    starts at -pi, and at a pole that it passes through.
    """
    pieces: list[tuple[bool, Float[np.ndarray, "points 2"]]] = []
    for flag, low, high in _runs(visible):
        # a piece reaches the first sample of the next one, so that there are no gaps
        part = slice(low, min(high + 1, len(lon)))
        for curve in _cut_at_poles(lon[part], lat[part]):
            pieces += [(flag, piece) for piece in _cut_at_seam(curve)]
    return pieces


def _runs(flag: Bool[np.ndarray, " samples"]) -> list[tuple[bool, int, int]]:
    """Return value, first index and index behind the last of each run of equal values."""
    if not len(flag):
        return []
    bounds = [0, *(np.flatnonzero(flag[1:] != flag[:-1]) + 1).tolist(), len(flag)]
    return [(bool(flag[a]), a, b) for a, b in pairwise(bounds)]


def _cut_at_poles(
    lon: Float[np.ndarray, " samples"], lat: Float[np.ndarray, " samples"]
) -> list[Float[np.ndarray, "points 2"]]:
    """Return curves of continuous lon; those through a pole end in it on both sides."""
    turn = np.diff(lon)
    turn -= 2 * np.pi * np.round(turn / (2 * np.pi))
    jumps = np.flatnonzero(np.abs(turn) > _JUMP)
    smooth = np.concatenate([lon[:1], lon[0] + np.cumsum(turn)])
    curves = []
    for low, high in zip([0, *(jumps + 1)], [*(jumps + 1), len(lon)], strict=True):
        curve = np.stack([smooth[low:high], lat[low:high]], axis=-1)
        if low:
            curve = np.concatenate([_pole(curve[:1]), curve])
        if high < len(lon):
            curve = np.concatenate([curve, _pole(curve[-1:])])
        curves.append(curve)
    return curves


def _pole(point: Float[np.ndarray, "1 2"]) -> Float[np.ndarray, "1 2"]:
    return np.array([[point[0, 0], np.copysign(np.pi / 2, point[0, 1])]])


def _cut_at_seam(
    curve: Float[np.ndarray, "points 2"],
) -> list[Float[np.ndarray, "pieces_points 2"]]:
    """Return the parts of a curve of continuous lon with lon in [-pi, pi]."""
    pieces = []
    low = int(np.floor((curve[:, 0].min() + np.pi) / (2 * np.pi)))
    high = int(np.floor((curve[:, 0].max() + np.pi) / (2 * np.pi)))
    for turn in range(low - 1, high + 1):
        lon = curve[:, 0] - 2 * np.pi * turn
        inside = np.abs(lon) <= np.pi + _SEAM
        for flag, a, b in _runs(inside):
            if flag and b - a > 1:
                piece = np.stack([np.clip(lon[a:b], -np.pi, np.pi), curve[a:b, 1]], axis=-1)
                pieces.append(piece)
    return pieces


def _unit(vector: Float[np.ndarray, "lines 3"]) -> Float[np.ndarray, "lines 3"]:
    return vector / np.maximum(np.linalg.norm(vector, axis=-1, keepdims=True), 1e-12)
