"""What the shape networks learn from, model by model: inside or outside, and pictures."""

import hashlib
import io
import zipfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float16, Float32, Int32, UInt8

from panoscene.scene import write_atomically
from panoscene.synth.assets import (
    AssetError,
    CadModel,
    ModelLibrary,
    ShapeSamples,
    load_library,
    prepare_shapes,
    sample_shape,
)

from ._shape_renders import ModelViews, render_views

_VERSIONS = (1, 2)
"""Files of version 1 also have samples, which are not read any more."""


@dataclass(frozen=True, slots=True)
class ModelShape:
    """The closed surface of one model with samples around it, and pictures of it.

    Frame: the object frame over the longest side of the model; the centre of its box is the
    origin. Divide by ``extent`` to get to the canonical box [-1/2, 1/2]^3.
    """

    id: str
    category: str
    split: Literal["seen", "unseen"]
    extent: Float32[np.ndarray, "3"]
    """Of the box; the longest is 1."""
    near: Float16[np.ndarray, "near 4"]
    """Points near the surface, and their signed distance, negative inside."""
    uniform: Float16[np.ndarray, "uniform 4"]
    """Points in the enlarged box, and their signed distance."""
    grid: Float16[np.ndarray, "32 32 32"]
    """Signed distances at nodes from -0.7 to 0.7, x first."""
    vertices: Float32[np.ndarray, "vertices 3"]
    faces: Int32[np.ndarray, "faces 3"]
    image: UInt8[np.ndarray, "views rows rows 3"]
    alpha: UInt8[np.ndarray, "views rows rows"]
    bfov: Float32[np.ndarray, "views 4"]
    view_yaw: Float32[np.ndarray, " views"]


_PICTURES = ("image", "alpha", "bfov", "view_yaw")


def prepare_shape_store(
    cache: Path,
    store: Path,
    ids: Iterable[str],
    *,
    views: int = 6,
    progress: Callable[[str], None] | None = None,
) -> tuple[tuple[str, str], ...]:
    """Return id and reason of the models that could not be stored; those that are there stay.

    The store keeps pictures only: signed distances are made and kept in the cache of the models.

    Args:
        cache: Folder that ``panoscene.synth.assets.prepare_assets`` made.
        store: Folder that gets one file for each model.
        ids: Of the models.
        views: Pictures of each model.
        progress: Told of every model that is done.
    """
    wanted = tuple(ids)
    failed = dict(prepare_shapes(cache, wanted, processes=1))
    library = load_library(cache)
    store.mkdir(parents=True, exist_ok=True)
    for name in wanted:
        path = store_file(store, name)
        if path.is_file() or name in failed:
            continue
        digest = hashlib.sha256(name.encode()).digest()
        rng = np.random.default_rng(int.from_bytes(digest[:8], "big"))
        try:
            _write(path, name, render_views(library[name], rng, views))
        except (AssetError, ValueError, RuntimeError) as error:
            failed[name] = str(error)
            continue
        if progress is not None:
            progress(name)
    return tuple(failed.items())


def sampled_model(
    model: CadModel,
    rng: np.random.Generator,
    views: ModelViews,
    split: Literal["seen", "unseen"] = "seen",
) -> ModelShape:
    """Return samples around the closed surface of a model that is in no cache.

    Args:
        model: To sample.
        rng: Source of randomness.
        views: Pictures to keep with it.
        split: Whether networks may learn from it.
    """
    return _joined(model.id, model.category, split, sample_shape(model, rng), views)


def _joined(
    identifier: str,
    category: str,
    split: Literal["seen", "unseen"],
    shape: ShapeSamples,
    views: ModelViews,
) -> ModelShape:
    return ModelShape(
        id=identifier,
        category=category,
        split=split,
        extent=shape.extent / shape.extent.max(),
        near=shape.near,
        uniform=shape.uniform,
        grid=shape.grid,
        vertices=shape.vertices,
        faces=shape.faces,
        image=views.image,
        alpha=views.alpha,
        bfov=views.bfov,
        view_yaw=views.view_yaw,
    )


def store_file(store: Path, identifier: str) -> Path:
    """Return where a store keeps a model."""
    return store / (identifier.replace("/", "_") + ".npz")


def _write(path: Path, identifier: str, views: ModelViews) -> None:
    stream = io.BytesIO()
    arrays = {name: getattr(views, name) for name in _PICTURES}
    np.savez_compressed(
        stream, version=np.array(_VERSIONS[-1]), text=np.array([identifier]), **arrays
    )
    write_atomically(path, stream.getvalue())


def read_model_shape(path: Path, library: ModelLibrary) -> ModelShape:
    """Return a model of a store, with its signed distances from the cache of the models.

    Args:
        path: Of its pictures.
        library: With the model.

    Raises:
        AssetError: The file is missing, damaged, or of another version, or the library has no
            such model, or no signed distances of it.
    """
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as content:
            version, name = int(content["version"]), str(content["text"][0])
            views = ModelViews(**{part: content[part] for part in _PICTURES})
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise AssetError(path, f"damaged file of a shape store: {error}") from error
    if version not in _VERSIONS:
        raise AssetError(path, f"expected version {_VERSIONS[-1]}; make the store again")
    if name not in library:
        raise AssetError(path, f"the cache of models has no {name!r}; make the store again")
    entry = library.entries[name]
    shape = library.shape(name)
    return _joined(name, entry.category, library.split[entry.base], shape, views)
