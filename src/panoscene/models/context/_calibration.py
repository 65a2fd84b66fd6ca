"""From logits to probabilities that mean what they say."""

from collections.abc import Iterable
from dataclasses import dataclass, fields

import torch
from jaxtyping import Bool, Float
from torch import Tensor

from ._messages import pairs_of
from ._move import moved
from ._relations import ContextOutput, ContextTargets, RelationBatch

RELATIONS: tuple[str, ...] = tuple(field.name for field in fields(RelationBatch))
"""Names of the relations, in the order of ``RelationBatch``."""
YAWS = ("relative_yaw", "relative_yaw_wall")
"""Relations with one of eight bins as their answer; the others are true or false."""
_UNSHIFTED = (*YAWS, "farther_than")
_CAUTION = 1.0
_STEPS = 50
_PRECISE = 1e-6
_SMALLEST_SCALE = 0.01


@dataclass(frozen=True, slots=True)
class Calibration:
    """A line for the logits of each relation, in the order of ``RelationBatch``.

    Balanced losses make rare relations look likely, and networks are too sure of themselves; after
    ``logit * scale + shift`` a probability of 0.7 is right in 7 of 10 cases, which is what the
    thresholds of the optimiser are about.
    """

    scale: Float[Tensor, "8"]
    """Positive."""
    shift: Float[Tensor, "8"]
    """0 for relative yaws and for ``farther_than``, whose two directions must agree."""

    def to(self, device: torch.device | str) -> "Calibration":
        """Return the same on a device."""
        return moved(self, device)


def relation_masks(
    valid: Bool[Tensor, "scenes n"], wall_valid: Bool[Tensor, "scenes m"]
) -> dict[str, Bool[Tensor, "scenes ..."]]:
    """Return for each relation which entries mean anything: no padding, no object with itself."""
    pair, wall = pairs_of(valid), valid[:, :, None] & wall_valid[:, None, :]
    return {
        "touching": pair,
        "touching_wall": wall,
        "on_floor": valid,
        "under_ceiling": valid,
        "inside_room": valid,
        "farther_than": pair,
        "relative_yaw": pair,
        "relative_yaw_wall": wall,
    }


def relation_probabilities(
    logits: RelationBatch,
    valid: Bool[Tensor, "scenes n"],
    wall_valid: Bool[Tensor, "scenes m"],
    calibration: Calibration | None = None,
) -> RelationBatch:
    """Return the probabilities of the relations, differentiable; 0 for padding and diagonals.

    Args:
        logits: Of the network.
        valid: Which objects are there.
        wall_valid: Which walls are there.
        calibration: Of the network; without it the logits are taken as they are.
    """
    found: dict[str, Tensor] = {}
    for number, (name, mask) in enumerate(relation_masks(valid, wall_valid).items()):
        logit = getattr(logits, name)
        if calibration is not None:
            logit = logit * calibration.scale[number] + calibration.shift[number]
        if name in YAWS:
            found[name] = logit.softmax(dim=-1) * mask.unsqueeze(-1)
        else:
            found[name] = logit.sigmoid() * mask
    return RelationBatch(**found)


def fit_calibration(judged: Iterable[tuple[ContextOutput, ContextTargets]]) -> Calibration:
    """Return the lines under which the true relations are likeliest.

    A weak preference for leaving the logits alone keeps relations sound that hardly occur.

    Args:
        judged: What the network said of scenes that it was not trained with, and the truth.

    Raises:
        ValueError: An output has no relations.

    Source: Platt scaling; Guo et al., On Calibration of Modern Neural Networks, for the yaws.
    """
    logits: dict[str, list[Tensor]] = {name: [] for name in RELATIONS}
    truths: dict[str, list[Tensor]] = {name: [] for name in RELATIONS}
    for output, target in judged:
        if output.relations is None:
            raise ValueError("judged: found an output without relations, expected relation heads")
        for name, mask in relation_masks(target.matched & output.valid, output.wall_valid).items():
            logits[name].append(getattr(output.relations, name)[mask].detach().double().cpu())
            truths[name].append(getattr(target.relations, name)[mask].double().cpu())
    lines = [
        _line(torch.cat(logits[name]), torch.cat(truths[name]), name)
        if logits[name]
        else torch.tensor([1.0, 0.0], dtype=torch.float64)
        for name in RELATIONS
    ]
    scale, shift = torch.stack(lines).float().unbind(-1)
    return Calibration(scale, shift)


def _line(logit: Tensor, truth: Tensor, name: str) -> Float[Tensor, "2"]:
    """Return scale and shift by Newton's method; the problem is convex."""
    if name not in YAWS:
        # false has the logit 0
        logit = torch.stack([torch.zeros_like(logit), logit], dim=-1)
        truth = torch.stack([1 - truth, truth], dim=-1)
    shifted = torch.zeros_like(logit)
    if name not in _UNSHIFTED:
        shifted[..., 1] = 1
    slope = torch.stack([logit, shifted], dim=-1)
    rest = line = torch.tensor([1.0, 0.0], dtype=torch.float64)

    def missed(line: Tensor) -> Tensor:
        likely = ((slope @ line).log_softmax(dim=-1) * truth).sum()
        return _CAUTION * (line - rest).square().sum() - likely

    for _ in range(_STEPS):
        chance = (slope @ line).softmax(dim=-1)
        first = torch.einsum("ek,ekp->p", chance - truth, slope) + 2 * _CAUTION * (line - rest)
        mean = torch.einsum("ek,ekp->ep", chance, slope)
        second = torch.einsum("ek,ekp,ekq->pq", chance, slope, slope) - mean.mT @ mean
        step = torch.linalg.solve(second + 2 * _CAUTION * torch.eye(2, dtype=torch.float64), first)
        while missed(line - step) > missed(line) and step.abs().max() > _PRECISE:
            step = step / 2
        line = line - step
        if step.abs().max() < _PRECISE:
            break
    return line.clamp(min=line.new_tensor([_SMALLEST_SCALE, -torch.inf]))
