"""Choosing models: by category and size, with some jitter of the size and a look."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from panoscene.scene import CATEGORIES

from ._boards import Board
from ._library import ModelLibrary, ModelSummary, SummaryLibrary, kind_of

Range = tuple[float, float]
_ANY: Range = (0.0, 20.0)

USUAL: dict[str, tuple[Range, Range, Range]] = {
    "basket": ((0.15, 0.62), (0.15, 0.62), (0.1, 0.75)),
    "bathtub": ((1.2, 1.95), (0.6, 1.65), (0.3, 1.1)),
    "bed": ((0.8, 2.15), (1.7, 2.6), (0.15, 2.0)),
    "bench": ((0.5, 1.75), (0.2, 0.65), (0.3, 1.0)),
    "carpet": ((0.5, 3.2), (0.4, 3.2), (0.0, 0.03)),
    "chair": ((0.36, 0.72), (0.36, 0.72), (0.7, 1.2)),
    "coffee_machine": ((0.1, 0.45), (0.1, 0.45), (0.1, 0.5)),
    "coffee_table": ((0.5, 1.5), (0.4, 1.2), (0.25, 0.6)),
    "fence": ((0.6, 1.9), (0.02, 0.2), (0.5, 1.15)),
    "fridge": ((0.5, 1.0), (0.5, 0.9), (0.8, 2.1)),
    "heater": ((0.3, 1.5), (0.04, 0.28), (0.25, 0.95)),
    "mirror": ((0.3, 1.9), (0.005, 0.2), (0.4, 1.8)),
    "shelf": ((0.3, 2.4), (0.15, 0.6), (0.3, 2.4)),
    "shower": ((0.7, 1.3), (0.7, 1.3), (1.8, 2.3)),
    "sink": ((0.35, 1.9), (0.3, 0.75), (0.2, 1.25)),
    "sofa": ((1.2, 3.0), (0.6, 1.95), (0.5, 1.1)),
    "stool": ((0.25, 0.56), (0.25, 0.6), (0.3, 1.15)),
    "table": ((0.5, 2.4), (0.45, 1.3), (0.6, 0.82)),
    "towel_rack": ((0.2, 0.75), (0.03, 0.2), (0.03, 0.8)),
    "trash_can": ((0.15, 0.45), (0.15, 0.45), (0.2, 0.85)),
    "chest": ((0.3, 1.7), (0.25, 0.6), (0.25, 1.05)),
    "standing_tv": ((0.4, 1.5), (0.05, 0.55), (0.3, 0.9)),
    "sofa_chair": ((0.5, 1.15), (0.5, 1.0), (0.5, 1.1)),
    "plant": ((0.1, 1.1), (0.1, 1.1), (0.12, 2.1)),
}
"""Width, depth and height of what stands in homes: libraries hold street benches as well."""
_MOST_STRETCH = 1.3


@dataclass(frozen=True, slots=True)
class Item:
    """A model that was chosen, with its size."""

    model: ModelSummary
    size: Float[np.ndarray, " 3"]
    look: int
    shape: tuple[Board, ...] = ()
    """Boards of the model as it is."""

    @property
    def boards(self) -> tuple[Board, ...]:
        """Where things can stand inside, in the frame of the piece."""
        x, y, z = self.scale
        return tuple(
            Board(b.height * z, b.left * x, b.right * x, b.rear * y, b.front * y, b.headroom * z)
            for b in self.shape
        )

    @property
    def scale(self) -> tuple[float, float, float]:
        """Factors of the model's width, depth and height."""
        return tuple((self.size / np.array(self.model.size)).tolist())

    @property
    def support(self) -> float | None:
        """Metres above the lower edge at which things can stand on it."""
        height = self.model.support_height
        return None if height is None else height * self.scale[2]


