"""Synthetic scenes: furnished rooms with exact ground truth, and estimates with known errors."""

from ._corrupt import corrupt_relations as corrupt_relations
from ._estimates import EstimateNoise as EstimateNoise
from ._estimates import estimate_scene as estimate_scene
from ._nonsense import sample_nonsense as sample_nonsense
from ._perturb import PerturbNoise as PerturbNoise
from ._perturb import perturb_scene as perturb_scene
from ._room_sampler import sample_room as sample_room
