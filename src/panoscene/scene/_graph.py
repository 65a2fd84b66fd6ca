"""The relation graph of a scene, as JSON and as GraphML for graph tools."""

import math
import os
from pathlib import Path
from typing import Any, cast

from ._atomic import write_atomically
from ._categories import CATEGORIES
from ._numbers import numbers_from_tensor
from ._records import Scene
from ._triples import Triple, object_names, relation_triples, wall_names

GRAPH_SCHEMA_NAME = "panoscene/relation-graph"
GRAPH_SCHEMA_VERSION = 1


def relation_graph(scene: Scene, *, threshold: float = 0.5) -> dict[str, Any]:
    """Return the relation graph as a document for ``json.dumps``.

    Nodes are the objects, the walls, the floor, the ceiling and the room. Edges are the relations
    with a score of at least ``threshold``, each once (see ``relation_triples``): from ``source``
    to ``target``, with the name of the relation, its score and, for ``relative_yaw``, the angle in
    radians from source to target.

    Convention:
        - metres and radians in the world frame; a wall has its two corners on the floor

    Raises:
        ValueError: The scene has no relations, or the threshold is not in (0, 1].
    """
    return {
        "schema": GRAPH_SCHEMA_NAME,
        "version": GRAPH_SCHEMA_VERSION,
        "name": scene.name,
        "threshold": threshold,
        "nodes": _object_nodes(scene) + _room_nodes(scene),
        "edges": [_edge(triple) for triple in relation_triples(scene, threshold=threshold)],
    }


def write_graphml(scene: Scene, path: str | os.PathLike[str], *, threshold: float = 0.5) -> None:
    """Write the relation graph as GraphML with typed attributes (Gephi, yEd, networkx).

    Nodes and edges are those of ``relation_graph``; lists become one attribute for each number,
    such as ``centre_x``. Angles are also given in degrees. The file appears complete or not at
    all.

    Raises:
        ValueError: The scene has no relations, or the threshold is not in (0, 1].
    """
    import networkx  # noqa: PLC0415 (who only describes scenes does not wait for it)

    document = relation_graph(scene, threshold=threshold)
    graph = cast(Any, networkx.MultiDiGraph(name=_xml_text(document["name"]), threshold=threshold))
    for node in document["nodes"]:
        graph.add_node(_xml_text(node["id"]), **_flat(node))
    for edge in document["edges"]:
        source, target = _xml_text(edge["source"]), _xml_text(edge["target"])
        attributes = {key: edge[key] for key in ("relation", "score")}
        if "angle" in edge:
            attributes |= {"angle": edge["angle"], "angle_deg": math.degrees(edge["angle"])}
        graph.add_edge(source, target, **attributes)
    lines: list[str] = list(networkx.generate_graphml(graph))
    write_atomically(Path(path), "\n".join(lines) + "\n")


def _object_nodes(scene: Scene) -> list[dict[str, Any]]:
    objects = scene.objects
    columns = (
        object_names(objects),
        numbers_from_tensor(objects.category),
        numbers_from_tensor(objects.score),
        numbers_from_tensor(objects.boxes.centre),
        numbers_from_tensor(objects.boxes.size),
        numbers_from_tensor(objects.boxes.yaw),
    )
    return [
        {
            "id": name,
            "kind": "object",
            "category": CATEGORIES[category],
            "score": score,
            "centre": centre,
            "size": size,
            "yaw": yaw,
        }
        for name, category, score, centre, size, yaw in zip(*columns, strict=True)
    ]


def _room_nodes(scene: Scene) -> list[dict[str, Any]]:
    layout = scene.layout
    corners: list[list[float]] = numbers_from_tensor(layout.floor_polygon)
    nodes: list[dict[str, Any]] = [
        {"id": name, "kind": "wall", "from": corner, "to": following}
        for name, corner, following in zip(
            wall_names(len(corners)), corners, corners[1:] + corners[:1], strict=True
        )
    ]
    nodes.append({"id": "floor", "kind": "floor", "z": float(layout.floor_height)})
    nodes.append({"id": "ceiling", "kind": "ceiling", "z": float(layout.ceiling_height)})
    nodes.append({"id": "room", "kind": "room"})
    return nodes


def _edge(triple: Triple) -> dict[str, Any]:
    edge: dict[str, Any] = {
        "source": triple.subject,
        "target": triple.object,
        "relation": triple.predicate,
        "score": triple.score,
    }
    if triple.angle is not None:
        edge["angle"] = triple.angle
    return edge


_PARTS = {"size": ("width", "depth", "height")}


def _flat(node: dict[str, Any]) -> dict[str, str | float]:
    flat: dict[str, str | float] = {}
    for key, value in node.items():
        if isinstance(value, list):
            parts = _PARTS.get(key) or [f"{key}_{axis}" for axis in "xyz"]
            flat |= dict(zip(parts, cast("list[float]", value), strict=False))
        elif key != "id":
            flat[key] = _xml_text(value) if isinstance(value, str) else float(value)
    return flat


def _xml_text(text: str) -> str:
    """Return the text without the control characters that XML cannot hold."""
    return "".join(c if c in "\t\n\r" or " " <= c not in "\ufffe\uffff" else "\ufffd" for c in text)
