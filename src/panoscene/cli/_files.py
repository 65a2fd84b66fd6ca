"""Files that commands read and write."""

import errno
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from panoscene.cli._errors import InputError
from panoscene.cli._folders import check_folder
from panoscene.scene import (
    PanoramaError,
    Scene,
    SceneFormatError,
    relocate_photo,
    write_atomically,
    write_scene,
)

CERTIFICATE = ".certificate.json"
"""What the name of a certificate ends in; files named so are never taken for scenes."""


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


def write_scene_from(source: Path, scene: Scene, target: Path) -> None:
    """Write a scene that was read from another file; the photo is still found from there."""
    with writing(target):
        write_scene(relocate_photo(scene, source, target), target)


def scene_files(arguments: Sequence[str]) -> list[Path]:
    """Return the scene files that arguments name, each once: files, folders, or patterns.

    Raises:
        InputError: Nothing was named, or a folder or a pattern holds no scene file.
    """
    if not arguments:
        raise InputError("SCENE: found nothing, expected scene.json files, folders or patterns")
    files: dict[Path, Path] = {}
    for argument in arguments:
        if not argument:
            raise InputError("SCENE: found an empty name, expected scene.json files or folders")
        path = Path(argument)
        if path.is_dir():
            named = path.glob("*.json")
        elif path.exists() or not any(mark in argument for mark in "*?["):
            named = iter([path])
        else:
            anchor = Path(path.anchor)
            named = anchor.glob(str(path.relative_to(anchor)))
        # a shell may have expanded the pattern, so certificates are left out wherever they are
        scenes = sorted(file for file in named if not file.name.endswith(CERTIFICATE[1:]))
        if not scenes and not path.is_file():
            raise InputError(f"{argument}: found no scene files there, expected names in .json")
        for file in scenes:
            files.setdefault(file.resolve(), file)
    if not files:
        raise InputError("SCENE: found only certificates, expected scene.json files")
    return list(files.values())


def scene_targets(files: Sequence[Path], output: Path) -> Mapping[Path, Path]:
    """Return where the scene made from each file goes: a single .json file, or into a folder.

    Raises:
        InputError: Several scenes would share a file, a scene would be written onto itself, or the
            output is a file where a folder must be.
    """
    targets = _targets(files, output)
    for file, target in targets.items():
        if target.resolve() == file.resolve():
            expected = "expected another place: the scene there would be lost"
            raise InputError(f"--output {output}: found the place of {file} itself, {expected}")
    return targets


def _targets(files: Sequence[Path], output: Path) -> Mapping[Path, Path]:
    if output.suffix == ".json" and not output.is_dir():
        if len(files) > 1:
            found = f"one file for {len(files)} scenes"
            raise InputError(f"--output {output}: found {found}, expected a folder")
        return {files[0]: output}
    check_folder(output)
    sources: dict[str, Path] = {}
    for file in files:
        name = f"{file.stem}.json"
        if name in sources:
            raise InputError(
                f"--output {output}: found {sources[name]} and {file}, which would both become "
                f"{output / name}; expected different names"
            )
        sources[name] = file
    return {file: output / name for name, file in sources.items()}


def beside(target: Path, ending: str) -> Path:
    """Return the path next to a scene file with the same name and another ending."""
    return target.with_name(target.stem + ending)
