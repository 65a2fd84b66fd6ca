"""Describe a room: boxes from anywhere become a scene whose relations can be read.

Usage: python examples/01_describe_a_room.py [FOLDER]
"""

import math
import sys
from pathlib import Path

import torch

from panoscene.geometry import OrientedBoxes
from panoscene.scene import (
    Layout,
    objects_from_boxes,
    relation_triples,
    scene_from_boxes,
    write_scene,
)
from panoscene.views import draw_birds_eye

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
folder.mkdir(parents=True, exist_ok=True)

# A room of 4 x 3 m and 2.5 m height around the camera, corners counter-clockwise from above.
corners = torch.tensor([[-1.8, -1.2], [2.2, -1.2], [2.2, 1.8], [-1.8, 1.8]])
layout = Layout(floor_polygon=corners, ceiling_height=2.5)

# Metres and radians. Yaw 0 faces +y, and turns counter-clockwise seen from above.
furniture = {
    #               centre x, y, z      width, depth, height   yaw
    "bed": ([1.20, 0.80, 0.45], [1.60, 2.00, 0.90], math.pi),
    "bottom_cabinet": ([0.15, 1.58, 0.30], [0.50, 0.44, 0.60], math.pi),
    "table_lamp": ([0.15, 1.58, 0.80], [0.24, 0.24, 0.40], math.pi),
    "table": ([-1.45, 0.20, 0.37], [1.20, 0.70, 0.74], -math.pi / 2),
    "chair": ([-0.88, 0.20, 0.44], [0.46, 0.44, 0.88], math.pi / 2),
    "door": ([-0.60, -1.16, 1.02], [0.90, 0.08, 2.04], 0.0),
}
centre, size, yaw = zip(*furniture.values(), strict=True)
boxes = OrientedBoxes(torch.tensor(centre), torch.tensor(size), torch.tensor(yaw))

scene = scene_from_boxes(objects_from_boxes(boxes, list(furniture)), layout, name="small bedroom")

for triple in relation_triples(scene):
    if triple.predicate in ("touching", "on_floor"):
        print(triple)

write_scene(scene, folder / "bedroom.json")
draw_birds_eye(scene, folder / "bedroom.png")
