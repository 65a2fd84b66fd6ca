"""From the file of a library to a furniture model in the object frame."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import trimesh
from jaxtyping import Float64
from scipy.spatial import KDTree, QhullError

from ._archives import ModelFiles
from ._catalogue import light_sources
from ._decimate import MAX_FACES, decimated
from ._errors import AssetError
from ._loaded import LoadedModel, load_model
from ._materials import MtlEntry, glows
from ._records import CadModel, LightSource, Material
from ._soup import IndexedMesh, Triangles, cleaned, indexed, oriented
from ._specs import ModelSpec

_OBJECT_FROM_FILE = {
    "y": np.array([[-1.0, 0, 0], [0, 0, 1], [0, 1, 0]]),
    "z": np.array([[-1.0, 0, 0], [0, -1, 0], [0, 0, 1]]),
}
"""Files look at the viewer with their right on his right; +x is the model's own right."""
_BAD_GEOMETRY = (ValueError, ArithmeticError, LookupError, QhullError)
"""What numpy, scipy and trimesh say of geometry that is none."""
_NEAR_LAMP = 0.2
_NO_FRONT = frozenset({"plant", "carpet", "cushion", "basket"})
_MAY_BE_ROUND = frozenset(
    {"table", "coffee_table", "stool", "trash_can", "table_lamp", "floor_lamp", "bathtub", "chest"}
)


def convert_models(
    specs: Sequence[ModelSpec],
    files: ModelFiles,
    catalogue: Mapping[str, Mapping[str, str]],
    defaults: Mapping[str, MtlEntry],
    max_faces: int = MAX_FACES,
) -> list[CadModel | AssetError]:
    """Return the models made from one file of a library, or what is wrong with them.

    Args:
        specs: Of one file: the model itself first, then those cut from it.
        files: The library.
        catalogue: What it says of its models, by catalogue id.
        defaults: Materials its OBJ files use without defining them.
        max_faces: Models with more triangles are simplified.
    """
    base = specs[0]
    try:
        loaded = load_model(files, base.file, defaults)
        loaded = replace(loaded, triangles=_canonical(loaded.triangles, base))
    except _BAD_GEOMETRY as error:
        return [_refused(spec, error) for spec in specs]
    models: list[CadModel | AssetError] = []
    for spec in specs:
        try:
            entry = catalogue.get(spec.catalogue_id, {})
            models.append(_finished(spec, loaded, dict(entry), max_faces))
        except _BAD_GEOMETRY as error:
            models.append(_refused(spec, error))
    return models


def _refused(spec: ModelSpec, error: Exception) -> AssetError:
    """Return why a model is left out; one that nobody foresaw does not stop the others."""
    known = isinstance(error, AssetError)
    return AssetError(spec.id, str(error) if known else f"cannot be converted: {error}")


def _canonical(triangles: Triangles, spec: ModelSpec) -> Triangles:
    """Return the triangles in the object frame, scaled to the size that the table gives."""
    turn = _OBJECT_FROM_FILE[spec.up]
    if spec.rotation is not None:
        turn = turn @ np.array(spec.rotation).reshape(3, 3)
    if spec.front_yaw_deg:
        cos, sin = np.cos(np.deg2rad(spec.front_yaw_deg)), np.sin(np.deg2rad(spec.front_yaw_deg))
        turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]) @ turn
    return _fitted(_transformed(triangles, turn), spec.size)


def _transformed(triangles: Triangles, matrix: Float64[np.ndarray, "3 3"]) -> Triangles:
    """Return triangles with a linear map applied; a mirroring one also turns the winding."""
    positions = triangles.positions @ matrix.T
    determinant = np.linalg.det(matrix)
    if abs(determinant) < 1e-30:
        raise AssetError("model", "its rotation or size flattens it")
    normals = triangles.normals @ np.linalg.inv(matrix) * np.sign(determinant)
    uv = triangles.uv
    if determinant < 0:
        positions, normals, uv = (values[:, [0, 2, 1]] for values in (positions, normals, uv))
        normals = -normals
    return Triangles(positions, uv, normals, triangles.label)


def _fitted(triangles: Triangles, size: tuple[float, float, float] | None) -> Triangles:
    """Return triangles centred on their bounding box and stretched to ``size``."""
    corners = triangles.positions.reshape(-1, 3)
    if not len(corners) or not np.ptp(corners, axis=0).any():
        raise AssetError("model", "no triangle with an area is left")
    low, high = corners.min(axis=0), corners.max(axis=0)
    extent = high - low
    scale = np.ones(3)
    if size is not None:
        flat = extent < 1e-9 * extent.max()
        scale = np.where(flat, 1.0, np.array(size) / np.where(flat, 1.0, extent))
    moved = replace(triangles, positions=triangles.positions - (low + high) / 2)
    return _transformed(moved, np.diag(scale))


