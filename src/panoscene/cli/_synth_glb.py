"""The scene of a panorama as a GLB file, small enough to come with every panorama."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
import trimesh

from panoscene.exports import write_glb
from panoscene.scene import Mesh, Scene

GLB = "scene.glb"
MAX_FACES = 4_000
"""Of one object; the exact mesh is that of its model, placed as labels.json says."""
_DIGITS = 4
"""Of a vertex where the longest side of the box is 1; equal vertices become one."""
_LOOSE = 0.7
"""Vertices per triangle; closed surfaces have half as many, loose leaves more: they resist edge
collapses and are simplified by rounding."""
_CELLS = (96, 64, 48, 32, 24, 16)
"""Along the longest side."""


def write_scene_glb(scene: Scene, folder: Path) -> None:
    """Write a scene with its meshes into the folder of a panorama.

    Objects have the colours of their groups. Vertices that only normals or textures kept apart
    are joined, and objects with more than 4,000 triangles simplified: together a quarter of the
    bytes, without a difference that can be seen at the size of a room.
    """
    meshes = tuple(
        None if mesh is None else lightened(mesh, scene.objects.boxes.size[k])
        for k, mesh in enumerate(scene.objects.shapes.mesh or ())
    )
    photo = next((path.name for path in sorted(folder.glob("rgb.*"))), None)
    shapes = replace(scene.objects.shapes, mesh=meshes)
    write_glb(
        replace(
            scene,
            objects=replace(scene.objects, shapes=shapes),
            panorama=replace(scene.panorama, file=photo),
        ),
        folder / GLB,
    )


def lightened(mesh: Mesh, size: torch.Tensor) -> Mesh:
    """Return a mesh in canonical space with its vertices joined and at most 4,000 triangles."""
    stretch = (size / size.max()).double().numpy(force=True)
    vertices = mesh.vertices.double().numpy(force=True) * stretch
    found = trimesh.Trimesh(vertices, mesh.faces.numpy(force=True), process=False)
    found.merge_vertices(merge_tex=True, merge_norm=True, digits_vertex=_DIGITS)
    found.update_faces(found.nondegenerate_faces())
    if len(found.faces) > MAX_FACES and len(found.vertices) < _LOOSE * len(found.faces):
        found = found.simplify_quadric_decimation(face_count=MAX_FACES)
    for cells in _CELLS:
        if len(found.faces) <= MAX_FACES:
            break
        found = _clustered(found, cells)
    if len(found.faces) == 0:
        return mesh
    found.remove_unreferenced_vertices()
    points = torch.tensor(found.vertices / stretch, dtype=mesh.vertices.dtype)
    return Mesh(points.clamp(-0.5, 0.5), torch.tensor(found.faces, dtype=torch.int64))


def _clustered(mesh: trimesh.Trimesh, cells: int) -> trimesh.Trimesh:
    """Return a mesh whose vertices in one cell of a grid are one, at their mean."""
    corners = np.round(np.asarray(mesh.vertices) * cells).astype(np.int64)
    _, cell = np.unique(corners, axis=0, return_inverse=True)
    cell = cell.reshape(-1)
    count = np.bincount(cell)
    sums = [np.bincount(cell, np.asarray(mesh.vertices)[:, axis]) for axis in range(3)]
    faces = np.unique(np.sort(cell[mesh.faces], axis=1), axis=0, return_index=True)[1]
    kept = cell[mesh.faces][np.sort(faces)]
    a, b, c = kept.T
    whole = (a != b) & (b != c) & (c != a)
    return trimesh.Trimesh(np.stack(sums, axis=1) / count[:, None], kept[whole], process=False)
