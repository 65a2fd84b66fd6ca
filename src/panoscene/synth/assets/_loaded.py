"""A model as its file has it: loose triangles with labelled parts, from OBJ or GLB."""

import io
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Float64
from PIL import Image
from trimesh.visual.material import PBRMaterial

from ._archives import ModelFiles, normalised_name
from ._errors import AssetError
from ._materials import MaterialTable, MtlEntry, material_of, parse_mtl, part_kind, read_texture
from ._obj import parse_obj
from ._records import Material
from ._soup import Triangles
from ._triangulate import triangulate


@dataclass(frozen=True, slots=True)
class LoadedModel:
    """Triangles in the axes and units of the file, and what their labels mean."""

    triangles: Triangles
    names: tuple[str, ...]
    """``part|material`` of every label."""
    materials: tuple[Material, ...]
    """Of every label."""


def load_model(
    files: ModelFiles, name: str, defaults: Mapping[str, MtlEntry] | None = None
) -> LoadedModel:
    """Return a model of an archive or folder; ``.obj`` and ``.glb`` are known.

    Args:
        files: Where it is.
        name: Of its file there.
        defaults: Materials that an OBJ file may use without defining them.

    Raises:
        AssetError: The file is missing, damaged or of another kind.
    """
    found = files.find(normalised_name(name))
    if found is None:
        raise AssetError(f"{files.name}!{name}", "no such file in the library")
    suffix = found.lower().rpartition(".")[2]
    if suffix == "obj":
        return _load_obj(files, found, defaults or {})
    if suffix == "glb":
        return _load_glb(files.read(found), f"{files.name}!{found}")
    raise AssetError(f"{files.name}!{found}", f"found a .{suffix} file, expected .obj or .glb")


def _load_obj(files: ModelFiles, name: str, defaults: Mapping[str, MtlEntry]) -> LoadedModel:
    polygons = parse_obj(files.read(name), f"{files.name}!{name}")
    folder = name.rpartition("/")[0]
    entries = dict(defaults) | _mtl_entries(files, folder, polygons.material_files)
    table = MaterialTable(files, folder, entries)
    corners, owner = triangulate(polygons.positions[polygons.corners[:, 0]], polygons.starts)
    place, texel, facet = np.moveaxis(polygons.corners[corners], -1, 0)
    triangles = Triangles(
        positions=polygons.positions[place],
        uv=_rows(polygons.uv, texel),
        normals=_rows(polygons.normals, facet),
        label=np.zeros(len(owner), np.int64),
    )
    pairs = np.stack([polygons.part[owner], polygons.material[owner]], axis=1)
    unique, label = np.unique(pairs, axis=0, return_inverse=True)
    names, materials = [], []
    for part, material in unique:
        part_name, material_name = polygons.part_names[part], polygons.material_names[material]
        kind = part_kind(part_name, material_name, table.entry(material_name))
        names.append(f"{part_name}|{material_name}")
        materials.append(table.material(material_name, kind))
    labelled = Triangles(triangles.positions, triangles.uv, triangles.normals, label.reshape(-1))
    shown = np.array([table.entry(text.rpartition("|")[2]).opacity > 0.005 for text in names])
    if shown[labelled.label].any():  # parts of no opacity at all are helpers of the author
        labelled = labelled.take(shown[labelled.label])
    return LoadedModel(labelled, tuple(names), tuple(materials))


def _rows(
    table: Float64[np.ndarray, "rows width"], index: np.ndarray
) -> Float64[np.ndarray, "n 3 width"]:
    """Return rows of a table; zeros for index -1."""
    padded = np.concatenate([table, np.zeros((1, table.shape[1]))])
    return padded[index]


