"""Meshes and the walls of their room."""

import numpy as np
import shapely
from jaxtyping import Float64

from panoscene.synth.homes import Room

from ._solids import Solid

_FAR = 0.3
_ALONG = 0.15


def back_gap(body: Solid, room: Room) -> tuple[float, Float64[np.ndarray, " 3"], float] | None:
    """Return how far the back is from the wall behind, the move that closes it, and the yaw.

    Negative where the back is in the wall. None when no wall within 30 cm of the back faces the
    way the model does, to 15 degrees.

    Args:
        body: What hangs there.
        room: Its room.
    """
    start = room.polygon
    edge = np.roll(start, -1, axis=0) - start
    length = np.linalg.norm(edge, axis=1)
    normal = np.stack([-edge[:, 1], edge[:, 0]], axis=1) / length[:, None]
    front = np.array([-np.sin(body.yaw), np.cos(body.yaw)])
    offset = body.position[:2] - start
    gap = (offset * normal).sum(axis=1) + float(body.extent[0, 1])
    place = (offset * edge).sum(axis=1) / length
    fits = (normal @ front > np.cos(np.radians(15))) & (np.abs(gap) <= _FAR)
    fits &= (place > -_ALONG) & (place < length + _ALONG)
    if not fits.any():
        return None
    wall = int(np.argmin(np.where(fits, np.abs(gap), np.inf)))
    move = np.append(-normal[wall] * gap[wall], 0.0)
    yaw = float(np.arctan2(-normal[wall, 0], normal[wall, 1]))
    if abs((yaw - body.yaw + np.pi) % (2 * np.pi) - np.pi) < 1e-6:
        yaw = body.yaw
    return float(gap[wall]), move, yaw


def outside(body: Solid, room: Room) -> tuple[float, Float64[np.ndarray, " 3"]]:
    """Return how deep a mesh is in the walls of its room, and a move that takes it out.

    Measured on the convex outline of its plan, so that something bent around a corner of the room
    counts as in it.

    Args:
        body: To look at.
        room: Its room.
    """
    low, high = room.polygon.min(axis=0), room.polygon.max(axis=0)
    under, over = low - body.bounds[0, :2], body.bounds[1, :2] - high
    floor = shapely.Polygon(room.polygon)
    if abs(floor.area - np.prod(high - low)) < 1e-9:
        move = np.maximum(under, 0.0) - np.maximum(over, 0.0)
        return float(max(under.max(), over.max(), 0.0)), np.append(move, 0.0)
    outline = shapely.convex_hull(shapely.MultiPoint(body.outline))
    corners = body.outline[~shapely.contains_xy(floor, body.outline)]
    ways = [_nearest(floor, corner) - corner for corner in corners]
    inner = room.polygon[shapely.contains_xy(outline, room.polygon)]
    ways += [corner - _nearest(outline.boundary, corner) for corner in inner]
    if not ways:
        return 0.0, np.zeros(3)
    depths = np.linalg.norm(ways, axis=1)
    deepest = int(np.argmax(depths))
    return float(depths[deepest]), np.append(ways[deepest], 0.0)


def _nearest(
    shape: shapely.Geometry, point: Float64[np.ndarray, " 2"]
) -> Float64[np.ndarray, " 2"]:
    """Return the nearest point of a shape."""
    line = shapely.shortest_line(shape, shapely.Point(point))
    return shapely.get_coordinates(line)[0]
