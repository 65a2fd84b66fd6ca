"""Furniture models into a cache, and homes into panoramas."""

import os
import shlex
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from panoscene.cli._errors import InputError
from panoscene.cli._folders import check_folder
from panoscene.cli._synth_glb import write_scene_glb
from panoscene.cli._synth_progress import spoken, steps_told, stopping_at_once, told_in_words
from panoscene.cli._tables import say_table
from panoscene.cli._terminal import complain, note, say, say_json
from panoscene.scene import CATEGORIES, write_atomically
from panoscene.style import words
from panoscene.synth.assets import (
    ModelEntry,
    attribution,
    load_library,
    prepare_assets,
    prepare_shapes,
)
from panoscene.synth.dataset import read_recipe
from panoscene.synth.production import (
    RenderProgress,
    add_parametric_models,
    render_dataset,
    render_with_ray,
)

ATTRIBUTION = "ATTRIBUTION"


def default_cache() -> Path:
    """Return where models are kept unless the user says otherwise."""
    base = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    return Path(base).expanduser() / "panoscene" / "assets"


def model_cache(cache: Path | None) -> Path:
    """Return the folder of the models.

    Raises:
        InputError: There are none.
    """
    folder = default_cache() if cache is None else cache
    if not (folder / "index.json").is_file():
        option = "" if cache is None else f" --cache {shlex.quote(str(cache))}"
        raise InputError(
            f"{folder}: found no furniture models there; get them with: "
            f"panoscene synth assets{option}"
        )
    return folder


def run_assets(
    sources: Sequence[Path],
    cache: Path | None,
    *,
    shapes: bool,
    designs: int,
    processes: int,
    as_json: bool,
) -> int:
    """Fill the cache, say what is in it, and return the exit code."""
    if designs < 0 or processes < 1:
        raise InputError(f"--designs {designs} --processes {processes}: expected at least 0 and 1")
    folder = default_cache() if cache is None else cache
    if cache is not None:
        check_folder(folder)
    if not sources and not (folder / "libraries").is_dir():
        note("downloading the libraries of Sweet Home 3D, some 100 MB")
    with stopping_at_once():
        failed = _fill(folder, sources, designs, processes, shapes=shapes)
    entries = load_library(folder).entries.values()
    write_atomically(folder / ATTRIBUTION, attribution(entries))
    rows = _rows(entries)
    if as_json:
        say_json({"cache": str(folder), "categories": rows, "failed": failed})
    else:
        say_table(
            ("category", "models", "shapes", "unseen"),
            [(words(name) if name else "decoration", *row.values()) for name, row in rows.items()],
        )
        say(f"{len(entries)} models in {folder}; their makers: {folder / ATTRIBUTION}")
    return _say_failed(failed)


def run_render(
    recipe_file: Path,
    output: Path,
    *,
    limit: int | None,
    processes: int,
    cache: Path | None,
    ray: str | None,
    glb: bool,
) -> int:
    """Render what is left of a set, and return the exit code."""
    if processes < 1 or (limit is not None and limit < 1):
        raise InputError("--limit, --processes: expected at least 1")
    recipe = read_recipe(recipe_file)
    check_folder(output)
    folder = model_cache(cache)
    extra = write_scene_glb if glb else None
    again = f"the same command goes on with {output}"
    try:
        with stopping_at_once(), told_in_words("rendering") as tell:

            def told(progress: RenderProgress) -> None:
                tell(progress.done, progress.wanted, _words(progress))

            if ray is None:
                done = render_dataset(
                    output, recipe, folder, limit=limit, processes=processes, extra=extra,
                    told=told,
                )  # fmt: skip
            else:
                done = render_with_ray(
                    output, recipe, folder, address=ray or None, limit=limit, extra=extra,
                    told=told,
                )  # fmt: skip
    except KeyboardInterrupt:
        note(f"stopped; {again}")
        raise
    except ImportError as error:
        raise InputError(str(error)) from None
    note(f"{output}: {done.done} of {done.wanted} panoramas, {done.made} of them new")
    if done.failed:
        note(f"when the reason is gone, {again}")
    return _say_failed(done.failed)


def _fill(
    folder: Path, sources: Sequence[Path], designs: int, processes: int, *, shapes: bool
) -> list[tuple[str, str]]:
    """Return the models that could not be had, and why."""
    with steps_told("converting models") as step:
        report = prepare_assets(
            folder, sources, processes=processes, progress=lambda k, n, _: step(k, n)
        )
    added = add_parametric_models(folder, designs)
    note(f"{report.converted} models converted, {report.kept} were there, {added} designs made")
    failed = list(report.failed)
    if shapes:
        with steps_told("sampling shapes") as step:
            failed += prepare_shapes(
                folder, processes=processes, progress=lambda k, n, _: step(k, n)
            )
    return failed


def _rows(entries: Sequence[ModelEntry] | Any) -> dict[str, dict[str, int]]:
    """Return models, base models and unseen models of each category; decoration last."""
    found: dict[str, list[ModelEntry]] = defaultdict(list)
    for entry in entries:
        found[entry.category].append(entry)
    return {
        name: {
            "models": len(found[name]),
            "bases": len({entry.base for entry in found[name]}),
            "unseen": sum(entry.split == "unseen" for entry in found[name]),
        }
        for name in (*CATEGORIES, "")
    }


def _words(progress: RenderProgress) -> str:
    left = progress.seconds_left
    parts = [f"about {spoken(left)} left"] if left else []
    if progress.failed:
        parts.append(f"homes that failed: {len(progress.failed)}")
    return ", ".join(parts)


def _say_failed(failed: Sequence[tuple[str, str]]) -> int:
    for name, why in failed:
        complain(why if why.startswith(name) else f"{name}: {why}")
    return 1 if failed else 0