def _mtl_entries(files: ModelFiles, folder: str, wanted: tuple[str, ...]) -> dict[str, MtlEntry]:
    """Return the materials of the MTL files, or of the only one in the folder when one is lost."""
    entries: dict[str, MtlEntry] = {}
    for name in wanted:
        last = name.replace("\\", "/").rpartition("/")[2]
        beside = [n for n in files.names() if n.rpartition("/")[0] == folder]
        lonely = [n for n in beside if n.lower().endswith(".mtl")]
        found = files.find(normalised_name(f"{folder}/{name}"))
        found = found or files.find(f"{folder}/{last}".lstrip("/"))
        found = found or (lonely[0] if len(lonely) == 1 else None)
        if found is not None:
            entries |= parse_mtl(files.read(found).decode("utf-8", "replace"))
    return entries


def _load_glb(content: bytes, name: str) -> LoadedModel:
    try:
        scene = trimesh.load(io.BytesIO(content), file_type="glb", force="scene")
    except (ValueError, KeyError, IndexError, TypeError, NotImplementedError) as error:
        raise AssetError(name, f"expected a binary glTF 2 file: {error}") from error
    if not isinstance(scene, trimesh.Scene):
        raise AssetError(name, "expected a scene in the glTF file")
    pieces: list[Triangles] = []
    names: list[str] = []
    materials: list[Material] = []
    for node in scene.graph.nodes_geometry:
        transform, key = scene.graph[node]
        mesh = scene.geometry[key]
        if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
            continue
        material, uv = _glb_material(mesh)
        normals = np.asarray(mesh.vertex_normals) @ np.linalg.inv(transform[:3, :3])
        positions = np.asarray(mesh.vertices) @ transform[:3, :3].T + transform[:3, 3]
        if not all(np.isfinite(numbers).all() for numbers in (positions, uv)):
            raise AssetError(name, f"found numbers that are not finite in {node}")
        faces = np.asarray(mesh.faces)
        label = np.full(len(faces), len(names))
        pieces.append(Triangles(positions[faces], uv[faces], normals[faces], label))
        names.append(f"{node}|{material.name}")
        materials.append(material)
    if not pieces:
        raise AssetError(name, "found no triangles in the glTF file")
    return LoadedModel(_joined(pieces), tuple(names), tuple(materials))


def _joined(pieces: list[Triangles]) -> Triangles:
    return Triangles(
        np.concatenate([piece.positions for piece in pieces]),
        np.concatenate([piece.uv for piece in pieces]),
        np.concatenate([piece.normals for piece in pieces]),
        np.concatenate([piece.label for piece in pieces]),
    )


def _glb_material(mesh: trimesh.Trimesh) -> tuple[Material, Float64[np.ndarray, "vertices 2"]]:
    """Return the material of a glTF mesh, and its texture coordinates (zeros when it has none)."""
    none = np.zeros((len(mesh.vertices), 2))
    pbr = getattr(mesh.visual, "material", None)
    if not isinstance(pbr, PBRMaterial):
        return material_of("default", MtlEntry(), "opaque", None), none
    uv = getattr(mesh.visual, "uv", None)
    factor = [1.0, 1.0, 1.0, 1.0]
    if pbr.baseColorFactor is not None:
        factor = (np.asarray(pbr.baseColorFactor, np.float64) / 255).tolist()
    texture = None
    if uv is not None and isinstance(pbr.baseColorTexture, Image.Image):
        stream = io.BytesIO()
        pbr.baseColorTexture.convert("RGBA").save(stream, "PNG")
        texture = read_texture(stream.getvalue())
    linear = np.clip(np.array(factor[:3]), 0, 1)
    red, green, blue = (linear ** (1 / 2.2)).tolist()
    clear = pbr.alphaMode == "BLEND" and factor[3] < 0.95
    rough = 0.7 if pbr.roughnessFactor is None else float(pbr.roughnessFactor)
    material = Material(
        name=str(pbr.name or "default"),
        colour=(red, green, blue),
        roughness=min(max(rough, 0.02), 1.0),
        metallic=0.0 if pbr.metallicFactor is None else float(pbr.metallicFactor),
        opacity=float(factor[3]) if clear else 1.0,
        kind="glass" if clear else "opaque",
        texture=texture,
    )
    return material, none if uv is None else np.asarray(uv, np.float64)
