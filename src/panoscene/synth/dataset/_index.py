"""dataset.json: what a set is, which homes are in which part, and hashes of all that is there."""

import hashlib
import json
import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal, TypeVar

from pydantic import Field, ValidationError

from panoscene import __version__
from panoscene.scene import write_atomically
from panoscene.synth.assets import attribution

from ._errors import DatasetError
from ._format import Format, Name, PanoramaLabels, Sha256, Split
from ._maps import LABELS
from ._recipe import HomeJob, Recipe, panoramas_to_homes, plan_homes, problems_of
from ._write import PANORAMAS, PARTIAL, file_hash, is_written

_T = TypeVar("_T", bound=Format)
INDEX, ATTRIBUTION = "dataset.json", "ATTRIBUTION"
GENERATOR = "panoscene synth"
HOMES_VERSION = 3
"""Raised whenever the home of a seed changes, in what it holds or how it is drawn."""


class HomeEntry(Format):
    """A home and its part; frozen when the set is begun."""

    home: Name
    seed: int
    split: Split


class PanoramaEntry(Format):
    """A panorama that is there."""

    name: Name
    home: Name
    split: Split
    labels_sha256: Sha256
    """Of labels.json, which has the hashes of the other files."""
    label_hash: Sha256
    """Of the labels as numbers."""


class DatasetIndex(Format):
    """Everything in dataset.json."""

    schema_name: Literal["panoscene/synth-dataset"] = Field(
        "panoscene/synth-dataset", alias="schema"
    )
    version: Literal[1] = 1
    name: str
    generator: str
    recipe: Recipe
    homes_version: int = 1
    """Of the rules that furnish homes and draw them: a home of the same seed differs in others."""
    planned: int
    """Panoramas of the whole set."""
    homes: tuple[HomeEntry, ...]
    """In the order of rendering."""
    panoramas: tuple[PanoramaEntry, ...] = ()
    """By name."""
    split_names: dict[Split, tuple[Name, ...]] = Field(default_factory=dict)
    """Panoramas of each part that are there."""
    unseen_bases: tuple[str, ...] = ()
    """Base models that only the homes of test-unseen may have."""
    set_hash: Annotated[str, Field(pattern=r"^([0-9a-f]{64})?$")] = ""
    """SHA-256 over the label hashes of all panoramas, by name."""


class ModelCredit(Format):
    """Who made a model in use, as ATTRIBUTION files want it."""

    id: str
    licence: str
    creator: str
    source: str


def begin_dataset(
    root: Path | str, recipe: Recipe, *, unseen_bases: Iterable[str] | None = None
) -> DatasetIndex:
    """Write dataset.json of a new set, or return that of one that was begun with this recipe.

    Folders that an earlier run left half-written are removed; call it before any worker starts.

    Args:
        root: Folder of the set; made if it is not there.
        recipe: What it will be.
        unseen_bases: Base models that training homes do not have; a set that was begun must have
            the same ones. None has none, or those of the set.

    Raises:
        DatasetError: The folder holds a set of another recipe or other models, or other files.
    """
    folder = Path(root)
    folder.mkdir(parents=True, exist_ok=True)
    unseen = tuple(sorted(set(unseen_bases or ())))
    if (folder / INDEX).is_file():
        index = read_index(folder)
        if index.recipe != recipe:
            raise DatasetError(
                folder / INDEX, "found a set of another recipe, expected the same or a new folder"
            )
        if index.homes_version != HOMES_VERSION:
            raise DatasetError(
                folder / INDEX,
                f"found homes of version {index.homes_version}, expected {HOMES_VERSION}, as this "
                "version of panoscene makes them: take a new folder, or render the rest with the "
                "version that began it",
            )
        if unseen_bases is not None and index.unseen_bases != unseen:
            raise DatasetError(
                folder / INDEX,
                "found a set begun with other models, expected the same folder of models: its "
                "training homes might get shapes that are kept for test-unseen",
            )
        _remove_partial(folder)
        return index
    if (folder / PANORAMAS).exists():
        raise DatasetError(folder, f"found panoramas without {INDEX}, expected an empty folder")
    jobs = plan_homes(recipe)
    index = DatasetIndex(
        schema="panoscene/synth-dataset",
        name=recipe.name,
        generator=f"{GENERATOR} {__version__}",
        recipe=recipe,
        homes_version=HOMES_VERSION,
        planned=sum(len(job.cameras) for job in jobs),
        homes=tuple(HomeEntry(home=job.home, seed=job.seed, split=job.split) for job in jobs),
        unseen_bases=unseen,
    )
    _write_index(folder, index)
    return index


