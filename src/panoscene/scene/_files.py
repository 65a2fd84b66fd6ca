"""Reading and writing scene.json."""

import json
import os
from pathlib import Path
from typing import Any

import torch

from ._atomic import write_atomically
from ._convert import scene_from_json, scene_to_json
from ._errors import Problem, SceneFormatError, shown
from ._records import Scene

MAX_BYTES = 256 * 1024 * 1024
"""Larger scene files are refused before they are read."""

_LINE = 100
_ENCODER = json.JSONEncoder(ensure_ascii=False, allow_nan=False)


class _DuplicateKeyError(ValueError):
    """A JSON object has the same key twice."""


def read_scene(path: str | os.PathLike[str], *, dtype: torch.dtype = torch.float32) -> Scene:
    """Return the scene in a scene.json file.

    Args:
        path: The file.
        dtype: Float type of all tensors.

    Raises:
        SceneFormatError: The file cannot be read or is not a valid scene. The message names the
            file and, for each problem, the field, what was found and what was expected.
    """
    file = os.fspath(path)
    return scene_from_json(_parsed(_text(Path(path), file), file), file=file, dtype=dtype)


def write_scene(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Write a scene to a scene.json file that ``read_scene`` gives back bit for bit.

    The file appears complete or not at all; an existing one is replaced.

    Raises:
        SceneFormatError: The scene cannot be a scene file, for example because of a NaN. Nothing
            is written then.
    """
    document = scene_to_json(scene, file=os.fspath(path))
    write_atomically(Path(path), formatted(document) + "\n")


def formatted(value: Any, indent: str = "") -> str:
    """Return a JSON document as text for people: what fits on a line, or is flat, stays on one."""
    if not isinstance(value, dict | list):
        return _ENCODER.encode(value)
    deeper = indent + "  "
    is_object = isinstance(value, dict)
    children: list[Any] = list(value.values() if is_object else value)
    if not any(isinstance(child, dict | list) for child in children):
        return _ENCODER.encode(value)
    if not is_object and all(type(child) is list for child in children):
        text = _ENCODER.encode(value)
        # a table of numbers, as the vertices of a mesh: encoded in one piece, three times as fast
        if not set('"{') & set(text) and text.count("[") == len(children) + 1:
            if len(indent) + len(text) <= _LINE:
                return text
            rows = text[1:-1].replace("], [", f"],\n{deeper}[")
            return f"[\n{deeper}{rows}\n{indent}]"
    parts = [formatted(child, deeper) for child in children]
    if is_object:
        keys = [_ENCODER.encode(key) for key in value]
        parts = [f"{key}: {part}" for key, part in zip(keys, parts, strict=True)]
    opening, closing = "{}" if is_object else "[]"
    length = len(indent) + sum(len(part) + 2 for part in parts)
    if length <= _LINE and not any("\n" in part for part in parts):
        return opening + ", ".join(parts) + closing
    lines = f",\n{deeper}".join(parts)
    return f"{opening}\n{deeper}{lines}\n{indent}{closing}"


def _text(path: Path, file: str) -> str:
    problem: Problem | None = None
    data = b""
    try:
        with path.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except IsADirectoryError:
        problem = Problem("the path", "a directory", "a scene.json file")
    except FileNotFoundError:
        problem = Problem("the path", "nothing", "an existing scene.json file")
    except OSError as error:
        problem = Problem("the path", error.strerror or "an error", "a readable file")
    if problem is not None:
        raise SceneFormatError(file, [problem])
    if len(data) > MAX_BYTES:
        found = f"more than {MAX_BYTES // 2**20} MiB"
        raise SceneFormatError(file, [Problem("the file", found, "at most that")])
    if not data.strip():
        raise SceneFormatError(file, [Problem("the file", "nothing in it", "a JSON document")])
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        found = f"the byte 0x{data[error.start]:02x} at position {error.start}"
        raise SceneFormatError(file, [Problem("the file", found, "text in UTF-8")]) from None


def _parsed(text: str, file: str) -> object:
    try:
        return json.loads(text, object_pairs_hook=_unique)
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        if file.lower().endswith(".csv"):
            found = "a table of boxes (.csv)"
            problem = Problem("the file", found, "a scene; make one with panoscene convert")
        elif error.pos >= len(text.rstrip()):
            problem = Problem(place, "the end of the file", "more JSON: the file looks truncated")
        elif error.msg.startswith("Unterminated string"):
            problem = Problem(place, "text without an end", "a closing quote (truncated?)")
        else:
            problem = Problem(place, shown(text[error.pos : error.pos + 20]), f"JSON: {error.msg}")
    except _DuplicateKeyError as error:
        problem = Problem("the file", f"the key {error} twice", "each key once in an object")
    except RecursionError:
        problem = Problem("the file", "JSON nested hundreds of levels deep", "a scene document")
    except ValueError as error:  # a whole number of thousands of digits
        problem = Problem("the file", "a number that is too long", f"JSON: {error}")
    raise SceneFormatError(file, [problem])


def _unique(pairs: list[tuple[str, object]]) -> dict[str, object]:
    result = dict(pairs)
    if len(result) != len(pairs):
        seen: set[str] = set()
        for key, _ in pairs:
            if key in seen:
                raise _DuplicateKeyError(shown(key))
            seen.add(key)
    return result
