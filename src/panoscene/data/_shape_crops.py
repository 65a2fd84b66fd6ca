"""Crops of objects from rendered panoramas, cut once for the shape networks."""

import io
import zipfile
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float32, UInt8

from panoscene.geometry import perspective_crop, rotate_panorama, view_relative_yaw
from panoscene.scene import write_atomically
from panoscene.synth.assets import AssetError
from panoscene.synth.dataset import ObjectLabel, PanoramaItem

CROP_MARGIN = 1.2
"""Crops show this much more than the object, so that samples can shift within them."""
CROP_ROWS = 112
_MIN_PIXELS = 150
_MAX_OCCLUSION = 0.7
_MAX_ANGLE = 2.3


@dataclass(frozen=True, slots=True)
class ObjectCrops:
    """Pictures of objects in panoramas, and how they were seen."""

    image: UInt8[np.ndarray, "crops 112 112 3"]
    """sRGB; the BFoV is the middle of it, 1 / 1.2 of its width and height on the picture plane."""
    bfov: Float32[np.ndarray, "crops 4"]
    """Of the visible part."""
    size: Float32[np.ndarray, "crops 3"]
    """Of the box in metres."""
    view_yaw: Float32[np.ndarray, " crops"]
    """Yaw relative to the line of sight."""
    occlusion: Float32[np.ndarray, " crops"]
    model: np.ndarray
    """Id of the CAD model."""
    category: np.ndarray
    """Its name."""


def cut_object_crops(
    panoramas: Iterable[PanoramaItem], progress: Callable[[int], None] | None = None
) -> ObjectCrops:
    """Return crops of all objects that are seen well enough, of all panoramas of a set.

    Left out: objects made by the building itself, with fewer than 150 pixels, hidden by more than
    70 percent, or too wide for a picture on a plane.

    Args:
        panoramas: Of a part of a set.
        progress: Told the number of panoramas done.
    """
    columns: dict[str, list[np.ndarray]] = {part.name: [] for part in fields(ObjectCrops)}
    for number, item in enumerate(panoramas):
        for name, values in _crops_of(item).items():
            columns[name].append(values)
        if progress is not None:
            progress(number + 1)
    return ObjectCrops(**{name: np.concatenate(values) for name, values in columns.items()})


def _crops_of(item: PanoramaItem) -> dict[str, np.ndarray]:
    labels = [label for label in item.labels().objects if _usable(label)]
    bfov = torch.tensor([label.bfov_visible for label in labels]).reshape(-1, 4)
    wide = 2 * torch.atan(torch.tan(bfov[:, 2:] / 2) * CROP_MARGIN)
    enlarged = torch.cat((bfov[:, :2], wide), 1)
    image = rotate_panorama(item.image(), torch.tensor(item.scene().panorama.upright_from_photo))
    crops = perspective_crop(image, enlarged, (CROP_ROWS, CROP_ROWS)).clamp(0, 1)
    centre = torch.tensor([label.box.centre for label in labels]).reshape(-1, 3)
    yaw = torch.tensor([label.box.yaw for label in labels]).reshape(-1)
    view_yaw = view_relative_yaw(yaw, torch.atan2(centre[:, 0], centre[:, 1]))
    return {
        "image": (crops * 255).round().byte().permute(0, 2, 3, 1).numpy(),
        "bfov": bfov.numpy(),
        "size": np.array([label.box.size for label in labels], np.float32).reshape(-1, 3),
        "view_yaw": view_yaw.numpy(),
        "occlusion": np.array([label.occlusion for label in labels], np.float32),
        "model": np.array([label.model for label in labels], dtype="U120"),
        "category": np.array([label.category for label in labels], dtype="U40"),
    }


def _usable(label: ObjectLabel) -> bool:
    return (
        not label.model.startswith("shell/")
        and label.pixels >= _MIN_PIXELS
        and label.occlusion <= _MAX_OCCLUSION
        and max(label.bfov_visible[2:]) <= _MAX_ANGLE
    )


def write_object_crops(path: Path, crops: ObjectCrops) -> None:
    """Write crops to one .npz file."""
    stream = io.BytesIO()
    arrays = {part.name: getattr(crops, part.name) for part in fields(crops)}
    np.savez(stream, allow_pickle=False, **arrays)
    write_atomically(path, stream.getvalue())


def read_object_crops(path: Path) -> ObjectCrops:
    """Return crops that ``write_object_crops`` wrote.

    Raises:
        AssetError: The file is missing or damaged.
    """
    try:
        with path.open("rb") as stream, np.load(stream, allow_pickle=False) as content:
            return ObjectCrops(**{part.name: content[part.name] for part in fields(ObjectCrops)})
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise AssetError(path, f"damaged file of object crops: {error}") from error
