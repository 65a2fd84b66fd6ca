"""What furnishing needs to know about furniture models, and stand-ins for development."""

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from typing import Protocol, runtime_checkable

import numpy as np

from panoscene.scene import CATEGORIES

from ._boards import Board


@runtime_checkable
class ModelSummary(Protocol):
    """What furnishing asks about a model; a ``CadModel`` without its shape."""

    @property
    def id(self) -> str:
        """Unique name."""
        ...

    @property
    def category(self) -> str:
        """One of the 57 categories, or "" for decoration."""
        ...

    @property
    def size(self) -> tuple[float, float, float]:
        """Width, depth, height in metres."""
        ...

    @property
    def placement(self) -> str:
        """Where it is put."""
        ...

    @property
    def elevation(self) -> float:
        """Usual height of its lower edge in metres."""
        ...

    @property
    def support_height(self) -> float | None:
        """Height above its lower edge on which things can stand; None when nothing can."""
        ...

    @property
    def has_front(self) -> bool:
        """False where every side is as good."""
        ...


@runtime_checkable
class ModelLibrary(Protocol):
    """Furniture models, by category."""

    def models(self, category: str) -> Sequence[ModelSummary]:
        """Return the models of a category, "" for decoration; always in the same order."""
        ...


@dataclass(frozen=True, slots=True)
class Summary:
    """A model as far as furnishing needs it."""

    id: str
    category: str
    size: tuple[float, float, float]
    placement: str = "floor"
    elevation: float = 0.0
    support_height: float | None = None
    has_front: bool = True
    lights: bool = False


@dataclass(frozen=True, slots=True)
class SummaryLibrary:
    """A library of summaries, without shapes."""

    by_category: dict[str, tuple[ModelSummary, ...]] = field(default_factory=dict)
    boards: Mapping[str, tuple[Board, ...]] = field(default_factory=dict)
    """Of shelves, by id."""

    def models(self, category: str) -> Sequence[ModelSummary]:
        """Return the models of a category, "" for decoration."""
        return self.by_category.get(category, ())


