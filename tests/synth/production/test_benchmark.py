"""What the benchmark of rendering counts; homes are copies of a sample."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from panoscene.scene import read_scene
from panoscene.synth.dataset import Recipe
from panoscene.synth.production import (
    Extra,
    RenderProgress,
    RenderTask,
    run_synth_benchmark,
    synth_benchmark_table,
)
from panoscene.synth.production import _benchmark as benchmark
from panoscene.synth.production import _run as run_module


def mark(home: str, process: int, wall: float, cpu: float, peak: float = 1.0) -> Any:
    return benchmark._Mark(home, process, wall, cpu, peak)


def test_rates_leave_out_the_first_home_of_each_process() -> None:
    """Two processes: 4 panoramas in 40 s, and 2 in 10 s: 0.3 in a second."""
    marks = [
        mark("a", 1, 100.0, 50.0), mark("a", 1, 120.0, 60.0, 1.5),
        *(mark("c", 1, 120.0 + 10 * k, 60.0 + 9 * k, 1.8) for k in range(1, 5)),
        mark("b", 2, 90.0, 70.0, 1.25),
        *(mark("d", 2, 90.0 + 5 * k, 70.0 + 3 * k) for k in range(1, 3)),
    ]  # fmt: skip
    found = benchmark._rates(marks[::-1])
    assert found["panorama_s"] == pytest.approx(1 / 0.3)
    assert found["panorama_cpu_s"] == pytest.approx((36 + 6) / 6)
    assert found["measured_panoramas"] == 6
    assert found["peak_gib"] == [1.25, 1.8]


def test_one_home_for_each_process_is_not_enough() -> None:
    with pytest.raises(ValueError, match="more repeats"):
        benchmark._rates([mark("a", 1, 1.0, 1.0), mark("b", 2, 1.0, 1.0)])


def test_every_panorama_is_counted_and_its_extra_files_are_written(
    cache: Path, recipe: Recipe, copy_sample: Callable[[RenderTask], None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    written: list[str] = []
    lines: list[str] = []

    def render(task: RenderTask) -> None:
        copy_sample(task)
        assert task.extra is not None
        for camera in task.job.cameras:
            folder = task.root / "panoramas" / camera.name
            write: Extra = task.extra
            write(read_scene(folder / "scene.json"), folder.with_name(f".part-{camera.name}-0bad"))

    def here(*arguments: Any, processes: int, **options: Any) -> RenderProgress:
        assert processes == 2
        return run_module.render_dataset(*arguments, processes=1, **options)

    monkeypatch.setattr(run_module, "render_home", render)
    monkeypatch.setattr(benchmark, "render_dataset", here)
    found = run_synth_benchmark(
        cache, repeats=1, recipe=recipe, progress=lines.append,
        extra=lambda scene, folder: written.append(folder.name),
    )  # fmt: skip
    assert (found["homes"], found["panoramas"], found["measured_panoramas"]) == (4, 8, 6)
    assert len(set(written)) == 8
    assert lines[0] == "rendering 4 homes"
    assert lines[-1] == "rendered 8 of 8 panoramas"
    (peak,) = found["peak_gib"]  # ty: ignore[not-iterable]
    assert 0.05 < peak < 8
    json.dumps(found)
    table = synth_benchmark_table(found)
    assert f"| peak memory of a process, GiB | {peak:.2f} | 2 |" in table
    assert "seconds a panorama, 2 processes" in table


def test_a_home_that_cannot_be_made_is_told(
    cache: Path, recipe: Recipe, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = RenderProgress(6, 8, 1.0, 6, (("home0002", "home0002: found no room for 2 cameras"),))
    monkeypatch.setattr(benchmark, "render_dataset", lambda *_a, **_o: done)
    with pytest.raises(ValueError, match="no room for 2 cameras"):
        run_synth_benchmark(cache, repeats=1, recipe=recipe)


def test_too_small_numbers_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="repeats: found 0"):
        run_synth_benchmark(tmp_path, repeats=0)
    with pytest.raises(ValueError, match="processes: found 1"):
        run_synth_benchmark(tmp_path, processes=1)
