"""The models of a cache, listed at once and loaded when asked for."""

from collections.abc import Iterable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Literal

from ._cache import CacheIndex, ModelEntry, read_index, read_model, write_index, write_model
from ._errors import AssetError
from ._records import CadModel, Placement
from ._shape_files import ShapeSamples, read_shape, shape_file
from ._split import Part, split_models

_LOADED = 48
"""Models kept in memory."""


class ModelLibrary:
    """Furniture models by id.

    Listings come from the index; a mesh is read when it is first asked for, and the last 48 stay
    in memory.

    Args:
        cache: Folder that ``prepare_assets`` made.
        index: Its index.

    Attributes:
        cache: Folder of the cache.
        entries: What the index says of every model, by id.
        split: Part of every base model.
    """

    def __init__(self, cache: Path, index: CacheIndex) -> None:
        self.cache = cache
        self.entries: dict[str, ModelEntry] = {entry.id: entry for entry in index.models}
        self.split: dict[str, Part] = {entry.base: entry.split for entry in index.models}
        self._load = lru_cache(maxsize=_LOADED)(self._read)

    def _read(self, identifier: str) -> CadModel:
        return read_model(self.cache, self.entries[identifier].file)

    def __getitem__(self, identifier: str) -> CadModel:
        """Return a model; its mesh is read now unless it was used lately.

        Raises:
            KeyError: There is no model of this id.
            AssetError: Its file is damaged or missing.
        """
        if identifier not in self.entries:
            raise KeyError(identifier)
        return self._load(identifier)

    def __contains__(self, identifier: object) -> bool:
        """Return whether there is a model of this id."""
        return identifier in self.entries

    def __iter__(self) -> Iterator[str]:
        """Return the ids, sorted."""
        return iter(self.entries)

    def __len__(self) -> int:
        """Return how many models there are."""
        return len(self.entries)

    def ids(
        self,
        category: str | None = None,
        placement: Placement | None = None,
        split: Part | None = None,
        low_confidence: bool = False,
    ) -> tuple[str, ...]:
        """Return the ids of the models that fit, sorted.

        Args:
            category: One of the 57, or "" for decoration; None for all.
            placement: Where they stand or hang; None for all.
            split: "seen" or "unseen" in training; None for both.
            low_confidence: Also those whose category or size is doubtful.
        """
        return tuple(
            entry.id
            for entry in self.entries.values()
            if (category is None or entry.category == category)
            and (placement is None or entry.placement == placement)
            and (split is None or entry.split == split)
            and (low_confidence or entry.confidence != "low")
        )

    def categories(self) -> tuple[str, ...]:
        """Return the categories that have a model, sorted; "" is decoration."""
        return tuple(sorted({entry.category for entry in self.entries.values()}))

    def has_shape(self, identifier: str) -> bool:
        """Return whether the signed distances of a model were sampled."""
        return (self.cache / shape_file(identifier)).exists()

    def shape(self, identifier: str) -> ShapeSamples:
        """Return the watertight mesh and signed distances of a model.

        Raises:
            KeyError: There is no model of this id.
            AssetError: ``prepare_shapes`` did not run for it, or its file is damaged.
        """
        if identifier not in self.entries:
            raise KeyError(identifier)
        return read_shape(self.cache, identifier)


def load_library(cache: Path | str) -> ModelLibrary:
    """Return the models of a cache; nothing but the index is read yet.

    Raises:
        AssetError: There is no cache, or one of another version.
    """
    folder = Path(cache)
    return ModelLibrary(folder, read_index(folder))


def add_models(
    cache: Path | str,
    models: Iterable[CadModel],
    confidence: Literal["high", "medium", "low"] = "high",
) -> ModelLibrary:
    """Return the library after adding or replacing models made elsewhere, such as parametric ones.

    The split of the models that are there already stays; new bases are divided.

    Args:
        cache: Folder of the cache; made if it is not there.
        models: To add.
        confidence: In their categories and sizes.
    """
    folder = Path(cache)
    folder.mkdir(parents=True, exist_ok=True)
    written = [write_model(folder, model, confidence=confidence) for model in models]
    try:
        index = read_index(folder)
    except AssetError:
        if (folder / "index.json").exists():
            raise
        index = CacheIndex()
    write_index(folder, extended(index, written))
    return load_library(folder)


def extended(index: CacheIndex, entries: Iterable[ModelEntry]) -> CacheIndex:
    """Return an index with entries added or replaced, and the bases that are new divided."""
    models = {entry.id: entry for entry in index.models}
    frozen: dict[str, Part] = {entry.base: entry.split for entry in index.models}
    models |= {entry.id: entry for entry in entries}
    split = split_models(models.values(), index.seed, index.unseen_share, frozen)
    updated = (entry.model_copy(update={"split": split[entry.base]}) for entry in models.values())
    return index.model_copy(update={"models": tuple(updated)})
