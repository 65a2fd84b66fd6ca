"""Relations that follow from boxes and layout, with the paper's tolerances."""

import math
from typing import Literal

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene.geometry import (
    OrientedBoxes,
    box_footprint,
    boxes_collide,
    footprint_area_in_polygon,
    polygon_problem,
    signed_distance_to_polygon,
    wall_boxes,
    wrap_angle,
)

from ._records import Layout, Relations

RELATIVE_YAW_BINS: tuple[float, ...] = tuple(math.radians(45 * k - 180) for k in range(8))
"""Centres of the 8 relative-yaw bins in radians: -180, -135, ..., +135 degrees."""


def relations_from_boxes(
    boxes: OrientedBoxes,
    layout: Layout,
    camera_height: float = 1.6,
    *,
    tolerance: float = 0.1,
    floor_tolerance: float = 0.1,
    inside: Literal["full", "any_corner"] = "full",
    inside_tolerance: float = 0.1,
    wall_thickness: float = 0.2,
) -> Relations:
    """Return the relations of n boxes in a room as 0 and 1, in the dtype of the boxes.

    Convention:
        - ``touching``, ``touching_wall``: the boxes overlap once each has grown by half of
          ``tolerance`` on every side; walls are cuboids of ``wall_thickness`` behind the polygon,
          and only boxes inside the room touch them
        - ``on_floor``, ``under_ceiling``: the box grown by ``floor_tolerance`` on every side
          reaches below the floor, above the ceiling. This is twice the growth of ``touching``, as
          in the authors' labels
        - ``inside_room``: with ``inside="full"`` no part of the box is more than
          ``inside_tolerance`` outside the room, as the paper's text says; boxes of real objects
          that stand against a wall stick out by centimetres, hence the tolerance. With
          ``"any_corner"`` one bottom corner (of the box grown by half of ``tolerance``) inside the
          floor polygon is enough, as in the authors' labels: the choice for boxes that are wrong
          by more than the tolerance and are yet to be repaired
        - ``farther_than[a, b]``: the centre of a is farther from the camera at
          (0, 0, ``camera_height``) than that of b, straight-line distance
        - ``relative_yaw[a, b]``: the nearest bin of ``RELATIVE_YAW_BINS`` to yaw_b - yaw_a,
          wrapped; a wall's front looks into the room

    The relative yaw is taken between world yaws. The authors' release subtracts the yaws relative
    to each object's own line of sight instead, so that two parallel objects at different azimuths
    get a relation that is neither zero nor a multiple of 45 degrees, and quantising it turns them
    by up to 22.5 degrees. The paper's reason for the relation is that furniture is well aligned;
    only differences in one frame say that. The release also does not wrap in its search for the
    nearest bin, so angles just below +180 degrees land in the bin of +135; here they land in -180.

    Raises:
        ValueError: The boxes are not n boxes, or hold a non-finite number or a size that is not
            positive, or a tolerance is negative, or ``inside`` is unknown; or the floor polygon is
            not simple and counter-clockwise, or the heights are not finite.

    Source: paper, Sec. 3.2 (relation estimation); tolerances of the labels in the release.

    Examples:
        >>> room = Layout(torch.tensor([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]]))
        >>> bed = OrientedBoxes(
        ...     torch.tensor([[0.0, 1.0, 0.3]]), torch.tensor([[1.6, 2.0, 0.6]]), torch.zeros(1)
        ... )
        >>> relations = relations_from_boxes(bed, room)
        >>> relations.on_floor.tolist(), relations.touching_wall.tolist()
        ([1.0], [[0.0, 0.0, 1.0, 0.0]])
    """
    tolerances = {
        "tolerance": tolerance,
        "floor_tolerance": floor_tolerance,
        "inside_tolerance": inside_tolerance,
        "wall_thickness": wall_thickness,
    }
    _check(boxes, tolerances)
    _check_room(layout, camera_height)
    layout_polygon = layout.floor_polygon.to(boxes.centre)
    walls = wall_boxes(layout_polygon, layout.floor_height, layout.ceiling_height, wall_thickness)
    if inside == "full":
        inside_room = _fully_inside(boxes, layout, layout_polygon, inside_tolerance)
    elif inside == "any_corner":
        inside_room = _any_corner_inside(boxes, layout_polygon, tolerance)
    else:
        raise ValueError(f"inside: expected 'full' or 'any_corner', found {inside!r}")

    other = ~torch.eye(len(boxes), dtype=torch.bool, device=boxes.yaw.device)
    touching = boxes_collide(boxes[:, None], boxes[None, :], -tolerance) & other
    touching_wall = boxes_collide(boxes[:, None], walls[None, :], -tolerance)
    half_height = boxes.size[:, 2] / 2
    bottom, top = boxes.centre[:, 2] - half_height, boxes.centre[:, 2] + half_height
    camera = boxes.centre.new_tensor([0.0, 0.0, camera_height])
    distance = (boxes.centre - camera).square().sum(dim=-1)
    dtype = boxes.centre.dtype
    turn = boxes.yaw[None, :] - boxes.yaw[:, None]
    return Relations(
        touching=touching.to(dtype),
        touching_wall=(touching_wall & inside_room[:, None]).to(dtype),
        on_floor=(bottom - floor_tolerance < layout.floor_height).to(dtype),
        under_ceiling=(top + floor_tolerance > layout.ceiling_height).to(dtype),
        inside_room=inside_room.to(dtype),
        farther_than=(distance[:, None] > distance[None, :]).to(dtype),
        relative_yaw=relative_yaw_bins(turn) * other[..., None],
        relative_yaw_wall=relative_yaw_bins(walls.yaw[None, :] - boxes.yaw[:, None]),
    )


