"""Signed distances of models for the shape networks, sampled once and kept in the cache."""

import io
import zipfile
import zlib
from dataclasses import dataclass, fields
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from jaxtyping import Float32, Float64, Int32, Int64
from scipy.spatial import KDTree

from panoscene.scene import write_atomically

from ._cache import file_word
from ._errors import AssetError
from ._records import CadModel
from ._watertight import RESOLUTION, ClosedSurface, close_surface

BOX = 0.7
"""Uniform samples and the grid fill [-0.7, 0.7]^3 in units of the longest side."""
BAND = 0.04375
"""Near samples are within this of the surface: one cell of the grid."""
GRID = 32
_MESH_FACES = 10_000
_SHAPE_VERSION = 1


@dataclass(frozen=True, slots=True)
class ShapeSamples:
    """A closed surface and signed distances around it (supplement of the paper, shape data).

    The frame is the object frame over ``scale``: the longest side of the model is 1, the centre of
    its box the origin. Distances are in the same unit, negative inside.
    """

    vertices: Float32[np.ndarray, "vertices 3"]
    faces: Int32[np.ndarray, "faces 3"]
    near: Float32[np.ndarray, "near 4"]
    """Points within 0.04375 of the surface, and their signed distance."""
    uniform: Float32[np.ndarray, "uniform 4"]
    """Points in [-0.7, 0.7]^3, and their signed distance."""
    grid: Float32[np.ndarray, "32 32 32"]
    """Signed distances at nodes from -0.7 to 0.7, x first."""
    scale: float
    """Metres per unit."""


def shape_file(identifier: str) -> str:
    """Return the name of a model's file of signed distances in a cache."""
    return f"shapes/{file_word(identifier)}.npz"


def sample_shape(
    model: CadModel,
    rng: np.random.Generator,
    samples: int = 50_000,
    resolution: int = RESOLUTION,
) -> ShapeSamples:
    """Return the closed surface of a model and signed distances around it.

    Args:
        model: To sample.
        rng: Source of randomness.
        samples: Near the surface, and again as many uniform ones.
        resolution: Voxels along the longest side.
    """
    surface = close_surface(model, resolution)
    near = _near_points(surface, rng, samples)
    uniform = rng.uniform(-BOX, BOX, (samples, 3))
    axis = np.linspace(-BOX, BOX, GRID)
    nodes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    distance = signed_distances(surface, np.concatenate([near, uniform, nodes]))
    vertices, faces = _lighter(surface)
    return ShapeSamples(
        vertices=vertices.astype(np.float32),
        faces=faces.astype(np.int32),
        near=np.c_[near, distance[:samples]].astype(np.float32),
        uniform=np.c_[uniform, distance[samples : 2 * samples]].astype(np.float32),
        grid=distance[2 * samples :].reshape(GRID, GRID, GRID).astype(np.float32),
        scale=surface.scale,
    )


