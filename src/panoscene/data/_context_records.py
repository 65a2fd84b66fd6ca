"""What the first stages see of each panorama, in files: the input of the relation graph network."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path

import torch
from jaxtyping import Float, Int64
from torch import Tensor

from panoscene.scene import Layout, write_atomically
from panoscene.synth.dataset import DatasetError

ESTIMATES = "estimates"
"""Folder of the records in the output of ``panoscene precompute --records``."""
_FOUND, _TRUE, _MOVED, _LAYOUT = "found", "true", "moved", "layout"


@dataclass(frozen=True, slots=True)
class EncodedObjects:
    """The n objects of a panorama as the encoders see them, and in a mirror.

    The first axis of what is encoded has 2 entries: the panorama, and its mirror image. Poses are
    not stored: they depend on the other objects and on the layout, and take no time.
    """

    bfov: Float[Tensor, "n 4"]
    """(lon, lat, width, height) in radians; not mirrored."""
    category: Int64[Tensor, " n"]
    """Index into ``CATEGORIES``."""
    score: Float[Tensor, " n"]
    """Of the detections; 1 for true BFoVs."""
    target: Int64[Tensor, " n"]
    """Index of the true object that is shown, or -1."""
    appearance: Float[Tensor, "2 n features"]
    """Crops, encoded by the pose network."""
    shape_code: Float[Tensor, "2 n codes"]
    """The Gaussians of the shapes: ten numbers of each."""


@dataclass(frozen=True, slots=True)
class EstimateRecord:
    """What the first stages see of one panorama."""

    found: EncodedObjects
    """The detections."""
    true: EncodedObjects
    """The true BFoVs."""
    moved: tuple[EncodedObjects, ...] = ()
    """The true BFoVs, moved as a detector would, in other colours; their shapes are not moved."""
    layout: Layout | None = None
    """As the layout network read it."""


def write_estimate_record(record: EstimateRecord, path: Path) -> None:
    """Write a record as safetensors, in one step."""
    from safetensors.torch import save  # noqa: PLC0415

    views = {_FOUND: record.found, _TRUE: record.true}
    views |= {f"{_MOVED}{k}": view for k, view in enumerate(record.moved)}
    tensors = {
        f"{name}.{part.name}": getattr(view, part.name).detach().cpu().contiguous().clone()
        for name, view in views.items()
        for part in fields(EncodedObjects)
    }
    if record.layout is not None:
        tensors[f"{_LAYOUT}.polygon"] = record.layout.floor_polygon.detach().cpu().contiguous()
        tensors[f"{_LAYOUT}.ceiling"] = torch.tensor(record.layout.ceiling_height)
    write_atomically(path, save(tensors))


def read_estimate_record(path: Path) -> EstimateRecord:
    """Return what the first stages see of a panorama.

    Args:
        path: Written by ``write_estimate_record``.

    Raises:
        DatasetError: The file is missing or damaged.
    """
    from safetensors import SafetensorError  # noqa: PLC0415
    from safetensors.torch import load  # noqa: PLC0415

    try:
        tensors = load(path.read_bytes())
    except OSError as error:
        raise DatasetError(path, f"expected an estimate record, found: {error.strerror}") from None
    except SafetensorError as error:
        raise DatasetError(path, f"damaged: {' '.join(str(error).split())}") from None
    try:
        count = sum(name.startswith(_MOVED) and name.endswith(".bfov") for name in tensors)
        layout = None
        if f"{_LAYOUT}.polygon" in tensors:
            ceiling = float(tensors[f"{_LAYOUT}.ceiling"])
            layout = Layout(tensors[f"{_LAYOUT}.polygon"], ceiling_height=ceiling)
        return EstimateRecord(
            _view(tensors, _FOUND),
            _view(tensors, _TRUE),
            tuple(_view(tensors, f"{_MOVED}{k}") for k in range(count)),
            layout,
        )
    except KeyError as error:
        raise DatasetError(path, f"{error.args[0]} is missing") from None


def read_estimate_records(folder: Path) -> dict[str, EstimateRecord]:
    """Return what ``panoscene precompute --records`` wrote, by the names of the panoramas.

    Args:
        folder: Its output.

    Raises:
        DatasetError: There are no records, or one is damaged.
    """
    files = sorted((folder / ESTIMATES).glob("*.safetensors"))
    if not files:
        raise DatasetError(
            folder, "found no estimates there; make them with panoscene precompute --records"
        )
    return {file.stem: read_estimate_record(file) for file in files}


def _view(tensors: Mapping[str, Tensor], name: str) -> EncodedObjects:
    return EncodedObjects(
        **{part.name: tensors[f"{name}.{part.name}"] for part in fields(EncodedObjects)}
    )
