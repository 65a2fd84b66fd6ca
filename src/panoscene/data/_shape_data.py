"""Everything that the shape network learns from, made once."""

from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from panoscene.models.shape import thin_boxes
from panoscene.synth.assets import load_library
from panoscene.synth.dataset import open_dataset

from ._shape_crops import cut_object_crops, write_object_crops
from ._shape_store import prepare_shape_store

MODELS = "models"
"""Folder of the models' files."""


def crops_file(folder: Path, split: str, panoramas: int | None = None) -> Path:
    """Return where the crops of a part of a data set, or of its first panoramas, are kept."""
    first = "" if panoramas is None else f"-{panoramas}"
    return folder / f"crops-{split}{first}.npz"


def prepare_shape_data(
    data: Path,
    assets: Path,
    folder: Path,
    *,
    views: int = 6,
    panoramas: int | None = None,
    progress: Callable[[str], None] = lambda what: None,
) -> tuple[tuple[str, str], ...]:
    """Return id and reason of the models that could not be sampled; what is there stays.

    Crops come from the parts ``train`` and ``val`` of the set; thin models, which are never
    predicted, are left out. A run that was stopped goes on.

    Args:
        data: Folder of a data set.
        assets: Cache of its models, with scikit-image and fast-simplification installed.
        folder: To fill.
        views: Pictures of each model.
        panoramas: Of the part ``train``, the first ones; None for all.
        progress: Told of everything that is done.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for split, first in (("train", panoramas), ("val", None)):
        path = crops_file(folder, split, first)
        if not path.is_file():
            write_object_crops(path, cut_object_crops(open_dataset(data, split)[:first]))
            progress(path.name)
    return prepare_shape_store(
        assets, folder / MODELS, shaped_models(assets), views=views, progress=progress
    )


def shaped_models(assets: Path) -> tuple[str, ...]:
    """Return the ids of the models that are not thin, so that any first few are of all categories.

    Args:
        assets: Cache of models.
    """
    library = load_library(assets)
    entries = [entry for entry in library.entries.values() if entry.category]
    sizes = torch.tensor([entry.size for entry in entries]).reshape(-1, 3)
    thin = thin_boxes(sizes).tolist()
    names = [entry.id for entry, left in zip(entries, thin, strict=True) if not left]
    np.random.default_rng(0).shuffle(names)
    place: dict[str, int] = {}
    count: Counter[str] = Counter()
    for name in names:
        category = library.entries[name].category
        place[name] = count[category]
        count[category] += 1
    return tuple(sorted(names, key=lambda name: place[name]))