class Stock:
    """The models of a library, ready to be chosen from."""

    def __init__(self, library: ModelLibrary, rng: np.random.Generator) -> None:
        self.rng = rng
        self._library = library
        self._models: dict[str, tuple[ModelSummary, ...]] = {}
        self._decoration: dict[str, list[ModelSummary]] = {}
        for model in library.models(""):
            self._decoration.setdefault(kind_of(model), []).append(model)
        self._sizes: dict[str, Float[np.ndarray, "models 3"]] = {}
        self._boards = library.boards if isinstance(library, SummaryLibrary) else {}
        self._hung: set[str] = set()

    def models(self, category: str) -> tuple[ModelSummary, ...]:
        """Return all models of a category or kind of decoration."""
        if category not in self._models:
            if category in CATEGORIES:
                models = tuple(self._library.models(category))
            else:
                models = tuple(self._decoration.get(category, ()))
            self._models[category] = models
            self._sizes[category] = np.array([m.size for m in models]).reshape(-1, 3)
        return self._models[category]

    def take(
        self,
        category: str,
        *,
        width: Range | None = None,
        depth: Range | None = None,
        height: Range | None = None,
        where: Callable[[ModelSummary], bool] | None = None,
    ) -> Item | None:
        """Return a model of a category whose size is within limits, or None.

        Sizes vary by about 5 %; a model is stretched by up to 30 % along an axis when nothing
        else fits.

        Args:
            category: one of the 57, or a kind of decoration.
            width: least and largest in metres; the usual ones when None.
            depth: the same.
            height: the same.
            where: tells which models are meant.
        """
        models = self.models(category)
        if where is None:
            able = np.arange(len(models))
        else:
            able = np.flatnonzero([where(model) for model in models])
        if able.size == 0:
            return None
        if category == "picture":
            able = np.array([k for k in able.tolist() if models[k].id not in self._hung], int)
            if able.size == 0:
                return None
        usual = USUAL.get(category, (_ANY, _ANY, _ANY))
        limits = np.array(
            [told or of for told, of in zip((width, depth, height), usual, strict=True)]
        )
        sizes = self._sizes[category][able]
        wanted = sizes * np.exp(self.rng.normal(0.0, 0.045)).clip(0.88, 1.13)
        wanted = wanted * np.exp(self.rng.normal(0.0, 0.015, 3)).clip(0.95, 1.05)
        fitted = wanted.clip(limits[:, 0], limits[:, 1])
        stretch = np.abs(np.log(fitted / sizes)).max(axis=1)
        exact = np.flatnonzero((fitted == wanted).all(axis=1))
        if exact.size == 0:
            exact = np.flatnonzero(stretch < np.log(_MOST_STRETCH))
        if exact.size == 0:
            return None
        chosen = int(self.rng.choice(exact))
        return self._item(models[able[chosen]], fitted[chosen])

    def another(self, item: Item) -> Item | None:
        """Return a picture in the same frame that shows something else, or None.

        Pictures of parametric frames depend on the look; the others have one.
        """
        if not _is_repainted(item.model):
            return None
        return Item(item.model, item.size, self._new_look())

    def _item(self, model: ModelSummary, size: Float[np.ndarray, " 3"]) -> Item:
        if model.category == "picture":
            if not _is_repainted(model):
                self._hung.add(model.id)
            return Item(model, size, self._new_look())
        return Item(model, size, self.sample_look(), self._boards.get(model.id, ()))

    def _new_look(self) -> int:
        return int(self.rng.integers(1, 2**31))

    def fitted(
        self,
        category: str,
        size: tuple[float, float, float],
        where: Callable[[ModelSummary], bool] | None = None,
    ) -> Item | None:
        """Return a model stretched to a size: one of those of about the same proportions."""
        models = self.models(category)
        able = [k for k, model in enumerate(models) if where is None or where(model)]
        if not able:
            return None
        ratio = np.log(self._sizes[category][able] / np.array(size))[:, [0, 2]]
        odd = np.abs(ratio).max(axis=1)
        close = np.flatnonzero(odd <= max(float(np.sort(odd)[min(2, len(odd) - 1)]), 0.12))
        chosen = able[int(self.rng.choice(close))]
        return Item(models[chosen], np.array(size), self.sample_look())

    def sample_look(self) -> int:
        """Return the seed of a recolouring; 0, the model's own colours, in a third of all cases."""
        return 0 if self.rng.random() < 0.35 else int(self.rng.integers(1, 2**31))


def _is_repainted(model: ModelSummary) -> bool:
    """Return whether another look of a picture shows another motif."""
    return model.id.startswith("parametric/")
