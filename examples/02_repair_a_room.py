"""Repair a room: wrong boxes are moved until nothing overlaps, floats or leaves the room.

Usage: python examples/02_repair_a_room.py [FOLDER]
"""

import sys
from pathlib import Path

import numpy as np

from panoscene.arrange import arrange
from panoscene.geometry import paired_box_iou
from panoscene.sample import sample_room_path
from panoscene.scene import read_scene, write_scene
from panoscene.synth import perturb_scene
from panoscene.views import describe_violations, draw_comparison

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
folder.mkdir(parents=True, exist_ok=True)

# The truth, and an estimate of it with the errors that networks make.
truth = read_scene(sample_room_path())
estimate = perturb_scene(truth, np.random.default_rng(1))

# "default" returns its input rather than anything worse; the certificate says what it did.
arrangement = arrange(estimate, "default")
repaired, certificate = arrangement.scene, arrangement.certificate

print("outcome:", certificate.outcome)
for name, scene, violations in (
    ("before", estimate, certificate.before),
    ("after", repaired, certificate.after),
):
    iou = paired_box_iou(scene.objects.boxes, truth.objects.boxes).mean()
    print(f"{name:>6}: {describe_violations(violations)}, mean 3D IoU with the truth {iou:.2f}")

write_scene(repaired, folder / "repaired.json")
draw_comparison(
    [("Before", estimate), ("After", repaired)],
    folder / "repair.png",
    captions=[describe_violations(certificate.before), describe_violations(certificate.after)],
    reference=truth,
)
