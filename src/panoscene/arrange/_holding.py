"""Which objects go back towards the input when the solution of a scene is not acceptable."""

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from panoscene.arrange._certificate import (
    COLLISION_TOLERANCE,
    SLACK,
    Faults,
    Measures,
    find_faults,
    measure,
)
from panoscene.arrange._energy import energy_of_boxes
from panoscene.arrange._problem import Problem, boxes_from_variables

_ROUNDS = 24
_LEAST_PART = 0.2
"""An object that would go a smaller part of its way stays where it was."""


def hold_back(
    final: Float[Tensor, "7 scenes n"], problem: Problem, before: Measures
) -> Float[Tensor, "7 scenes n"]:
    """Return the solution with the objects that make a scene worse moved part of their way only.

    In every round the objects to blame for what is worse than before go half as far, until
    nothing is worse: one pair that cannot be parted then no longer stops all others.

    Args:
        final: solution of every scene.
        problem: of the same scenes.
        before: what the input is worth.
    """
    start = problem.start
    part = torch.ones_like(start[0])
    old = find_faults(problem.batch.boxes, problem.batch)
    held = final
    for _ in range(_ROUNDS):
        boxes = boxes_from_variables(held, problem)
        faults = find_faults(boxes, problem.batch)
        after = measure(faults, energy_of_boxes(boxes, problem))
        worse = ~after.acceptable(before)
        if not bool(worse.any()):
            break
        guilty = _guilty(faults, old, after, before) & (part > 0)
        # without anybody to blame, as for the energy, all go back
        guilty |= ~guilty.any(-1, keepdim=True)
        part = torch.where(guilty & worse[:, None], part / 2, part)
        part = torch.where(part < _LEAST_PART, torch.zeros_like(part), part)
        held = start + part * (final - start)
    return held


def _guilty(
    faults: Faults, old: Faults, after: Measures, before: Measures
) -> Bool[Tensor, "scenes n"]:
    """Return the objects whose own faults grew, among those that must not have grown."""
    overlap, more = faults.overlap, faults.overlap - old.overlap

    def grew(name: str) -> Tensor:
        new, was = getattr(after, name), getattr(before, name)
        return (new > was + SLACK * (1 + was))[:, None, None]

    def above(bound: Tensor) -> Tensor:
        return overlap > bound[:, None, None] + SLACK

    most = more.flatten(1).amax(-1)[:, None, None]
    pair = grew("pairs") & above(before.pairs * 0 + COLLISION_TOLERANCE)
    pair |= grew("worst_penetration") & above(before.worst_penetration)
    pair |= grew("total_penetration") & (more > most / 2)
    own = (pair & (more > SLACK)).any(-1)
    far = faults.outside > before.worst_outside[:, None] + SLACK
    own |= grew("worst_outside")[..., 0] & far
    spilt = faults.volume - old.volume
    most = spilt.amax(-1, keepdim=True).clamp(min=0)
    return own | (grew("outside_volume")[..., 0] & (spilt > most / 2))
