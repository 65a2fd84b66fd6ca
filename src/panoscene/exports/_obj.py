"""Scenes as Wavefront OBJ, with the colours in an MTL beside it."""

import os
from pathlib import Path

from panoscene.exports._axes import gltf_from_world
from panoscene.exports._colours import surface_colour
from panoscene.scene import Scene, scene_surfaces, scene_to_json, write_atomically


def write_obj(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Write a scene as an OBJ file, and its colours as an MTL file of the same name beside it.

    Every object and every wall, floor and ceiling is an object and a group of its own; blanks in
    names become underlines. Both files appear complete or not at all.

    Args:
        scene: what to write.
        path: of the OBJ file, ending in ``.obj``.

    Convention:
        - metres; +y up, as in GLB: the world's (x, y, z) is the file's (x, z, -y)
        - faces of the room point inwards

    Raises:
        SceneFormatError: the scene cannot be written, for example because of a NaN.
        ValueError: the path does not end in ``.obj``.
    """
    path = Path(path)
    if path.suffix.lower() != ".obj":
        raise ValueError(f"path: found {path.name!r}, expected a name that ends in .obj")
    scene_to_json(scene, file=os.fspath(path))  # refuses what is not finite
    materials: dict[str, str] = {}
    lines = ["# panoscene: metres, +y up", f"mtllib {path.with_suffix('.mtl').name}"]
    taken: set[str] = set()
    first = 1
    for surface in scene_surfaces(scene):
        material, colour = surface_colour(scene, surface.kind, surface.index)
        material = material.replace(" ", "_")
        materials[material] = colour
        name = _unique("_".join(surface.name.split()), taken)
        lines += [f"o {name}", f"g {name}", f"usemtl {material}"]
        vertices = gltf_from_world(surface.vertices.double().numpy(force=True)) + 0.0
        lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in vertices.tolist()]
        faces = (surface.faces + first).tolist()
        lines += [f"f {a} {b} {c}" for a, b, c in faces]
        first += len(vertices)
    write_atomically(path.with_suffix(".mtl"), _mtl(materials))
    write_atomically(path, "\n".join(lines) + "\n")


def _mtl(materials: dict[str, str]) -> str:
    lines = ["# panoscene"]
    for name, colour in materials.items():
        red, green, blue = (level / 255 for level in bytes.fromhex(colour[1:]))
        lines += ["", f"newmtl {name}", f"Kd {red:.4f} {green:.4f} {blue:.4f}"]
        lines += ["Ka 0 0 0", "Ks 0 0 0", "illum 1"]
    return "\n".join(lines) + "\n"


def _unique(name: str, taken: set[str]) -> str:
    number = 2
    candidate = name
    while candidate in taken:
        candidate, number = f"{name}-{number}", number + 1
    taken.add(candidate)
    return candidate
