"""Furniture models on disk: one .npz each, pictures beside them, an index over all."""

import hashlib
import io
import json
import re
import zipfile
import zlib
from pathlib import Path
from tokenize import TokenError
from typing import Any, Literal

import numpy as np
from jaxtyping import UInt8
from PIL import Image
from pydantic import BaseModel, ConfigDict, ValidationError

from panoscene.scene import write_atomically

from ._errors import AssetError
from ._records import CadModel, LightSource, Material, Placement
from ._split import Part

CACHE_FORMAT = "panoscene assets"
CACHE_VERSION = 1
_ARRAYS = ("vertices", "normals", "uv", "faces", "face_material")
_MAPS = ("texture", "roughness_map", "normal_map")
_PNG_BYTES = 250_000


class ModelEntry(BaseModel):
    """What the index says of a model without opening its file."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    id: str
    base: str
    category: str
    placement: Placement
    size: tuple[float, float, float]
    elevation: float = 0.0
    support_height: float | None = None
    has_front: bool = True
    licence: str = ""
    creator: str = ""
    source: str = ""
    confidence: Literal["high", "medium", "low"] = "high"
    """How sure the table is of category and size; low ones are left out of listings."""
    faces: int
    textured: bool
    lights: int = 0
    file: str
    sha256: str
    key: str = ""
    """Hash of everything the model was converted from; another one means: convert again."""
    split: Part = "seen"


class CacheIndex(BaseModel):
    """The index file of a cache."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: Literal["panoscene assets"] = CACHE_FORMAT
    version: Literal[1] = CACHE_VERSION
    seed: int = 0
    unseen_share: float = 0.15
    libraries: dict[str, str] = {}
    """SHA-256 of every library file that models were made from."""
    models: tuple[ModelEntry, ...] = ()


def file_word(identifier: str) -> str:
    """Return a file name, without suffix, for the id of a model; ids never share one.

    Examples:
        >>> file_word("sweethome3d/Scopia/34")
        'sweethome3d_Scopia_34-47071df2'
    """
    digest = hashlib.sha256(identifier.encode()).hexdigest()[:8]
    return f"{re.sub(r'[^A-Za-z0-9.-]+', '_', identifier)[:80].lstrip('.')}-{digest}"


def write_model(
    cache: Path,
    model: CadModel,
    key: str = "",
    confidence: Literal["high", "medium", "low"] = "high",
) -> ModelEntry:
    """Return the index entry of a model after writing its files.

    Args:
        cache: Folder of the cache.
        model: To write.
        key: Hash of what it was made from.
        confidence: In its category and size.
    """
    materials = [_material_to_json(cache, material) for material in model.materials]
    head: dict[str, Any] = {
        "format": CACHE_FORMAT,
        "version": CACHE_VERSION,
        "key": key,
        "id": model.id,
        "base": model.base,
        "category": model.category,
        "size": model.size,
        "placement": model.placement,
        "elevation": model.elevation,
        "support_height": model.support_height,
        "has_front": model.has_front,
        "licence": model.licence,
        "creator": model.creator,
        "source": model.source,
        "confidence": confidence,
        "materials": materials,
        "lights": [[*light.position, light.diameter, *light.colour] for light in model.lights],
    }
    arrays = {name: getattr(model, name) for name in _ARRAYS}
    stream = io.BytesIO()
    np.savez_compressed(stream, head=np.array(json.dumps(head)), **arrays)
    file = f"models/{file_word(model.id)}.npz"
    (cache / "models").mkdir(parents=True, exist_ok=True)
    write_atomically(cache / file, stream.getvalue())
    return _entry(head, file, stream.getvalue(), len(model.faces))


def _entry(head: dict[str, Any], file: str, content: bytes, faces: int) -> ModelEntry:
    shared = set(ModelEntry.model_fields) & head.keys() - {"lights"}
    return ModelEntry(
        **{name: head[name] for name in shared},
        faces=faces,
        textured=any(material["texture"] for material in head["materials"]),
        lights=len(head["lights"]),
        file=file,
        sha256=hashlib.sha256(content).hexdigest(),
    )


def _material_to_json(cache: Path, material: Material) -> dict[str, Any]:
    plain = ("name", "colour", "roughness", "metallic", "opacity", "kind", "emission")
    found: dict[str, Any] = {name: getattr(material, name) for name in plain}
    for name in _MAPS:
        picture = getattr(material, name)
        exact = name != "texture"
        found[name] = None if picture is None else _write_picture(cache, picture, exact)
    return found


