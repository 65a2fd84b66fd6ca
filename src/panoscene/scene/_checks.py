"""What can be wrong with a scene.json document, told so that a person can put it right."""

import difflib
import re
from typing import Any, cast

import torch
from pydantic import ValidationError

from panoscene._photo import ASPECT_TOLERANCE
from panoscene.geometry import polygon_problem

from ._categories import category_suggestion
from ._errors import Problem, shown
from ._schema import (
    SCHEMA_NAME,
    SCHEMA_VERSION,
    LayoutModel,
    Model,
    ObjectModel,
    PanoramaModel,
    RelationsModel,
    SceneModel,
)
from ._triples import ROOM_PARTS, wall_names

_RADIANS = {"yaw", "lon", "lat"}
_FIELDS = sorted(
    {
        field.alias or name
        for model in Model.__subclasses__()
        for name, field in model.model_fields.items()
    }
)


def json_path(parts: tuple[int | str, ...]) -> str:
    """Return a place in a JSON document in the usual notation.

    Examples:
        >>> json_path(("objects", 3, "box"))
        '$.objects[3].box'
    """
    text = "$"
    for part in parts:
        if isinstance(part, int):
            text += f"[{part}]"
        elif re.fullmatch(r"[A-Za-z_]\w*", part):
            text += f".{part}"
        elif part != "[key]":
            text += f'["{part[:60]}"]'
    return text


def version_problems(document: object) -> list[Problem]:
    """Return why this is not a scene document of this version at all; usually nothing."""
    if not isinstance(document, dict):
        return [Problem("$", shown(document), f'an object with "schema": "{SCHEMA_NAME}"')]
    fields = cast("dict[str, object]", document)
    problems: list[Problem] = []
    name, version = fields.get("schema"), fields.get("version")
    if name != SCHEMA_NAME:
        found = shown(name) if "schema" in fields else "nothing"
        problems.append(Problem("$.schema", found, repr(SCHEMA_NAME)))
    if type(version) is not int or version != SCHEMA_VERSION:
        found = shown(version) if "version" in fields else "nothing"
        newer = type(version) is int and version > SCHEMA_VERSION
        hint = " (the file may come from a newer panoscene)" if newer else ""
        problems.append(Problem("$.version", found, f"{SCHEMA_VERSION}{hint}"))
    return problems


def schema_problems(error: ValidationError) -> list[Problem]:
    """Return what pydantic found, in our words."""
    problems: list[Problem] = []
    for detail in error.errors(include_url=False):
        kind, place, value = detail["type"], detail["loc"], detail["input"]
        found, expected = shown(value), detail["msg"].removeprefix("Input should be ")
        if kind == "missing":
            found, expected = "nothing", "a value: this field is required"
        elif kind == "extra_forbidden":
            close = difflib.get_close_matches(str(place[-1]), _FIELDS, n=1)
            hint = f"; did you mean {close[0]!r}?" if close else ""
            expected = f"no field of this name{hint}"
        elif kind == "value_error":
            expected = f"a category; {category_suggestion(str(value))}"
        elif place and place[-1] in _RADIANS and kind.startswith(("less", "greater")):
            expected += " (radians, not degrees)"
        problems.append(Problem(json_path(place), found, expected))
    return problems


def document_problems(model: SceneModel) -> list[Problem]:
    """Return what types alone cannot see: polygon, ids, shapes, names in the relations."""
    names = names_in_model(model.objects)
    walls = wall_names(len(model.layout.floor_polygon))
    problems = _text_problems(model)
    problems += _panorama_problems(model.panorama) + _layout_problems(model.layout)
    unclear = _id_problems(names)
    problems += unclear + _shape_problems(model.objects)
    # when a name is given twice, others are missing: relations would be blamed for that
    if model.relations is not None and not unclear:
        problems += _relation_problems(model.relations, set(names), set(walls))
    return problems


def names_in_model(objects: list[ObjectModel]) -> list[str]:
    """Return the objects' ids; where one is missing, category and index, such as ``bed-0``."""
    return [
        f"{item.category}-{k}" if item.id is None else item.id for k, item in enumerate(objects)
    ]


def _text_problems(model: SceneModel) -> list[Problem]:
    problems: list[Problem] = []
    for field, text in (("$.name", model.name), ("$.panorama.file", model.panorama.file)):
        # JSON can escape one half of a character; no file can be written with it
        if re.search("[\ud800-\udfff]", text or ""):
            problems.append(
                Problem(field, shown(text), "characters, not halves of them (surrogates)")
            )
    return problems


