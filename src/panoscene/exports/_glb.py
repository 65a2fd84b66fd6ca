"""Scenes as GLB files, for viewers, game engines and Blender."""

import json
import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

from jaxtyping import Float
from torch import Tensor

from panoscene.exports._axes import gltf_from_world
from panoscene.exports._colours import surface_colour
from panoscene.exports._glb_container import pack_glb
from panoscene.exports._gltf_builder import GltfBuilder
from panoscene.exports._room_textures import halvings, jpeg, reproject, texture_plane
from panoscene.exports._smooth_normals import smooth_normals
from panoscene.scene import (
    CATEGORIES,
    Scene,
    Surface,
    object_mesh,
    object_names,
    relation_triples,
    room_surfaces,
    scene_to_json,
    write_atomically,
)


def write_glb(
    scene: Scene,
    path: str | os.PathLike[str],
    *,
    image: Float[Tensor, "3 height width"] | None = None,
    texture_px_per_metre: float = 128.0,
) -> None:
    """Write a scene as a binary glTF 2.0 file, which ``read_glb`` reads back.

    Two nodes hold everything: ``room`` with ``floor``, ``ceiling`` and the walls, ``objects``
    with one node for each object, placed by its translation and rotation. The extras of a node
    tell what it is: of objects ``name``, ``category``, ``score``, ``size``, ``relations``; of
    walls their length and height. The extras of the scene carry scene.json under ``panoscene``,
    as text, which Blender hands through where it would drop nested lists.

    Args:
        scene: what to write.
        path: the file; it appears complete or not at all.
        image: the upright panorama, RGB in [0, 1]. The room is painted with it as its camera saw
            it, furniture and all; without it, the room is plain.
        texture_px_per_metre: how fine the room is painted; sides of pictures are rounded to
            powers of two, of at most 1024.

    Convention:
        - metres; +y up: the world's (x, y, z) is the file's (x, z, -y)
        - the vertices of an object are in metres around its box's centre, in the box's axes
        - faces of the room point inwards, so that viewers show it like a doll's house
        - what other walls hide from the camera gets the mean colour of its wall

    Raises:
        SceneFormatError: the scene cannot be written, for example because of a NaN.
        ValueError: the image is empty or not finite, or ``texture_px_per_metre`` not above 0.
    """
    _check(image, texture_px_per_metre)
    bare = replace(scene.objects, shapes=replace(scene.objects.shapes, mesh=()))
    document = scene_to_json(replace(scene, objects=bare), file=os.fspath(path))
    builder = GltfBuilder()
    groups = {
        "room": _room_nodes(builder, scene, image, texture_px_per_metre),
        "objects": _object_nodes(builder, scene),
    }
    top = [
        builder.add("nodes", {"name": name, "children": children})
        for name, children in groups.items()
        if children
    ]
    carried = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    whole: dict[str, Any] = {"nodes": top, "extras": {"panoscene": carried}}
    if scene.name:
        whole["name"] = scene.name
    builder.document["scene"] = builder.add("scenes", whole)
    write_atomically(Path(path), pack_glb(*builder.finish()))


def _placement(
    centre: Float[Tensor, "3"], yaw: Float[Tensor, ""]
) -> tuple[list[float], list[float]]:
    """Return translation and rotation (a quaternion x, y, z, w) of an object's node."""
    half = float(yaw) / 2
    place = gltf_from_world(centre.double().numpy(force=True))
    return (place + 0.0).tolist(), [0.0, math.sin(half), 0.0, math.cos(half)]


def _check(image: Float[Tensor, "3 height width"] | None, texture_px_per_metre: float) -> None:
    if not 0 < texture_px_per_metre < math.inf:
        raise ValueError(f"texture_px_per_metre: found {texture_px_per_metre}, expected above 0")
    if image is not None and image.numel() == 0:
        raise ValueError(f"image: found {tuple(image.shape)}, expected at least one pixel")
    if image is not None and not math.isfinite(float(image.sum())):
        raise ValueError("image: found values that are not finite, expected numbers in [0, 1]")


