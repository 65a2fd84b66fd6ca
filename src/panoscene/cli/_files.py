"""Files that commands read and write."""

import errno
import json
import os
import secrets
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from panoscene.cli._errors import InputError
from panoscene.scene import (
    PanoramaError,
    Scene,
    SceneFormatError,
    relocate_photo,
    write_atomically,
    write_scene,
)


@contextmanager
def blaming(culprit: object) -> Iterator[None]:
    """Turn a ValueError about values the user gave into an InputError that names the culprit.

    Errors of files name their file already and pass through.
    """
    try:
        yield
    except (InputError, SceneFormatError, PanoramaError):
        raise
    except ValueError as error:
        raise InputError(f"{culprit}: {error}") from None


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Make the folder that a file goes into, and report what goes wrong under the file's name."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        blocked = error.filename is not None and Path(error.filename) in path.parents
        where = f"{error.filename}: " if blocked else ""
        raise InputError(f"{path}: cannot be written: {where}{reason}") from None


def read_json_object(file: Path, what: str) -> dict[str, Any]:
    """Return the object in a JSON file; ``what`` says what is expected there."""
    try:
        document = json.loads(file.read_text(encoding="utf-8-sig"))
    except ValueError as error:
        raise InputError(f"{file}: found text that is not JSON ({error}), expected JSON") from None
    except RecursionError:
        raise InputError(f"{file}: found JSON nested too deeply, expected {what}") from None
    if not isinstance(document, dict):
        kind = type(document).__name__
        raise InputError(f"{file}: found a {kind}, expected a JSON object of {what}")
    return document


def write_text(path: Path, text: str) -> None:
    """Write text to a file that appears complete or not at all."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, data: bytes) -> None:
    """Write bytes to a file that appears complete or not at all."""
    with writing(path):
        write_atomically(path, data)


def write_together(folder: Path, contents: Mapping[str, bytes]) -> None:
    """Write files to a folder that all appear complete, or none; the last in the mapping at last.

    Files that were there stay until all new ones are written beside them. Who is interrupted while
    they are moved into place leaves none under the last name, rather than one that belongs to
    others.
    """
    waiting: dict[Path, Path] = {}
    try:
        for name, data in contents.items():
            with writing(folder / name):
                draft = folder / f".{name}.{secrets.token_hex(4)}.part"
                waiting[draft] = folder / name
                draft.write_bytes(data)
        for path in [*waiting.values()][-1:]:
            path.unlink(missing_ok=True)
        for draft, path in waiting.items():
            with writing(path):
                draft.replace(path)
    finally:
        for draft in waiting:
            draft.unlink(missing_ok=True)


def write_scene_from(source: Path, scene: Scene, target: Path) -> None:
    """Write a scene that was read from another file; the photo is still found from there."""
    with writing(target):
        write_scene(relocate_photo(scene, source, target), target)


def beside(target: Path, ending: str) -> Path:
    """Return the path next to a scene file with the same name and another ending."""
    return target.with_name(target.stem + ending)