def _panorama_problems(panorama: PanoramaModel) -> list[Problem]:
    problems: list[Problem] = []
    if abs(panorama.width - 2 * panorama.height) > ASPECT_TOLERANCE * panorama.width:
        found = f"{panorama.width} x {panorama.height} pixels"
        problems.append(Problem("$.panorama", found, "a width of twice the height"))
    rotation = torch.tensor(panorama.upright_from_photo, dtype=torch.float64)
    skew = (rotation @ rotation.T - torch.eye(3, dtype=torch.float64)).abs().max()
    if float(skew) > 1e-3 or float(torch.det(rotation)) < 0:
        expected = "a rotation: orthogonal rows of length 1, right-handed"
        problems.append(Problem("$.panorama.upright_from_photo", "a 3 x 3 matrix", expected))
    return problems


def _layout_problems(layout: LayoutModel) -> list[Problem]:
    problems: list[Problem] = []
    corners = len(layout.floor_polygon)
    for field, polygon in (
        ("floor_polygon", layout.floor_polygon),
        ("raw_polygon", layout.raw_polygon),
    ):
        if polygon is None:
            continue
        fault = polygon_problem(torch.tensor(polygon, dtype=torch.float64))
        if fault is not None:
            expected = "a simple polygon, counter-clockwise from above"
            if "clockwise" in fault:
                expected += " (reverse the corners, and with them the order of the walls)"
            problems.append(Problem(f"$.layout.{field}", fault, expected))
    if layout.ceiling_height <= layout.floor_height:
        expected = f"more than the floor_height {layout.floor_height:g}"
        problems.append(Problem("$.layout.ceiling_height", f"{layout.ceiling_height:g}", expected))
    if layout.wall_score is not None and len(layout.wall_score) != corners:
        found = f"{len(layout.wall_score)} scores"
        problems.append(Problem("$.layout.wall_score", found, f"{corners}, one for each corner"))
    return problems


def _id_problems(names: list[str]) -> list[Problem]:
    problems: list[Problem] = []
    first: dict[str, int] = {}
    for k, name in enumerate(names):
        field = f"$.objects[{k}].id"
        if name in ROOM_PARTS or re.fullmatch(r"wall-\d+", name):
            problems.append(Problem(field, shown(name), "a name that the room does not use"))
        if not name.strip():
            problems.append(Problem(field, shown(name), "a name that can be seen"))
        if name in first:
            expected = f"a unique name (objects[{first[name]}] has it too)"
            problems.append(Problem(field, shown(name), expected))
        first.setdefault(name, k)
    return problems


def _shape_problems(objects: list[ObjectModel]) -> list[Problem]:
    problems: list[Problem] = []
    lengths = [len(o.shape.code) if o.shape and o.shape.code else 0 for o in objects]
    for k, item in enumerate(objects):
        if lengths[k] != lengths[0]:
            expected = f"{lengths[0]} as in objects[0]: every object has a code or none"
            problems.append(
                Problem(f"$.objects[{k}].shape.code", f"{lengths[k]} numbers", expected)
            )
        mesh = item.shape.mesh if item.shape else None
        highest = max(map(max, mesh.faces), default=-1) if mesh else -1
        if mesh and highest >= len(mesh.vertices):
            expected = f"indices below {len(mesh.vertices)}, the number of vertices"
            problems.append(
                Problem(f"$.objects[{k}].shape.mesh.faces", f"index {highest}", expected)
            )
    return problems


def _relation_problems(
    relations: RelationsModel, objects: set[str], walls: set[str]
) -> list[Problem]:
    places: dict[tuple[str, bool], list[tuple[str, ...]]] = {}

    def check(place: tuple[str, ...], name: str, allowed: set[str]) -> None:
        if name not in allowed:
            places.setdefault((name, allowed is everything), []).append(place)

    everything = objects | walls
    for predicate in ("on_floor", "under_ceiling", "inside_room"):
        for name in cast("dict[str, Any]", getattr(relations, predicate)):
            check((predicate,), name, objects)
    for predicate in ("touching", "farther_than", "relative_yaw_deg"):
        allowed = objects if predicate == "farther_than" else everything
        for subject, targets in cast(
            "dict[str, dict[str, Any]]", getattr(relations, predicate)
        ).items():
            check((predicate,), subject, objects)
            for name in targets:
                check((predicate, subject), name, allowed)
    # one misspelt object is one problem, in however many relations it is
    return [
        _unknown_name(name, found, sorted(everything if walls_too else objects), walls_too)
        for (name, walls_too), found in places.items()
        if walls_too or (name, True) not in places
    ]


def _unknown_name(
    name: str, places: list[tuple[str, ...]], allowed: list[str], walls_too: bool
) -> Problem:
    close = difflib.get_close_matches(name, allowed, n=1)
    hint = f"; did you mean {close[0]!r}?" if close else ""
    kind = "an object or wall" if walls_too else "an object"
    more = f" (and in {len(places) - 1} other places)" if len(places) > 1 else ""
    return Problem(
        json_path(("relations", *places[0])), f"{shown(name)}{more}", f"{kind} of this scene{hint}"
    )
