"""How long a rendered panorama takes, and how much memory a process of it."""

import json
import os
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, cast

from panoscene.scene import Scene
from panoscene.synth.dataset import HomesOfSplits, Recipe

from ._photographs import Extra
from ._run import RenderProgress, render_dataset

_LIMIT_S, _LIMIT_GIB = 8.0, 2.0
"""Of the design: seconds a panorama, and memory of a process."""


@dataclass(frozen=True, slots=True)
class _Mark:
    """What a process had used when a panorama was nearly written."""

    home: str
    process: int
    wall: float
    cpu: float
    peak: float


def run_synth_benchmark(
    cache: Path | str,
    *,
    repeats: int = 5,
    processes: int = 2,
    recipe: Recipe | None = None,
    extra: Extra | None = None,
    progress: Callable[[str], None] | None = None,
) -> dict[str, object]:
    """Return how long panoramas take and how much memory, home, light and labels included.

    Homes are rendered side by side by processes of this computer, into a folder that is removed.
    The first home of each process is not in the times: it starts the renderer. Seconds and CPU
    seconds are means over all later panoramas (``panorama_s``, ``panorama_cpu_s``); memory is the
    largest resident set of each process in its whole life (``peak_gib``). What ``render_dataset``
    does is measured, so the rest of the machine should be idle.

    Args:
        cache: Folder of the models.
        repeats: Homes for each process after its first.
        processes: Side by side, at least 2: one would be this process.
        recipe: Of the homes; their number is set here. That of the full set by default.
        extra: Writes further files of a panorama; a function of a module.
        progress: Called with a line of text before and after each step.

    Raises:
        ValueError: A number is too small, or no process had two homes.
        AssetError: There is no cache of models.
        MissingRendererError: Mitsuba, its denoiser or LLVM is not installed.
    """
    for name, value, least in (("repeats", repeats, 1), ("processes", processes, 2)):
        if value < least:
            raise ValueError(f"{name}: found {value}, expected {least} or more")
    tell = progress or (lambda _text: None)
    homes = processes * (repeats + 1)
    counts = {"train": homes, "val": 0, "test-seen": 0, "test-unseen": 0}
    chosen = (recipe or Recipe(name="benchmark", seed=7)).model_copy(
        update={"homes": HomesOfSplits.model_validate(counts)}
    )
    with TemporaryDirectory() as folder:
        marks = Path(folder) / "marks"
        marks.mkdir()
        tell(f"rendering {homes} homes")
        start = time.monotonic()
        done = render_dataset(
            Path(folder) / "set", chosen, cache, processes=processes,
            extra=partial(_marking, marks, extra), told=lambda p: tell(_words(p)),
        )  # fmt: skip
        seconds = time.monotonic() - start
        found = [_Mark(**json.loads(file.read_text())) for file in marks.iterdir()]
    if done.failed:
        raise ValueError(f"expected all homes to be made, found: {done.failed[0][1]}")
    return {
        **_rates(found),
        "panoramas": done.made,
        "homes": homes,
        "processes": processes,
        "run_s": seconds,
        "width": chosen.width,
        "samples": chosen.samples,
        "depth": chosen.depth,
        "furniture_texture": chosen.furniture_texture,
    }


def synth_benchmark_table(result: dict[str, object]) -> str:
    """Return the figures of ``run_synth_benchmark`` as a Markdown table."""
    peaks = cast("list[float]", result["peak_gib"])
    rows = [
        (f"seconds a panorama, {result['processes']} processes", result["panorama_s"], _LIMIT_S),
        ("CPU seconds a panorama", result["panorama_cpu_s"], ""),
        ("peak memory of a process, GiB", max(peaks), _LIMIT_GIB),
    ]
    lines = ["| figure | measured | limit |", "| --- | ---: | ---: |"]
    for name, value, limit in rows:
        told = f"{limit:g}" if limit else ""
        lines.append(f"| {name} | {cast('float', value):.2f} | {told} |")
    return "\n".join(lines)


def _marking(folder: Path, extra: Extra | None, scene: Scene, panorama: Path) -> None:
    """Write the further files of a panorama, and what this process has used so far."""
    if extra is not None:
        extra(scene, panorama)
    name = panorama.name.removeprefix(".part-")
    usage: dict[str, Any] = {
        "home": name.partition("-")[0],
        "process": os.getpid(),
        "wall": time.time(),
        "cpu": time.process_time(),
        "peak": _peak_memory(),
    }
    (folder / f"{name}.json").write_text(json.dumps(usage))


def _rates(marks: list[_Mark]) -> dict[str, object]:
    """Return means over the panoramas after each process's first home, and peaks of memory."""
    by_process: dict[int, list[_Mark]] = defaultdict(list)
    for mark in sorted(marks, key=lambda mark: mark.wall):
        by_process[mark.process].append(mark)
    rate = cpu = 0.0
    count = 0
    for mine in by_process.values():
        first = [mark for mark in mine if mark.home == mine[0].home][-1]
        later = [mark for mark in mine if mark.wall > first.wall]
        if later:
            rate += len(later) / (later[-1].wall - first.wall)
            cpu += later[-1].cpu - first.cpu
            count += len(later)
    if count == 0:
        raise ValueError("expected a process with two homes, found none: more repeats are needed")
    return {
        "panorama_s": 1.0 / rate,
        "panorama_cpu_s": cpu / count,
        "measured_panoramas": count,
        "peak_gib": sorted(max(mark.peak for mark in mine) for mine in by_process.values()),
    }


def _peak_memory() -> float:
    """Return the largest resident set of this process so far, in GiB."""
    status = Path("/proc/self/status")
    if status.is_file():  # getrusage would count what the parent had when it started this process
        line = next(line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return int(line.split()[1]) / 2**20
    import resource  # noqa: PLC0415 - not on Windows

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (2**30 if sys.platform == "darwin" else 2**20)


def _words(progress: RenderProgress) -> str:
    return f"rendered {progress.done} of {progress.wanted} panoramas"
