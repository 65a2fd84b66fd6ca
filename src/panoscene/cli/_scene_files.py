"""Scene files that commands are given: which they are, where they are, what becomes of them.

Nothing here needs PyTorch: who names a file that is not there does not wait for it.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

from panoscene.cli._errors import InputError
from panoscene.cli._folders import check_folder
from panoscene.cli._terminal import complain, say_json

CERTIFICATE = ".certificate.json"
"""What the name of a certificate ends in; files named so are never taken for scenes."""


def check_scene(file: Path) -> None:
    """Refuse a scene file that is not there.

    Raises:
        InputError: It is not; the message is that of ``read_scene``.
    """
    if _is_gone(file):
        raise InputError(_gone(file))


def all_gone(arguments: Sequence[str], *, as_json: bool) -> bool:
    """Return whether no scene file that arguments name is there; then each has been told.

    Raises:
        InputError: Nothing was named, or a folder or a pattern holds no scene file.
    """
    files = scene_files(arguments)
    if not all(map(_is_gone, files)):
        return False
    for file in files:
        complain(_gone(file))
    if as_json:
        say_json([{"scene": str(file), "ok": False, "error": _gone(file)} for file in files])
    return True


def _is_gone(file: Path) -> bool:
    try:
        file.stat()
    except FileNotFoundError:
        return True
    except (OSError, ValueError):
        # whoever reads it says why it cannot be read
        return False
    return False


def _gone(file: Path) -> str:
    return f"{file}: the path: found nothing, expected an existing scene.json file"


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
