"""Openings in walls: where doors and windows stand in them."""

import torch
from jaxtyping import Bool, Float, Int64
from torch import Tensor

from panoscene.geometry import box_footprint, wall_normals

from ._categories import BUILT_IN, CATEGORIES
from ._records import Scene

_NEAR = 0.5
"""Metres between the middle of a door or window and the wall that it may stand in."""
_REACH = 0.02
"""Metres before a wall up to which something still stands in it."""
_SUNK = 0.01
"""The same for other things: nearly nothing of them is before the wall."""
_ALONG = 0.8
"""Cosine of the largest angle between a wall and what stands in it."""
_RIM = 0.02
"""Metres of a wall that are left beside, above and below an opening."""
_BUILT_IN = torch.tensor([name in BUILT_IN for name in CATEGORIES])


def built_in(category: Int64[Tensor, "*batch"]) -> Bool[Tensor, "*batch"]:
    """Return which categories stand in walls: doors and windows.

    Args:
        category: indices into ``CATEGORIES``.

    Examples:
        >>> built_in(torch.tensor([CATEGORIES.index("door"), CATEGORIES.index("bed")]))
        tensor([ True, False])
    """
    return _BUILT_IN.to(category.device)[category]


def wall_openings(scene: Scene) -> list[Float[Tensor, "openings 4"]]:
    """Return the openings of each wall: first and last metre along it, bottom and top z.

    A door or window opens the nearest wall if it reaches into it and stands along it; so does any
    other thing that has sunk into a wall entirely, such as a picture whose place is not exact: else
    nobody would see it.

    Args:
        scene: its boxes and its room.
    """
    layout, boxes = scene.layout, scene.objects.boxes
    corners = layout.floor_polygon
    edge = corners.roll(-1, 0) - corners
    length = edge.square().sum(-1).sqrt()
    along = edge / length.clamp(min=1e-9)[:, None]
    normal = wall_normals(corners)
    foot = box_footprint(boxes)[:, None] - corners[:, None]
    place, depth = (foot * along[:, None]).sum(-1), (foot * normal[:, None]).sum(-1)
    middle, before = place.mean(-1), depth.mean(-1)
    beside = (-middle).clamp(min=0) + (middle - length).clamp(min=0)
    distance = torch.hypot(before, beside)
    wall = distance.argmin(-1, keepdim=True)
    across = torch.stack([boxes.yaw.cos(), boxes.yaw.sin()], -1)
    straight = (across[:, None] * along).sum(-1).abs()
    fits = (distance <= _NEAR) & (straight >= _ALONG) & (depth.amin(-1) <= _REACH)
    sunk = depth.amax(-1).gather(1, wall)[:, 0] <= _SUNK
    kept = (built_in(scene.objects.category) | sunk) & fits.gather(1, wall)[:, 0]
    half = boxes.size[:, 2] / 2
    low = (boxes.centre[:, 2] - half).clamp(min=layout.floor_height + _RIM)
    high = (boxes.centre[:, 2] + half).clamp(max=layout.ceiling_height - _RIM)
    found: list[Tensor] = []
    for k in range(len(corners)):
        mine = kept & (wall[:, 0] == k)
        first = place[mine, k].amin(-1).clamp(min=_RIM)
        last = torch.minimum(place[mine, k].amax(-1), length[k] - _RIM)
        spans = torch.stack([first, last, low[mine], high[mine]], -1)
        found.append(spans[(spans[:, 0] < spans[:, 1]) & (spans[:, 2] < spans[:, 3])])
    return found


def opened_wall(
    start: Float[Tensor, " 2"],
    end: Float[Tensor, " 2"],
    low: float,
    high: float,
    openings: Float[Tensor, "openings 4"],
) -> tuple[Float[Tensor, "vertices 3"], Int64[Tensor, "faces 3"]]:
    """Return the triangles of a wall around its openings, seen from the room.

    Args:
        start: corner that the wall begins at, where the room is on its left.
        end: corner that it ends at.
        low: z of the floor.
        high: z of the ceiling.
        openings: as ``wall_openings`` says.
    """
    length = float((end - start).square().sum().sqrt())
    x = _ticks(openings[:, :2], 0.0, length)
    z = _ticks(openings[:, 2:], low, high)
    whole = _closed(x, z, openings)
    ground = start + (end - start) * (x / max(length, 1e-9))[:, None]
    vertices = torch.cat([ground.repeat(len(z), 1), z.repeat_interleave(len(x))[:, None]], dim=1)
    row, column = whole.nonzero().unbind(-1)
    corner = row * len(x) + column
    right, above = corner + 1, corner + len(x)
    lower = torch.stack([corner, above + 1, right], -1)
    upper = torch.stack([corner, above, above + 1], -1)
    return vertices, torch.cat([lower, upper])


def _ticks(
    sides: Float[Tensor, "openings 2"], first: float, last: float
) -> Float[Tensor, " ticks"]:
    """Return where the sides of openings and the ends are, in order, each once."""
    ticks = torch.cat([sides.flatten(), sides.new_tensor([first, last])]).sort().values
    return ticks[torch.cat([ticks.new_ones(1, dtype=torch.bool), ticks[1:] > ticks[:-1]])]


def _closed(
    x: Float[Tensor, " columns"], z: Float[Tensor, " rows"], openings: Float[Tensor, "openings 4"]
) -> Bool[Tensor, "rows_less_1 columns_less_1"]:
    """Return which fields of a grid on a wall are in no opening."""
    x, z = (x[1:] + x[:-1]) / 2, (z[1:] + z[:-1]) / 2
    first, last, bottom, top = (side[:, None] for side in openings.unbind(-1))
    inside = ((first < x) & (x < last))[:, None] & ((bottom < z) & (z < top))[:, :, None]
    return ~inside.any(0)
