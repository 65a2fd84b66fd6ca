"""GLB files of ours back to scenes, with what was changed in an editor."""

import os
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from jaxtyping import Float, Int64
from torch import Tensor

from panoscene.exports._axes import world_from_gltf
from panoscene.exports._glb_container import parsed_json, read_container
from panoscene.exports._gltf_meshes import MAX_TRIANGLES, mesh_triangles
from panoscene.exports._gltf_nodes import box_placement, placed_nodes
from panoscene.exports._gltf_schema import GltfFile, gltf_file
from panoscene.geometry import OrientedBoxes, wrap_angle
from panoscene.scene import (
    Mesh,
    Scene,
    object_names,
    scene_from_json,
    scene_to_json,
    select,
)

UNMOVED = 1e-5
"""Metres, radians and shares; changes of less come from rounding in the editor."""
MAX_OBJECTS = 10_000
"""As many as scene.json may have."""


@dataclass(frozen=True, slots=True)
class _Placed:
    """One object as it stands in the file."""

    source: int
    """Index in the carried scene."""
    centre: list[float]
    """World x, y, z in metres."""
    scale: list[float]
    """Of width, depth and height; ones when it was not scaled."""
    yaw: float
    mesh: Mesh | None
    """Its shape in canonical space."""


def read_glb(path: str | os.PathLike[str], *, dtype: torch.dtype = torch.float32) -> Scene:
    """Return the scene in a GLB file that ``write_glb`` wrote, with the changes of an editor.

    The scene is the one in the file's extras. Objects follow their nodes, which are found by the
    ``name`` in their extras, else by their own name, wherever they hang and whatever was
    renamed: one that was moved, turned about the vertical or scaled gets the new box; one that
    is gone is left out, with its relations; a copy becomes another object. Shapes come from the
    buffers. Room, relations, scores and views of the panorama stay as they were written.

    Args:
        path: the file.
        dtype: float type of all tensors.

    Convention:
        - unchanged boxes and all else but shapes come back bit for bit; vertices of shapes to
          within one rounding of float32
        - scale is read from nodes; scale that was applied to vertices changes the shape in its box

    Raises:
        SceneFormatError: the file cannot be read, is damaged, is not of ours, names other files,
            or has an object that is tilted, skewed or mirrored.
    """
    file = os.fspath(path)
    container = read_container(path)
    source = gltf_file(container.document, container.binary, file)
    scene = _carried(source, dtype)
    placed = _placed_objects(source, scene)
    kept = [one.source for one in placed]
    if kept != list(range(len(scene.objects.boxes))):
        scene = _selected(scene, kept)
    meshes = tuple(one.mesh for one in placed)
    shapes = replace(
        scene.objects.shapes, mesh=meshes if any(mesh is not None for mesh in meshes) else ()
    )
    boxes = _boxes_as_placed(scene.objects.boxes, placed)
    if boxes is not scene.objects.boxes:
        scene = replace(scene, objects=replace(scene.objects, boxes=boxes))
        scene_to_json(scene, file=file)  # refuses places and sizes that no scene can have
    return replace(scene, objects=replace(scene.objects, shapes=shapes))


def _carried(source: GltfFile, dtype: torch.dtype) -> Scene:
    """Return the scene in the extras, as it was when the file was written, without meshes."""
    gltf, file = source.gltf, source.file
    extras = source.item(gltf.scenes, gltf.scene, "$.scene").extras
    field = f"$.scenes[{gltf.scene}].extras.panoscene"
    document: object = extras.get("panoscene") if isinstance(extras, dict) else None
    if document is None:
        expected = "a scene: only files that write_glb wrote, with their extras, can be read"
        raise source.refusal(field, "nothing", expected)
    if isinstance(document, str):
        document = parsed_json(document, file, field)
    return scene_from_json(document, file=f"{file}, scene in its extras", dtype=dtype)