_NO_FRONT = ("plant", "table_lamp", "floor_lamp", "stool", "trash_can", "basket", "cushion")
_CARRIES = (
    "bed", "bench", "bottom_cabinet", "bottom_cabinet_no_top", "chair", "chest", "coffee_table",
    "console_table", "counter", "dishwasher", "dryer", "oven", "shelf", "sink", "sofa",
    "sofa_chair", "stool", "stove", "table", "top_cabinet", "washer", "microwave",
)  # fmt: skip
_THIN = ("none", "wall_mounted_tv")
"""Rows of these categories are taken even if it is doubtful what they are."""
_STAND_INS: dict[str, tuple[tuple[float, ...], tuple[float, ...], str, float]] = {
    "picture": ((0.30, 0.02, 0.30), (1.20, 0.05, 0.90), "wall", 1.3),
    "mirror": ((0.40, 0.02, 0.50), (1.00, 0.05, 1.20), "wall", 1.1),
    "carpet": ((1.20, 0.80, 0.008), (3.00, 2.20, 0.02), "floor", 0.0),
    "cushion": ((0.35, 0.32, 0.10), (0.55, 0.50, 0.16), "on_top", 0.0),
    "wall_clock": ((0.20, 0.03, 0.20), (0.45, 0.05, 0.45), "wall", 1.8),
    "grandfather_clock": ((0.40, 0.25, 1.80), (0.55, 0.32, 2.10), "floor", 0.0),
    "counter": ((1.20, 0.60, 0.86), (2.20, 0.90, 0.94), "floor", 0.0),
    "bottom_cabinet": ((0.45, 0.42, 0.50), (1.80, 0.60, 2.10), "floor", 0.0),
    "bottom_cabinet_no_top": ((0.40, 0.56, 0.78), (0.90, 0.60, 0.86), "floor", 0.0),
    "top_cabinet": ((0.40, 0.32, 0.60), (1.00, 0.38, 0.90), "wall", 1.45),
    "dishwasher": ((0.45, 0.58, 0.82), (0.60, 0.62, 0.88), "floor", 0.0),
    "dryer": ((0.58, 0.58, 0.84), (0.62, 0.64, 0.88), "floor", 0.0),
    "oven": ((0.58, 0.58, 0.58), (0.62, 0.62, 0.88), "floor", 0.0),
    "stove": ((0.50, 0.58, 0.84), (0.90, 0.64, 0.92), "floor", 0.0),
    "washer": ((0.58, 0.56, 0.84), (0.62, 0.64, 0.88), "floor", 0.0),
    "microwave": ((0.44, 0.34, 0.26), (0.54, 0.42, 0.32), "on_top", 0.0),
    "fridge": ((0.55, 0.58, 1.40), (0.92, 0.72, 2.00), "floor", 0.0),
    "window": ((0.60, 0.16, 0.60), (2.00, 0.30, 2.20), "in_wall", 0.9),
    "door": ((0.75, 0.12, 2.00), (1.00, 0.16, 2.10), "in_wall", 0.0),
    "towel_rack": ((0.40, 0.08, 0.08), (0.70, 0.14, 0.60), "wall", 1.0),
    "floor_lamp": ((0.28, 0.28, 1.40), (0.50, 0.50, 1.85), "floor", 0.0),
    "shower": ((0.80, 0.80, 1.95), (1.20, 0.95, 2.10), "floor", 0.0),
    "basket": ((0.25, 0.25, 0.22), (0.50, 0.40, 0.55), "floor", 0.0),
    "trash_can": ((0.20, 0.20, 0.28), (0.36, 0.36, 0.70), "floor", 0.0),
    "laptop": ((0.30, 0.22, 0.20), (0.38, 0.28, 0.26), "on_top", 0.0),
    "monitor": ((0.48, 0.16, 0.38), (0.72, 0.24, 0.52), "on_top", 0.0),
    "standing_tv": ((0.70, 0.15, 0.45), (1.40, 0.28, 0.85), "on_top", 0.0),
    "wall_mounted_tv": ((0.80, 0.05, 0.48), (1.50, 0.09, 0.88), "wall", 1.0),
    "range_hood": ((0.55, 0.40, 0.30), (0.90, 0.50, 0.75), "wall", 1.6),
    "pool_table": ((2.20, 1.20, 0.78), (2.60, 1.45, 0.85), "floor", 0.0),
    "treadmill": ((0.70, 1.50, 1.20), (0.88, 1.90, 1.50), "floor", 0.0),
    "guitar": ((0.34, 0.30, 0.95), (0.42, 0.40, 1.10), "floor", 0.0),
    "speaker_system": ((0.30, 0.15, 0.12), (0.55, 0.30, 0.40), "on_top", 0.0),
    "loudspeaker": ((0.16, 0.18, 0.28), (0.26, 0.30, 1.00), "floor", 0.0),
    "coffee_machine": ((0.16, 0.25, 0.28), (0.34, 0.40, 0.40), "on_top", 0.0),
    "piano": ((1.35, 0.50, 1.05), (1.55, 0.66, 1.25), "floor", 0.0),
    "crib": ((0.65, 1.15, 0.85), (0.80, 1.35, 1.10), "floor", 0.0),
    "chest": ((0.36, 0.34, 0.42), (1.20, 0.50, 0.95), "floor", 0.0),
}
"""Least and largest size, placement and elevation of parametric models."""
_DECORATION: dict[str, tuple[tuple[float, ...], tuple[float, ...], str, float]] = {
    "curtain": ((1.20, 0.10, 2.00), (2.80, 0.14, 2.50), "wall", 0.05),
    "ceiling_lamp": ((0.30, 0.30, 0.12), (0.60, 0.60, 0.55), "ceiling", 0.0),
    "books": ((0.15, 0.15, 0.04), (0.32, 0.22, 0.25), "on_top", 0.0),
    "bottles": ((0.06, 0.06, 0.18), (0.35, 0.10, 0.33), "on_top", 0.0),
    "vase": ((0.10, 0.10, 0.18), (0.20, 0.20, 0.38), "on_top", 0.0),
    "dishes": ((0.18, 0.18, 0.06), (0.32, 0.32, 0.12), "on_top", 0.0),
    "candles": ((0.08, 0.08, 0.10), (0.25, 0.10, 0.30), "on_top", 0.0),
    "towels": ((0.28, 0.20, 0.10), (0.33, 0.24, 0.22), "on_top", 0.0),
    "small_box": ((0.16, 0.14, 0.09), (0.36, 0.28, 0.25), "on_top", 0.0),
    "toys": ((0.25, 0.20, 0.12), (0.45, 0.40, 0.45), "floor", 0.0),
    "socket": ((0.08, 0.01, 0.08), (0.16, 0.02, 0.08), "wall", 0.3),
    "switch": ((0.08, 0.01, 0.08), (0.09, 0.02, 0.22), "wall", 1.05),
}


