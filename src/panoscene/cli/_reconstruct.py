# ruff: noqa: PLC0415
# The imports stand inside: who names a photo that cannot be used does not wait for torch.
"""Photos in, scenes out: which photos, where their results go, and what came of each."""

import hashlib
import json
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from uuid import uuid4

from panoscene._photo import PanoramaError, read_photo
from panoscene._ray import ray_cluster, ray_package, ray_result, spread
from panoscene.cli._errors import InputError
from panoscene.cli._folders import check_folder
from panoscene.cli._importing import importing
from panoscene.cli._progress import progress_bar
from panoscene.cli._terminal import complain, note, say, say_json

PHOTOS = frozenset({".jpg", ".jpeg", ".png", ".tif", ".tiff", ".webp", ".bmp"})
ENOUGH_COLUMNS = 4096
"""Of a photo: networks see 1,024, and 16,384 take gigabytes."""
SCENE = "scene.json"
"""The file that is written last: where it is, everything is."""
ACCOUNT = "reconstruction.json"
"""The file that says how the scene came about, and of which photo it is."""


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
        if not argument:
            raise InputError("PHOTO: found an empty name, expected photos, folders or patterns")
        path = Path(argument)
        if path.is_dir():
            inside = (file for file in path.iterdir() if file.suffix.lower() in PHOTOS)
            named = filter(Path.is_file, inside)
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


def account_of_photo(file: Path) -> dict[str, str]:
    """Return what results say of the photo that they are of, so that no other is taken for it."""
    with file.open("rb") as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
    return {"photo": file.resolve().name, "photo_sha256": digest}


@dataclass(frozen=True, slots=True)
class Task:
    """One photo, and where its results go."""

    file: Path
    folder: Path
    choice: Choice

    def done(self) -> bool:
        """Return whether the results of this photo are there."""
        if not (self.folder / SCENE).is_file():
            return False
        try:
            account = json.loads((self.folder / ACCOUNT).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return True
        if not isinstance(account, dict):
            return True
        try:
            own = account_of_photo(self.file)
        except OSError:  # whoever reads it will say so
            return False
        return all(account.get(key, value) == value for key, value in own.items())


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a photo."""

    entry: dict[str, Any]
    """For programs."""
    text: tuple[str, ...] = ()
    """For people, line by line."""


def reconstruct_files(
    make: Callable[[], Any],
    files: Sequence[Path],
    output: Path,
    choice: Choice,
    *,
    as_json: bool,
    ray: str | None = None,
    artist: Callable[[], AbstractContextManager[Executor]] | None = None,
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
        artist: gives who draws pictures; None draws them in this process, as on a cluster.
    """
    folders = photo_folders(files, output)
    tasks = [Task(file, folders[file], choice) for file in files]
    left = deque(task for task in tasks if not (choice.resume and task.done()))
    told: dict[Path, dict[str, Any]] = {}

    def tell(task: Task, outcome: Outcome) -> None:
        told[task.file] = outcome.entry
        if "error" in outcome.entry:
            if "fault" in outcome.entry:
                note(outcome.entry["fault"].rstrip())
            complain(outcome.entry["error"])
        for flag in outcome.entry.get("flags", ()):
            note(f"{task.file}: {flag['text']}")
        for line in () if as_json else outcome.text:
            say(line)

    # nobody waits for libraries that no photo needs
    while ray is None and left and (refusal := _refusal(left[0])) is not None:
        tell(left.popleft(), refusal)
    with (
        _working(make, left, ray, artist) as outcomes,
        progress_bar("reconstructing", len(left)) as advance,
    ):
        for task, outcome in outcomes:
            tell(task, outcome)
            advance(1)
    entries = [told.get(task.file) or _there(task) for task in tasks]
    if as_json:
        say_json(entries)
        return _code(entries)
    made = sum(entry["ok"] for entry in entries)
    kept = sum(not entry.get("new", True) for entry in entries)
    if len(files) > 1:
        before = f", {kept} of them before" if kept else ""
        say(f"wrote {output}: {made} of {len(files)} photos{before}")
    elif kept:
        say(f"{output}: the results are there, nothing was done")
    return _code(entries)


def _refusal(task: Task) -> Outcome | None:
    """Return what is wrong with a photo, before anything else is loaded."""
    try:
        read_photo(task.file, ENOUGH_COLUMNS)
    except PanoramaError as error:
        return failure(task, str(error))
    return None


def failure(task: Task, error: str, **more: str) -> Outcome:
    """Return that nothing came of a photo, and what more programs are told."""
    return Outcome({"photo": str(task.file), "ok": False, "error": error, **more})


def _code(entries: Iterable[dict[str, Any]]) -> int:
    """Return the exit code: 1 where the program failed, 2 where a photo could not be used."""
    failed = [entry for entry in entries if not entry["ok"]]
    return (1 if any("fault" in entry for entry in failed) else 2) if failed else 0


def _there(task: Task) -> dict[str, Any]:
    return {"photo": str(task.file), "ok": True, "output": str(task.folder), "new": False}


@contextmanager
def _working(
    make: Callable[[], Any],
    tasks: Sequence[Task],
    ray: str | None,
    artist: Callable[[], AbstractContextManager[Executor]] | None,
) -> Iterator[Iterable[tuple[Task, Outcome]]]:
    """Give tasks with what came of them, as they finish."""
    if not tasks:
        yield ()
    elif ray is not None:
        yield _spread(make, tasks, ray)
    else:
        with importing():
            from panoscene.cli._reconstruct_photo import loading, reconstruct_photo
        with (artist or _thread)() as drawing:
            pipeline = make()
            with loading(pipeline):
                yield ((task, reconstruct_photo(pipeline, task, drawing)) for task in tasks)


def _thread() -> AbstractContextManager[Executor]:
    return ThreadPoolExecutor(max_workers=1)


def _spread(
    make: Callable[[], Any], tasks: Sequence[Task], ray: str
) -> Iterator[tuple[Task, Outcome]]:
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


def reconstruct_there(run: str, make: Callable[[], Any], task: Task) -> Outcome:
    """Return what came of a photo on another computer; a process makes one pipeline a run."""
    from panoscene.cli._reconstruct_photo import reconstruct_photo

    if not task.file.is_file():
        found = f"{task.file}: not on every computer of the cluster"
        return failure(task, f"{found}, expected a shared folder")
    if run not in _MADE:
        _MADE.clear()
        _MADE[run] = make()
    with _thread() as drawing:
        return reconstruct_photo(_MADE[run], task, drawing)


_MADE: dict[str, Any] = {}
"""The pipeline of this process, by the run that it is for."""


def _checked(task: Task, outcome: Outcome) -> Outcome:
    """Return an outcome under the names of this computer, or what is wrong about its folder."""
    entry = outcome.entry | {"photo": str(task.file)}
    if not entry["ok"]:
        return Outcome(entry)
    if not task.done():
        problem = f"{task.folder}: not here, expected a folder that all computers share"
        return failure(task, problem)
    return Outcome(entry | {"output": str(task.folder)}, outcome.text)