def relative_yaw_bins(angle: Float[Tensor, "*batch"]) -> Float[Tensor, "*batch 8"]:
    """Return the one-hot bin whose centre is nearest to each angle in radians, on the circle.

    Examples:
        >>> relative_yaw_bins(torch.tensor([0.1, 3.1])).argmax(-1).tolist()
        [4, 0]
    """
    index = torch.remainder(torch.round(wrap_angle(angle) / (math.pi / 4)).long() + 4, 8)
    return torch.nn.functional.one_hot(index, 8).to(angle.dtype)


def relative_yaw_angle(probability: Float[Tensor, "*batch 8"]) -> Float[Tensor, "*batch"]:
    """Return the centre in radians of the most probable bin, in [-pi, pi).

    Examples:
        >>> relative_yaw_angle(torch.eye(8)[[0, 4, 6]])
        tensor([-3.1416,  0.0000,  1.5708])
    """
    return probability.new_tensor(RELATIVE_YAW_BINS)[probability.argmax(dim=-1)]


def _fully_inside(
    boxes: OrientedBoxes, layout: Layout, polygon: Float[Tensor, "corners 2"], tolerance: float
) -> Bool[Tensor, " n"]:
    half_height = boxes.size[:, 2] / 2
    above_floor = boxes.centre[:, 2] - half_height >= layout.floor_height - tolerance
    below_ceiling = boxes.centre[:, 2] + half_height <= layout.ceiling_height + tolerance
    outside = signed_distance_to_polygon(box_footprint(boxes).flatten(0, 1), polygon)
    corners_in = (outside.reshape(-1, 4) <= tolerance).all(dim=-1)
    # where the room is not convex, a wall may run through a box whose corners are all inside
    core_size = boxes.size - 2 * tolerance
    thick = (core_size[:, :2] > 0).all(dim=-1)
    core = OrientedBoxes(boxes.centre, core_size.clamp(min=0.01), boxes.yaw)
    area = core.size[:, 0] * core.size[:, 1]
    whole = footprint_area_in_polygon(core, polygon) >= (1 - 1e-3) * area
    return above_floor & below_ceiling & corners_in & (whole | ~thick)


def _any_corner_inside(
    boxes: OrientedBoxes, polygon: Float[Tensor, "corners 2"], tolerance: float
) -> Bool[Tensor, " n"]:
    grown = OrientedBoxes(boxes.centre, boxes.size + tolerance, boxes.yaw)
    outside = signed_distance_to_polygon(box_footprint(grown).flatten(0, 1), polygon)
    return (outside.reshape(-1, 4) <= 0).any(dim=-1)


def _check(boxes: OrientedBoxes, tolerances: dict[str, float]) -> None:
    if boxes.yaw.ndim != 1:
        raise ValueError(f"boxes: expected batch shape (n,), found {tuple(boxes.yaw.shape)}")
    for name, tensor in (("centre", boxes.centre), ("size", boxes.size), ("yaw", boxes.yaw)):
        if not bool(tensor.isfinite().all()):
            raise ValueError(f"boxes.{name}: expected finite numbers, found NaN or infinity")
    if not bool((boxes.size > 0).all()):
        raise ValueError(f"boxes.size: expected positive metres, found {float(boxes.size.min()):g}")
    for name, value in tolerances.items():
        if not (math.isfinite(value) and value >= 0):
            raise ValueError(f"{name}: expected metres of at least 0, found {value}")


def _check_room(layout: Layout, camera_height: float) -> None:
    problem = polygon_problem(layout.floor_polygon)
    if problem is not None:
        raise ValueError(
            "layout.floor_polygon: expected a simple polygon, counter-clockwise from above, "
            f"found {problem}"
        )
    if not -math.inf < layout.floor_height < layout.ceiling_height < math.inf:
        raise ValueError(
            f"layout.ceiling_height: expected more than the floor's {layout.floor_height}, "
            f"found {layout.ceiling_height}"
        )
    if not math.isfinite(camera_height):
        raise ValueError(f"camera_height: expected finite metres, found {camera_height}")
