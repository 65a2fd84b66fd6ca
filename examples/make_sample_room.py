"""Make the sample room of the package: python examples/make_sample_room.py [FILE]."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from panoscene.scene import CATEGORIES, Scene, objects_from_boxes, scene_from_boxes, write_scene
from panoscene.synth import sample_room

# chosen by looking: a bed between two chests, two desks, an L-shaped room; before the bed
SEED, CAMERA = 93, (0.7, -2.55)


def seen_from(room: Scene, place: tuple[float, float]) -> Scene:
    """Return the room with its camera at another place: there the world has its origin."""
    objects, layout, height = room.objects, room.layout, room.panorama.camera_height
    boxes = replace(objects.boxes, centre=objects.boxes.centre - torch.tensor([*place, 0.0]))
    categories = [CATEGORIES[int(k)] for k in objects.category]
    moved = objects_from_boxes(boxes, categories, camera_height=height, id=objects.id)
    layout = replace(layout, floor_polygon=layout.floor_polygon - torch.tensor(place))
    return scene_from_boxes(moved, layout, camera_height=height, name=room.name)


file = Path(sys.argv[1] if len(sys.argv) > 1 else "room.json")
room = seen_from(sample_room(np.random.default_rng(SEED), objects=17, corners=6), CAMERA)
write_scene(replace(room, name="sample room", seed=SEED), file)
print(f"{file}: {len(room.objects.boxes)} objects")
