"""How long scoring takes: predictions and targets of many rooms, from disk to numbers."""

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import cast

import numpy as np

from panoscene.eval._bootstrap import REPLICATES
from panoscene.eval._export import PREDICTIONS, TARGETS, export_predictions
from panoscene.eval._machine import machine_facts
from panoscene.eval._methods import METHODS
from panoscene.eval._score import score_folder
from panoscene.scene import Scene
from panoscene.synth import sample_room


def run_score_benchmark(
    *,
    repeats: int = 3,
    scenes: int = 500,
    objects: int = 20,
    workers: int = 2,
    replicates: int = REPLICATES,
    progress: Callable[[str], None] | None = None,
) -> dict[str, object]:
    """Return how long it takes to score simulated estimates of rooms, the median of the repeats.

    Reading both folders, every metric but shapes, and the bootstrap are in the time
    (``score_500_scenes_s``); making the rooms is not.

    Args:
        repeats: how often it is measured.
        scenes: number of rooms.
        objects: in each room.
        workers: processes.
        replicates: bootstrap resamples.
        progress: called with a line of text before each step.

    Raises:
        ValueError: a number below 1.
    """
    for name, value in (("repeats", repeats), ("scenes", scenes), ("workers", workers)):
        if value < 1:
            raise ValueError(f"{name}: found {value}, expected 1 or more")
    tell = progress or (lambda _text: None)
    seconds: list[float] = []
    with TemporaryDirectory() as folder:
        tell(f"sampling {scenes} rooms")
        methods = {"estimates": METHODS["estimates"]}
        export_predictions(Path(folder), _rooms(scenes, objects), methods=methods)
        for repeat in range(repeats):
            tell(f"scoring, {repeat + 1} of {repeats}")
            start = time.perf_counter()
            score_folder(
                Path(folder) / PREDICTIONS / "estimates",
                Path(folder) / TARGETS,
                replicates=replicates,
                workers=workers,
            )
            seconds.append(time.perf_counter() - start)
    return {
        f"score_{scenes}_scenes_s": float(np.median(seconds)),
        "seconds": seconds,
        "scenes": scenes,
        "objects": objects,
        "workers": workers,
        "replicates": replicates,
        "machine": machine_facts(),
    }


def score_benchmark_table(result: dict[str, object]) -> str:
    """Return the figures of ``run_score_benchmark`` as a Markdown table."""
    name = f"score_{result['scenes']}_scenes_s"
    seconds = cast("list[float]", result["seconds"])
    each = ", ".join(f"{value:.1f}" for value in seconds)
    figure = (
        f"{result['scenes']} scenes of {result['objects']} objects, {result['workers']} processes, "
        f"{result['replicates']} resamples, s"
    )
    return (
        f"| figure | median | each |\n| --- | ---: | ---: |\n"
        f"| {figure} | {result[name]:.1f} | {each} |"
    )


def _rooms(count: int, objects: int) -> list[Scene]:
    return [
        replace(sample_room(np.random.default_rng([3, k]), objects=objects), name=f"room-{k:04d}")
        for k in range(count)
    ]
