"""Scenes without any sense: what a solver must survive."""

from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from panoscene.geometry import OrientedBoxes
from panoscene.scene import Layout, Objects, Panorama, Relations, Scene, relations_from_boxes

_SQUARE = ((-1, -1), (1, -1), (1, 1), (-1, 1))
_ELL = ((-1, -1), (1, -1), (1, 0.3), (0.2, 0.3), (0.2, 1), (-1, 1))


def sample_nonsense(rng: np.random.Generator, objects: int) -> Scene:
    """Return boxes anywhere, of any size, with any scores, in a room of any shape and height.

    Rooms are squares, Ls and stars of up to 12 corners, half a metre to 30 m across, 0.1 to 20 m
    high; every fourth does not hold the camera. Sizes span millimetres to tens of metres; places a
    point to five times the room; BFoVs and half of all relations have nothing to do with the
    boxes.
    """
    polygon = torch.from_numpy(_outline(rng).astype(np.float32))
    layout = Layout(polygon, 0.0, float(10 ** rng.uniform(-1, 1.3)))

    def uniform(*shape: int) -> Tensor:
        return torch.from_numpy(rng.random((objects, *shape), dtype=np.float32))

    spread = float(rng.choice([0.01, 1.0, 3.0, 10.0]))
    boxes = OrientedBoxes(
        (uniform(3) - 0.5) * spread * torch.tensor([2.0, 2.0, 1.0]),
        torch.exp((uniform(3) - 0.7) * float(rng.choice([0.5, 3.0, 9.0]))),
        (uniform() - 0.5) * 20,
    )
    lonlat = torch.stack([(uniform() - 0.5) * 2 * np.pi, (uniform() - 0.5) * np.pi], -1)
    fov = torch.stack([uniform() * 2 * np.pi, uniform() * np.pi], -1)
    found = Objects(
        boxes=boxes,
        category=torch.zeros(objects, dtype=torch.int64),
        score=uniform(),
        bfov=torch.cat([lonlat, fov], -1),
        distance_score=uniform(),
        yaw_score=uniform(),
    )
    scene = Scene(Panorama(1024, 512), layout, found)
    if rng.random() < 0.5:
        return replace(scene, relations=relations_from_boxes(boxes, layout))
    walls, touching = len(polygon), uniform(objects)
    return replace(
        scene,
        relations=Relations(
            touching=(touching + touching.T) / 2,
            touching_wall=uniform(walls),
            on_floor=uniform(),
            under_ceiling=uniform(),
            inside_room=uniform(),
            farther_than=uniform(objects),
            relative_yaw=torch.softmax(uniform(objects, 8) * 8, -1),
            relative_yaw_wall=torch.softmax(uniform(walls, 8) * 8, -1),
        ),
    )


def _outline(rng: np.random.Generator) -> np.ndarray:
    """Return a simple polygon, counter-clockwise, "corners 2"."""
    kind = rng.integers(3)
    if kind == 0:
        corners = np.array(_SQUARE, dtype=float)
    elif kind == 1:
        corners = np.array(_ELL)
    else:
        # corners in the order of their angles see the centre, so no two walls cross
        count = int(rng.integers(4, 13))
        angle = (np.arange(count) + rng.uniform(0.1, 0.9, count)) * (2 * np.pi / count)
        radius = rng.uniform(0.3, 1, count)
        corners = np.stack([radius * np.cos(angle), radius * np.sin(angle)], -1)
    corners = corners * 10 ** rng.uniform(-0.6, 1.2, size=2)
    if rng.random() < 0.25:
        corners = corners + 3 * np.ptp(corners, axis=0) * rng.uniform(-1, 1, 2)
    return corners
