"""Make the sample room of the package: python examples/make_sample_room.py [FILE]."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from panoscene.scene import write_scene
from panoscene.synth import sample_room

SEED = 93  # chosen by looking: a bed between two chests, two desks, an L-shaped room

file = Path(sys.argv[1] if len(sys.argv) > 1 else "room.json")
room = sample_room(np.random.default_rng(SEED), objects=17, corners=6)
write_scene(replace(room, name="sample room", seed=SEED), file)
print(f"{file}: {len(room.objects.boxes)} objects")
