"""All furniture models at once: those of an asset cache, and the parametric ones."""

import copy
from collections.abc import Iterator, Sequence
from pathlib import Path

from panoscene.synth.assets import CadModel, ModelEntry, add_models, load_library
from panoscene.synth.homes import SummaryLibrary, boards_of, has_top, summary_library
from panoscene.synth.models import PARAMETRIC_KINDS, make_model

from ._split import Part, entries_for

PARAMETRIC = "parametric/"
"""Begin of the ids of models that are made when they are needed."""
DESIGNS = 12
"""Of every parametric kind, unless told otherwise."""


class Models:
    """Furniture models by id: read from a cache or, if they are parametric, made with textures.

    Args:
        cache: Folder that ``prepare_models`` filled.
        texture_size: Edge of the textures of parametric models in pixels; 0 makes plain colours.

    Attributes:
        cache: Folder of the cache.
        entries: What the index says of every model, by id; parametric ones are in it too.
    """

    def __init__(self, cache: Path | str, texture_size: int = 256) -> None:
        self._library = load_library(cache)
        self._texture_size = texture_size
        self.cache = self._library.cache
        self.entries: dict[str, ModelEntry] = self._library.entries

    def __getitem__(self, identifier: str) -> CadModel:
        """Return a model.

        Raises:
            KeyError: There is no model of this id.
            AssetError: Its file is damaged or missing.
        """
        if identifier not in self.entries:
            raise KeyError(identifier)
        if not identifier.startswith(PARAMETRIC):
            return self._library[identifier]
        _, kind, seed = identifier.split("/")
        return make_model(kind, int(seed), self._texture_size)

    def __contains__(self, identifier: object) -> bool:
        """Return whether there is a model of this id."""
        return identifier in self.entries

    def __iter__(self) -> Iterator[str]:
        """Return the ids, sorted."""
        return iter(self.entries)

    def __len__(self) -> int:
        """Return how many models there are."""
        return len(self.entries)

    def plain(self) -> "Models":
        """Return the same models without procedural textures: for whoever needs shapes only."""
        plain = copy.copy(self)
        plain._texture_size = 0
        return plain

    def unseen_bases(self) -> tuple[str, ...]:
        """Return the base models that are kept from training, sorted."""
        return tuple(sorted({e.base for e in self.entries.values() if e.split == "unseen"}))

    def entries_of(self, part: Part) -> dict[str, ModelEntry]:
        """Return the models that homes of a part are furnished with, by id."""
        found = entries_for(self.entries.values(), part)
        return {name: entry for name, entry in found.items() if not self._is_open(entry)}

    def _is_open(self, entry: ModelEntry) -> bool:
        """Return whether one sees into a cupboard from above: its worktop is a model of its own."""
        if entry.category != "bottom_cabinet_no_top" or entry.support_height is None:
            return False
        model = self._library[entry.id]
        return not has_top(model.vertices, model.faces, entry.support_height)

    def summaries(self, part: Part) -> SummaryLibrary:
        """Return what furnishing needs to know of the models of a part."""
        entries = self.entries_of(part)
        shelves = (self._library[name] for name, e in entries.items() if e.category == "shelf")
        boards = {model.id: boards_of(model.vertices, model.faces) for model in shelves}
        return summary_library(entries.values(), boards)


def add_parametric_models(cache: Path | str, designs: int = DESIGNS) -> int:
    """Return how many parametric models were added to a cache; those that are there stay.

    Only their shapes are written; textures are made when a model is drawn.

    Args:
        cache: Folder of the cache; made if it is not there.
        designs: Of every kind.
    """
    try:
        known: Sequence[str] = tuple(load_library(cache).entries)
    except (OSError, ValueError):
        known = ()
    missing = [
        (kind, seed)
        for kind in PARAMETRIC_KINDS
        for seed in range(designs)
        if f"{PARAMETRIC}{kind}/{seed}" not in known
    ]
    if missing:
        add_models(cache, (make_model(kind, seed, 0) for kind, seed in missing))
    return len(missing)
