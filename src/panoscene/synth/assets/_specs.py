"""Which models there are: the tables of the known libraries, and tables that users write."""

import csv
import io
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from panoscene.scene import CATEGORIES

from ._errors import AssetError
from ._records import Placement

Confidence = Literal["high", "medium", "low"]
_FOLDER = Path(__file__).parent
_PLACEMENTS: dict[str, Placement] = {
    "floor": "floor", "wall": "wall", "on-top": "on_top", "on_top": "on_top",
    "inside-wall": "in_wall", "in_wall": "in_wall", "ceiling": "ceiling",
}  # fmt: skip
_SUPPORTING = frozenset(
    {
        "bed", "bench", "bottom_cabinet", "bottom_cabinet_no_top", "chest", "coffee_table",
        "console_table", "counter", "dishwasher", "dryer", "fridge", "microwave", "piano",
        "pool_table", "shelf", "table", "washer", "top_cabinet",
    }
)  # fmt: skip
"""On these the whole top can carry things where a catalogue does not say otherwise."""


@dataclass(frozen=True, slots=True)
class Cut:
    """How a model is made from another one."""

    keep: str = ""
    """Regular expression searched in ``part|material``; empty keeps all."""
    drop: str = ""
    flat: bool = False
    """Turn it so that the thinnest axis of its oriented box is up."""
    stretch: bool = False
    """Stretch it to ``size``; else it keeps the size it has in the whole model."""


@dataclass(frozen=True, slots=True)
class ModelSpec:
    """One model of a library, before it is converted."""

    id: str
    base: str
    category: str
    file: str
    """Name of the model's file in its library."""
    library: str
    """File name of the library, or of the folder."""
    name: str = ""
    catalogue_id: str = ""
    placement: Placement = "floor"
    size: tuple[float, float, float] | None = None
    """Width, depth and height in metres; None keeps the file's units as metres."""
    elevation: float = 0.0
    support_height: float | None = None
    rotation: tuple[float, ...] | None = None
    """Row-major 3 x 3, applied in the file's axes before anything else."""
    front_yaw_deg: float = 0.0
    up: Literal["y", "z"] = "y"
    licence: str = ""
    creator: str = ""
    confidence: Confidence = "high"
    cut: Cut | None = None


def known_models() -> tuple[ModelSpec, ...]:
    """Return the 439 models of the Sweet Home 3D libraries and the 61 that are cut from them."""
    bases: dict[tuple[str, str], ModelSpec] = {}
    for row in _rows(_FOLDER / "sweethome3d.csv"):
        spec = _base_spec(row)
        bases[row["library"], row["id"]] = spec
    derived: list[ModelSpec] = []
    count: Counter[str] = Counter()
    for row in _rows(_FOLDER / "sweethome3d_derived.csv"):
        base = bases[row["library"], row["id"]]
        name = f"{base.id}/{row['category']}"
        count[name] += 1
        derived.append(_cut_spec(row, base, name if count[name] == 1 else f"{name}-{count[name]}"))
    return (*bases.values(), *derived)


def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def library_word(library: str) -> str:
    """Return how ids name a library: the file without its suffix, and eTeks for the program's own.

    Examples:
        >>> library_word("Scopia.sh3f"), library_word("sweethome3d.jar")
        ('Scopia', 'eTeks')
    """
    word = library.removesuffix(".sh3f").removesuffix(".jar")
    return "eTeks" if word == "sweethome3d" else word


def _size(row: dict[str, str]) -> tuple[float, float, float]:
    return float(row["width_m"]), float(row["depth_m"]), float(row["height_m"])


def _support(category: str, value: str, height: float) -> float | None:
    if value:
        return float(value) if float(value) >= 0 else None
    return height if category in _SUPPORTING else None