def kind_of(model: ModelSummary) -> str:
    """Return what a model is: its category or, for decoration, its kind; "" when that is unknown.

    Decoration is told apart by ids of the form ``parametric/<kind>/<seed>``.

    Examples:
        >>> kind_of(Summary("parametric/vase/3", "", (0.1, 0.1, 0.3), "on_top"))
        'vase'
    """
    if model.category:
        return model.category
    source, _, rest = model.id.partition("/")
    return rest.partition("/")[0] if source == "parametric" else ""


def is_kitchen_sink(model: ModelSummary) -> bool:
    """Return whether a sink is a unit of a kitchen, as deep as the others, or a basin.

    Examples:
        >>> is_kitchen_sink(Summary("a", "sink", (1.2, 0.64, 1.05))), is_kitchen_sink(
        ...     Summary("b", "sink", (0.56, 0.47, 0.97))
        ... )
        (True, False)
    """
    width, depth, height = model.size
    return (
        model.category == "sink"
        and model.placement == "floor"
        and width > 0.55
        and 0.6 <= depth <= 0.66
        and height > 0.84
    )


def summary_library(
    models: Iterable[ModelSummary], boards: Mapping[str, tuple[Board, ...]] | None = None
) -> SummaryLibrary:
    """Return a library of models given in any order, such as the entries of an asset cache.

    Args:
        models: The models.
        boards: Of shelves, by id; things stand at one height in the others.

    Examples:
        >>> chair = Summary("chair/1", "chair", (0.5, 0.5, 0.9))
        >>> summary_library([chair]).models("chair")[0].id
        'chair/1'
    """
    found: dict[str, list[ModelSummary]] = {}
    for model in sorted(models, key=lambda model: model.id):
        found.setdefault(model.category, []).append(model)
    return SummaryLibrary(
        {category: tuple(of) for category, of in found.items()}, dict(boards or {})
    )


def stand_in_library(seed: int = 0, *, parametric: int = 8) -> SummaryLibrary:
    """Return the sizes of the Sweet Home 3D models, and of stand-ins for thin categories.

    It has no shapes: it is for furnishing homes when the converted models are not at hand.

    Args:
        seed: of the stand-ins' sizes.
        parametric: number of stand-ins in each category that has any.

    Examples:
        >>> library = stand_in_library()
        >>> min(len(library.models(category)) for category in CATEGORIES) > 0
        True
    """
    rng = np.random.default_rng([seed, 57])
    found: dict[str, list[ModelSummary]] = {category: [] for category in (*CATEGORIES, "")}
    folder = files("panoscene.synth") / "assets"
    for table in ("sweethome3d.csv", "sweethome3d_derived.csv"):
        with (folder / table).open(encoding="utf-8") as stream:
            for number, row in enumerate(csv.DictReader(stream)):
                if row.get("confidence") == "low" and row["category"] not in _THIN:
                    continue
                category = "" if row["category"] == "none" else row["category"]
                found[category].append(_from_row(row, category, f"{table[:-4]}/{number}"))
    for table in (_STAND_INS, _DECORATION):
        for name, (low, high, placement, elevation) in table.items():
            category = name if name in found else ""
            for k in range(parametric):
                width, depth, height = rng.uniform(low, high).tolist()
                carries = height if category in _CARRIES else None
                found[category].append(
                    Summary(
                        f"parametric/{name}/{k}", category, (width, depth, height), placement,
                        elevation, carries, category not in _NO_FRONT, "lamp" in name,
                    )
                )  # fmt: skip
    return SummaryLibrary({category: tuple(models) for category, models in found.items()})


def _from_row(row: dict[str, str], category: str, place: str) -> Summary:
    size = (float(row["width_m"]), float(row["depth_m"]), float(row["height_m"]))
    placement: str = {
        "on-top": "on_top", "inside-wall": "in_wall", "wall": "wall",
    }.get(row["placement"], "floor")  # fmt: skip
    told = row.get("support_height_m") or ""
    support = size[2] if category in _CARRIES else None
    if told:
        support = float(told) if float(told) > 0.0 else None
    return Summary(
        f"{place}/{row['id']}", category, size, placement, float(row["elevation_m"]), support,
        category not in _NO_FRONT, "lamp" in category,
    )  # fmt: skip
