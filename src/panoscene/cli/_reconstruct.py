"""Photos in, scenes out: files for people and programs, in one folder for each photo."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from panoscene.cli._draw import draw_pictures
from panoscene.cli._errors import InputError
from panoscene.cli._files import check_folder, write_bytes
from panoscene.cli._progress import progress_bar
from panoscene.cli._terminal import complain, json_text, note, say, say_json
from panoscene.exports import write_floor_plan_svg, write_glb
from panoscene.pipeline import Pipeline, Reconstruction
from panoscene.scene import (
    PanoramaError,
    SceneFormatError,
    read_panorama,
    relocate_photo,
    write_scene,
)
from panoscene.style import words
from panoscene.views import describe_violations, write_report

PHOTOS = frozenset({".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp", ".bmp"})
SCENE = "scene.json"
"""The file that is written last: where it is, everything is."""


@dataclass(frozen=True, slots=True)
class Choice:
    """What to make of each photo."""

    camera_height: float
    resolution: int
    resume: bool


def photo_files(arguments: Sequence[str]) -> list[Path]:
    """Return the photos that arguments name, each once: files, folders, or patterns.

    Raises:
        InputError: A folder or a pattern holds no picture.
    """
    files: dict[Path, Path] = {}
    for argument in arguments:
        path = Path(argument)
        if path.is_dir():
            named = (file for file in path.iterdir() if file.suffix.lower() in PHOTOS)
        elif path.exists() or not any(mark in argument for mark in "*?["):
            named = iter([path])
        else:
            anchor = Path(path.anchor)
            named = anchor.glob(str(path.relative_to(anchor)))
        found = sorted(named)
        if not found:
            expected = "names in " + " ".join(sorted(PHOTOS))
            raise InputError(f"{argument}: found no photos there, expected {expected}")
        for file in found:
            files.setdefault(file.resolve(), file)
    return list(files.values())


def photo_folders(files: Sequence[Path], output: Path) -> dict[Path, Path]:
    """Return the folder that each photo's results go to: the output, or one in it for each.

    Raises:
        InputError: The output is a file, or two photos would share a folder.
    """
    check_folder(output)
    if len(files) == 1:
        return {files[0]: output}
    sources: dict[str, Path] = {}
    for file in files:
        if file.stem in sources:
            both = f"{sources[file.stem]} and {file}"
            folder = output / file.stem
            expected = "expected different names"
            raise InputError(
                f"--output {output}: found {both}, which would both go to {folder}; {expected}"
            )
        sources[file.stem] = file
    return {file: output / file.stem for file in files}


def reconstruct_files(
    pipeline: Pipeline, files: Sequence[Path], output: Path, choice: Choice, *, as_json: bool
) -> int:
    """Reconstruct photos, say what was found, and return the exit code."""
    folders = photo_folders(files, output)
    told: list[dict[str, Any]] = []
    with progress_bar("reconstructing", len(files)) as advance:
        for file in files:
            folder = folders[file]
            if choice.resume and (folder / SCENE).is_file():
                told.append({"photo": str(file), "ok": True, "output": str(folder), "new": False})
            else:
                told.append(_one(pipeline, file, folder, choice, quiet=as_json))
            advance(1)
    if as_json:
        say_json(told)
    elif len(files) > 1:
        made = sum(entry["ok"] for entry in told)
        say(f"wrote {output}: {made} of {len(files)} photos")
    return 0 if all(entry["ok"] for entry in told) else 2


def _one(
    pipeline: Pipeline, file: Path, folder: Path, choice: Choice, *, quiet: bool
) -> dict[str, Any]:
    """Reconstruct one photo; what is wrong with it is told and does not stop the others."""
    try:
        image, panorama = read_panorama(file, camera_height=choice.camera_height)
        start = time.perf_counter()
        result = pipeline(image, panorama, name=file.stem, resolution=choice.resolution)
        seconds = time.perf_counter() - start
        _write(result, file, folder)
    except (PanoramaError, SceneFormatError, InputError) as error:
        complain(str(error))
        return {"photo": str(file), "ok": False, "error": str(error)}
    except OSError as error:
        message = f"{folder}: cannot be written: {(error.strerror or str(error)).lower()}"
        complain(message)
        return {"photo": str(file), "ok": False, "error": message}
    for doubt in result.doubts:
        note(f"{file}: {doubt}")
    if not quiet:
        _tell(result, folder, seconds)
    return {
        "photo": str(file),
        "ok": True,
        "new": True,
        "output": str(folder),
        "objects": len(result.scene.objects.boxes),
        "corners": len(result.scene.layout.floor_polygon),
        "doubts": list(result.doubts),
        "timings": result.timings,
        "certificate": None if result.certificate is None else result.certificate.as_dict(),
    }


def _write(result: Reconstruction, file: Path, folder: Path) -> None:
    """Write everything about a photo, the scene last; all is drawn before the first is written."""
    scene = result.scene
    with TemporaryDirectory(prefix="panoscene-") as name:
        drafts = Path(name)
        for _ in draw_pictures(
            scene, drafts, image=result.image, reference=None, page=False, sheet=False
        ):
            pass
        write_glb(scene, drafts / "scene.glb", image=result.image)
        write_floor_plan_svg(scene, drafts / "floorplan.svg")
        write_report(
            drafts / "report.html",
            scene,
            image=result.image,
            before=result.initial,
            certificate=result.certificate,
            timings=result.timings,
            title=scene.name,
            notes=result.doubts,
        )
        account = {
            "schema": "panoscene/reconstruction",
            "version": 1,
            "timings": result.timings,
            "doubts": list(result.doubts),
            "certificate": None if result.certificate is None else result.certificate.as_dict(),
        }
        (drafts / "reconstruction.json").write_text(json_text(account) + "\n", encoding="utf-8")
        write_scene(relocate_photo(scene, file.resolve(), folder.resolve() / SCENE), drafts / SCENE)
        for draft in sorted(drafts.iterdir(), key=lambda path: (path.name == SCENE, path.name)):
            write_bytes(folder / draft.name, draft.read_bytes())


def _tell(result: Reconstruction, folder: Path, seconds: float) -> None:
    scene = result.scene
    names = [_name(scene, k) for k in range(len(scene.objects.boxes))]
    counted = ", ".join(
        f"{names.count(name)} {name}"
        for name in sorted(set(names), key=lambda n: (-names.count(n), n))
    )
    corners = len(scene.layout.floor_polygon)
    height = scene.layout.ceiling_height - scene.layout.floor_height
    say(f"{scene.name}: a room with {corners} corners, {height:.2f} m high, in {seconds:.1f} s")
    say(f"  {len(names)} objects: {counted}" if names else "  no objects")
    if result.certificate is not None:
        say(f"  before the arrangement: {describe_violations(result.certificate.before)}")
        say(f"  after it: {describe_violations(result.certificate.after)}")
    say(f"  open {folder / 'report.html'} in a browser; the scene is {folder / SCENE}")


def _name(scene: Any, index: int) -> str:
    from panoscene.scene import CATEGORIES  # noqa: PLC0415

    return words(CATEGORIES[int(scene.objects.category[index])])
