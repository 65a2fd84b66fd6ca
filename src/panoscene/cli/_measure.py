"""Benchmarks and experiments: run them, print or write what they find."""

from pathlib import Path

from panoscene.cli._errors import InputError
from panoscene.cli._files import write_text
from panoscene.cli._folders import check_folder
from panoscene.cli._progress import progress_words
from panoscene.cli._terminal import json_text, note, say, say_json
from panoscene.eval import (
    benchmark_table,
    experiment_table,
    run_arrange_benchmark,
    run_arrange_experiment,
    run_arrange_safety,
    run_score_benchmark,
    safety_table,
    score_benchmark_table,
)


def run_bench(subject: str, repeats: int, *, as_json: bool) -> int:
    """Run the benchmark of the optimiser, or of scoring, and return the exit code."""
    _at_least(1, "--repeats", repeats)
    with progress_words() as progress:
        if subject == "score":
            result = run_score_benchmark(repeats=repeats, progress=progress)
        else:
            result = run_arrange_benchmark(repeats=repeats, progress=progress)
    if as_json:
        say_json(result)
    else:
        say((score_benchmark_table if subject == "score" else benchmark_table)(result))
    return 0


def run_experiment(
    subject: str, output: Path | None, *, scenes: int | None, seed: int, as_json: bool
) -> int:
    """Run an experiment on the optimiser and return the exit code.

    Without ``scenes`` there are as many as the experiment needs to say something.
    """
    if scenes is not None:
        _at_least(1, "--scenes", scenes)
    _at_least(0, "--seed", seed)
    if output is not None:
        # before the long run, not after it
        check_folder(output)
    with progress_words() as progress:
        if subject == "safety":
            result = run_arrange_safety(scenes=scenes or 10_000, seed=seed, progress=progress)
        else:
            result = run_arrange_experiment(scenes=scenes or 100, seed=seed, progress=progress)
    table = (safety_table if subject == "safety" else experiment_table)(result)
    if output is not None:
        write_text(output / f"{subject}.json", json_text(result) + "\n")
        write_text(output / f"{subject}.md", table + "\n")
        note(f"wrote {output}: {subject}.json, {subject}.md")
    if as_json:
        say_json(result)
    else:
        say(table)
    return 0


def _at_least(least: int, option: str, value: int) -> None:
    if value < least:
        raise InputError(f"{option}: found {value}, expected {least} or more")
