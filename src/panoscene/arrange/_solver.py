"""Gradient descent on the arrangement: plain momentum (paper) and our damped adaptive steps."""

import math
from collections.abc import Collection, Iterator
from typing import Any

from panoscene.arrange._gradient import energy_gradient
from panoscene.arrange._kernel import Kernel
from panoscene.arrange._settings import ArrangementSettings

Array = Any

_SECOND_MOMENTUM = 0.9
_DAMPING = 0.05
"""Gradients well below this move a variable in proportion, larger ones by the learning rate."""


def descend(
    start: Array, kernel: Kernel, settings: ArrangementSettings, keep: Collection[int] = ()
) -> tuple[Array, dict[int, Array]]:
    """Return the variables after all steps, and those after the steps to ``keep``.

    Differentiable in everything when ``start`` and ``kernel`` hold torch tensors: the steps are
    unrolled, nothing is changed in place.

    Args:
        start: variables "7 scenes n", numpy or torch like the kernel.
        kernel: constants of the problem.
        settings: solver, number of steps, learning rate, momentum.
        keep: numbers of steps after which the variables are kept; 0 is the start.
    """
    kept = {0: start} if 0 in keep else {}
    x = start
    for step, x in enumerate(steps(start, kernel, settings), start=1):
        if step in keep:
            kept[step] = x
    return x, kept


def steps(start: Array, kernel: Kernel, settings: ArrangementSettings) -> Iterator[Array]:
    """Yield the variables after each step."""
    run = _sgd if settings.solver == "sgd" else _adam
    return run(start, kernel, settings)


def _sgd(x: Array, kernel: Kernel, settings: ArrangementSettings) -> Iterator[Array]:
    """Yield the variables after every step of momentum descent (paper, Sec. 3.3)."""
    xp = kernel.xp
    direction = settings.direction_gradient_scale
    velocity = xp.zeros_like(x)
    for _ in range(settings.steps):
        gradient = energy_gradient(x, kernel)
        if direction != 1:
            gradient = xp.concatenate([gradient[:2] * direction, gradient[2:]])
        velocity = settings.momentum * velocity + gradient
        x = x - settings.learning_rate * kernel.pace * velocity
        x = xp.minimum(xp.maximum(x, kernel.least_allowed), kernel.most_allowed)
        yield x


def _adam(x: Array, kernel: Kernel, settings: ArrangementSettings) -> Iterator[Array]:
    """Yield the variables after every adaptive step; the step length falls like half a cosine."""
    xp = kernel.xp
    mean = xp.zeros_like(x)
    square = xp.zeros_like(x)
    for step in range(settings.steps):
        gradient = energy_gradient(x, kernel)
        mean = settings.momentum * mean + (1 - settings.momentum) * gradient
        square = _SECOND_MOMENTUM * square + (1 - _SECOND_MOMENTUM) * gradient * gradient
        rate = settings.learning_rate * (0.5 + 0.5 * math.cos(math.pi * step / settings.steps))
        first = rate / (1 - settings.momentum ** (step + 1))
        scale = 1 / (1 - _SECOND_MOMENTUM ** (step + 1))
        # the tiny offset keeps the square root differentiable for variables that never moved
        x = x - first * kernel.pace * mean / (xp.sqrt(square * scale + 1e-12) + _DAMPING)
        x = xp.minimum(xp.maximum(x, kernel.least_allowed), kernel.most_allowed)
        yield x
