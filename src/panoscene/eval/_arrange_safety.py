"""The promise of the ``default`` preset, put to the test on scenes without any sense."""

from collections import Counter
from collections.abc import Callable

import numpy as np
import torch

from panoscene.arrange import Arrangement, arrange_scenes
from panoscene.synth import sample_nonsense

_CHUNK = 250
_LARGEST = 64
_SLACK = 2e-5
PROMISED = (
    "energy",
    "colliding_pairs",
    "worst_penetration",
    "total_penetration",
    "worst_out_of_room",
    "out_of_room_volume",
)
"""Violations that ``default`` never makes larger."""


def broken_promises(result: Arrangement) -> list[str]:
    """Return what is worse than before or not finite; empty for every result of ``default``."""
    boxes, before, after = (
        result.scene.objects.boxes,
        result.certificate.before,
        result.certificate.after,
    )
    broken = []
    values = (boxes.centre, boxes.size, boxes.yaw)
    if not all(bool(torch.isfinite(value).all()) for value in values):
        broken.append("not finite")
    if not bool((boxes.size > 0).all()):
        broken.append("size not positive")
    for name in PROMISED:
        old, new = getattr(before, name), getattr(after, name)
        if not new <= old + _SLACK * (1 + abs(old)):
            broken.append(name)
    return broken


def run_arrange_safety(
    *, scenes: int = 10_000, seed: int = 0, progress: Callable[[str], None] | None = None
) -> dict[str, object]:
    """Return how many nonsense scenes ``default`` made worse (``worse``: none, it promises).

    Objects per scene: 0 to 64, geometric with mean 4.6. ``outcomes`` counts what became of the
    scenes, ``broken`` the promises that were not kept, by name.
    """
    rng = np.random.default_rng(seed)
    counts = np.minimum(rng.geometric(0.18, size=scenes) - 1, _LARGEST)
    counts[: min(scenes, 3)] = (0, 1, _LARGEST)[: min(scenes, 3)]
    counts = np.sort(counts)
    outcomes: Counter[str] = Counter()
    broken: Counter[str] = Counter()
    worse = 0
    for first in range(0, scenes, _CHUNK):
        chunk = [sample_nonsense(rng, int(n)) for n in counts[first : first + _CHUNK]]
        for result in arrange_scenes(chunk, "default"):
            outcomes[result.certificate.outcome] += 1
            faults = broken_promises(result)
            broken.update(faults)
            worse += bool(faults)
        if progress:
            progress(f"{min(first + _CHUNK, scenes)} of {scenes} scenes, {worse} worse")
    return {
        "scenes": scenes,
        "seed": seed,
        "worse": worse,
        "broken": dict(broken),
        "outcomes": dict(outcomes),
    }


def safety_table(result: dict[str, object]) -> str:
    """Return in one paragraph what ``run_arrange_safety`` found."""
    outcomes = result["outcomes"]
    if not isinstance(outcomes, dict):
        raise TypeError(f"result: found outcomes {outcomes!r}, expected counts by name")
    listed = ", ".join(f"{count} {name}" for name, count in sorted(outcomes.items()))
    return (
        f"Of {result['scenes']} scenes without any sense, {result['worse']} came out worse or not "
        f"finite. What was done: {listed}."
    )