def _finished(
    spec: ModelSpec, loaded: LoadedModel, entry: dict[str, str], max_faces: int
) -> CadModel:
    triangles = loaded.triangles
    if spec.cut is not None:
        triangles = _cut(spec, loaded)
    whole = spec.cut is None or not (spec.cut.keep or spec.cut.drop)
    size = np.ptp(triangles.positions.reshape(-1, 3), axis=0)
    lights = light_sources(entry, (size[0], size[1], size[2])) if whole and entry else ()
    materials = _with_lights(loaded, triangles, lights)
    textured = np.array([material.texture is not None for material in materials])
    triangles = decimated(cleaned(triangles, prefer=textured), max_faces)
    triangles = _fitted(triangles, spec.size if whole else None)
    mesh = indexed(oriented(triangles))
    if not len(mesh.faces):
        raise AssetError(spec.id, "no triangle with an area is left")
    used, material = _merged(materials, triangles)
    extent = np.ptp(mesh.vertices, axis=0).astype(float)
    return CadModel(
        id=spec.id,
        base=spec.base,
        category=spec.category,
        vertices=mesh.vertices,
        normals=mesh.normals,
        uv=mesh.uv,
        faces=mesh.faces,
        face_material=material,
        materials=used,
        size=(extent[0], extent[1], extent[2]),
        placement=spec.placement,
        elevation=spec.elevation,
        support_height=spec.support_height,
        lights=lights,
        has_front=not (
            spec.category in _NO_FRONT
            or (spec.category in _MAY_BE_ROUND and looks_alike_turned(mesh))
        ),
        licence=spec.licence,
        creator=spec.creator,
        source=f"{spec.library}: {spec.name}" if spec.name else spec.library,
    )


def _cut(spec: ModelSpec, loaded: LoadedModel) -> Triangles:
    """Return the part of a model that a table row asks for."""
    cut = spec.cut
    if cut is None:
        return loaded.triangles
    keep = [not cut.keep or re.search(cut.keep, name) is not None for name in loaded.names]
    drop = [bool(cut.drop) and re.search(cut.drop, name) is not None for name in loaded.names]
    chosen = np.array(keep) & ~np.array(drop)
    triangles = loaded.triangles.take(chosen[loaded.triangles.label])
    if not len(triangles.label):
        raise AssetError(spec.id, "no part of the model has the names that the table wants")
    if cut.flat:
        points = triangles.positions.reshape(-1, 3)
        to_origin, _ = trimesh.bounds.oriented_bounds(points, angle_digits=1)
        thin, middle, long = to_origin[:3, :3]
        up = thin if thin[2] >= 0 else -thin
        right = long if np.linalg.det([long, middle, up]) > 0 else -long
        triangles = _transformed(triangles, np.stack([right, middle, up]))
    return _fitted(triangles, spec.size if cut.stretch else None)


def _with_lights(
    loaded: LoadedModel, triangles: Triangles, lights: tuple[LightSource, ...]
) -> tuple[Material, ...]:
    """Return the materials with the parts that shine marked: by name, else pale ones at a lamp."""
    if not lights:
        return loaded.materials
    present = np.unique(triangles.label)
    glowing = [k for k in present if glows(*loaded.names[k].rsplit("|", 1))]
    if not glowing:
        lamps = KDTree(np.array([light.position for light in lights]))
        near = lamps.query(triangles.positions.mean(axis=1))[0] < _NEAR_LAMP
        close = [near[triangles.label == k].mean() > 0.7 for k in present]
        pale = [sum(loaded.materials[k].colour) > 1.5 for k in present]
        glowing = [k for k, one, two in zip(present, close, pale, strict=True) if one and two]
    materials = list(loaded.materials)
    for k in glowing:
        materials[k] = replace(materials[k], kind="light", emission=1.0, opacity=1.0)
    return tuple(materials)


def _merged(
    materials: tuple[Material, ...], triangles: Triangles
) -> tuple[tuple[Material, ...], np.ndarray]:
    """Return the materials in use, one for each name and look, and the one of each face."""
    number: dict[tuple[object, ...], int] = {}
    used: list[Material] = []
    lookup = np.zeros(len(materials), np.int16)
    for label in np.unique(triangles.label):
        material = materials[label]
        # GLB files may have many materials without a name
        plain = (material.colour, material.roughness, material.metallic, material.opacity)
        key = (material.name, material.kind, id(material.texture), *plain)
        if key not in number:
            number[key] = len(used)
            used.append(material)
        lookup[label] = number[key]
    return tuple(used), lookup[triangles.label]


def looks_alike_turned(mesh: IndexedMesh, tolerance: float = 0.012) -> bool:
    """Return whether a quarter turn about the vertical leaves the surface in place.

    Args:
        mesh: In the object frame.
        tolerance: Mean distance allowed between the two, as a share of the width.
    """
    width, depth = np.ptp(mesh.vertices[:, :2], axis=0)
    if abs(width - depth) > 0.04 * max(width, depth):
        return False
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    rng = np.random.default_rng(0)
    face = rng.choice(len(area), 6000, p=area / area.sum())
    weights = rng.dirichlet((1, 1, 1), 6000)
    points = np.einsum("nk,nkx->nx", weights, corners[face])
    turned = points[:1000] @ np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    here, there = (KDTree(points[1000:]).query(p)[0].mean() for p in (points[:1000], turned))
    return bool(there - here < tolerance * max(width, depth))
