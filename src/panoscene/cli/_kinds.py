"""What a file holds, told from its name."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from panoscene.cli._errors import InputError
from panoscene.cli._files import write_scene_from, write_text, writing
from panoscene.cli._terminal import json_text
from panoscene.scene import Scene, relation_graph, write_box_table, write_graphml

Kind = Literal[
    "table",
    "scene",
    "graph JSON",
    "GraphML",
    "GLB",
    "OBJ",
    "SVG",
    "DXF",
    "page",
    "picture",
    "folder",
    "file of another kind",
]

PICTURES = {
    ".png": "PNG",
    ".jpg": "JPEG",
    ".jpeg": "JPEG",
    ".webp": "WEBP",
    ".tif": "TIFF",
    ".tiff": "TIFF",
    ".bmp": "BMP",
}
"""Pillow's names of the picture formats that are read and written."""
ENDINGS: dict[Kind, str] = {
    "scene": ".json",
    "table": ".csv",
    "graph JSON": ".relations.json",
    "GraphML": ".graphml",
    "GLB": ".glb",
    "OBJ": ".obj",
    "SVG": ".svg",
    "DXF": ".dxf",
    "page": ".html",
    "picture": " ".join(PICTURES),
    "folder": "a name without an ending",
}
GRAPH_NAMES = ("relations.json", "graph.json")
"""A .json file whose name ends like this holds a relation graph; any other one a scene."""


def kind_of(path: Path) -> Kind:
    """Return what a file of this name holds."""
    name = path.name.lower()
    suffix = path.suffix.lower()
    if name.endswith(GRAPH_NAMES):
        return "graph JSON"
    if suffix in PICTURES:
        return "picture"
    if path.is_dir() or not suffix:
        return "folder"
    known: dict[str, Kind] = {
        ending: kind for kind, ending in ENDINGS.items() if ending.count(".") == 1
    }
    return known.get(suffix, "file of another kind")


def check_kind(output: Path, allowed: Sequence[Kind]) -> Kind:
    """Return what an output holds by its name.

    Raises:
        InputError: Something that this command does not write.
    """
    kind = kind_of(output)
    if kind not in allowed:
        expected = ", ".join(f"{ENDINGS[name]} ({name})" for name in allowed)
        raise InputError(f"--output {output}: found the name of a {kind}, expected {expected}")
    return kind


def write_as(kind: Kind, scene: Scene, output: Path, source: Path, threshold: float = 0.5) -> str:
    """Write a scene, its boxes or its relations, and say what was written.

    Args:
        kind: what to write.
        scene: from where.
        output: file to write.
        source: file that the scene comes from.
        threshold: least probability of the relations in a graph.

    Raises:
        InputError: The file cannot be written.
    """
    count = len(scene.objects.boxes)
    if kind == "scene":
        write_scene_from(source, scene, output)
        return f"wrote {output}: scene with {count} objects"
    if kind == "table":
        with writing(output):
            write_box_table(scene.objects, output)
        return f"wrote {output}: table of {count} boxes"
    graph = relation_graph(scene, threshold=threshold)
    if kind == "GraphML":
        with writing(output):
            write_graphml(scene, output, threshold=threshold)
    else:
        write_text(output, json_text(graph) + "\n")
    return f"wrote {output}: {kind} with {len(graph['edges'])} relations of {count} objects"
