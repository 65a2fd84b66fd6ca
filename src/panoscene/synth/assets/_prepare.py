"""Making the cache: find the libraries, convert what is new, write the index."""

import hashlib
import multiprocessing
import time
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

import numpy as np

from ._archives import FolderFiles, ModelFiles, ZipFiles
from ._cache import (
    CACHE_VERSION,
    CacheIndex,
    ModelEntry,
    entry_of_file,
    file_word,
    read_index,
    write_index,
    write_model,
)
from ._catalogue import default_materials, read_catalogue
from ._convert import convert_models
from ._debian import fetch_libraries, libraries_in, unpack_libraries
from ._decimate import MAX_FACES
from ._errors import AssetError
from ._library import ModelLibrary, extended, load_library
from ._materials import MtlEntry, parse_mtl
from ._shape_files import SAMPLES, read_shape, sample_shape, shape_file, write_shape
from ._specs import ModelSpec, folder_models, known_models
from ._watertight import RESOLUTION

Progress = Callable[[int, int, str], None]
"""Called with how many steps are done, how many there are, and what was done last."""
_CONVERTER = 3
"""Counted up whenever the same file would become another model."""
_Task = TypeVar("_Task")
_Result = TypeVar("_Result")


@dataclass(frozen=True, slots=True)
class AssetReport:
    """What ``prepare_assets`` did."""

    converted: int
    kept: int
    """Models that were in the cache already and whose source has not changed."""
    failed: tuple[tuple[str, str], ...]
    """Id and reason."""
    libraries: tuple[str, ...]
    categories: dict[str, int] = field(default_factory=dict)
    """Models per category in the whole cache."""
    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class _ConvertTask:
    cache: Path
    library: Path
    specs: tuple[ModelSpec, ...]
    keys: tuple[str, ...]
    max_faces: int
    digest: str
    """Of the library: another content is opened anew."""


def prepare_assets(
    cache: Path | str,
    sources: Sequence[Path | str] = (),
    *,
    progress: Progress | None = None,
    processes: int = 2,
    max_faces: int = MAX_FACES,
    seed: int = 0,
    unseen_share: float = 0.15,
) -> AssetReport:
    """Return what was done to fill a cache with the models of furniture libraries.

    Run again, it converts only what is missing or has changed; a run that was killed goes on where
    it stopped. The split of models that are in the index stays as it is.

    Args:
        cache: Folder to fill; made if it is not there.
        sources: Library files (.sh3f, .jar, .deb), folders of them, or folders of .glb and .obj
            files with a ``models.csv``. Without any, the Debian packages are downloaded.
        progress: Told of every model file that is done.
        processes: Run side by side; 1 stays in this process.
        max_faces: Models with more triangles are simplified.
        seed: Of the split into seen and unseen models.
        unseen_share: Of the base models of every category with enough of them.

    Raises:
        AssetError: A source is missing, damaged or hostile, or has no model that is known.
    """
    start = time.perf_counter()
    folder = Path(cache)
    folder.mkdir(parents=True, exist_ok=True)
    index = _old_index(folder, seed, unseen_share)
    libraries = _libraries(folder, [Path(source) for source in sources])
    digests = {path: _digest(path) for path in libraries}
    tasks: list[_ConvertTask] = []
    for path in libraries:
        tasks += _tasks(folder, path, digests[path], max_faces)
    if not tasks:
        raise AssetError(folder, f"found no known model in {[path.name for path in libraries]}")
    kept, todo = _already_there(tasks)
    done: list[ModelEntry] = []
    failed: list[tuple[str, str]] = []
    for results in _in_parallel(_convert, todo, processes, progress, lambda t: t.specs[0].id):
        done += [result for result in results if isinstance(result, ModelEntry)]
        failed += [result for result in results if isinstance(result, tuple)]
    names = {path.name: digests[path] for path in libraries}
    index = index.model_copy(update={"libraries": index.libraries | names})
    index = extended(index, [*kept, *done])
    write_index(folder, index)
    return AssetReport(
        converted=len(done),
        kept=len(kept),
        failed=tuple(failed),
        libraries=tuple(names),
        categories=dict(sorted(Counter(entry.category for entry in index.models).items())),
        seconds=time.perf_counter() - start,
    )


