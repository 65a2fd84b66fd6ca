"""The room as the boundaries draw it, before anything is made regular."""

import shapely
import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry import polygon_problem, signed_distance_to_polygon

SIMPLER = 0.01
"""Camera heights by which the drawn outline may move for fewer corners (1.6 cm)."""
MOST_CORNERS = 64
"""Corners above which it may move more."""


def drawn_polygon(points: Float[Tensor, "columns 2"]) -> Float[Tensor, "corners 2"]:
    """Return the polygon through the columns' points, without those on straight lines.

    Args:
        points: One per column, counter-clockwise around the camera.

    Examples:
        >>> square = torch.tensor([[1.0, 1.0], [0.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
        >>> len(drawn_polygon(square))
        4
    """
    outline = shapely.Polygon(points.double().numpy())
    corners, tolerance = points.double(), SIMPLER
    while True:
        simpler = _simplified(outline, tolerance)
        if not _is_room(simpler):
            return corners
        corners, tolerance = simpler, 1.5 * tolerance
        if len(corners) <= MOST_CORNERS:
            return corners


def _simplified(outline: shapely.Polygon, tolerance: float) -> Float[Tensor, "corners 2"]:
    """Return the outline with fewer corners; the first one goes when it is on a straight line."""
    simple = shapely.simplify(outline, tolerance, preserve_topology=True)
    corners = torch.from_numpy(shapely.get_coordinates(simple)[:-1].copy())
    to, onwards = corners[0] - corners[-1], corners[1] - corners[0]
    across = abs(float(to[0] * onwards[1] - to[1] * onwards[0]))
    straight = across < tolerance * float((to + onwards).norm())
    return corners[1:] if straight and len(corners) > 4 else corners


def _is_room(polygon: Float[Tensor, "corners 2"]) -> bool:
    if polygon_problem(polygon) is not None:
        return False
    inside = signed_distance_to_polygon(torch.zeros(1, 2, dtype=polygon.dtype), polygon)
    return float(inside[0]) < 0