def _placed_objects(source: GltfFile, scene: Scene) -> list[_Placed]:
    """Return the objects that have nodes, in the order of the scene."""
    index = {name: k for k, name in enumerate(object_names(scene.objects))}
    placed: list[_Placed] = []
    meshes: dict[tuple[int, int], Mesh] = {}
    for k, node, matrix in placed_nodes(source):
        extras: dict[str, Any] = node.extras if isinstance(node.extras, dict) else {}
        written = extras.get("name", node.name)
        name = written if isinstance(written, str) and written in index else node.name
        if name not in index:
            continue
        mesh, shape = None, extras.get("shape")
        if node.mesh is not None and shape != "box":
            drawn = (node.mesh, index[name])
            if drawn not in meshes:
                triangles = mesh_triangles(source, node.mesh, f"$.nodes[{k}].mesh")
                meshes[drawn] = _canonical(*triangles, scene.objects.boxes.size[index[name]])
            mesh = meshes[drawn] if shape == "mesh" or not _is_box(meshes[drawn]) else None
            if sum(len(one.faces) for one in meshes.values()) > MAX_TRIANGLES:
                raise source.refusal("$.meshes", "more triangles", f"at most {MAX_TRIANGLES}")
        placement = box_placement(source, matrix, f"$.nodes[{k}]")
        placed.append(_Placed(index[name], *placement, mesh))
        if len(placed) > MAX_OBJECTS:
            raise source.refusal("$.nodes", "more objects", f"at most {MAX_OBJECTS}")
    return sorted(placed, key=lambda one: one.source)


def _canonical(
    vertices: Float[np.ndarray, "vertices 3"],
    faces: Int64[np.ndarray, "faces 3"],
    size: Float[Tensor, "3"],
) -> Mesh:
    """Return a shape in canonical space."""
    canonical = torch.from_numpy(world_from_gltf(vertices)) / size.double()
    return Mesh((canonical + 0.0).to(size.dtype), torch.from_numpy(faces))


def _is_box(mesh: Mesh) -> bool:
    """Return whether a mesh that does not say what it is stands for a shape not known."""
    return bool(((mesh.vertices.abs() - 0.5).abs() < 1e-4).all())


def _boxes_as_placed(boxes: OrientedBoxes, placed: list[_Placed]) -> OrientedBoxes:
    """Return the boxes where their nodes stand; numbers that did not change stay bit for bit."""
    if not placed:
        return boxes
    table = torch.tensor(
        [[*one.centre, *one.scale, one.yaw] for one in placed], dtype=torch.float64
    )
    centre, scale, yaw = table[:, :3], table[:, 3:6], table[:, 6]
    moved = (centre - boxes.centre).abs() > UNMOVED
    scaled = (scale - 1).abs() > UNMOVED
    turned = wrap_angle(yaw - boxes.yaw).abs() > UNMOVED
    if not bool(moved.any() | scaled.any() | turned.any()):
        return boxes
    dtype = boxes.centre.dtype
    return OrientedBoxes(
        torch.where(moved, centre.to(dtype), boxes.centre),
        torch.where(scaled, (boxes.size * scale).to(dtype), boxes.size),
        torch.where(turned, wrap_angle(yaw).to(dtype), boxes.yaw),
    )


def _selected(scene: Scene, kept: list[int]) -> Scene:
    """Return the scene with some of its objects, some perhaps more than once."""
    chosen = select(scene, torch.tensor(kept, dtype=torch.int64))
    # shapes come from the buffers
    shapes = replace(chosen.objects.shapes, mesh=())
    names = _names(object_names(scene.objects), kept)
    return replace(chosen, objects=replace(chosen.objects, id=names, shapes=shapes))


def _names(names: tuple[str, ...], kept: list[int]) -> tuple[str, ...]:
    """Return the names of the objects; those of copies end in -2, -3, ..."""
    taken = set(names)
    given: list[str] = []
    for k, index in enumerate(kept):
        name = names[index]
        if index in kept[:k]:
            number = next(n for n in range(2, len(kept) + 3) if f"{name}-{n}" not in taken)
            name = f"{name}-{number}"
            taken.add(name)
        given.append(name)
    return tuple(given)
