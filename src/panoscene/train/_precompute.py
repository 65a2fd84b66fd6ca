"""The first stages, run once over a data set for the stages that learn from what they find."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import torch
from torch import Tensor

from panoscene.data import RECORDS, StageRecord, write_stage_record
from panoscene.models.layout import LayoutPrediction
from panoscene.scene import Detections, upright_photo, write_atomically
from panoscene.synth.dataset import PanoramaItem, open_dataset

from ._environment import data_hash
from ._errors import TrainError

HEADER = "precompute.json"


Detector = Callable[[Tensor], Detections]
"""Finds objects in an upright panorama, such as a ``DetectorStage``."""
LayoutReader = Callable[..., LayoutPrediction]
"""Reads the room from an upright panorama and ``camera_height``, such as a ``LayoutStage``."""


def precompute(
    data: Path,
    output: Path,
    *,
    detector: Detector | None,
    layout: LayoutReader | None,
    sources: Mapping[str, str],
    splits: Sequence[str] = ("train", "val"),
    told: Callable[[int, int], None] = lambda done, total: None,
) -> int:
    """Write what detector and layout network find in each panorama; return how many were new.

    Panoramas are turned upright as their labels say. Records that are there are kept, so the work
    may be stopped at any time; each appears as a whole or not at all.

    Args:
        data: Folder of a data set.
        output: Folder that gets precompute.json and records/NAME.json.
        detector: None writes records without detections.
        layout: None writes records without layouts.
        sources: What the stages are, such as the hashes of their weights: records of others are
            not mixed with these.
        splits: Parts of the data set.
        told: Called with how many are done, and how many there are.

    Raises:
        TrainError: The folder has records of other weights or data.
        DatasetError: The data set is damaged.
    """
    items = [item for split in splits for item in open_dataset(data, split)]
    begin_records(output, {"data_hash": data_hash(data), **sources})
    new = 0
    for done, item in enumerate(items):
        told(done, len(items))
        file = output / RECORDS / f"{item.name}.json"
        if not file.is_file():
            write_stage_record(stage_record(item, detector, layout), file)
            new += 1
    told(len(items), len(items))
    return new


@torch.inference_mode()
def stage_record(
    item: PanoramaItem, detector: Detector | None, layout: LayoutReader | None
) -> StageRecord:
    """Return what the stages find in a panorama."""
    panorama = item.scene().panorama
    image = upright_photo(item.image(), panorama)
    if detector is None:
        empty = torch.zeros(0)
        found = Detections(empty.reshape(0, 4), empty.long(), empty)
    else:
        found = detector(image)
    if layout is None:
        return StageRecord(found)
    room = layout(image, camera_height=panorama.camera_height)
    return StageRecord(found, room.layout, room.ambiguous)


def begin_records(output: Path, header: Mapping[str, str], folder: str = RECORDS) -> None:
    """Make the folder of the records, or check that it is of the same stages and data.

    Args:
        output: Where precompute.json is.
        header: What the records are made with.
        folder: Of the records, in ``output``.

    Raises:
        TrainError: It is of others, or no folder.
    """
    if output.exists() and not output.is_dir():
        raise TrainError(output, "found a file, expected a folder")
    (output / folder).mkdir(parents=True, exist_ok=True)
    file = output / HEADER
    if file.is_file():
        try:
            before = json.loads(file.read_text(encoding="utf-8"))
        except json.JSONDecodeError:
            before = None
        if before != dict(header):
            raise TrainError(file, "found records of other weights or data: take a new folder")
        return
    write_atomically(file, json.dumps(dict(header), indent=2) + "\n")
