"""What the first stages found in each panorama, in files, so that it is computed once."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import torch
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from torch import Tensor

from panoscene.scene import (
    CATEGORIES,
    Detections,
    Layout,
    category_index,
    write_atomically,
)
from panoscene.synth.dataset import DatasetError, decode_mask, encode_mask

RECORDS = "records"
"""Folder of the records in the output of ``panoscene precompute``."""
_DIGITS = 6
Numbers4 = tuple[float, float, float, float]
Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class StageRecord:
    """What detector and layout network found in one upright panorama."""

    detections: Detections
    layout: Layout | None = None
    ambiguous: bool = False
    """Whether the layout network saw two readings of the room."""


class _Format(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class _Mask(_Format):
    size: tuple[int, int]
    counts: str


class _Detection(_Format):
    category: str
    bfov: Numbers4
    score: Annotated[float, Field(ge=0.0, le=1.0)]
    mask: _Mask | None = None


class _Layout(_Format):
    floor_polygon: list[Point]
    ceiling_height: float
    wall_score: list[float] | None = None
    raw_polygon: list[Point] | None = None
    ambiguous: bool = False


class _Record(_Format):
    format: Literal["panoscene/stage-record"] = "panoscene/stage-record"
    version: Literal[1] = 1
    detections: list[_Detection]
    layout: _Layout | None = None


def write_stage_record(record: StageRecord, path: Path) -> None:
    """Write what was found in a panorama as JSON, in one step; masks as COCO's run lengths."""
    found = record.detections
    masks = [None] * len(found.category) if found.mask is None else list(found.mask)
    detections = [
        _Detection(
            category=CATEGORIES[int(found.category[k])],
            bfov=_row(found.bfov[k]),
            score=round(float(found.score[k].clamp(0.0, 1.0)), _DIGITS),
            mask=None if mask is None else _mask(mask),
        )
        for k, mask in enumerate(masks)
    ]
    document = _Record(detections=detections, layout=_layout_format(record))
    write_atomically(path, document.model_dump_json(exclude_none=True) + "\n")


def read_stage_record(path: Path, *, masks: bool = True) -> StageRecord:
    """Return what was found in a panorama.

    Args:
        path: Written by ``write_stage_record``.
        masks: Whether to give detections their masks, which are large.

    Raises:
        DatasetError: The file is missing or damaged.
    """
    try:
        record = _Record.model_validate_json(path.read_bytes())
        detections = _detections(record.detections, masks=masks)
    except OSError as error:
        raise DatasetError(path, f"expected a stage record, found: {error.strerror}") from None
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the file"
        raise DatasetError(path, f"{where}: {first['msg']}") from None
    except ValueError as error:
        raise DatasetError(path, str(error)) from None
    layout = record.layout
    if layout is None:
        return StageRecord(detections)
    return StageRecord(
        detections,
        Layout(
            torch.tensor(layout.floor_polygon),
            ceiling_height=layout.ceiling_height,
            wall_score=None if layout.wall_score is None else torch.tensor(layout.wall_score),
            raw_polygon=None if layout.raw_polygon is None else torch.tensor(layout.raw_polygon),
        ),
        layout.ambiguous,
    )


def read_stage_records(folder: Path, *, masks: bool = False) -> dict[str, StageRecord]:
    """Return what ``panoscene precompute`` wrote, by the names of the panoramas.

    Args:
        folder: Its output.
        masks: Whether to give detections their masks, which are large.

    Raises:
        DatasetError: There are no records, or one is damaged.
    """
    files = sorted((folder / RECORDS).glob("*.json"))
    if not files:
        raise DatasetError(folder, "found no records there; make them with panoscene precompute")
    return {file.stem: read_stage_record(file, masks=masks) for file in files}


def _detections(found: list[_Detection], *, masks: bool) -> Detections:
    pixels = [
        torch.from_numpy(decode_mask(list(entry.mask.size), entry.mask.counts).copy())
        for entry in found
        if entry.mask is not None and masks
    ]
    if pixels and (len(pixels) != len(found) or len({mask.shape for mask in pixels}) != 1):
        raise ValueError("detections: expected masks of one size for all or for none")
    return Detections(
        bfov=torch.tensor([entry.bfov for entry in found]).reshape(-1, 4),
        category=torch.tensor([category_index(e.category) for e in found], dtype=torch.int64),
        score=torch.tensor([entry.score for entry in found]),
        mask=torch.stack(pixels) if pixels else None,
    )


def _layout_format(record: StageRecord) -> _Layout | None:
    layout = record.layout
    if layout is None:
        return None
    return _Layout(
        floor_polygon=[_row(point) for point in layout.floor_polygon],
        ceiling_height=round(layout.ceiling_height, _DIGITS),
        wall_score=None if layout.wall_score is None else list(_row(layout.wall_score)),
        raw_polygon=None
        if layout.raw_polygon is None
        else [_row(point) for point in layout.raw_polygon],
        ambiguous=record.ambiguous,
    )


def _row(numbers: Tensor) -> tuple[float, ...]:
    return tuple(round(value, _DIGITS) for value in numbers.double().tolist())


def _mask(mask: Tensor) -> _Mask:
    runs = encode_mask(np.ascontiguousarray(mask.numpy(force=True)))
    height, width = runs["size"]
    return _Mask(size=(height, width), counts=runs["counts"])
