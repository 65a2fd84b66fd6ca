"""Checks of a whole set on disk."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from panoscene.scene import SceneFormatError
from panoscene.synth.assets import CadModel

from ._checks import check_distance, check_holes, check_mirrored, check_relations
from ._errors import DatasetError
from ._index import panorama_names
from ._label import label_hash
from ._loaded import Loaded
from ._maps import DISTANCE, INSTANCE, LABELS, MILLIMETRES, SEMANTIC, read_map, read_rgb
from ._picture_checks import check_alignment, check_exposure, check_seam
from ._point_checks import check_masks, check_points
from ._read import PanoramaItem, SynthDataset, open_dataset
from ._variety import variety_problems
from ._write import file_hash, scene_text

CHECKS: Mapping[str, Callable[[Loaded], list[str]]] = MappingProxyType(
    {
        "distance": check_distance,
        "holes": check_holes,
        "masks": check_masks,
        "points": check_points,
        "relations": check_relations,
        "seam": check_seam,
        "exposure": check_exposure,
        "mirrored": check_mirrored,
        "alignment": check_alignment,
    }
)
"""Checks of one panorama, by the keys of ``check_dataset``."""
SET_CHECKS = ("files", "hashes", "splits", "distinct", "variety")
"""Keys of the checks of files and of the set as a whole."""
_LISTED = 200


def check_dataset(
    root: Path | str,
    *,
    names: Sequence[str] | None = None,
    library: Mapping[str, CadModel] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Return what is wrong with a rendered set; plain values, ready for JSON.

    ``panoramas`` were looked at; each check has the number of panoramas that failed it, and
    ``failures`` is the sum of these; ``problems`` says what they are, the first 200.

    - files: all files are there and can be read
    - hashes: files and labels are the ones that were written
    - distance: walls, floor and ceiling are as far away as the layout says
    - holes: nobody looks out of the home but through windows
    - masks: every pixel of an object is inside the projection of its box; semantics agree
    - points: the points from the distance map fill the box and reach its faces
    - relations: recomputed from boxes, and with a library from meshes, they are the same
    - seam: colours, distances and instances go on from the last column to the first
    - exposure: neither black nor blown out nor empty
    - mirrored: objects are on the side where their boxes are
    - alignment: colours change where the instances change
    - splits: homes are in one part only, and unseen models only in test-unseen
    - distinct: no two panoramas have the same labels
    - variety: of ten homes and more, no statistic of ``dataset_statistics`` is the same in all

    Args:
        root: Folder of the set.
        names: Panoramas to look at; all when not given.
        library: Models by id, such as a ``ModelLibrary``: boxes and relations are then checked
            against the meshes.
        progress: Called with how many are done, and how many there are.

    Raises:
        DatasetError: dataset.json is missing or damaged, or lists a panorama without a folder.
        ValueError: There is no panorama of a name.
    """
    dataset = open_dataset(root)
    items = _chosen(dataset, names)
    counts: Counter[str] = Counter(dict.fromkeys((*SET_CHECKS, *CHECKS), 0))
    problems: list[str] = []
    for number, item in enumerate(items):
        for check, found in check_item(item, dataset, library).items():
            counts[check] += 1
            problems += [f"{item.name}: {check}: {problem}" for problem in found]
        if progress is not None:
            progress(number + 1, len(items))
    for check, found in _set_problems(dataset).items():
        counts[check] += len(found)
        problems += [f"{check}: {problem}" for problem in found]
    return {
        "panoramas": len(items),
        "failures": sum(counts.values()),
        **{check: counts[check] for check in (*SET_CHECKS, *CHECKS)},
        "problems": problems[:_LISTED],
    }


def check_item(
    item: PanoramaItem, dataset: SynthDataset, library: Mapping[str, CadModel] | None = None
) -> dict[str, list[str]]:
    """Return what is wrong with one panorama, by check; checks that it passes are not in it."""
    try:
        panorama = _load(item, library)
    except (DatasetError, SceneFormatError) as error:
        return {"files": [str(error)]}
    found = {"hashes": _hash_problems(item, dataset, panorama)}
    found |= {name: check(panorama) for name, check in CHECKS.items()}
    found["splits"] = _split_problems(item, dataset, panorama)
    return {name: problems for name, problems in found.items() if problems}