def _base_spec(row: dict[str, str]) -> ModelSpec:
    category = "" if row["category"] == "none" else row["category"]
    size, placement = _size(row), _PLACEMENTS[row["placement"]]
    name = f"sweethome3d/{library_word(row['library'])}/{row['index']}"
    rotation = tuple(float(x) for x in row["model_rotation"].split())
    confidence = row["confidence"]
    return ModelSpec(
        id=name,
        base=name,
        category=category,
        file=row["model"],
        library=row["library"],
        name=row["name"],
        catalogue_id=row["id"],
        placement=placement,
        size=size,
        elevation=0.0 if placement == "on_top" else float(row["elevation_m"] or 0),
        support_height=_support(category, row["support_height_m"], size[2]),
        rotation=rotation or None,
        front_yaw_deg=float(row["front_yaw_deg"] or 0),
        licence=row["licence"],
        creator=row["creator"],
        confidence="high" if confidence == "high" else "low" if confidence == "low" else "medium",
    )


def _cut_spec(row: dict[str, str], base: ModelSpec, name: str) -> ModelSpec:
    size, placement = _size(row), _PLACEMENTS[row["placement"]]
    return replace(
        base,
        id=name,
        category=row["category"],
        placement=placement,
        size=size,
        elevation=0.0 if placement == "on_top" else float(row["elevation_m"] or 0),
        support_height=_support(row["category"], "", size[2]),
        licence=row["licence"],
        confidence="high",
        cut=Cut(row["keep"], row["drop"], row["reorient"] == "flat", row["resize"] == "1"),
    )


def folder_models(table: str, folder: str) -> tuple[ModelSpec, ...]:
    """Return the models of a folder by its table, ``models.csv``.

    Columns: ``file`` and ``category`` (one of the 57, or empty), and if wanted ``name``, ``base``,
    ``width``, ``depth``, ``height`` (metres; all three or none), ``front_yaw_deg`` (how far the
    model must turn, counter-clockwise from above, so that its front is the front), ``up`` (``y`` or
    ``z``), ``placement``, ``elevation``, ``support_height``, ``licence``, ``creator``.

    Args:
        table: Content of the table.
        folder: Name of the folder; ids are ``folder/name of the file without suffix``.

    Raises:
        AssetError: A column is missing, or a row has an unknown category, placement or number.
    """
    reader = csv.DictReader(io.StringIO(table))
    if not {"file", "category"} <= set(reader.fieldnames or ()):
        raise AssetError(f"{folder}/models.csv", "expected the columns file and category")
    specs = tuple(_folder_spec(row, k + 2, folder) for k, row in enumerate(reader))
    twice = [name for name, n in Counter(spec.id for spec in specs).items() if n > 1]
    if twice:
        raise AssetError(f"{folder}/models.csv", f"found {twice[0]} twice, expected one row each")
    return specs


def _folder_spec(row: dict[str, str | None], line: int, folder: str) -> ModelSpec:
    where = f"{folder}/models.csv line {line}"
    cells = {key: (value or "").strip() for key, value in row.items() if isinstance(key, str)}
    category = cells["category"]
    if category and category not in CATEGORIES:
        raise AssetError(where, f"category: found {category!r}, expected one of the 57 or nothing")
    placement = _PLACEMENTS.get(cells.get("placement") or "floor")
    up = cells.get("up") or "y"
    if placement is None or up not in {"y", "z"}:
        raise AssetError(where, f"expected a placement of {sorted(set(_PLACEMENTS))} and up y or z")
    try:
        sides = [float(cells[key]) for key in ("width", "depth", "height") if cells.get(key)]
        yaw, elevation = (float(cells.get(k) or 0) for k in ("front_yaw_deg", "elevation"))
        support = float(cells["support_height"]) if cells.get("support_height") else None
    except ValueError as error:
        raise AssetError(where, f"found a number that is none: {error}") from error
    if len(sides) not in {0, 3} or min(sides, default=1) <= 0:
        raise AssetError(where, "expected width, depth and height in metres, all three or none")
    name = f"{folder}/{cells['file'].rpartition('.')[0]}"
    return ModelSpec(
        id=name,
        base=f"{folder}/{cells['base']}" if cells.get("base") else name,
        category=category,
        file=cells["file"],
        library=folder,
        name=cells.get("name") or cells["file"],
        placement=placement,
        size=(sides[0], sides[1], sides[2]) if sides else None,
        elevation=elevation,
        support_height=support,
        front_yaw_deg=yaw,
        up="z" if up == "z" else "y",
        licence=cells.get("licence", ""),
        creator=cells.get("creator", ""),
    )
