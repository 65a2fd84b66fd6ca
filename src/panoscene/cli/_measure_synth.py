"""The benchmark of rendering: run it, print what it finds."""

from pathlib import Path

from panoscene.cli._errors import InputError
from panoscene.cli._progress import progress_words
from panoscene.cli._synth_glb import write_scene_glb
from panoscene.cli._synth_make import model_cache
from panoscene.cli._synth_progress import stopping_at_once
from panoscene.cli._terminal import say, say_json
from panoscene.eval import machine_facts
from panoscene.synth.production import run_synth_benchmark, synth_benchmark_table


def run_synth_bench(cache: Path | None, repeats: int, *, as_json: bool) -> int:
    """Run the benchmark of rendering and return the exit code."""
    if repeats < 1:
        raise InputError(f"--repeats: found {repeats}, expected 1 or more")
    folder = model_cache(cache)
    try:
        with stopping_at_once(), progress_words() as progress:
            found = run_synth_benchmark(
                folder, repeats=repeats, extra=write_scene_glb, progress=progress
            )
    except ImportError as error:
        raise InputError(str(error)) from None
    result = {**found, "machine": machine_facts()}
    if as_json:
        say_json(result)
    else:
        say(synth_benchmark_table(result))
    return 0
