"""Signed distances of models for the shape networks, sampled once and kept in the cache."""

import io
import zipfile
import zlib
from dataclasses import dataclass, fields
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from jaxtyping import Float16, Float32, Float64, Int32, Int64
from scipy.spatial import KDTree

from panoscene.scene import write_atomically

from ._cache import file_word
from ._errors import AssetError
from ._records import CadModel
from ._watertight import RESOLUTION, ClosedSurface, close_surface

SHAPE_MARGIN = 1.2
"""Uniform samples fill the model's box, larger by this factor."""
NEAR_BAND = 0.04375
"""Near samples are within this of the surface, in units of the longest side."""
GRID_NODES = 32
"""Of the coarse grid along each axis, from -0.7 to 0.7."""
SAMPLES = 16_384
"""Near the surface, and again as many uniform ones."""
_GRID_REACH = 0.7
_LEAST = 1e-4
_CLOSE = 0.75
"""Voxels from the surface within which the field tells the distance."""
_BESIDE = 0.4
"""Voxels along the surface between a foot and the nearest vertex, about."""
_MESH_FACES = 10_000
_SHAPE_VERSION = 2


@dataclass(frozen=True, slots=True)
class ShapeSamples:
    """A closed surface and signed distances around it (supplement of the paper, shape data).

    The frame is the object frame over ``scale``: the longest side of the model is 1, the centre of
    its box the origin. Distances are in the same unit, negative inside.
    """

    vertices: Float32[np.ndarray, "vertices 3"]
    faces: Int32[np.ndarray, "faces 3"]
    extent: Float32[np.ndarray, "3"]
    """Of the box; the longest is 1."""
    near: Float16[np.ndarray, "near 4"]
    """Points within 0.04375 of the surface, and their signed distance."""
    uniform: Float16[np.ndarray, "uniform 4"]
    """Points in the box, enlarged by 1.2, and their signed distance."""
    grid: Float16[np.ndarray, "32 32 32"]
    """Signed distances at nodes from -0.7 to 0.7, x first."""
    scale: float
    """Metres per unit."""


def shape_file(identifier: str) -> str:
    """Return the name of a model's file of signed distances in a cache."""
    return f"shapes/{file_word(identifier)}.npz"


def sample_shape(
    model: CadModel,
    rng: np.random.Generator,
    samples: int = SAMPLES,
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
    extent = np.ptp(surface.vertices, axis=0)
    near = _near_points(surface, rng, samples)
    uniform = rng.uniform(-0.5, 0.5, (samples, 3)) * extent * SHAPE_MARGIN
    axis = np.linspace(-_GRID_REACH, _GRID_REACH, GRID_NODES)
    nodes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    points = np.concatenate([near, uniform]).astype(np.float16).astype(np.float64)
    distance = signed_distances(surface, np.concatenate([points, nodes]))
    signed = np.c_[points, distance[: 2 * samples]].astype(np.float16)
    vertices, faces = _lighter(surface)
    return ShapeSamples(
        vertices=vertices.astype(np.float32),
        faces=faces.astype(np.int32),
        extent=extent.astype(np.float32),
        near=signed[:samples],
        uniform=signed[samples:],
        grid=distance[2 * samples :].reshape((GRID_NODES,) * 3).astype(np.float16),
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
    return foot + direction * rng.uniform(0, NEAR_BAND, (samples, 1))


def signed_distances(
    surface: ClosedSurface, points: Float64[np.ndarray, "n 3"]
) -> Float64[np.ndarray, " n"]:
    """Return the distance of points to a closed surface, negative inside.

    Right to about a fifth of a voxel near the surface; further away than ten voxels, too large by
    1 percent at most.

    Args:
        surface: To measure from.
        points: In its frame.
    """
    tree = KDTree(surface.vertices, balanced_tree=False, compact_nodes=False)
    voxel = float(surface.step.mean())
    beside = np.square(np.asarray(tree.query(points, eps=0.01)[0])) - (_BESIDE * voxel) ** 2
    depth = surface.depth(points)
    close = np.where(np.abs(depth) < _CLOSE * voxel, np.abs(depth), _LEAST)
    return np.maximum(close, np.sqrt(beside.clip(min=0.0))) * np.where(depth < 0, -1, 1)


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
    """Return whether every edge is run along as often in one direction as in the other.

    So every part is closed; parts may touch along an edge.

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
