"""Batches of random boxes in an L-shaped room, and furnished rooms."""

import dataclasses

import numpy as np
import pytest
import torch

from panoscene.arrange import ArrangementBatch
from panoscene.geometry import OrientedBoxes, wall_boxes
from panoscene.scene import Scene
from panoscene.synth import perturb_scene, sample_room


def random_batch(
    scenes: int = 3, n: int = 5, seed: int = 0, dtype: torch.dtype = torch.float64
) -> ArrangementBatch:
    """Boxes anywhere about an L-shaped room with soft random relations; scene 1 is padded."""
    generator = torch.Generator().manual_seed(seed)

    def rand(*shape: int) -> torch.Tensor:
        return torch.rand(*shape, generator=generator, dtype=dtype)

    polygon = torch.tensor([[-3, -3], [3, -3], [3, 1], [1, 1], [1, 3], [-3, 3]], dtype=dtype)
    walls = wall_boxes(polygon, 0.0, 2.6)
    m = len(polygon)
    valid = torch.ones(scenes, n, dtype=torch.bool)
    if scenes > 1:
        valid[1, -2:] = False
    centre = torch.stack(
        [rand(scenes, n) * 7 - 3.5, rand(scenes, n) * 7 - 3.5, rand(scenes, n) * 2.2], -1
    )
    x, y, z = (centre - centre.new_tensor([0, 0, 1.6])).unbind(-1)
    bfov = torch.stack(
        [
            torch.atan2(x, y) + 0.1 * rand(scenes, n),
            torch.atan2(z, torch.hypot(x, y)),
            0.3 + rand(scenes, n),
            0.3 + rand(scenes, n),
        ],
        -1,
    )
    centre[:, 0, 2] = 2.2  # one box through the ceiling, one far below the floor, one far above
    centre[:, 1, 2] = -1.5
    centre[:, 2, 2] = 4.5
    centre[:, -1] = centre[:, -2] + 0.2  # and two that collide
    touching = 0.5 + 0.5 * rand(scenes, n, n)

    number = torch.arange(n)
    nested = (number[:, None] + number) % 3 == 0

    def each(values: torch.Tensor) -> torch.Tensor:
        return values.expand(scenes, *values.shape).contiguous()

    return ArrangementBatch(
        boxes=OrientedBoxes(centre, 0.3 + rand(scenes, n, 3) * 1.5, rand(scenes, n) * 6.2 - 3.1),
        valid=valid,
        bfov=bfov,
        score=rand(scenes, n),
        distance_score=rand(scenes, n),
        yaw_score=rand(scenes, n),
        built_in=torch.zeros(scenes, n, dtype=torch.bool),
        nested=nested.expand(scenes, n, n),
        touching=(touching + touching.transpose(-1, -2)) / 2,
        touching_wall=0.2 + 0.8 * rand(scenes, n, m),
        on_floor=rand(scenes, n),
        under_ceiling=rand(scenes, n),
        inside_room=1 - 0.04 * rand(scenes, n),
        farther_than=rand(scenes, n, n),
        relative_yaw=torch.softmax(rand(scenes, n, n, 8) * 6, -1),
        relative_yaw_wall=torch.softmax(rand(scenes, n, m, 8) * 6, -1),
        polygon=each(polygon),
        walls=OrientedBoxes(each(walls.centre), each(walls.size), each(walls.yaw)),
        wall_valid=torch.ones(scenes, m, dtype=torch.bool),
        floor_height=torch.zeros(scenes, dtype=dtype),
        ceiling_height=torch.full((scenes,), 2.6, dtype=dtype),
        camera_height=torch.full((scenes,), 1.6, dtype=dtype),
    )


def with_boxes(batch: ArrangementBatch, **fields: torch.Tensor) -> ArrangementBatch:
    """The same batch with some fields of its boxes replaced."""
    return dataclasses.replace(batch, boxes=dataclasses.replace(batch.boxes, **fields))


def noisy_room(seed: int, objects: int = 12, corners: int | None = None) -> tuple[Scene, Scene]:
    """A furnished room, and the same room as badly estimated."""
    rng = np.random.default_rng(seed)
    truth = sample_room(rng, objects=objects, corners=corners)
    return truth, perturb_scene(truth, rng)


@pytest.fixture(scope="session")
def noisy_rooms() -> list[tuple[Scene, Scene]]:
    """Ten rooms of several sizes: truth and estimate."""
    return [noisy_room(seed, objects=4 + 2 * seed) for seed in range(10)]
