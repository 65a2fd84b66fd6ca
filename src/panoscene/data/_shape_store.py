"""What the shape networks learn from, model by model: inside or outside, and pictures."""

import hashlib
import io
import zipfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from jaxtyping import Float16, Float32, Float64, Int32, UInt8
from scipy.spatial import KDTree

from panoscene.scene import write_atomically
from panoscene.synth.assets import AssetError, CadModel, ClosedSurface, close_surface, load_library

from ._shape_renders import ModelViews, render_views

SHAPE_MARGIN = 1.2
"""Samples fill the model's box, larger by this factor."""
NEAR_BAND = 0.04375
"""Near samples are within this part of the longest side of the surface."""
GRID_CELLS = 32
"""Nodes of the coarse grid along each axis."""
_GRID_REACH = 0.7
_RESOLUTION = 64
_SAMPLES = 8192
_MESH_FACES = 12_000
_STORE_VERSION = 1


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


_ARRAYS = ("extent", "near", "uniform", "grid", "vertices", "faces",
           "image", "alpha", "bfov", "view_yaw")  # fmt: skip


def prepare_shape_store(
    cache: Path,
    store: Path,
    ids: Iterable[str],
    *,
    views: int = 6,
    progress: Callable[[str], None] | None = None,
) -> tuple[tuple[str, str], ...]:
    """Return id and reason of the models that could not be stored; those that are there stay.

    Args:
        cache: Folder that ``panoscene.synth.assets.prepare_assets`` made.
        store: Folder that gets one file for each model.
        ids: Of the models.
        views: Pictures of each model.
        progress: Told of every model that is done.
    """
    library = load_library(cache)
    store.mkdir(parents=True, exist_ok=True)
    failed: list[tuple[str, str]] = []
    for name in ids:
        path = store_file(store, name)
        if path.is_file():
            continue
        digest = hashlib.sha256(name.encode()).digest()
        rng = np.random.default_rng(int.from_bytes(digest[:8], "big"))
        try:
            model = library[name]
            shape = sampled_model(model, rng, render_views(model, rng, views),
                                  library.split[model.base])  # fmt: skip
        except (AssetError, ValueError, RuntimeError) as error:
            failed.append((name, str(error)))
            continue
        _write(path, shape)
        if progress is not None:
            progress(name)
    return tuple(failed)


def sampled_model(
    model: CadModel,
    rng: np.random.Generator,
    views: ModelViews,
    split: Literal["seen", "unseen"] = "seen",
) -> ModelShape:
    """Return samples around the closed surface of a model.

    The sign is that of ``close_surface`` at 64 voxels; distances are those to the vertices of the
    surface, right to about half a voxel, for the losses look at the sign.

    Args:
        model: To sample.
        rng: Source of randomness.
        views: Pictures to keep with it.
        split: Whether networks may learn from it.
    """
    surface = close_surface(model, _RESOLUTION)
    extent = np.ptp(surface.vertices, axis=0)
    near = _near_points(surface, rng)
    uniform = rng.uniform(-0.5, 0.5, (2 * _SAMPLES, 3)) * extent * SHAPE_MARGIN
    axis = np.linspace(-_GRID_REACH, _GRID_REACH, GRID_CELLS)
    nodes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    points = np.concatenate([near, uniform, nodes]).astype(np.float64)
    distance = np.asarray(KDTree(surface.vertices, balanced_tree=False).query(points, eps=0.05)[0])
    distance = np.maximum(distance, 1e-3) * np.where(surface.inside(points), -1, 1)
    ends = np.cumsum([len(near), len(uniform)])
    signed = [part.astype(np.float16) for part in np.split(np.c_[points, distance], ends)]
    vertices, faces = _lighter(surface)
    return ModelShape(
        id=model.id,
        category=model.category,
        split=split,
        extent=(extent / extent.max()).astype(np.float32),
        near=signed[0],
        uniform=signed[1],
        grid=signed[2][:, 3].reshape(GRID_CELLS, GRID_CELLS, GRID_CELLS),
        vertices=vertices,
        faces=faces,
        image=views.image,
        alpha=views.alpha,
        bfov=views.bfov,
        view_yaw=views.view_yaw,
    )


def _near_points(
    surface: ClosedSurface, rng: np.random.Generator
) -> Float64[np.ndarray, "samples 3"]:
    """Return points spread evenly over the surface and moved off it by less than the band."""
    corners = surface.vertices[surface.faces]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    face = rng.choice(len(area), _SAMPLES, p=area / area.sum())
    foot = np.einsum("nk,nkx->nx", rng.dirichlet((1, 1, 1), _SAMPLES), corners[face])
    direction = rng.normal(size=(_SAMPLES, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return foot + direction * rng.uniform(0, NEAR_BAND, (_SAMPLES, 1))


def _lighter(
    surface: ClosedSurface,
) -> tuple[Float32[np.ndarray, "vertices 3"], Int32[np.ndarray, "faces 3"]]:
    """Return the surface with fewer triangles where that keeps it closed."""
    vertices, faces = surface.vertices.astype(np.float32), surface.faces.astype(np.int32)
    if len(faces) <= _MESH_FACES:
        return vertices, faces
    import fast_simplification  # noqa: PLC0415 - optional

    fewer = fast_simplification.simplify(surface.vertices, faces, target_count=_MESH_FACES)
    light, sides = np.asarray(fewer[0], np.float32), np.asarray(fewer[1], np.int32)
    return (light, sides) if _closed(sides) else (vertices, faces)


def _closed(faces: Int32[np.ndarray, "faces 3"]) -> bool:
    """Return whether every edge is run along once in each direction."""
    start = faces.ravel().astype(np.int64)
    end = np.roll(faces, -1, axis=1).ravel().astype(np.int64)
    width = int(faces.max(initial=0)) + 1
    return bool(np.array_equal(np.sort(start * width + end), np.sort(end * width + start)))


def store_file(store: Path, identifier: str) -> Path:
    """Return where a store keeps a model."""
    return store / (identifier.replace("/", "_") + ".npz")


def _write(path: Path, shape: ModelShape) -> None:
    stream = io.BytesIO()
    text = np.array([shape.id, shape.category, shape.split])
    arrays = {name: getattr(shape, name) for name in _ARRAYS}
    np.savez_compressed(stream, version=np.array(_STORE_VERSION), text=text, **arrays)
    write_atomically(path, stream.getvalue())


def read_model_shape(path: Path) -> ModelShape:
    """Return a model of a store.

    Raises:
        AssetError: The file is missing, damaged, or of another version.
    """
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as content:
            version = int(content["version"])
            identifier, category, split = content["text"].tolist()
            arrays = {name: content[name] for name in _ARRAYS}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise AssetError(path, f"damaged file of a shape store: {error}") from error
    if version != _STORE_VERSION:
        raise AssetError(path, f"expected version {_STORE_VERSION}; make the store again")
    return ModelShape(id=identifier, category=category, split=split, **arrays)
