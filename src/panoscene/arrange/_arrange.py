"""Scenes in, repaired scenes and certificates out: the public face of the optimiser."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.arrange._batch import ArrangementBatch, collate_scenes
from panoscene.arrange._certificate import SLACK, Certificate, Measures, find_faults, measure
from panoscene.arrange._energy import energy_of_boxes, energy_terms
from panoscene.arrange._holding import hold_back
from panoscene.arrange._kernel import Kernel, make_kernel
from panoscene.arrange._problem import (
    Problem,
    boxes_from_variables,
    make_problem,
    repeat_problem,
    variables_from_boxes,
)
from panoscene.arrange._settings import ArrangementSettings
from panoscene.arrange._solver import descend, steps
from panoscene.geometry import OrientedBoxes
from panoscene.scene import Scene

_BLENDS = (0.5, 0.25, 0.1)
"""Parts of the way to the solution that are tried when the solution itself is not acceptable."""


@dataclass(frozen=True, slots=True)
class Arrangement:
    """A repaired scene, what it is worth, and how it came about."""

    scene: Scene
    """The scene with its boxes replaced; everything else as it came."""
    certificate: Certificate
    path: tuple[OrientedBoxes, ...] = ()
    """Boxes from the start to the end of the descent, when they were asked for."""


def arrange(
    scene: Scene, settings: ArrangementSettings | str = "default", *, frames: int = 0
) -> Arrangement:
    """Return the scene with its objects moved to agree with physics, relations and image.

    Args:
        scene: boxes, layout and relations; relations that are missing are derived from the boxes.
        settings: a preset's name or your own settings.
        frames: number of states of the descent to keep in ``path``, from start to end; at most one
            more than the settings have steps. With ``safe`` the path of a scene whose solution was
            not acceptable still shows that solution.

    Raises:
        ValueError: boxes that cannot be arranged (NaN, infinite, sizes not positive), or an
            unknown preset. Anything else in a scene that is not finite, of the wrong shape or out
            of range is refused too; the message names scene and field.

    Source: DeepPanoContext, Sec. 3.3 "Relation optimization".
    """
    return arrange_scenes([scene], settings, frames=frames)[0]


def arrange_scenes(
    scenes: Sequence[Scene], settings: ArrangementSettings | str = "default", *, frames: int = 0
) -> list[Arrangement]:
    """Return one arrangement for each scene, solved as one padded batch.

    Arguments and errors as in ``arrange``.
    """
    if isinstance(settings, str):
        settings = ArrangementSettings.preset(settings)
    if not scenes:
        return []
    with torch.no_grad():
        batch = collate_scenes(scenes)
        problem = make_problem(batch, settings)
        marks = {round(settings.steps * i / max(frames - 1, 1)) for i in range(frames)}
        late = settings.steps * 3 // 4
        final, kept = _descend(problem, keep={*marks, late, settings.steps // 2})
        finite = torch.isfinite(final).all(0).all(-1)
        final = torch.where(finite[None, :, None], final, problem.start)
        solved = _settle(final, problem) if settings.safe else final
        before, after = _measure_all([solved], problem)
        start, between, end = before.energy.sum(-1), *_energies([kept[late], final], problem)
        chosen = _choose(problem, _Solved(final, solved, finite, after), kept, before)
        path = [boxes_from_variables(kept[mark], problem) for mark in sorted(marks)]
    energies = torch.stack([start, between, end])
    outside = ((batch.inside_room < 0.5) & batch.valid).sum(-1)
    results = []
    for index, scene in enumerate(scenes):
        converged = _converged(*energies[:, index].tolist())
        count = len(scene.objects.boxes)
        boxes = chosen.boxes[index, :count] if chosen.changed[index] else scene.objects.boxes
        certificate = Certificate(
            preset=settings.name,
            steps=settings.steps,
            changed=bool(chosen.changed[index]),
            converged=converged,
            outcome=_words(
                chosen.outcome[index],
                converged,
                float(before.energy[index].sum()),
                float(chosen.after.energy[index].sum()),
            ),
            largest_size_change=_size_change(scene.objects.boxes, boxes),
            left_outside=int(outside[index]),
            before=before.violations(index),
            after=(chosen.after if chosen.changed[index] else before).violations(index),
        )
        results.append(
            Arrangement(
                scene=replace(scene, objects=replace(scene.objects, boxes=_like(boxes, scene))),
                certificate=certificate,
                path=tuple(frame[index, :count] for frame in path),
            )
        )
    return results


def optimise_boxes(
    batch: ArrangementBatch,
    settings: ArrangementSettings,
    weights: Float[Tensor, " terms"] | None = None,
) -> OrientedBoxes:
    """Return the optimised boxes with gradients to start boxes, relation scores and weights.

    The steps are unrolled, so memory grows with ``settings.steps`` (the paper trains with few
    steps at batch size 1). Stop-gradients: which boxes collide, the side of a wall, the bounding
    corner, the arg-max bin, and thresholds; the confidence above a threshold is differentiable.
    ``safe`` is not applied: choosing between input and output has no gradient.

    Args:
        batch: scenes from ``collate_scenes``; may require gradients.
        settings: how to solve.
        weights: lambda of every term in the order of ``TERM_NAMES``, instead of the settings'.
    """
    problem = make_problem(batch, settings, weights)
    final, _ = descend(problem.start, make_kernel(problem), settings)
    return boxes_from_variables(final, problem)


def energy(
    batch: ArrangementBatch,
    settings: ArrangementSettings,
    *,
    boxes: OrientedBoxes | None = None,
    weights: Float[Tensor, " terms"] | None = None,
) -> Float[Tensor, "scenes terms"]:
    """Return the energy terms of each scene, in the order of ``TERM_NAMES``.

    Args:
        batch: scenes from ``collate_scenes``; their boxes are the observation.
        settings: which energy.
        boxes: boxes to judge by that observation instead of the observed ones, batch shape
            (scenes, n).
        weights: lambda of every term, instead of the settings'.
    """
    problem = make_problem(batch, settings, weights)
    if boxes is None:
        return energy_terms(problem.start, problem, batch.boxes)
    return energy_of_boxes(boxes, problem)


def solver_states(
    batch: ArrangementBatch, settings: ArrangementSettings
) -> Iterator[tuple[int, OrientedBoxes]]:
    """Yield step numbers from 1 and the boxes after each step, without ``safe`` and gradients."""
    with torch.no_grad():
        problem = make_problem(batch, settings)
        kernel, start = _for_device(problem)
    following = enumerate(steps(start, kernel, settings), start=1)
    while True:
        # the mode must not stay switched while a caller holds the generator
        with torch.no_grad():
            number, x = next(following, (0, None))
            if x is None:
                return
            boxes = boxes_from_variables(torch.as_tensor(x), problem)
        yield number, boxes


def _for_device(problem: Problem) -> tuple[Kernel, Any]:
    """Return kernel and start values in the array library that suits the device."""
    kernel = make_kernel(problem)
    if problem.start.device.type != "cpu":
        return kernel, problem.start
    return kernel.numpy(), problem.start.numpy()


def _descend(problem: Problem, keep: set[int]) -> tuple[Tensor, dict[int, Tensor]]:
    """Run the solver with the array library that suits the device."""
    kernel, start = _for_device(problem)
    if problem.settings.variables == "metric":
        # boxes in the same place have no direction to part in; a tenth of a millimetre gives one
        number = np.arange(start.shape[-1])
        angle = np.stack([2.4 * number, 2.4 * number + 2, 4.1 * number + 1])[:, None]
        apart = kernel.xp.asarray(1e-4 * np.cos(angle), dtype=start.dtype)
        start = kernel.xp.concatenate([start[:3] + apart, start[3:]])
    # what overflows is not finite and will not be taken
    with np.errstate(all="ignore"):
        final, kept = descend(start, kernel, problem.settings, keep)
    return torch.as_tensor(final), {step: torch.as_tensor(x) for step, x in kept.items()}


def _like(boxes: OrientedBoxes, scene: Scene) -> OrientedBoxes:
    """Return the boxes in the scene's own precision; a batch has the finest of its scenes."""
    dtype = scene.objects.boxes.centre.dtype
    return OrientedBoxes(boxes.centre.to(dtype), boxes.size.to(dtype), boxes.yaw.to(dtype))


