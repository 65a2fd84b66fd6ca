"""Train through the optimiser: relation scores learn from where the boxes end up.

A cabinet and a chair are both seen 15 cm away from a wall. In truth the cabinet stands against
it and the chair does not. Nobody says so to the scores of "touches the wall": they learn it from
the error of the final boxes, whose gradients flow back through every step of the optimiser.

Usage: python examples/03_train_through_the_optimiser.py [FOLDER]
"""

import sys
from dataclasses import replace
from pathlib import Path

import torch

from panoscene.arrange import ArrangementSettings, arrange, collate_scenes, optimise_boxes
from panoscene.geometry import OrientedBoxes
from panoscene.scene import Layout, objects_from_boxes, relations_from_boxes, scene_from_boxes
from panoscene.views import draw_comparison

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
folder.mkdir(parents=True, exist_ok=True)

corners = torch.tensor([[-1.5, -1.0], [1.5, -1.0], [1.5, 2.5], [-1.5, 2.5]])
seen = OrientedBoxes(
    centre=torch.tensor([[0.6, 2.10, 0.45], [-0.7, 2.10, 0.45]]),
    size=torch.tensor([[1.2, 0.5, 0.9], [0.5, 0.5, 0.9]]),
    yaw=torch.tensor([torch.pi, 0.0]),
)
true_y = torch.tensor([2.25, 2.10])
scene = scene_from_boxes(objects_from_boxes(seen, ["bottom_cabinet", "chair"]), Layout(corners))
batch = collate_scenes([scene])
settings = ArrangementSettings.preset("default").model_copy(update={"steps": 12})

logit = torch.ones(2, requires_grad=True)  # what a relation network would predict
learner = torch.optim.Adam([logit], lr=0.5)
wall = torch.tensor([0.0, 0.0, 1.0, 0.0])  # the third wall, from corner 2 to corner 3
for step in range(6):
    score = torch.sigmoid(logit)
    touching_wall = score[None, :, None] * wall
    boxes = optimise_boxes(replace(batch, touching_wall=touching_wall), settings)
    error = (boxes.centre[0, :, 1] - true_y).abs()
    learner.zero_grad()
    error.sum().backward()
    learner.step()
    cabinet, chair = score.tolist()
    print(f"step {step}: cabinet {cabinet:.2f}, chair {chair:.2f}, error {error.sum():.3f} m")

relations = relations_from_boxes(seen, scene.layout)
learnt = replace(relations, touching_wall=torch.sigmoid(logit.detach())[:, None] * wall)
final = arrange(replace(scene, relations=learnt)).scene
draw_comparison([("Seen", scene), ("With the learnt scores", final)], folder / "learnt.png")