def _write_picture(cache: Path, picture: UInt8[np.ndarray, "..."], exact: bool) -> str:
    """Return the name of a picture in the cache; equal pictures share a file."""
    digest = hashlib.sha256(repr(picture.shape).encode() + picture.tobytes()).hexdigest()[:24]
    for suffix in ("png", "jpg"):
        if (cache / f"textures/{digest}.{suffix}").exists():
            return f"textures/{digest}.{suffix}"
    image, stream, suffix = Image.fromarray(picture), io.BytesIO(), "png"
    image.save(stream, "PNG")
    if stream.tell() > _PNG_BYTES and not exact:
        stream, suffix = io.BytesIO(), "jpg"
        image.save(stream, "JPEG", quality=93, subsampling=0)
    (cache / "textures").mkdir(parents=True, exist_ok=True)
    write_atomically(cache / f"textures/{digest}.{suffix}", stream.getvalue())
    return f"textures/{digest}.{suffix}"


def read_head(path: Path) -> dict[str, Any]:
    """Return what a model file says of its model.

    Raises:
        AssetError: The file is damaged, or of another format or version.
    """
    return _read(path, arrays=False)[0]


def _read(path: Path, arrays: bool) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as content:
            head = json.loads(str(content["head"]))
            found = {name: content[name] for name in _ARRAYS} if arrays else {}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error,
            TokenError, SyntaxError) as error:  # fmt: skip
        raise AssetError(path, f"damaged model file: {error}") from error
    if (head.get("format"), head.get("version")) != (CACHE_FORMAT, CACHE_VERSION):
        raise AssetError(path, f"expected a model file of version {CACHE_VERSION}")
    return head, found


def entry_of_file(cache: Path, file: str) -> ModelEntry:
    """Return the index entry of a model file that is there already.

    Raises:
        AssetError: The file, or one of its pictures, is damaged or missing.
    """
    path = cache / file
    head, found = _read(path, arrays=True)
    for material in head["materials"]:
        for name in _MAPS:
            if material[name] and not (cache / material[name]).exists():
                raise AssetError(path, f"its picture {material[name]} is missing")
    return _entry(head, file, path.read_bytes(), len(found["faces"]))


def read_model(cache: Path, file: str) -> CadModel:
    """Return a model of the cache with its textures.

    Raises:
        AssetError: The file, or one of its pictures, is damaged or missing.
    """
    head, arrays = _read(cache / file, arrays=True)
    numbers = [tuple(float(x) for x in row) for row in head["lights"]]
    size = head["size"]
    return CadModel(
        id=head["id"],
        base=head["base"],
        category=head["category"],
        vertices=arrays["vertices"],
        normals=arrays["normals"],
        uv=arrays["uv"],
        faces=arrays["faces"],
        face_material=arrays["face_material"],
        materials=tuple(_material_from_json(cache, value) for value in head["materials"]),
        size=(float(size[0]), float(size[1]), float(size[2])),
        placement=head["placement"],
        elevation=float(head["elevation"]),
        support_height=head["support_height"],
        lights=tuple(LightSource(x[:3], x[3], x[4:7]) for x in numbers),  # ty: ignore[invalid-argument-type]
        has_front=head["has_front"],
        licence=head["licence"],
        creator=head["creator"],
        source=head["source"],
    )


def _material_from_json(cache: Path, value: dict[str, Any]) -> Material:
    maps: dict[str, Any] = {
        name: _read_picture(cache, value[name]) for name in _MAPS if value[name]
    }
    rest: dict[str, Any] = {name: value[name] for name in value if name not in {*_MAPS, "colour"}}
    colour = value["colour"]
    return Material(colour=(colour[0], colour[1], colour[2]), **rest | maps)


def _read_picture(cache: Path, file: str) -> UInt8[np.ndarray, "..."]:
    try:
        with Image.open(cache / file) as image:
            return np.array(image)
    except (OSError, SyntaxError) as error:
        raise AssetError(cache / file, f"damaged picture: {error}") from error


def read_index(cache: Path) -> CacheIndex:
    """Return the index of a cache.

    Raises:
        AssetError: There is no index, or one of another version, or a damaged one.
    """
    path = cache / "index.json"
    hint = "run 'panoscene synth assets' to make it"
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise AssetError(path, f"no cache of furniture here; {hint}") from error
    try:
        return CacheIndex.model_validate_json(text)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(step) for step in first["loc"]) or "the file"
        raise AssetError(path, f"{where}: {first['msg']}; {hint}") from error


def write_index(cache: Path, index: CacheIndex) -> None:
    """Write the index, models sorted by id, in one step."""
    ordered = index.model_copy(update={"models": tuple(sorted(index.models, key=lambda m: m.id))})
    write_atomically(cache / "index.json", ordered.model_dump_json(indent=1) + "\n")
