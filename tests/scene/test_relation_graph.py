import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path

import networkx
import pytest

from panoscene.scene import PREDICATES, Scene, relation_graph, relation_triples, write_graphml


def test_triples_say_each_relation_once(bedroom: Scene) -> None:
    triples = relation_triples(bedroom)
    words = {(t.subject, t.predicate, t.object) for t in triples}
    assert len(words) == len(triples)
    assert {t.predicate for t in triples} == set(PREDICATES)
    assert ("bed", "touching", "nightstand") in words
    assert ("nightstand", "touching", "bed") not in words
    assert ("bed", "touching", "wall-2") in words
    assert ("lamp", "under_ceiling", "ceiling") in words
    assert ("bed", "on_floor", "floor") in words
    assert ("picture", "inside_room", "room") in words
    assert ("nightstand", "farther_than", "lamp") in words
    turns = [t for t in triples if t.predicate == "relative_yaw"]
    turn = next(t for t in turns if (t.subject, t.object) == ("bed", "picture"))
    assert turn.angle == pytest.approx(-math.pi / 2)
    assert str(turn) == "bed relative_yaw picture -90 deg (1.00)"


def test_threshold(random_scene: Callable[..., Scene]) -> None:
    scene = random_scene(5, 6)
    counts = [len(relation_triples(scene, threshold=t)) for t in (0.1, 0.5, 0.9)]
    assert counts[0] > counts[1] > counts[2] > 0
    assert all(t.score >= 0.9 for t in relation_triples(scene, threshold=0.9))
    with pytest.raises(ValueError, match="threshold: expected"):
        relation_triples(scene, threshold=0.0)
    with pytest.raises(ValueError, match="expected relations, found none"):
        relation_triples(dataclasses.replace(scene, relations=None))


def test_default_names_are_category_and_index(bedroom: Scene) -> None:
    nameless = dataclasses.replace(bedroom, objects=dataclasses.replace(bedroom.objects, id=()))
    nodes = relation_graph(nameless)["nodes"]
    assert [node["id"] for node in nodes[:4]] == [
        "bed-0",
        "bottom_cabinet-1",
        "floor_lamp-2",
        "picture-3",
    ]


def test_graph_is_json_and_its_edges_join_nodes(bedroom: Scene) -> None:
    graph = json.loads(json.dumps(relation_graph(bedroom), allow_nan=False))
    names = [node["id"] for node in graph["nodes"]]
    assert len(names) == len(set(names)) == 4 + 4 + 3
    assert {edge["source"] for edge in graph["edges"]} <= set(names[:4])
    assert {edge["target"] for edge in graph["edges"]} <= set(names)
    assert all(("angle" in edge) == (edge["relation"] == "relative_yaw") for edge in graph["edges"])


def test_graphml_is_read_back_by_networkx_with_types(bedroom: Scene, tmp_path: Path) -> None:
    path = tmp_path / "scene.graphml"
    write_graphml(bedroom, path)
    graph = networkx.read_graphml(path)
    document = relation_graph(bedroom)
    assert graph.number_of_nodes() == len(document["nodes"])
    assert graph.number_of_edges() == len(document["edges"])
    assert graph.nodes["bed"]["category"] == "bed"
    assert graph.nodes["bed"]["depth"] == 2.0
    assert graph.nodes["wall-2"]["to_x"] == -2.0
    edges = list(graph.get_edge_data("bed", "picture").values())
    turn = next(edge for edge in edges if edge["relation"] == "relative_yaw")
    assert turn["angle_deg"] == pytest.approx(-90, abs=1e-4)
    assert isinstance(turn["score"], float)
    assert [entry.name for entry in tmp_path.iterdir()] == ["scene.graphml"]


def test_graphml_survives_names_that_xml_cannot_hold(bedroom: Scene, tmp_path: Path) -> None:
    odd = dataclasses.replace(bedroom.objects, id=("a<b>&\"'", "\u00e9\U0001f6cf", "\x0b", "d"))
    write_graphml(dataclasses.replace(bedroom, objects=odd, name="\x00"), tmp_path / "g.graphml")
    graph = networkx.read_graphml(tmp_path / "g.graphml")
    assert "a<b>&\"'" in graph
    assert "\u00e9\U0001f6cf" in graph


def test_empty_scene(random_scene: Callable[..., Scene], tmp_path: Path) -> None:
    write_graphml(random_scene(1, 0), tmp_path / "empty.graphml")
    assert networkx.read_graphml(tmp_path / "empty.graphml").number_of_edges() == 0