def _chosen(dataset: SynthDataset, names: Sequence[str] | None) -> list[PanoramaItem]:
    if names is None:
        return list(dataset)
    items = {item.name: item for item in dataset}
    unknown = [name for name in names if name not in items]
    if unknown:
        raise ValueError(f"names: found {unknown[0]!r}, expected panoramas of the set")
    return [items[name] for name in names]


def _load(item: PanoramaItem, library: Mapping[str, CadModel] | None) -> Loaded:
    scene, labels = item.scene(), item.labels()
    rgb = read_rgb(item.image_file())
    instance = read_map(item.folder / INSTANCE, 16)
    distance = read_map(item.folder / DISTANCE, 16).astype(np.float64) / MILLIMETRES
    semantic = read_map(item.folder / SEMANTIC, 8)
    expected = (scene.panorama.height, scene.panorama.width)
    for name, array in (("rgb", rgb[..., 0]), ("instance", instance), ("distance", distance),
                        ("semantic", semantic)):  # fmt: skip
        if array.shape != expected:
            found = f"{array.shape[0]} x {array.shape[1]} pixels"
            raise DatasetError(
                item.folder, f"{name}: found {found}, expected {expected[0]} x {expected[1]}"
            )
    return Loaded(item.name, scene, labels, rgb, distance, instance, semantic, library)


def _hash_problems(item: PanoramaItem, dataset: SynthDataset, panorama: Loaded) -> list[str]:
    problems = []
    for name, digest in panorama.labels.files.items():
        path = item.folder / name
        if not path.is_file():
            problems.append(f"{name} is not there")
        elif file_hash(path) != digest:
            problems.append(f"{name} is not the file that was written")
    entry = next(e for e in dataset.info.panoramas if e.name == item.name)
    if file_hash(item.folder / LABELS) != entry.labels_sha256:
        problems.append(f"{LABELS} is not the file that dataset.json knows")
    millimetres = np.rint(panorama.distance * MILLIMETRES)
    bare = _without_file(panorama)
    digest = label_hash(bare, millimetres, panorama.instance, panorama.semantic)
    if digest != panorama.labels.label_hash:
        problems.append("the labels are not the ones that were written")
    return problems


def _without_file(panorama: Loaded) -> str:
    scene = panorama.scene
    return scene_text(replace(scene, panorama=replace(scene.panorama, file=None)))


def _split_problems(item: PanoramaItem, dataset: SynthDataset, panorama: Loaded) -> list[str]:
    homes = {entry.home: entry.split for entry in dataset.info.homes}
    labels = panorama.labels
    problems = []
    frozen = homes.get(labels.home)
    if not frozen == item.split == labels.split:
        problems.append(
            f"home {labels.home} is in {frozen}, dataset.json says {item.split}, "
            f"labels.json {labels.split}"
        )
    if item.split != "test-unseen":
        unseen = set(dataset.info.unseen_bases)
        problems += [
            f"{label.id} has an unseen model, {label.base}"
            for label in labels.objects
            if label.base in unseen
        ]
    return problems


def _set_problems(dataset: SynthDataset) -> dict[str, list[str]]:
    entries = dataset.info.panoramas
    hashes: dict[str, list[str]] = {}
    for entry in entries:
        hashes.setdefault(entry.label_hash, []).append(entry.name)
    same = [f"{', '.join(names)} are the same" for names in hashes.values() if len(names) > 1]
    listed = {entry.name for entry in entries}
    there = set(panorama_names(dataset.root))
    unlisted = sorted(there - listed)
    found = [
        f"{name} is not in dataset.json; the command that renders the set lists it"
        for name in unlisted
    ]
    parts: dict[str, set[str]] = {}
    for entry in entries:
        parts.setdefault(entry.home, set()).add(entry.split)
    torn = [f"{home} is in {' and '.join(sorted(s))}" for home, s in parts.items() if len(s) > 1]
    return {
        "distinct": same,
        "files": found,
        "splits": torn,
        "variety": variety_problems(dataset),
    }
