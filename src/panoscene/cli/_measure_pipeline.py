"""The benchmarks of the pipeline: each stage alone, and the whole way from a photo to a folder."""

import os
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.cli._errors import InputError
from panoscene.cli._progress import progress_words
from panoscene.cli._terminal import say, say_json
from panoscene.eval import machine_facts
from panoscene.models.shape import ShapeStage, slab_objects
from panoscene.pipeline import Given, Pipeline, Stages, load_stages
from panoscene.sample import sample_photo_path
from panoscene.scene import Detections, Objects, read_panorama, select_objects

OBJECTS = 20
"""In the room whose stages are measured."""
RESOLUTIONS = (64, 128)
"""Of the meshes of the stages."""
_COMMAND = "from panoscene.cli import run; run()"

Progress = Callable[[str], None]


def run_pipeline_bench(subject: str, repeats: int, *, as_json: bool) -> int:
    """Run the benchmark of the stages or of the pipeline, and return the exit code."""
    if repeats < 1:
        raise InputError(f"--repeats: found {repeats}, expected 1 or more")
    with progress_words() as progress:
        measure = measure_stages if subject == "stages" else measure_pipeline
        result = measure(repeats=repeats, progress=progress) | {"machine": machine_facts()}
    if as_json:
        say_json(result)
    else:
        say(seconds_table(result))
    return 0


@torch.inference_mode()
def measure_stages(*, repeats: int, progress: Progress) -> dict[str, Any]:
    """Return the median seconds of each stage, for the sample photo and 20 objects.

    Shapes are codes and meshes; ``codes_s`` is the part of the codes, where the stage is the
    package's. Objects are those of the sample photo that are not slabs, again and again.
    """
    stages = load_stages()
    image, panorama = read_panorama(sample_photo_path())
    objects = _many(stages, image)
    seen = Detections(objects.bfov, objects.category, objects.score)
    estimator = stages.shape
    if estimator is None:
        raise ValueError("stages: found none for shapes")
    # those of the package stand behind what loads them at their first use
    shape: Any = getattr(estimator, "ready", lambda: estimator)()
    layout = stages.layout(image, camera_height=panorama.camera_height).layout
    parts: dict[str, Callable[[], object]] = {
        "detector_s": lambda: stages.detector(image),
        "layout_s": lambda: stages.layout(image, camera_height=panorama.camera_height),
        "pose_s": lambda: stages.pose(image, seen, layout, panorama.camera_height),
    }
    if isinstance(shape, ShapeStage):
        parts["codes_s"] = lambda: shape.codes(image, objects)
    for resolution in RESOLUTIONS:
        parts[f"shape_{resolution}_s"] = lambda r=resolution: shape(image, objects, resolution=r)
    found: dict[str, Any] = {"objects": OBJECTS, "repeats": repeats}
    for name, part in parts.items():
        progress(f"measuring {name}")
        part()  # the first time is slower
        found[name] = statistics.median(_seconds(part) for _ in range(repeats))
    return found


def measure_pipeline(*, repeats: int, progress: Progress) -> dict[str, Any]:
    """Return seconds of the pipeline, memory, and seconds of the command for one photo.

    ``total_s`` and the stages are medians for a panorama of 1024 x 512 with 20 objects, with the
    weights loaded. ``cold_start_s`` is the whole command ``panoscene reconstruct`` for the sample
    photo in a new process, imports, pictures and report included; ``peak_rss_mib`` the most memory
    that either took.
    """
    stages = load_stages()
    image, panorama = read_panorama(sample_photo_path())
    objects = _many(stages, image)
    # given detections all stay, though some are in one place
    given = Given(detections=Detections(objects.bfov, objects.category, objects.score))
    pipeline = Pipeline(stages)
    runs: list[dict[str, float]] = []
    for number in range(repeats + 1):
        progress(f"measuring the pipeline, {number + 1} of {repeats + 1}")
        start = time.perf_counter()
        stages.detector(image)
        detected = time.perf_counter() - start
        result = pipeline(image, panorama, given=given)
        total = time.perf_counter() - start
        runs.append({"detector": detected, **result.timings, "total": total})
    # the first time is slower
    found: dict[str, Any] = {"objects": OBJECTS, "repeats": repeats}
    for name in runs[0]:
        found[f"{name}_s"] = statistics.median(run[name] for run in runs[1:])
    progress("measuring the command")
    # the first time compiles what an installation has not compiled
    commands = [_command_seconds() for _ in range(repeats + 1)]
    found["cold_start_s"] = statistics.median(commands[1:])
    usage = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    # kilobytes, but bytes on a Mac
    unit = 2**20 if sys.platform == "darwin" else 2**10
    found["peak_rss_mib"] = max(resource.getrusage(who).ru_maxrss for who in usage) / unit
    return found


def seconds_table(result: dict[str, Any]) -> str:
    """Return what was measured as a table."""
    rows = [f"| {name[:-2].replace('_', ' ')} | {x:.2f} s |" for name, x in _times(result).items()]
    if "peak_rss_mib" in result:
        rows.append(f"| peak memory | {result['peak_rss_mib']:.0f} MiB |")
    return "\n".join(["| part | measured |", "| --- | --- |", *rows])


def _times(result: dict[str, Any]) -> dict[str, float]:
    return {name: value for name, value in result.items() if name.endswith("_s")}


def _many(stages: Stages, image: Float[Tensor, "3 height width"]) -> Objects:
    """Return objects of a photo, as many as are measured, again and again and none of them thin."""
    found = Pipeline(replace(stages, shape=None), settings=None)(image).scene.objects
    thick = (~slab_objects(found)).nonzero()[:, 0]
    if len(thick) == 0:
        raise ValueError("photo: found no object in it that gets a mesh")
    return select_objects(found, thick[torch.arange(OBJECTS) % len(thick)])


def _seconds(part: Callable[[], object]) -> float:
    start = time.perf_counter()
    part()
    return time.perf_counter() - start


def _command_seconds() -> float:
    """Return how long the command takes in a new process."""
    with TemporaryDirectory(prefix="panoscene-") as name:
        arguments = ["reconstruct", str(sample_photo_path()), "-o", str(Path(name) / "room")]
        command = [sys.executable, "-c", _COMMAND, *arguments]
        # who forbids to keep what is compiled would measure the compiler
        environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
        start = time.perf_counter()
        subprocess.run(  # noqa: S603
            command, check=True, env=environment,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        return time.perf_counter() - start
