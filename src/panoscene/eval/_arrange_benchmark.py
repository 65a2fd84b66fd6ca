"""Speed of the arrangement optimiser, and time until it beats the authors' released solver."""

import statistics
import time
from collections.abc import Callable, Sequence

import numpy as np
import torch

from panoscene.arrange import (
    PRESETS,
    ArrangementSettings,
    arrange_scenes,
    collate_scenes,
    energy,
    solver_states,
)
from panoscene.eval._machine import machine_facts
from panoscene.scene import Scene
from panoscene.synth import perturb_scene, sample_room

STEPS = 100
"""Steps of a timed solve: as many as the paper's."""
_WALLS = 8
_BATCH = 64
_GROWTH = (10, 20, 50, 100, 200)

Progress = Callable[[str], None] | None


def run_arrange_benchmark(*, repeats: int = 5, progress: Progress = None) -> dict[str, object]:
    """Return wall-clock medians of the optimiser on perturbed rooms with eight walls.

    Every time but those to quality is that of the whole call: padding, 100 steps, certificate.
    Keys:

    - ``scene_20_ms``: one scene of 20 objects with ``default``; every preset's time is in
      ``scene_20_presets_ms``;
    - ``batch_64_scenes_s``: 64 such scenes at once, and ``batch_64_presets_s`` likewise;
    - ``scene_200_s``: one scene of 200 objects; ``growth_s`` the way there;
    - ``to_quality_20_ms``: time until ``default`` has a lower energy than ``released`` after its
      100 steps, from the same start: padding, preparing and the steps up to the first such state,
      without certificate. Median over scenes, infinite where it never does;
      ``to_quality_reached`` is the share of scenes in which it gets there. The judge is the energy
      of the paper (plain sums, the paper's weights), which neither of the two minimises to the
      letter. ``to_quality_released_20_ms`` and ``.._reached`` are judged by the released energy,
      the rival's own;
    - ``default_20_ms``: one scene of 20 objects with the default's own number of steps.

    Args:
        repeats: how often everything is measured; the first run of each is not counted.
        progress: called with a line of text before each measurement.
    """
    tell = progress or (lambda _text: None)
    rooms = {n: [_room(n, seed) for seed in range(2)] for n in _GROWTH}
    many = [_room(20, seed) for seed in range(_BATCH)]
    presets = {
        name: settings.model_copy(update={"steps": STEPS}) for name, settings in PRESETS.items()
    }
    single: dict[str, float] = {}
    batched: dict[str, float] = {}
    for name, settings in presets.items():
        tell(f"{name}: one scene of 20 objects")
        single[name] = 1e3 * _median(rooms[20][:1], settings, 2 * repeats)
        tell(f"{name}: {_BATCH} scenes of 20 objects")
        batched[name] = _median(many, settings, repeats)
    growth: dict[str, float] = {}
    for n in _GROWTH:
        tell(f"default: one scene of {n} objects")
        growth[str(n)] = _median(rooms[n][:1], presets["default"], repeats)
    tell("default: time to quality")
    quality = {
        name: _time_to_quality(many[:20], PRESETS[name], repeats) for name in ("released", "paper")
    }
    return {
        "scene_20_ms": single["default"],
        "batch_64_scenes_s": batched["default"],
        "scene_200_s": growth["200"],
        "to_quality_20_ms": quality["paper"][0],
        "to_quality_reached": quality["paper"][1],
        "to_quality_released_20_ms": quality["released"][0],
        "to_quality_released_reached": quality["released"][1],
        "default_20_ms": 1e3 * _median(rooms[20][:1], PRESETS["default"], 2 * repeats),
        "scene_20_presets_ms": single,
        "batch_64_presets_s": batched,
        "growth_s": growth,
        "steps": STEPS,
        "repeats": repeats,
        "machine": machine_facts(),
    }


_LABELS = {
    "scene_20_ms": "`default`, one scene of 20 objects, 100 steps, ms",
    "batch_64_scenes_s": "`default`, 64 scenes of 20 objects at once, 100 steps, s",
    "scene_200_s": "`default`, one scene of 200 objects, 100 steps, s",
    "default_20_ms": "`default`, one scene of 20 objects with its own 50 steps, ms",
    "to_quality_20_ms": "until `default` beats `released` by the paper's energy, ms",
    "to_quality_reached": "share of scenes in which it beats it by the paper's energy",
    "to_quality_released_20_ms": "until `default` beats `released` by the released energy, ms",
    "to_quality_released_reached": "share of scenes in which it beats it by the released energy",
}


def benchmark_table(result: dict[str, object]) -> str:
    """Return the main figures as a Markdown table."""
    lines = ["| figure | value |", "| --- | ---: |"]
    lines += [f"| {label} | {result[key]:.3g} |" for key, label in _LABELS.items() if key in result]
    growth = result.get("growth_s")
    if isinstance(growth, dict):
        listed = ", ".join(f"{n}: {seconds:.2f}" for n, seconds in growth.items())
        lines.append(f"| growth, 100 steps, s by number of objects | {listed} |")
    return "\n".join(lines)


def _room(objects: int, seed: int) -> Scene:
    rng = np.random.default_rng(seed)
    return perturb_scene(sample_room(rng, objects=objects, corners=_WALLS), rng)


def _median(scenes: Sequence[Scene], settings: ArrangementSettings, repeats: int) -> float:
    """Return the median seconds of a whole call after one that is not counted."""
    seconds = []
    for _ in range(repeats + 1):
        start = time.perf_counter()
        arrange_scenes(scenes, settings)
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds[1:])


def _time_to_quality(
    scenes: Sequence[Scene], referee: ArrangementSettings, repeats: int
) -> tuple[float, float]:
    """Return milliseconds until ``default`` beats ``released`` (median), and how often it does."""
    times = []
    released, ours = PRESETS["released"], PRESETS["default"]
    for scene in scenes:
        batch = collate_scenes([scene])
        rival = collate_scenes([arrange_scenes([scene], released)[0].scene])
        goal = energy(batch, referee, boxes=rival.boxes).sum()
        reached = None
        for step, boxes in solver_states(batch, ours):
            if bool(energy(batch, referee, boxes=boxes).sum() < goal):
                reached = step
                break
        times.append(float("inf") if reached is None else _reach(scene, ours, reached, repeats))
    return 1e3 * statistics.median(times), float(np.isfinite(times).mean())


def _reach(scene: Scene, settings: ArrangementSettings, steps: int, repeats: int) -> float:
    """Return the median seconds of padding, preparing and the first ``steps`` steps."""
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        with torch.no_grad():
            states = solver_states(collate_scenes([scene]), settings)
            for step, _boxes in states:
                if step >= steps:
                    break
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds)
