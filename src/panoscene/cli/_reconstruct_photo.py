"""One photo: from its pixels to files for people and programs in its folder."""

import time
import traceback
from collections.abc import Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from panoscene.cli._account import account
from panoscene.cli._errors import InputError
from panoscene.cli._reconstruct import ENOUGH_COLUMNS, SCENE, Outcome, Task, failure
from panoscene.cli._results import results
from panoscene.models import CheckpointError
from panoscene.pipeline import Pipeline, Reconstruction, load_steps
from panoscene.scene import CATEGORIES, PanoramaError, SceneFormatError, read_panorama
from panoscene.style import words
from panoscene.views import describe_violations


@contextmanager
def loading(pipeline: Pipeline) -> Iterator[None]:
    """Load in another thread what the first photo needs later than it is needed here."""
    with ThreadPoolExecutor(max_workers=1) as pool:
        for step in load_steps(pipeline.stages):
            pool.submit(step)
        try:
            yield
        finally:
            pool.shutdown(cancel_futures=True)


def reconstruct_photo(pipeline: Pipeline, task: Task, artist: Executor) -> Outcome:
    """Return what came of a photo; nothing that goes wrong with it stops the others."""
    file, folder, choice = task.file, task.folder, task.choice
    try:
        height = choice.camera_height
        image, panorama = read_panorama(file, camera_height=height, columns=ENOUGH_COLUMNS)
        start = time.perf_counter()
        placed = pipeline.place(image, panorama, name=file.stem)
        with results(placed, artist) as drawn:
            result = pipeline.shape(placed, resolution=choice.resolution)
            seconds = time.perf_counter() - start
            drawn.write(result, file, folder)
    except (PanoramaError, SceneFormatError, InputError) as error:
        return failure(task, str(error))
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        return failure(task, f"{folder}: cannot be written: {reason}")
    except CheckpointError:  # of weights, not of this photo
        raise
    except Exception as error:  # noqa: BLE001 - a fault of ours costs one photo, not the batch
        said = " ".join(str(error).split())
        found = f"{type(error).__name__}: {said}" if said else type(error).__name__
        problem = f"{file}: found a fault of panoscene with this photo ({found}); please report it"
        return failure(task, problem, fault=traceback.format_exc())
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
