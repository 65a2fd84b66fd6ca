"""Rendered sets: what is in them, whether it is right, and in the formats of others."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

from panoscene.cli._errors import InputError
from panoscene.cli._files import writing
from panoscene.cli._folders import check_folder
from panoscene.cli._progress import progress_words
from panoscene.cli._synth_make import model_cache
from panoscene.cli._synth_progress import steps_told
from panoscene.cli._tables import say_table
from panoscene.cli._terminal import note, say, say_json
from panoscene.scene import CATEGORIES, write_atomically
from panoscene.style import words
from panoscene.synth.assets import CadModel
from panoscene.synth.dataset import (
    CHECKS,
    SET_CHECKS,
    Layer,
    check_dataset,
    data_card,
    dataset_statistics,
    export_coco,
    export_crops,
    export_horizonnet,
    open_dataset,
    write_category_sheets,
    write_contact_sheets,
)
from panoscene.synth.production import Models

CARD = "README.md"
LAYERS: tuple[Layer, ...] = ("rgb", "objects")
"""Kinds of contact sheets."""
Form = Literal["coco", "horizonnet", "crops"]
EXPORTS: Mapping[Form, Callable[[Path, Path], list[Path]]] = {
    "coco": export_coco,
    "horizonnet": export_horizonnet,
    "crops": export_crops,
}
SHOWN = 20
"""Problems that are printed."""


class _Meshes(Mapping[str, CadModel]):
    """The shapes of all models of a cache, by id."""

    def __init__(self, models: Models) -> None:
        self._models = models

    def __getitem__(self, identifier: str) -> CadModel:
        return self._models[identifier]

    def __contains__(self, identifier: object) -> bool:
        return identifier in self._models

    def __iter__(self) -> Iterator[str]:
        return iter(self._models)

    def __len__(self) -> int:
        return len(self._models)


def run_stats(folder: Path, *, as_json: bool) -> int:
    """Say what is in a set, and return the exit code."""
    found = dataset_statistics(folder)
    if as_json:
        say_json(found)
        return 0
    visible = found["visible_objects"]
    say(f"{found['panoramas']} of {found['planned']} panoramas in {found['homes']} homes")
    say(f"splits: {_listed(found['splits'])}")
    say(f"corners of the room: {_listed(found['corner_counts'])}")
    say(f"rooms: {_listed(found['room_kinds'])}")
    say(f"light: {_listed(found['lights'])}")
    say(
        f"objects in a panorama: {visible['mean']:g} on average, {visible['min']:g} to "
        f"{visible['max']:g}; {found['objects']} in all"
    )
    say_table(
        ("category", "objects", "different models"),
        [
            (words(name), found["categories"][name], found["models"][name])
            for name in sorted(CATEGORIES, key=lambda name: -found["categories"][name])
        ],
    )
    return 0


def run_preview(folder: Path, output: Path, each: int) -> int:
    """Draw data card and sheets, and return the exit code."""
    if each < 1:
        raise InputError(f"--each: found {each}, expected at least 1")
    if not len(open_dataset(folder)):
        raise InputError(f"{folder}: found no panoramas yet, expected at least one")
    check_folder(output)
    with writing(output / CARD):
        write_atomically(output / CARD, data_card(folder))
    sheets = 0
    with progress_words() as progress:
        for layer in LAYERS:
            progress(f"contact sheets: {layer}")
            sheets += len(write_contact_sheets(folder, output, layer=layer, each=each))
        progress("a sheet for each category")
        sheets += len(write_category_sheets(folder, output))
    note(f"wrote {output}: {CARD} and {sheets} sheets")
    return 0


def run_check(folder: Path, cache: Path | None, *, as_json: bool) -> int:
    """Check a set; return 0 when all is right, else 1."""
    library = None if cache is None else _Meshes(Models(model_cache(cache), 0))
    with steps_told("checking") as step:
        found = check_dataset(folder, library=library, progress=step)
    if as_json:
        say_json(found)
    else:
        _say_checks(found)
    return 1 if found["failures"] else 0


def run_export(folder: Path, form: Form, output: Path) -> int:
    """Write a set in another format, and return the exit code."""
    check_folder(output)
    files = EXPORTS[form](folder, output)
    if not files:
        raise InputError(f"{folder}: found no panoramas yet, expected at least one")
    note(f"wrote {output}: {len(files)} {'file' if len(files) == 1 else 'files'}")
    return 0


def _say_checks(found: Mapping[str, Any]) -> None:
    say_table(("check", "failures"), [(name, found[name]) for name in (*SET_CHECKS, *CHECKS)])
    for problem in found["problems"][:SHOWN]:
        say(problem)
    more = len(found["problems"]) - SHOWN
    if more > 0:
        say(f"and {more} more: --json has them")
    number = found["failures"]
    verdict = f"{number} failure{'s' * (number != 1)}" if number else "all is right"
    say(f"{found['panoramas']} panoramas: {verdict}")


def _listed(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{name} {count}" for name, count in counts.items()) or "none"