def _measure(variables: Tensor, problem: Problem) -> Measures:
    boxes = boxes_from_variables(variables, problem)
    return measure(find_faults(boxes, problem.batch), energy_of_boxes(boxes, problem))


def _measure_all(states: list[Tensor], problem: Problem) -> list[Measures]:
    """Return the measures of the input and of other states, in one go."""
    together = repeat_problem(problem, 1 + len(states))
    variables = torch.cat([problem.start, *states], 1)
    decoded = boxes_from_variables(variables, together)
    given, count = problem.batch.boxes, len(problem.batch.boxes)
    boxes = OrientedBoxes(
        torch.cat([given.centre, decoded.centre[count:]]),
        torch.cat([given.size, decoded.size[count:]]),
        torch.cat([given.yaw, decoded.yaw[count:]]),
    )
    energies = energy_of_boxes(boxes, together)
    return measure(find_faults(boxes, together.batch), energies).split(1 + len(states))


def _energies(states: list[Tensor], problem: Problem) -> tuple[Tensor, ...]:
    """Return the energy of each scene in each state."""
    together = repeat_problem(problem, len(states))
    return energy_terms(torch.cat(states, 1), together).sum(-1).chunk(len(states))


@dataclass(frozen=True, slots=True)
class _Solved:
    """Where the descent ended: as it did, settled on the floor, and measured."""

    final: Tensor
    settled: Tensor
    finite: Tensor
    measures: Measures


