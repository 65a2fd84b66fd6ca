"""What holds the objects of a room up, and how far those hang that nothing holds."""

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene.eval._padded_rooms import PaddedRooms
from panoscene.geometry import boxes_collide, rectangle_intersection_area

CONTACT_TOLERANCE = 0.1
"""Metres of gap that still count as contact, as in ``relations_from_boxes``."""


def supported_objects(
    rooms: PaddedRooms, *, tolerance: float = CONTACT_TOLERANCE
) -> Bool[Tensor, "scenes n"]:
    """Return which objects the room holds up, directly or through other objects.

    Convention:
        - floor, ceiling and walls support what is less than ``tolerance`` from them; floor and
          ceiling are endless planes, walls are the paper's cuboids, 0.2 m thick
        - a supported box supports every box less than ``tolerance`` from it that it lies under or
          beside: it must reach below the middle of the other. So a table holds its lamp and a
          shelf the books between its sides, but a lamp does not hold the table it stands on
        - boxes that only touch each other support nobody: the chain must end at the room
    """
    boxes = rooms.boxes
    half = boxes.size[..., 2] / 2
    bottom, top = boxes.centre[..., 2] - half, boxes.centre[..., 2] + half
    at_wall = boxes_collide(boxes[:, :, None], rooms.walls()[:, None], -tolerance)
    supported = (
        (bottom - tolerance < rooms.floor[:, None])
        | (top + tolerance > rooms.ceiling[:, None])
        | (at_wall & rooms.wall_valid[:, None]).any(-1)
    ) & rooms.valid
    reaches_below = bottom[:, None] < boxes.centre[..., 2, None]
    carries = boxes_collide(boxes[:, :, None], boxes[:, None], -tolerance) & reaches_below
    while True:
        grown = supported | ((carries & supported[:, None]).any(-1) & rooms.valid)
        if torch.equal(grown, supported):
            return supported
        supported = grown


def floating_distances(
    rooms: PaddedRooms, *, tolerance: float = CONTACT_TOLERANCE
) -> Float[Tensor, "scenes n"]:
    """Return how far each object would fall, in metres; 0 for those that are supported.

    That is the distance from the bottom of an unsupported box to the highest support below it:
    the floor, or the top of a supported box that overlaps it in plan.

    Convention:
        - support and ``tolerance`` as in ``supported_objects``; floating boxes do not catch others,
          so in a floating pile each box falls to what the room holds
    """
    boxes = rooms.boxes
    supported = supported_objects(rooms, tolerance=tolerance)
    half = boxes.size[..., 2] / 2
    bottom, top = boxes.centre[..., 2] - half, boxes.centre[..., 2] + half
    falls = torch.zeros_like(bottom)
    scene, loose = (rooms.valid & ~supported).nonzero(as_tuple=True)
    if len(scene) == 0:
        return falls
    below = (
        supported[scene]
        & (top[scene] <= bottom[scene, loose, None])
        & (rectangle_intersection_area(boxes[scene, loose][:, None], boxes[scene]) > 0)
    )
    highest = torch.where(below, top[scene], rooms.floor[scene, None]).amax(-1)
    falls[scene, loose] = (bottom[scene, loose] - highest).clamp(min=0)
    return falls
