"""Photos in, scenes out: files for people and programs, in one folder for each photo."""

import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any
from uuid import uuid4

from panoscene._ray import ray_cluster, ray_package, ray_result, spread
from panoscene.cli._account import SCENE, account
from panoscene.cli._errors import InputError
from panoscene.cli._files import check_folder
from panoscene.cli._progress import progress_bar
from panoscene.cli._terminal import complain, note, say, say_json
from panoscene.pipeline import Pipeline, Reconstruction, load_steps
from panoscene.scene import (
    CATEGORIES,
    PanoramaError,
    SceneFormatError,
    read_panorama,
)
from panoscene.style import words

PHOTOS = frozenset({".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp", ".bmp"})
ENOUGH_COLUMNS = 4096
"""Of a photo: networks see 1,024, and 16,384 take gigabytes."""
_RESULTS = "panoscene.cli._results"


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


@dataclass(frozen=True, slots=True)
class Task:
    """One photo, and where its results go."""

    file: Path
    folder: Path
    choice: Choice

    def done(self) -> bool:
        """Return whether the results are there."""
        return (self.folder / SCENE).is_file()


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a photo."""

    entry: dict[str, Any]
    """For programs."""
    text: tuple[str, ...] = ()
    """For people, line by line."""


def reconstruct_files(
    make: Callable[[], Pipeline],
    files: Sequence[Path],
    output: Path,
    choice: Choice,
    *,
    as_json: bool,
    ray: str | None = None,
    artist: Executor | None = None,
) -> int:
    """Reconstruct photos, say what was found, and return the exit code.

    Args:
        make: makes the pipeline, once in each process that needs it.
        files: the photos.
        output: folder for the results, or for a folder of each photo.
        choice: what to make of each photo.
        as_json: print the outcomes as JSON.
        ray: address of a Ray cluster to spread the photos over, "" for the one that is running
            here; None works on them in this process.
        artist: draws pictures; None draws them in this process, as on a cluster.
    """
    folders = photo_folders(files, output)
    tasks = [Task(file, folders[file], choice) for file in files]
    left = [task for task in tasks if not (choice.resume and task.done())]
    told: dict[Path, dict[str, Any]] = {}
    with progress_bar("reconstructing", len(left)) as advance:
        for task, outcome in _outcomes(make, left, ray, artist):
            told[task.file] = outcome.entry
            if "error" in outcome.entry:
                complain(outcome.entry["error"])
            for flag in outcome.entry.get("flags", ()):
                note(f"{task.file}: {flag['text']}")
            for line in () if as_json else outcome.text:
                say(line)
            advance(1)
    entries = [told.get(task.file) or _there(task) for task in tasks]
    if as_json:
        say_json(entries)
    elif len(files) > 1:
        made = sum(entry["ok"] for entry in entries)
        say(f"wrote {output}: {made} of {len(files)} photos")
    return 0 if all(entry["ok"] for entry in entries) else 2


@contextmanager
def _ahead(pipeline: Pipeline) -> Iterator[None]:
    """Load in another thread what the first photo needs later than it is needed here."""
    with ThreadPoolExecutor(max_workers=1) as pool:
        for step in (*load_steps(pipeline.stages), partial(import_module, _RESULTS)):
            pool.submit(step)
        try:
            yield
        finally:
            pool.shutdown(cancel_futures=True)


def _drawing(artist: Executor | None) -> AbstractContextManager[Executor]:
    """Return who draws: the artist, or a thread of this process."""
    return ThreadPoolExecutor(max_workers=1) if artist is None else nullcontext(artist)


def _there(task: Task) -> dict[str, Any]:
    return {"photo": str(task.file), "ok": True, "output": str(task.folder), "new": False}


def _outcomes(
    make: Callable[[], Pipeline],
    tasks: Sequence[Task],
    ray: str | None,
    artist: Executor | None,
) -> Iterator[tuple[Task, Outcome]]:
    """Return tasks with what came of them, as they finish."""
    if not tasks:
        return
    if ray is None:
        pipeline = make()
        with _ahead(pipeline), _drawing(artist) as drawing:
            for task in tasks:
                yield task, reconstruct_one(pipeline, task, drawing)
        return
    # other computers start in other folders
    shared = {
        replace(task, file=task.file.resolve(), folder=task.folder.resolve()): task
        for task in tasks
    }
    package = ray_package()
    with ray_cluster(package, ray or None):
        given = uuid4().hex, make
        for task, reference in spread(package, reconstruct_there, given, list(shared)):
            yield shared[task], _checked(shared[task], ray_result(package, reference))


def reconstruct_there(run: str, make: Callable[[], Pipeline], task: Task) -> Outcome:
    """Return what came of a photo on another computer; a process makes one pipeline a run."""
    if not task.file.is_file():
        problem = f"{task.file}: not on every computer of the cluster, expected a shared folder"
        return Outcome({"photo": str(task.file), "ok": False, "error": problem})
    if run not in _MADE:
        _MADE.clear()
        _MADE[run] = make()
    with _drawing(None) as drawing:
        return reconstruct_one(_MADE[run], task, drawing)


_MADE: dict[str, Pipeline] = {}
"""The pipeline of this process, by the run that it is for."""


def _checked(task: Task, outcome: Outcome) -> Outcome:
    """Return an outcome under the names of this computer, or what is wrong about its folder."""
    entry = outcome.entry | {"photo": str(task.file)}
    if not entry["ok"]:
        return Outcome(entry)
    if not task.done():
        problem = f"{task.folder}: not here, expected a folder that all computers share"
        return Outcome({"photo": str(task.file), "ok": False, "error": problem})
    return Outcome(entry | {"output": str(task.folder)}, outcome.text)


def reconstruct_one(pipeline: Pipeline, task: Task, artist: Executor) -> Outcome:
    """Return what came of a photo; what is wrong with it is told and does not stop the others."""
    file, folder, choice = task.file, task.folder, task.choice
    try:
        height = choice.camera_height
        image, panorama = read_panorama(file, camera_height=height, columns=ENOUGH_COLUMNS)
        start = time.perf_counter()
        placed = pipeline.place(image, panorama, name=file.stem)
        # imported meanwhile in another thread
        from panoscene.cli._results import results  # noqa: PLC0415

        with results(placed, artist) as drawn:
            result = pipeline.shape(placed, resolution=choice.resolution)
            seconds = time.perf_counter() - start
            drawn.write(result, file, folder)
    except (PanoramaError, SceneFormatError, InputError) as error:
        return Outcome({"photo": str(file), "ok": False, "error": str(error)})
    except OSError as error:
        message = f"{folder}: cannot be written: {(error.strerror or str(error)).lower()}"
        return Outcome({"photo": str(file), "ok": False, "error": message})
    entry = {
        "photo": str(file),
        "ok": True,
        "new": True,
        "output": str(folder),
        "objects": len(result.scene.objects.boxes),
        "corners": len(result.scene.layout.floor_polygon),
        **account(result),
    }
    return Outcome(entry, tuple(_lines(result, folder, seconds)))


def _lines(result: Reconstruction, folder: Path, seconds: float) -> Iterator[str]:
    """Return what was found, in sentences."""
    from panoscene.views import describe_violations  # noqa: PLC0415 (as above)

    scene = result.scene
    names = [_name(scene, k) for k in range(len(scene.objects.boxes))]
    counted = ", ".join(
        f"{names.count(name)} {name}"
        for name in sorted(set(names), key=lambda n: (-names.count(n), n))
    )
    corners = len(scene.layout.floor_polygon)
    height = scene.layout.ceiling_height - scene.layout.floor_height
    yield f"{scene.name}: a room with {corners} corners, {height:.2f} m high, in {seconds:.1f} s"
    yield f"  {len(names)} objects: {counted}" if names else "  no objects"
    if result.certificate is not None:
        yield f"  before the arrangement: {describe_violations(result.certificate.before)}"
        yield f"  after it: {describe_violations(result.certificate.after)}"
    yield f"  open {folder / 'report.html'} in a browser; the scene is {folder / SCENE}"


def _name(scene: Any, index: int) -> str:
    return words(CATEGORIES[int(scene.objects.category[index])])
