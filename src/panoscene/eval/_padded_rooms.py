"""Boxes and rooms of several scenes side by side, so that scores need no loop over scenes."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene.geometry import OrientedBoxes, polygon_problem, wall_boxes
from panoscene.scene import Layout

_PAIRS_AT_ONCE = 100_000
"""Pairs of objects that are worked on together; bounds the memory."""


@dataclass(frozen=True, slots=True)
class PaddedRooms:
    """Scenes of up to n objects and up to m walls each, in float64 on the CPU."""

    boxes: OrientedBoxes
    """Batch shape (scenes, n); unit boxes at the origin where ``valid`` is false."""
    valid: Bool[Tensor, "scenes n"]
    polygon: Float[Tensor, "scenes m 2"]
    """Floor polygons; the last corner repeated."""
    wall_valid: Bool[Tensor, "scenes m"]
    floor: Float[Tensor, " scenes"]
    """World z in metres."""
    ceiling: Float[Tensor, " scenes"]
    """World z in metres."""

    def walls(self) -> OrientedBoxes:
        """Return the paper's walls: cuboids 0.2 m thick behind the polygon, (scenes, m)."""
        return wall_boxes(self.polygon, self.floor, self.ceiling, thickness=0.2)


def padded_rooms(
    boxes: Sequence[OrientedBoxes], layouts: Sequence[Layout]
) -> Iterator[tuple[list[int], PaddedRooms]]:
    """Yield batches of scenes of similar size, with the indices of the scenes in them.

    Raises:
        ValueError: Boxes hold a non-finite number or a size that is not positive, or a layout is
            not a valid room; the message says which scene.
    """
    for index, (some, layout) in enumerate(zip(boxes, layouts, strict=True)):
        _check(some, layout, f"scene {index}: " if len(boxes) > 1 else "")
    order = sorted(range(len(boxes)), key=lambda index: len(boxes[index]))
    while order:
        # the largest first: it decides how many fit
        room_for = max(1, _PAIRS_AT_ONCE // max(1, len(boxes[order[-1]])) ** 2)
        chosen, order = order[-room_for:], order[:-room_for]
        yield chosen, _padded([boxes[k] for k in chosen], [layouts[k] for k in chosen])


def _padded(boxes: Sequence[OrientedBoxes], layouts: Sequence[Layout]) -> PaddedRooms:
    scenes = len(boxes)
    n = max(len(some) for some in boxes)
    m = max(len(layout.floor_polygon) for layout in layouts)
    centre = torch.zeros(scenes, n, 3, dtype=torch.float64)
    size = torch.ones(scenes, n, 3, dtype=torch.float64)
    yaw = torch.zeros(scenes, n, dtype=torch.float64)
    polygon = torch.zeros(scenes, m, 2, dtype=torch.float64)
    for k, (some, layout) in enumerate(zip(boxes, layouts, strict=True)):
        centre[k, : len(some)] = some.centre.detach()
        size[k, : len(some)] = some.size.detach()
        yaw[k, : len(some)] = some.yaw.detach()
        corners = layout.floor_polygon.detach()
        polygon[k, : len(corners)] = corners
        polygon[k, len(corners) :] = corners[-1]
    objects = torch.tensor([len(some) for some in boxes])
    return PaddedRooms(
        boxes=OrientedBoxes(centre, size, yaw),
        valid=torch.arange(n) < objects[:, None],
        polygon=polygon,
        # the walls of padding have no length; the last real one closes the polygon after them
        wall_valid=(polygon != polygon.roll(-1, dims=1)).any(-1),
        floor=torch.tensor([layout.floor_height for layout in layouts], dtype=torch.float64),
        ceiling=torch.tensor([layout.ceiling_height for layout in layouts], dtype=torch.float64),
    )


def _check(boxes: OrientedBoxes, layout: Layout, where: str) -> None:
    for name, part in (("centre", boxes.centre), ("size", boxes.size), ("yaw", boxes.yaw)):
        if not bool(part.isfinite().all()):
            raise ValueError(f"{where}boxes.{name}: expected finite numbers, found NaN or infinity")
    if not bool((boxes.size > 0).all()):
        raise ValueError(
            f"{where}boxes.size: expected positive metres, found {float(boxes.size.min()):g}"
        )
    problem = polygon_problem(layout.floor_polygon)
    if problem is not None:
        raise ValueError(f"{where}layout.floor_polygon: expected a simple polygon, found {problem}")
    if not -math.inf < layout.floor_height < layout.ceiling_height < math.inf:
        raise ValueError(
            f"{where}layout.ceiling_height: expected more than the floor's {layout.floor_height}, "
            f"found {layout.ceiling_height}"
        )
