"""A seeded sampler of furnished rooms, with exact ground truth."""

import numpy as np
import torch
from jaxtyping import Float

from panoscene.geometry import OrientedBoxes, wrap_angle
from panoscene.scene import Layout, Scene, objects_from_boxes, scene_from_boxes
from panoscene.synth._floor_plan import sample_camera, sample_corner_count, sample_floor_plan
from panoscene.synth._furnishing import Furnishing
from panoscene.synth._groups import GROUPS, Group, door, window

_FAILURES = 25
"""So many groups in a row may fail to find a place before the room is judged too small."""


def sample_room(
    rng: np.random.Generator,
    *,
    objects: int = 20,
    corners: int | None = None,
    camera_height: float = 1.6,
) -> Scene:
    """Return a furnished Manhattan room with exact boxes, BFoVs and relations.

    The room has a random kind (living room, bedroom, kitchen, bathroom, office; above 40 objects
    an open plan with everything), an area that grows with the number of objects until they fit, a
    random yaw about the vertical, a ceiling between 2.3 and 3.4 m and the camera somewhere inside.
    Furniture keeps the regularities that relations describe: backs exactly against walls, chairs
    facing tables, lamps on cabinets, hanging cabinets under the ceiling, kitchen units side by
    side. No two boxes overlap, everything is inside the room, and pieces on the floor have their
    lower face at z = 0 (all to float32 rounding, about 1e-6 m). All scores are 1. There is no
    line-of-sight test: a piece may be hidden behind another one.

    Args:
        rng: source of randomness; the same state gives the same room.
        objects: number of objects, exactly; 0 to 200 are tested.
        corners: corners of the floor polygon: 4, 6, 8, 10 or 12; by default 4, 6, 8 or 10 in
            60, 22, 10 and 8 % of rooms.
        camera_height: metres from the floor to the camera.

    Raises:
        ValueError: if ``objects`` is negative, ``corners`` is not one of these numbers or the
            camera is not between 0.3 and 2.2 m above the floor.

    Examples:
        >>> room = sample_room(np.random.default_rng(0), objects=5, corners=6)
        >>> len(room.objects.boxes), len(room.layout.floor_polygon)
        (5, 6)
    """
    if objects < 0:
        raise ValueError(f"objects must not be negative, found {objects}")
    if not 0.3 <= camera_height <= 2.2:
        raise ValueError(f"camera_height must be between 0.3 and 2.2 m, found {camera_height}")
    corners = sample_corner_count(rng) if corners is None else corners
    # the last part: walls, where most pieces stand, grow only with the root of the area
    area = (7.0 + 0.9 * objects + 0.002 * objects**2) * rng.uniform(0.9, 1.25)
    ceiling = float(rng.uniform(2.3, 3.4))
    names = [name for name in GROUPS if name != "open plan"]
    kind = "open plan" if objects > 40 else names[int(rng.integers(len(names)))]
    while True:
        plan = sample_floor_plan(rng, area, corners)
        camera = sample_camera(rng, plan)
        room = Furnishing(plan, camera, ceiling, objects, rng)
        _furnish(room, GROUPS[kind])
        if room.full:
            break
        area *= 1.2
    return _scene(room, camera, float(rng.uniform(-np.pi, np.pi)), camera_height, kind)


def _furnish(room: Furnishing, weights: dict[Group, float]) -> None:
    """Add groups until the room is full or too many of them fail."""
    rng, groups = room.rng, list(weights)
    share = np.array(list(weights.values()))
    # openings first, while walls are free: 20 objects include 1 or 2 doors, 1 to 3 windows
    wanted = room.capacity / 20
    openings = [door] * int(np.ceil(wanted * rng.uniform(0.4, 1.6)))
    openings += [window] * int(np.ceil(wanted * rng.uniform(0.4, 2.6)))
    if room.capacity < 4:
        openings = []
    for opening in openings:
        opening(room)
    failures = 0
    while not room.full and failures < _FAILURES:
        chosen = int(rng.choice(len(groups), p=share / share.sum()))
        placed = groups[chosen](room)
        failures = failures + 1 if placed is None else 0
        # another group of the same sort is less likely in a small room, and where there is
        # no more space for it (walls fill up before the floor does)
        share[chosen] *= 0.8 if placed is None else 1.0 - 0.7 / (1.0 + room.capacity / 40)


def _scene(
    room: Furnishing,
    camera: Float[np.ndarray, " 2"],
    yaw: float,
    camera_height: float,
    name: str,
) -> Scene:
    """Return the room as a scene: moved to the camera and turned about the vertical."""
    world_from_plan = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    polygon = (room.plan.polygon - camera) @ world_from_plan.T
    centre = np.array([piece.centre for piece in room.pieces]).reshape(-1, 3)
    centre[:, :2] = (centre[:, :2] - camera) @ world_from_plan.T
    size = np.array([piece.size for piece in room.pieces]).reshape(-1, 3)
    world_yaw = torch.tensor([piece.yaw + yaw for piece in room.pieces], dtype=torch.float32)
    boxes = OrientedBoxes(
        torch.tensor(centre, dtype=torch.float32),
        torch.tensor(size, dtype=torch.float32),
        wrap_angle(world_yaw),
    )
    objects = objects_from_boxes(
        boxes,
        [piece.category for piece in room.pieces],
        camera_height=camera_height,
        id=tuple(f"{piece.category}_{index}" for index, piece in enumerate(room.pieces)),
    )
    layout = Layout(torch.tensor(polygon, dtype=torch.float32), 0.0, room.ceiling)
    return scene_from_boxes(objects, layout, camera_height=camera_height, name=name)