def _near_points(
    surface: ClosedSurface, rng: np.random.Generator, samples: int
) -> Float64[np.ndarray, "samples 3"]:
    """Return points spread over the surface and moved off it by less than the band."""
    corners = surface.vertices[surface.faces]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    face = rng.choice(len(area), samples, p=area / area.sum())
    foot = np.einsum("nk,nkx->nx", rng.dirichlet((1, 1, 1), samples), corners[face])
    direction = rng.normal(size=(samples, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return foot + direction * rng.uniform(0, BAND, (samples, 1))


def signed_distances(
    surface: ClosedSurface, points: Float64[np.ndarray, "n 3"]
) -> Float64[np.ndarray, " n"]:
    """Return the distance of points to a closed surface, negative inside.

    Exact near the surface, where the triangles with the nearest middles are tried; further than
    about a cell of the grid away, too large by 1 percent at most.

    Args:
        surface: To measure from.
        points: In its frame.
    """
    corners = surface.vertices[surface.faces]
    tree = KDTree(corners.mean(axis=1))
    _, nearest = tree.query(points, eps=0.01)
    best = _triangle_distance(points, corners[nearest])
    close = np.flatnonzero(best < 1.2 * BAND)
    if len(close):
        for column in np.asarray(tree.query(points[close], 5)[1]).T:
            here = _triangle_distance(points[close], corners[column])
            best[close] = np.minimum(best[close], here)
    return np.where(surface.inside(points), -best, best)


def _triangle_distance(
    points: Float64[np.ndarray, "n 3"], corners: Float64[np.ndarray, "n 3 3"]
) -> Float64[np.ndarray, " n"]:
    """Return the distance of each point to its own triangle."""
    following = np.roll(corners, -1, axis=1)
    along = following - corners
    away = points[:, None] - corners
    length = np.maximum(np.einsum("nkx,nkx->nk", along, along), 1e-30)
    share = np.clip(np.einsum("nkx,nkx->nk", away, along) / length, 0, 1)
    rim = np.linalg.norm(away - share[..., None] * along, axis=2).min(axis=1)
    normal = np.cross(along[:, 0], along[:, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    height = np.einsum("nx,nx->n", away[:, 0], normal)
    sides = np.einsum("nkx,nx->nk", np.cross(along, away), normal)
    return np.where((sides >= 0).all(axis=1), np.abs(height), rim)


def _lighter(
    surface: ClosedSurface,
) -> tuple[Float64[np.ndarray, "vertices 3"], Int64[np.ndarray, "faces 3"]]:
    """Return the surface with about 10,000 faces, or as it is where that would open it."""
    try:
        import fast_simplification  # noqa: PLC0415 - optional
    except ImportError as error:
        hint = "watertight meshes need fast-simplification: pip install 'panoscene[synth]'"
        raise AssetError("fast-simplification", hint) from error
    if len(surface.faces) <= _MESH_FACES:
        return surface.vertices, surface.faces
    vertices, faces = fast_simplification.simplify(
        surface.vertices, surface.faces.astype(np.int32), target_count=_MESH_FACES
    )[:2]
    faces = np.asarray(faces, np.int64)
    return (np.asarray(vertices), faces) if is_closed(faces) else (surface.vertices, surface.faces)


def is_closed(faces: Int64[np.ndarray, "faces 3"]) -> bool:
    """Return whether every edge is run along once in each direction.

    Examples:
        >>> import numpy as np
        >>> is_closed(np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]))
        True
        >>> is_closed(np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3]]))
        False
    """
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    width = int(faces.max(initial=0)) + 1
    there, back = np.sort(start * width + end), np.sort(end * width + start)
    return bool(np.array_equal(there, back))


def write_shape(cache: Path, identifier: str, shape: ShapeSamples) -> None:
    """Write the signed distances of a model into a cache."""
    arrays: dict[str, Any] = {part.name: getattr(shape, part.name) for part in fields(shape)}
    stream = io.BytesIO()
    np.savez_compressed(stream, version=np.array(_SHAPE_VERSION), **arrays)
    (cache / "shapes").mkdir(parents=True, exist_ok=True)
    write_atomically(cache / shape_file(identifier), stream.getvalue())


def read_shape(cache: Path, identifier: str) -> ShapeSamples:
    """Return the signed distances of a model.

    Raises:
        AssetError: They were not sampled yet, or the file is damaged.
    """
    path = cache / shape_file(identifier)
    if not path.exists():
        raise AssetError(path, f"no shape of {identifier}; run 'panoscene synth assets --shapes'")
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as content:
            version, scale = int(content["version"]), float(content["scale"])
            names = [part.name for part in fields(ShapeSamples) if part.name != "scale"]
            arrays = {name: content[name] for name in names}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error,
            TokenError, SyntaxError) as error:  # fmt: skip
        raise AssetError(path, f"damaged shape file: {error}") from error
    if version != _SHAPE_VERSION:
        raise AssetError(path, f"expected version {_SHAPE_VERSION}; sample it again")
    return ShapeSamples(**arrays, scale=scale)