def _old_index(cache: Path, seed: int, unseen_share: float) -> CacheIndex:
    """Return the index that is there, without models whose files are gone, or a new one.

    An index that cannot be read, or one of another version, is made anew: the same seed gives the
    same split.
    """
    try:
        index = read_index(cache)
    except AssetError:
        return CacheIndex(seed=seed, unseen_share=unseen_share)
    there = tuple(entry for entry in index.models if (cache / entry.file).exists())
    return index.model_copy(update={"models": there})


def _libraries(cache: Path, sources: list[Path]) -> tuple[Path, ...]:
    """Return the files and folders to read models from."""
    if not sources:
        return fetch_libraries(cache / "libraries")
    found: list[Path] = []
    for source in sources:
        if source.is_dir():
            inside = (source,) if (source / "models.csv").exists() else libraries_in(source)
            if not inside:
                raise AssetError(source, "expected .sh3f or .jar files or a models.csv in it")
            found += inside
        elif not source.is_file():
            raise AssetError(source, "no such file or folder")
        elif source.suffix.lower() == ".deb":
            (cache / "libraries").mkdir(exist_ok=True)
            found += unpack_libraries(source, cache / "libraries")
        else:
            found.append(source)
    libraries = tuple(dict.fromkeys(path.resolve() for path in found))
    names = Counter(path.name for path in libraries)
    for path in libraries:
        if names[path.name] > 1:
            reason = f"found {names[path.name]} sources of this name, which their models' ids have"
            raise AssetError(path, reason)
    return libraries


def _digest(path: Path) -> str:
    if path.is_dir():
        stats = [(p, p.stat()) for p in sorted(path.rglob("*")) if p.is_file()]
        facts = [(p.relative_to(path).as_posix(), s.st_size, s.st_mtime_ns) for p, s in stats]
        return hashlib.sha256(repr(facts).encode()).hexdigest()
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _tasks(cache: Path, library: Path, digest: str, max_faces: int) -> list[_ConvertTask]:
    """Return one task for each model file of a library: the model and those cut from it."""
    if library.is_dir():
        files = FolderFiles(library)
        table = files.read("models.csv").decode("utf-8-sig", "replace")
        groups = [(spec,) for spec in folder_models(table, files.name)]
    else:
        _opened(library, digest)
        by_file: dict[str, list[ModelSpec]] = {}
        for spec in known_models():
            if spec.library == library.name:
                by_file.setdefault(spec.file, []).append(spec)
        groups = [tuple(specs) for specs in by_file.values()]
    facts = (CACHE_VERSION, _CONVERTER, max_faces, digest)
    return [
        _ConvertTask(
            cache,
            library,
            specs,
            tuple(hashlib.sha256(repr((facts, spec)).encode()).hexdigest()[:32] for spec in specs),
            max_faces,
            digest,
        )
        for specs in groups
    ]


def _already_there(tasks: list[_ConvertTask]) -> tuple[list[ModelEntry], list[_ConvertTask]]:
    """Return the entries of models that are converted, and the tasks with one that is not."""
    kept: list[ModelEntry] = []
    todo: list[_ConvertTask] = []
    for task in tasks:
        entries = [_entry_with_key(task, k) for k in range(len(task.specs))]
        if any(entry is None for entry in entries):
            todo.append(task)
        else:
            kept += [entry for entry in entries if entry is not None]
    return kept, todo


def _entry_with_key(task: _ConvertTask, k: int) -> ModelEntry | None:
    file = f"models/{file_word(task.specs[k].id)}.npz"
    try:
        entry = entry_of_file(task.cache, file) if (task.cache / file).exists() else None
    except AssetError:
        return None
    return entry if entry is not None and entry.key == task.keys[k] else None


