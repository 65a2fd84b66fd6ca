"""The pipeline on a rendered set: what it predicts, and what its parts and oracles predict."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path

from panoscene.eval._export import MANIFEST, PREDICTIONS, TARGETS
from panoscene.eval._methods import mean_box_scene
from panoscene.eval._rendered_rows import ROWS
from panoscene.pipeline import Given, Pipeline
from panoscene.scene import (
    Detections,
    Panorama,
    Scene,
    Shapes,
    write_atomically,
    write_scene,
)
from panoscene.synth.dataset import PanoramaItem

SHAPED = ("full", "without-arrangement")
"""Rows whose objects have meshes, if the pipeline makes some; the others are boxes."""


def export_reconstructions(
    output: Path,
    items: Sequence[PanoramaItem],
    pipeline: Pipeline,
    *,
    data: str,
    sources: Mapping[str, str],
    true_scene: Callable[[PanoramaItem], Scene] = PanoramaItem.scene,
    told: Callable[[int, int], None] = lambda done, total: None,
) -> int:
    """Write the truth and what the pipeline and its parts predict; return how many were new.

    The folder gets ``targets/NAME.json``, ``predictions/ROW/NAME.json`` and last ``export.json``.
    Panoramas that are done are left out, so the work may be stopped at any time.

    Args:
        output: Folder; it is made if it does not exist.
        items: Panoramas of a rendered set.
        pipeline: With all its stages; those of ``SHAPED`` get meshes if it makes shapes.
        data: What the panoramas are, for the reader of the scores.
        sources: What the pipeline consists of, such as the hashes of its weights.
        true_scene: Reads the true scene of a panorama; one with meshes lets shapes be scored.
        told: Called with how many are done, and how many there are.

    Raises:
        ValueError: The folder has predictions of another pipeline.
        DatasetError: The data set is damaged.
    """
    _begin(output, {"data": data, **sources})
    new = 0
    for done, item in enumerate(items):
        told(done, len(items))
        target = output / TARGETS / f"{item.name}.json"
        if target.is_file():
            continue
        truth = replace(true_scene(item), name=item.name)
        for name, scene in predicted_rows(item, truth, pipeline).items():
            write_scene(scene, _made(output / PREDICTIONS / name) / f"{item.name}.json")
        # the truth comes last: where it is, everything is
        write_scene(truth, _made(target.parent) / target.name)
        new += 1
    told(len(items), len(items))
    manifest = {
        "schema": "panoscene/export",
        "version": 1,
        "data": data,
        "scenes": len(items),
        "sources": dict(sources),
        "parts": {item.name: item.split for item in items},
        "methods": {name: asdict(row) for name, row in ROWS.items()},
    }
    write_atomically(output / MANIFEST, json.dumps(manifest, indent=2) + "\n")
    return new


def predicted_rows(item: PanoramaItem, truth: Scene, pipeline: Pipeline) -> dict[str, Scene]:
    """Return what each of ``ROWS`` predicts for a panorama.

    Every row but the oracles sees the photo and the height of its camera alone.

    Args:
        item: The panorama.
        truth: Its true scene.
        pipeline: With all its stages.
    """
    image = item.image()
    stages = replace(pipeline.stages, shape=None)
    unshaped = Pipeline(stages, settings=pipeline.settings)
    alone = Pipeline(replace(stages, context=None), settings=None)
    repaired = Pipeline(replace(stages, context=None), settings=pipeline.settings)
    photo = Panorama(image.shape[-1], image.shape[-2], camera_height=truth.panorama.camera_height)
    full = pipeline(image, photo, name=item.name)
    objects = full.initial.objects
    seen = Detections(objects.bfov, objects.category, objects.score)
    room = full.initial.layout
    upright = full.initial.panorama
    found = Given(detections=seen, layout=room, upright_from_photo=upright.upright_from_photo)
    pose = alone(image, photo, given=found, name=item.name).scene
    true_objects = truth.objects
    true_seen = Detections(true_objects.bfov, true_objects.category, true_objects.score)
    in_true_frame = replace(found, upright_from_photo=truth.panorama.upright_from_photo)
    told_all = replace(
        in_true_frame, detections=true_seen, layout=truth.layout, relations=truth.relations
    )
    # the same objects have the same meshes, wherever their boxes are
    meshes = full.scene.objects.shapes
    placed = replace(full.initial, objects=replace(objects, shapes=meshes))
    told_boxes = replace(found, objects=replace(true_objects, shapes=Shapes()))
    return {
        "full": full.scene,
        "without-arrangement": placed,
        "pose-arranged": repaired(image, photo, given=found, name=item.name).scene,
        "pose": pose,
        "mean-box": mean_box_scene(pose),
        "true-layout": unshaped(
            image, photo, given=replace(in_true_frame, layout=truth.layout), name=item.name
        ).scene,
        "true-detections": unshaped(
            image, photo, given=replace(in_true_frame, detections=true_seen), name=item.name
        ).scene,
        "true-boxes": alone(image, photo, given=told_boxes, name=item.name).scene,
        "true-relations": unshaped(image, photo, given=told_all, name=item.name).scene,
    }


def _begin(output: Path, header: Mapping[str, str]) -> None:
    """Make the folder, or check that what it has is of the same pipeline and data."""
    file = _made(output) / "sources.json"
    text = json.dumps(dict(header), indent=2) + "\n"
    if not file.is_file():
        write_atomically(file, text)
    elif file.read_text(encoding="utf-8") != text:
        raise ValueError(f"{output}: found predictions of another pipeline or other panoramas")


def _made(folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    return folder
