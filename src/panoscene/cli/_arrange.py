"""Scene files in batches: repaired, certified, drawn."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from panoscene.arrange import ArrangementSettings, Certificate, arrange_scenes
from panoscene.cli._doubts import note_doubts
from panoscene.cli._errors import InputError
from panoscene.cli._files import (
    beside,
    blaming,
    write_scene_from,
    write_text,
    writing,
)
from panoscene.cli._progress import progress_bar
from panoscene.cli._scene_files import CERTIFICATE, scene_files, scene_targets
from panoscene.cli._tables import say_certificates
from panoscene.cli._terminal import complain, json_text, say, say_json
from panoscene.scene import Scene, SceneFormatError, read_scene

PICTURE, REPORT, ANIMATION = ".before-after.png", ".report.html", ".repair.webp"
"""What the names of pictures end in; never that of the photo next to the scene."""
BATCH = 64
"""Scenes that are solved together."""
BATCH_PAIRS = BATCH * 40**2
"""Pairs of objects in a batch, padding included, so that memory stays below some 100 MB."""


@dataclass(frozen=True, slots=True)
class Extras:
    """What to draw of each repaired scene."""

    picture: bool = False
    report: bool = False
    animation: bool = False

    @property
    def endings(self) -> dict[str, str]:
        """Return what is drawn, with the ending of its file's name."""
        known = {"picture": PICTURE, "report": REPORT, "animation": ANIMATION}
        return {name: ending for name, ending in known.items() if getattr(self, name)}


def arrange_files(
    arguments: Sequence[str],
    output: Path,
    settings: ArrangementSettings,
    extras: Extras,
    *,
    as_json: bool,
) -> int:
    """Repair the scenes that arguments name, say what happened, and return the exit code."""
    files = scene_files(arguments)
    targets = scene_targets(files, output)
    results: dict[Path, _Result] = {}
    with progress_bar("arranging", len(files)) as advance:
        for start in range(0, len(files), BATCH):
            for result in _arranged(files[start : start + BATCH], settings):
                results[result.file] = _written(result, targets[result.file], settings, extras)
                advance(1)
    in_order = [results[file] for file in files]
    if as_json:
        say_json([_as_json(result, targets[result.file], extras) for result in in_order])
    else:
        _say_table(in_order, targets[files[0]] if len(files) == 1 else output)
        for ending in extras.endings.values() if len(files) == 1 else ():
            if in_order[0].certificate is not None:
                say(f"wrote {beside(targets[files[0]], ending)}")
    return 2 if any(result.error for result in in_order) else 0


@dataclass(frozen=True, slots=True)
class _Result:
    """What became of one file: an arrangement of a scene, or an error."""

    file: Path
    scene: Scene | None = None
    certificate: Certificate | None = None
    arranged: Scene | None = None
    seconds: float = 0.0
    """Of the batch that the scene was arranged in."""
    error: str = ""


def _arranged(files: Sequence[Path], settings: ArrangementSettings) -> Iterator[_Result]:
    """Yield what becomes of each file, in any order."""
    scenes: list[tuple[Path, Scene]] = []
    for file in files:
        try:
            scene = read_scene(file)
        except SceneFormatError as error:
            yield _Result(file, error=str(error))
            continue
        note_doubts(scene, file)
        scenes.append((file, scene))
    for batch in batches(scenes):
        yield from _solved(batch, settings)


def batches(scenes: Sequence[tuple[Path, Scene]]) -> Iterator[list[tuple[Path, Scene]]]:
    """Yield scenes with similar numbers of objects, few enough that their pairs fit in memory."""
    batch: list[tuple[Path, Scene]] = []
    for file, scene in sorted(scenes, key=lambda item: len(item[1].objects.boxes)):
        if batch and (len(batch) + 1) * len(scene.objects.boxes) ** 2 > BATCH_PAIRS:
            yield batch
            batch = []
        batch.append((file, scene))
    if batch:
        yield batch


def _solved(
    batch: Sequence[tuple[Path, Scene]], settings: ArrangementSettings
) -> Iterator[_Result]:
    start = time.perf_counter()
    try:
        with blaming(batch[0][0]):
            arrangements = arrange_scenes([s for _, s in batch], settings)
    except InputError as error:
        if len(batch) == 1:
            yield _Result(batch[0][0], error=str(error))
            return
        # one scene cannot be arranged: find out which, and arrange the others
        for item in batch:
            yield from _solved([item], settings)
        return
    seconds = time.perf_counter() - start
    for (file, scene), found in zip(batch, arrangements, strict=True):
        yield _Result(file, scene, found.certificate, found.scene, seconds)


def _written(
    result: _Result, target: Path, settings: ArrangementSettings, extras: Extras
) -> _Result:
    """Write what belongs to a result, the scene last: where it is, everything is."""
    if result.scene is None or result.certificate is None or result.arranged is None:
        complain(result.error)
        return result
    document = {"schema": "panoscene/certificate", "version": 1, **result.certificate.as_dict()}
    try:
        _draw(result, target, settings, extras)
        write_text(beside(target, CERTIFICATE), json_text(document) + "\n")
        write_scene_from(result.file, result.arranged, target)
    except ValueError as error:
        complain(str(error))
        return _Result(result.file, error=str(error))
    # the scenes themselves are not needed any more
    return _Result(result.file, certificate=result.certificate)


def _draw(result: _Result, target: Path, settings: ArrangementSettings, extras: Extras) -> None:
    """Draw what was asked for."""
    before, after, certificate = result.scene, result.arranged, result.certificate
    if not extras.endings or before is None or after is None or certificate is None:
        return
    # matplotlib takes as long to load as a scene to repair
    from panoscene.cli._photos import photo_image  # noqa: PLC0415
    from panoscene.views import (  # noqa: PLC0415
        describe_violations,
        draw_animation,
        draw_comparison,
        render_panorama,
        write_report,
    )

    if extras.picture:
        captions = [describe_violations(v) for v in (certificate.before, certificate.after)]
        path = beside(target, PICTURE)
        with writing(path), blaming(path):
            draw_comparison([("Before", before), ("After", after)], path, captions=captions)
    if extras.report:
        path = beside(target, REPORT)
        photo = photo_image(before, result.file, None)
        with writing(path), blaming(path):
            write_report(
                path,
                after,
                image=render_panorama(after) if photo is None else photo,
                image_caption="" if photo is not None else "Rendered from the boxes.",
                before=before,
                certificate=certificate,
                timings={"arrangement": result.seconds},
            )
    if extras.animation:
        path = beside(target, ANIMATION)
        with writing(path), blaming(path):
            draw_animation(before, path, settings=settings, title=before.name)


def _as_json(result: _Result, target: Path, extras: Extras) -> dict[str, Any]:
    if result.certificate is None:
        return {"scene": str(result.file), "ok": False, "error": result.error}
    found: dict[str, Any] = {"scene": str(result.file), "ok": True, "output": str(target)}
    found |= {name: str(beside(target, ending)) for name, ending in extras.endings.items()}
    return {**found, "certificate": result.certificate.as_dict()}


def _say_table(results: Sequence[_Result], output: Path) -> None:
    rows = [(r.file, r.certificate) for r in results if r.certificate is not None]
    if not rows:
        return
    say_certificates(rows)
    say(f"wrote {output}" + ("" if len(results) == 1 else f": {len(rows)} of {len(results)}"))