@lru_cache(maxsize=8)
def _opened(
    library: Path, digest: str
) -> tuple[ModelFiles, dict[str, dict[str, str]], dict[str, MtlEntry]]:
    """Return a library with its catalogue and default materials; open once in each process.

    Args:
        library: Archive or folder.
        digest: Of its content: a library that was replaced in between is opened anew.
    """
    del digest
    if library.is_dir():
        return FolderFiles(library), {}, {}
    files = ZipFiles(library)
    return files, read_catalogue(files), parse_mtl(default_materials(files))


def _convert(task: _ConvertTask) -> list[ModelEntry | tuple[str, str]]:
    """Return index entries of the models that were written, and id and reason of failures."""
    files, catalogue, defaults = _opened(task.library, task.digest)
    models = convert_models(task.specs, files, catalogue, defaults, task.max_faces)
    results: list[ModelEntry | tuple[str, str]] = []
    for spec, key, model in zip(task.specs, task.keys, models, strict=True):
        if isinstance(model, AssetError):
            results.append((spec.id, str(model)))
        else:
            results.append(write_model(task.cache, model, key, spec.confidence))
    return results


def _in_parallel(
    work: Callable[[_Task], _Result],
    tasks: Sequence[_Task],
    processes: int,
    progress: Progress | None,
    name: Callable[[_Task], str],
) -> Iterable[_Result]:
    """Yield the results in the order of the tasks, from this process or several new ones."""

    def told(results: Iterable[_Result]) -> Iterable[_Result]:
        for k, result in enumerate(results):
            if progress is not None:
                progress(k + 1, len(tasks), name(tasks[k]))
            yield result

    if processes <= 1 or len(tasks) < 2:
        yield from told(map(work, tasks))
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(processes, mp_context=context) as pool:
        yield from told(pool.map(work, tasks, chunksize=1))


@dataclass(frozen=True, slots=True)
class _ShapeTask:
    cache: Path
    id: str
    samples: int
    resolution: int


def prepare_shapes(
    cache: Path | str,
    ids: Iterable[str] | None = None,
    *,
    progress: Progress | None = None,
    processes: int = 2,
    samples: int = SAMPLES,
    resolution: int = RESOLUTION,
) -> tuple[tuple[str, str], ...]:
    """Return id and reason of models whose signed distances could not be sampled, mostly none.

    Models that have them already are passed over, so a run that was killed goes on.

    Args:
        cache: Folder that ``prepare_assets`` filled.
        ids: Which models; None for all that have a category.
        progress: Told of every model that is done.
        processes: Run side by side; 1 stays in this process.
        samples: Near the surface, and again as many uniform ones.
        resolution: Voxels along the longest side.
    """
    library = load_library(cache)
    wanted = library.ids(low_confidence=True) if ids is None else tuple(ids)
    chosen = [name for name in wanted if ids is not None or library.entries[name].category]
    tasks = [
        _ShapeTask(library.cache, name, samples, resolution)
        for name in chosen
        if _lacks(library, name)
    ]
    results = _in_parallel(_sample, tasks, processes, progress, lambda task: task.id)
    return tuple((task.id, why) for task, why in zip(tasks, results, strict=True) if why)


def _lacks(library: ModelLibrary, name: str) -> bool:
    path = library.cache / shape_file(name)
    model = library.cache / library.entries[name].file
    if not path.exists() or path.stat().st_mtime_ns < model.stat().st_mtime_ns:
        return True
    try:
        read_shape(library.cache, name)
    except AssetError:
        return True
    return False


def _sample(task: _ShapeTask) -> str:
    """Return why a model has no signed distances, or an empty text once they are written."""
    digest = hashlib.sha256(task.id.encode()).digest()
    rng = np.random.default_rng(int.from_bytes(digest[:8], "big"))
    try:
        model = load_library(task.cache)[task.id]
        write_shape(task.cache, task.id, sample_shape(model, rng, task.samples, task.resolution))
    except (AssetError, ValueError, RuntimeError) as error:
        return str(error)
    return ""
