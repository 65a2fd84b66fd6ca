"""The room as the boundaries draw it, before anything is made regular."""

import shapely
import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry import polygon_problem

SIMPLER = 0.01
"""Camera heights by which the drawn outline may move for fewer corners (1.6 cm)."""


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
    simple = shapely.simplify(outline, SIMPLER, preserve_topology=True)
    corners = torch.from_numpy(shapely.get_coordinates(simple)[:-1].copy())
    # the first point stays even on a straight line
    before, here, after = corners[-1], corners[0], corners[1]
    across = (here - before)[0] * (after - here)[1] - (here - before)[1] * (after - here)[0]
    if len(corners) > 4 and abs(float(across)) < SIMPLER * float((after - before).norm()):
        corners = corners[1:]
    return corners if polygon_problem(corners) is None else points.double()
