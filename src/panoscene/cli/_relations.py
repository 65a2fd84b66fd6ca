"""The relations of a scene: derived, in sentences, as a graph."""

from dataclasses import replace
from pathlib import Path

from panoscene.cli._doubts import note_doubts
from panoscene.cli._errors import InputError
from panoscene.cli._files import blaming
from panoscene.cli._kinds import check_kind, write_as
from panoscene.cli._sentences import ROUTINE, sentence
from panoscene.cli._terminal import note, say, say_json
from panoscene.scene import (
    Scene,
    object_names,
    read_scene,
    relation_graph,
    relation_triples,
    relations_from_boxes,
)


def show_relations(
    file: Path,
    output: Path | None,
    *,
    threshold: float,
    keep: bool,
    everything: bool,
    as_json: bool,
) -> int:
    """Print or write the relations of a scene and return the exit code."""
    kind = None if output is None else check_kind(output, ("scene", "graph JSON", "GraphML"))
    scene = read_scene(file)
    note_doubts(scene, file)
    known = with_relations(scene, file, keep=keep)
    with blaming("--threshold"):
        triples = relation_triples(known, threshold=threshold)
        if as_json:
            say_json(relation_graph(known, threshold=threshold))
    if output is not None and kind is not None:
        note(write_as(kind, known, output, file, threshold))
    if as_json or output is not None:
        return 0
    shown = [triple for triple in triples if everything or triple.predicate not in ROUTINE]
    place = {name: k for k, name in enumerate(object_names(known.objects))}
    for triple in sorted(shown, key=lambda triple: place[triple.subject]):
        say(sentence(triple))
    if len(shown) < len(triples):
        note(f"and {len(triples) - len(shown)} about distances and turns, shown with --all")
    return 0


def with_relations(scene: Scene, file: Path, *, keep: bool = False) -> Scene:
    """Return the scene with relations derived from its boxes, or with those it has.

    Raises:
        InputError: There are none to keep, or they cannot be derived.
    """
    if keep:
        if scene.relations is None:
            raise InputError(f"{file}: found no relations to keep, expected some; drop --keep")
        return scene
    with blaming(file):
        found = relations_from_boxes(
            scene.objects.boxes,
            scene.layout,
            scene.panorama.camera_height,
            inside="any_corner",  # as convert and arrange: the boxes may be off
        )
    return replace(scene, relations=found)