@dataclass(frozen=True, slots=True)
class _Chosen:
    boxes: OrientedBoxes
    after: Measures
    changed: Tensor
    outcome: list[str]


def _choose(
    problem: Problem, solved: _Solved, kept: dict[int, Tensor], before: Measures
) -> _Chosen:
    """Take the solution of each scene, or with ``safe`` the best acceptable state."""
    start, best, after = problem.start, solved.settled, solved.measures
    taken = solved.finite
    words = ["solved" if good else "diverged, input returned" for good in taken.tolist()]
    if problem.settings.safe:
        taken = after.acceptable(before) & solved.finite
        words = ["solved" if good else "input returned" for good in taken.tolist()]
        for label, candidate in _second_choices(problem, solved.final, kept, before):
            if bool(taken.all()):
                break
            trial = _measure(candidate, problem)
            take = trial.acceptable(before) & ~taken
            best = torch.where(take[None, :, None], candidate, best)
            after = trial.where(take, after)
            words = [label if new else word for new, word in zip(take.tolist(), words, strict=True)]
            taken = taken | take
    changed = taken & (best != start).any(0).any(-1)
    return _Chosen(boxes_from_variables(best, problem), after, changed, words)


def _second_choices(
    problem: Problem, final: Tensor, kept: dict[int, Tensor], before: Measures
) -> Iterator[tuple[str, Tensor]]:
    """Yield what else may be acceptable, best first."""
    start = problem.start
    yield "solved", final
    if problem.settings.safe_by == "object":
        yield "solved in part", hold_back(final, problem, before)
    for step in sorted(kept, reverse=True):
        yield f"state after {step} steps", kept[step]
    for part in _BLENDS:
        yield f"{part:.0%} of the way", start + part * (final - start)


def _settle(variables: Tensor, problem: Problem) -> Tensor:
    """Return the variables with boxes that stand within the clearance of the floor put onto it."""
    boxes = boxes_from_variables(variables, problem)
    bottom = boxes.centre[..., 2] - boxes.size[..., 2] / 2
    gap = bottom - problem.batch.floor_height[:, None]
    near = (gap.abs() <= 2 * problem.settings.clearance) & (problem.confidence.on_floor > 0)
    drop = torch.stack([torch.zeros_like(gap), torch.zeros_like(gap), gap * near], -1)
    on_floor = OrientedBoxes(boxes.centre - drop, boxes.size, boxes.yaw)
    settled = variables_from_boxes(on_floor, problem)
    return torch.where(near[None], settled, variables)


def _words(outcome: str, converged: bool, start: float, end: float) -> str:
    """Return the outcome; a descent that ended too early, or uphill, does not count as solved.

    Only ``safe`` forbids a result that is worse than the input.
    """
    if outcome != "solved":
        return outcome
    if end > start + SLACK * (1 + abs(start)):
        return "worse than the input"
    return outcome if converged else "improved, not converged"


def _size_change(before: OrientedBoxes, after: OrientedBoxes) -> float:
    """Return the largest factor between sizes, at least 1."""
    if len(before) == 0:
        return 1.0
    ratio = after.size / before.size
    return float(torch.maximum(ratio, 1 / ratio).max())


def _converged(start: float, late: float, end: float) -> bool:
    """Return whether the last quarter of the steps brought less than 1 % of the decrease."""
    return abs(late - end) <= 0.01 * abs(start - end) + 1e-9