def next_jobs(root: Path | str, *, limit: int | None = None) -> tuple[HomeJob, ...]:
    """Return what is left to render, in order: homes with the cameras that are not there yet.

    Args:
        root: Folder of a set that was begun.
        limit: The panoramas that shall be there in the end, counting those that are.

    Raises:
        DatasetError: dataset.json is missing or damaged.
    """
    folder = Path(root)
    wanted = panoramas_to_homes(plan_homes(read_index(folder).recipe), limit)
    left = []
    for job in wanted:
        missing = tuple(c for c in job.cameras if not is_written(folder, c.name))
        if missing:
            left.append(job.model_copy(update={"cameras": missing}))
    return tuple(left)


def finish_index(root: Path | str) -> DatasetIndex:
    """Write dataset.json and ATTRIBUTION anew from the panoramas that are there.

    The split stays as it was frozen. It may be called at any time, also while others render.

    Raises:
        DatasetError: dataset.json or a labels.json is missing or damaged, or a panorama is of a
            home that the set does not have.
    """
    folder = Path(root)
    index = read_index(folder)
    splits: dict[str, Split] = {entry.home: entry.split for entry in index.homes}
    entries, credits = [], {}
    for name in panorama_names(folder):
        labels = read_labels(folder / PANORAMAS / name)
        if labels.home not in splits:
            raise DatasetError(
                folder / PANORAMAS / name, f"found home {labels.home!r}, which is not in the set"
            )
        entries.append(
            PanoramaEntry(
                name=name,
                home=labels.home,
                split=splits[labels.home],
                labels_sha256=file_hash(folder / PANORAMAS / name / LABELS),
                label_hash=labels.label_hash,
            )
        )
        for item in (*labels.objects, *labels.structure):
            if item.model:
                credits[item.model] = ModelCredit(
                    id=item.model, licence=item.licence, creator=item.creator, source=item.source
                )
    named = {
        split: tuple(e.name for e in entries if e.split == split)
        for split in dict.fromkeys(e.split for e in entries)
    }
    index = index.model_copy(
        update={
            "panoramas": tuple(entries),
            "split_names": named,
            "set_hash": _set_hash(entries),
        }
    )
    write_atomically(folder / ATTRIBUTION, attribution(credits.values()))
    _write_index(folder, index)
    return index


def panorama_names(root: Path | str) -> list[str]:
    """Return the names of all panoramas that are there, sorted."""
    parent = Path(root) / PANORAMAS
    if not parent.is_dir():
        return []
    return sorted(
        path.name
        for path in parent.iterdir()
        if not path.name.startswith(PARTIAL) and (path / LABELS).is_file()
    )


def read_index(root: Path | str) -> DatasetIndex:
    """Return what dataset.json says.

    Raises:
        DatasetError: It is missing or damaged.
    """
    return _read(Path(root) / INDEX, DatasetIndex)


def read_labels(folder: Path) -> PanoramaLabels:
    """Return what labels.json in the folder of a panorama says.

    Raises:
        DatasetError: It is missing or damaged.
    """
    return _read(folder / LABELS, PanoramaLabels)


def _read(path: Path, kind: type[_T]) -> _T:
    try:
        return kind.model_validate_json(path.read_bytes())
    except OSError as error:
        reason = f"expected a {path.name} of a rendered set, found: {error.strerror}"
        raise DatasetError(path, reason) from None
    except ValidationError as error:
        raise DatasetError(path, problems_of(error)) from None


def _set_hash(entries: list[PanoramaEntry]) -> str:
    lines = "".join(f"{entry.name} {entry.label_hash}\n" for entry in entries)
    return hashlib.sha256(lines.encode()).hexdigest()


def _write_index(folder: Path, index: DatasetIndex) -> None:
    document = index.model_dump(mode="json", by_alias=True)
    lists = {key: document.pop(key) for key in ("homes", "panoramas")}
    text = json.dumps(document, indent=1, ensure_ascii=False)[:-2]
    for key, rows in lists.items():
        lines = ",\n  ".join(json.dumps(row, ensure_ascii=False) for row in rows)
        text += f',\n "{key}": [\n  {lines}\n ]' if rows else f',\n "{key}": []'
    write_atomically(folder / INDEX, text + "\n}\n")


def _remove_partial(folder: Path) -> None:
    for path in (folder / PANORAMAS).glob(f"{PARTIAL}*"):
        shutil.rmtree(path, ignore_errors=True)