def _room_nodes(
    builder: GltfBuilder,
    scene: Scene,
    image: Float[Tensor, "3 height width"] | None,
    texture_px_per_metre: float,
) -> list[int]:
    nodes: list[int] = []
    levels = None if image is None else halvings(image)
    for surface in room_surfaces(scene.layout):
        plane = texture_plane(surface, scene.layout)
        texture_uv = None
        if levels is None:
            material = builder.add_colour(*surface_colour(scene, surface.kind, surface.index))
        else:
            picture = reproject(levels, plane, scene, texture_px_per_metre)
            material = builder.add_picture(surface.name, jpeg(picture))
            texture_uv = plane.texture_uv(surface.vertices).numpy(force=True)
        vertices = gltf_from_world(surface.vertices.double().numpy(force=True))
        mesh = builder.add_mesh(
            surface.name,
            vertices,
            surface.faces.numpy(force=True),
            material,
            texture_uv=texture_uv,
        )
        extras = {"name": surface.name, "kind": surface.kind}
        node = {"name": surface.name, "mesh": mesh, "extras": extras | _wall_size(surface, scene)}
        nodes.append(builder.add("nodes", node))
    return nodes


def _wall_size(surface: Surface, scene: Scene) -> dict[str, float]:
    if surface.kind != "wall":
        return {}
    length = float((surface.vertices[1] - surface.vertices[0]).norm())
    height = scene.layout.ceiling_height - scene.layout.floor_height
    return {"length": round(length, 4), "height": round(height, 4)}


def _object_nodes(builder: GltfBuilder, scene: Scene) -> list[int]:
    objects = scene.objects
    relations = _relations(scene)
    given = objects.shapes.mesh or (None,) * len(objects.boxes)
    nodes: list[int] = []
    for k, name in enumerate(object_names(objects)):
        category = CATEGORIES[int(objects.category[k])]
        mesh = object_mesh(objects, k)
        own = given[k]
        is_mesh = own is not None and len(own.faces) > 0
        size = objects.boxes.size[k].double()
        vertices = gltf_from_world((mesh.vertices.double() * size).numpy(force=True))
        faces = mesh.faces.numpy(force=True)
        drawn = builder.add_mesh(
            name,
            vertices,
            faces,
            builder.add_colour(*surface_colour(scene, "object", k)),
            normals=smooth_normals(vertices, faces) if is_mesh else None,
        )
        translation, rotation = _placement(objects.boxes.centre[k], objects.boxes.yaw[k])
        extras = {
            "name": name,
            "kind": "object",
            "category": category,
            "score": round(float(objects.score[k]), 6),
            "size": [round(side, 6) for side in size.tolist()],
            "shape": "mesh" if is_mesh else "box",
            "relations": relations.get(name, []),
        }
        node = {"name": name, "mesh": drawn, "translation": translation, "rotation": rotation}
        nodes.append(builder.add("nodes", node | {"extras": extras}))
    return nodes


def _relations(scene: Scene) -> dict[str, list[dict[str, Any]]]:
    """Return what is known about each object, from its own side; symmetric relations twice."""
    found: dict[str, list[dict[str, Any]]] = {name: [] for name in object_names(scene.objects)}
    for triple in relation_triples(scene) if scene.relations is not None else []:
        edge: dict[str, Any] = {
            "predicate": triple.predicate,
            "object": triple.object,
            "score": round(triple.score, 4),
        }
        angle = triple.angle
        if angle is not None:
            edge["angle"] = round(angle, 4)
        found[triple.subject].append(edge)
        if triple.object in found and triple.predicate in {"touching", "relative_yaw"}:
            edge = edge | {"object": triple.subject}
            if angle is not None and angle > -math.pi + 1e-6:  # half a turn is the same both ways
                edge["angle"] = round(-angle, 4)
            found[triple.object].append(edge)
    return found
