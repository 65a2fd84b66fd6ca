"""Predictions from disk: what is not valid in them costs scores, and never stops the scoring."""

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from panoscene.scene import Problem, Scene, SceneFormatError, read_scene, scene_from_json

_WALL = re.compile(r"wall-\d+")
_OBJECT = re.compile(r"\$\.objects\[(\d+)\]")
_RAW = re.compile(r"\$\.layout\.raw_polygon\b")
_LAYOUT = re.compile(r"\$\.layout\b")
_RELATIONS = re.compile(r"\$\.relations\b")


@dataclass(frozen=True, slots=True)
class Prediction:
    """What a file of predictions is worth."""

    scene: Scene | None
    """Its valid parts; None when there is no file, or nothing in it can be used."""
    warning: str | None = None
    """What was not valid and how it counts, on one line that names the file."""
    invalid: bool = False
    """There is a file, and something in it is not valid."""
    no_layout: bool = False
    """The layout is not valid; that of the target stands in its place."""
    no_raw: bool = False
    """The raw polygon alone is not valid; it is left out."""


def read_prediction(path: Path, target: Scene) -> Prediction:
    """Return the valid parts of a predicted scene.json.

    The smallest part around a problem is lost: the raw polygon, the layout, an object, or the
    relations. A problem anywhere else costs the whole prediction.

    Args:
        path: the file; it may be missing.
        target: the true scene, whose room stands in for a layout that is not valid.
    """
    if not path.exists():
        return Prediction(None, f"{path}: found no prediction; it counts as an empty room")
    try:
        return Prediction(read_scene(path))
    except SceneFormatError as error:
        problems = error.problems
    first, *others = problems
    reason = f"{path}: {first}" + (f" (and {len(others)} more problems)" if others else "")
    # other problems are those of a file, not of a place in a document
    if all(problem.field.startswith("$") for problem in problems):
        repair = _Repair(json.loads(path.read_text("utf-8-sig")), target)
        scene = repair.run(problems)
        if scene is not None:
            return Prediction(
                scene, f"{reason}; {repair.lost}", True, repair.no_layout, repair.no_raw
            )
    return Prediction(None, f"{reason}; the prediction counts as an empty room", True)


class _Repair:
    """A document of which parts are taken away until the rest is valid."""

    def __init__(self, document: Any, target: Scene) -> None:
        self.document = document
        self.target = target
        self.no_layout = False
        self.no_raw = False
        self.no_relations = False
        self.objects_lost = 0

    @property
    def lost(self) -> str:
        """Return in words how what was taken away counts."""
        words: list[str] = []
        if self.no_layout:
            words.append("the layout counts as degenerate")
        elif self.no_raw:
            words.append("the raw polygon counts as degenerate")
        if self.objects_lost:
            words.append(f"objects left out: {self.objects_lost}")
        if self.no_relations:
            words.append("all relations count as not predicted")
        return ", ".join(words)

    def run(self, problems: tuple[Problem, ...]) -> Scene | None:
        """Return what is valid, or None when that is nothing."""
        # a document whose fields are right can still have problems, found in a later round
        while self._take_away({problem.field for problem in problems}):
            try:
                return scene_from_json(self.document)
            except SceneFormatError as error:
                problems = error.problems
        return None

    def _take_away(self, fields: set[str]) -> bool:
        """Take away what problems are in, and return whether that is possible."""
        objects: set[int] = set()
        raw = layout = relations = False
        for field in fields:
            if found := _OBJECT.match(field):
                objects.add(int(found[1]))
            elif _RAW.match(field):
                raw = True
            elif _LAYOUT.match(field):
                layout = True
            elif _RELATIONS.match(field):
                relations = True
            else:
                return False
        # relations may be right again without the names of walls and objects that are gone
        relations = relations and not (layout or objects)
        if (layout and self.no_layout) or (relations and self.no_relations):
            return False
        if raw:
            del self.document["layout"]["raw_polygon"]
            self.no_raw = True
        if layout:
            self._replace_layout()
        if objects:
            self._leave_out(objects)
        if relations:
            self.document["relations"] = {}
            self.no_relations = True
        return True

    def _replace_layout(self) -> None:
        layout = self.target.layout
        self.document["layout"] = {
            "floor_polygon": layout.floor_polygon.tolist(),
            "floor_height": layout.floor_height,
            "ceiling_height": layout.ceiling_height,
        }
        self.no_layout = True
        # the walls of the target are others than those that the relations speak of
        self._forget(lambda name: _WALL.fullmatch(name) is not None)

    def _leave_out(self, indices: set[int]) -> None:
        objects: list[Any] = self.document["objects"]
        for k, item in enumerate(objects):
            # the names of objects without one depend on their place in the list
            if isinstance(item, dict) and item.get("id") is None:
                item["id"] = f"{item.get('category')}-{k}"
        gone = {str(objects[k].get("id")) for k in indices if isinstance(objects[k], dict)}
        self.document["objects"] = [o for k, o in enumerate(objects) if k not in indices]
        self.objects_lost += len(indices)
        self._forget(gone.__contains__)

    def _forget(self, gone: Callable[[str], bool]) -> None:
        """Take names out of the relations, which then count as not predicted."""
        relations = self.document.get("relations")
        for table in _tables(relations):
            for name in [name for name in table if gone(name)]:
                del table[name]
            for targets in _tables(table):
                for name in [name for name in targets if gone(name)]:
                    del targets[name]


def _tables(document: object) -> list[dict[str, Any]]:
    """Return the objects directly in a JSON object; none where it is something else."""
    if not isinstance(document, dict):
        return []
    values = cast("dict[str, object]", document).values()
    return [cast("dict[str, Any]", value) for value in values if isinstance(value, dict)]
