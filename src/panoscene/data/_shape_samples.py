"""Samples for the shape network: a picture of an object, and points inside and outside of it."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal

import numpy as np
import torch
from jaxtyping import Bool, Float, Int64, UInt8
from torch import Tensor
from torch.nn import functional as F

from panoscene.models.shape import ShapeTargets, view_hints
from panoscene.scene import CATEGORIES, write_atomically
from panoscene.synth.assets import SHAPE_MARGIN, load_library

from ._shape_crops import CROP_MARGIN, ObjectCrops
from ._shape_store import ModelShape, read_model_shape

_CUBE = 0.7
_WINDOW = (0.90, 1.12)
_SHIFT = 0.05
_SIZE_NOISE = 0.10
_YAW_NOISE = math.radians(12)
_LOST = 0.04
_COVERED = 0.3
_SEEN = ("features", "window", "mirrored")


@dataclass(frozen=True, slots=True)
class ShapeSample:
    """One object, or a batch of them with one more axis in front."""

    crop: Tensor
    """RGB in [0, 1], (3, rows, columns), or what the backbone sees there, when it is frozen."""
    category: Int64[Tensor, "*batch"]
    hints: Float[Tensor, "*batch 8"]
    uniform: Float[Tensor, "*batch uniform 3"]
    uniform_outside: Float[Tensor, "*batch uniform"]
    near: Float[Tensor, "*batch near 3"]
    near_outside: Float[Tensor, "*batch near"]
    grid: Float[Tensor, "*batch 32 32 32"]
    stretch: Float[Tensor, "*batch 3"]

    def targets(self) -> ShapeTargets:
        """Return what the losses compare with."""
        return ShapeTargets(
            uniform=self.uniform,
            uniform_outside=self.uniform_outside,
            near=self.near,
            near_outside=self.near_outside,
            grid=self.grid,
            stretch=self.stretch,
        )


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture of an object with a border around it, and how it was taken."""

    image: UInt8[np.ndarray, "rows columns 3"]
    bfov: Float[Tensor, "4"]
    size: Float[Tensor, "3"]
    view_yaw: float


@dataclass(frozen=True, slots=True)
class View:
    """A crop as the network gets it, or what its backbone sees there."""

    crop: Tensor
    """RGB (3, rows, columns), or features of any shape."""
    window: float
    """Shown width, of that of the object."""
    mirrored: bool


@dataclass(frozen=True, slots=True)
class SeenViews:
    """What a backbone sees in crops of pictures, several of each."""

    names: tuple[str, ...]
    """Of the pictures."""
    features: Float[Tensor, "pictures views seen"]
    window: Float[Tensor, "pictures views"]
    mirrored: Bool[Tensor, "pictures views"]

    def view(self, picture: int, number: int) -> View:
        """Return one crop of a picture."""
        return View(
            self.features[picture, number].float(),
            float(self.window[picture, number]),
            mirrored=bool(self.mirrored[picture, number]),
        )

    def with_more(self, other: "SeenViews") -> "SeenViews":
        """Return these pictures and others behind them."""
        return SeenViews(
            self.names + other.names,
            torch.cat((self.features, other.features)),
            torch.cat((self.window, other.window)),
            torch.cat((self.mirrored, other.mirrored)),
        )

    def chosen(self, names: Sequence[str]) -> "SeenViews":
        """Return the pictures of these names, in this order."""
        place = {name: row for row, name in enumerate(self.names)}
        rows = torch.tensor([place[name] for name in names])
        return SeenViews(tuple(names), self.features[rows], self.window[rows], self.mirrored[rows])


def seen_views(names: Sequence[str], features: Tensor, views: Sequence[View]) -> SeenViews:
    """Return what a backbone sees as a record.

    Args:
        names: Of the pictures.
        features: One row for each view.
        views: In the order of the pictures, equally many of each.
    """
    count = len(views) // len(names)
    return SeenViews(
        names=tuple(names),
        features=features.half().reshape(len(names), count, -1),
        window=torch.tensor([view.window for view in views]).reshape(-1, count),
        mirrored=torch.tensor([view.mirrored for view in views]).reshape(-1, count),
    )


def write_seen_views(path: Path, views: SeenViews) -> None:
    """Write what a backbone sees to a .safetensors file."""
    from safetensors.torch import save  # noqa: PLC0415

    tensors = {name: getattr(views, name).contiguous() for name in _SEEN}
    write_atomically(path, save(tensors, {"names": json.dumps(views.names)}))


def read_seen_views(path: Path) -> SeenViews:
    """Return what ``write_seen_views`` wrote."""
    from safetensors import safe_open  # noqa: PLC0415

    with safe_open(path, framework="pt") as file:
        names = tuple(json.loads(file.metadata()["names"]))
        return SeenViews(names, *(file.get_tensor(name) for name in _SEEN))


def read_store(store: Path, cache: Path) -> dict[str, ModelShape]:
    """Return all models of a store by id.

    Args:
        store: Folder with their pictures.
        cache: Folder of the models and their signed distances.

    Raises:
        AssetError: A file is damaged or missing.
    """
    library = load_library(cache)
    shapes = (read_model_shape(path, library) for path in sorted(store.glob("*.npz")))
    return {shape.id: shape for shape in shapes}


def crop_picture(crops: ObjectCrops, index: int) -> Picture:
    """Return one object as it was seen in a panorama."""
    return Picture(
        crops.image[index],
        torch.from_numpy(crops.bfov[index]),
        torch.from_numpy(crops.size[index]),
        float(crops.view_yaw[index]),
    )


def render_picture(
    shape: ModelShape, index: int, metres: float, background: UInt8[np.ndarray, "rows columns 3"]
) -> Picture:
    """Return a picture of a model on a background.

    Args:
        shape: The model.
        index: Of its picture.
        metres: Its longest side.
        background: Of the size of the result.
    """
    image = background.copy()
    rows = shape.image.shape[1]
    first = (len(image) - rows) // 2
    middle = image[first : first + rows, first : first + rows]
    shown = shape.alpha[index][..., None] > 0
    np.copyto(middle, shape.image[index], where=np.broadcast_to(shown, middle.shape))
    return Picture(
        image,
        torch.from_numpy(shape.bfov[index]),
        torch.from_numpy(shape.extent) * metres,
        float(shape.view_yaw[index]),
    )


def shape_sample(
    picture: Picture,
    shape: ModelShape,
    generator: torch.Generator | None,
    *,
    rows: int,
    points: int,
    frame: Literal["longest", "box"],
    view: "View | None" = None,
) -> ShapeSample:
    """Return a sample; with a generator an augmented one, else the picture as it is.

    Augmentation: window, mirroring (of picture and shape), colours, a covered corner, and errors
    of size and yaw as pose estimates have.

    Args:
        picture: Of the object; its border is 1/12 on each side.
        shape: Of its model.
        generator: Of the augmentation.
        rows: Of the crop, and columns.
        points: Uniform ones, and as many near the surface.
        frame: The network's. One that works in the box learns from points in the box only: what
            it says elsewhere is cut off.
        view: The crop, when it was made before; else it is made now.
    """
    if view is None:
        view = picture_view(picture, generator, rows=rows)
    size, yaw = picture.size, picture.view_yaw
    if generator is not None:
        noise = torch.randn(4, generator=generator)
        size = size * (_SIZE_NOISE * noise[:3]).exp()
        yaw = yaw + _YAW_NOISE * float(noise[3])
        if torch.rand((), generator=generator) < _LOST:
            yaw = math.pi * 2 * float(torch.rand((), generator=generator))
    bfov = picture.bfov.clone()
    bfov[2:] = 2 * torch.atan(torch.tan(bfov[2:] / 2) * view.window)
    near, uniform = shape.near, shape.uniform
    if frame == "box":
        near, uniform = (_in_box(stored, shape.extent) for stored in (near, uniform))
    near, near_outside = _points(near, points, generator)
    uniform, uniform_outside = _points(uniform, points, generator)
    grid = torch.from_numpy(shape.grid.astype(np.float32))
    stretch = torch.from_numpy(shape.extent)
    if frame == "longest":
        uniform, uniform_outside = _cube(uniform, uniform_outside, stretch, generator)
        stretch = torch.ones(3)
    uniform, near = uniform / stretch, near / stretch
    if view.mirrored:
        yaw, grid = -yaw, grid.flip(0)
        mirror = torch.tensor([-1.0, 1.0, 1.0])
        uniform, near = uniform * mirror, near * mirror
    return ShapeSample(
        crop=view.crop,
        category=torch.tensor(CATEGORIES.index(shape.category)),
        hints=view_hints(bfov[None], size[None], torch.tensor([yaw], dtype=torch.float32))[0],
        uniform=uniform,
        uniform_outside=uniform_outside,
        near=near,
        near_outside=near_outside,
        grid=grid,
        stretch=stretch,
    )


def picture_view(picture: Picture, generator: torch.Generator | None, *, rows: int) -> "View":
    """Return a crop of a picture; with a generator an augmented one, see ``shape_sample``."""
    image = torch.from_numpy(picture.image).permute(2, 0, 1).float() / 255
    if generator is None:
        return View(_windowed(image, 1.0, torch.zeros(2), rows), 1.0, mirrored=False)
    draw = torch.rand(4, generator=generator)
    window = float(_WINDOW[0] + (_WINDOW[1] - _WINDOW[0]) * draw[0])
    crop = _windowed(image, window, _SHIFT * (2 * draw[1:3] - 1), rows)
    crop = _recoloured(_covered(crop, generator), generator)
    mirrored = bool(draw[3] < 0.5)
    return View(crop.flip(-1) if mirrored else crop, window, mirrored=mirrored)


def collate_shapes(samples: Sequence[ShapeSample]) -> dict[str, Tensor]:
    """Return samples as one batch, by the names of ``ShapeSample``."""
    return {
        part.name: torch.stack([getattr(sample, part.name) for sample in samples])
        for part in fields(ShapeSample)
    }


def batch_of(values: Mapping[str, Tensor]) -> ShapeSample:
    """Return a batch by name as a record."""
    return ShapeSample(**values)


def _windowed(image: Tensor, window: float, shift: Tensor, rows: int) -> Tensor:
    """Return the part of a picture that is ``window`` times the object, moved, at a new size."""
    whole = image.shape[-1]
    span = whole / CROP_MARGIN * window
    first = [round((whole - span) / 2 + float(s) * whole / CROP_MARGIN) for s in shift]
    top, left = (min(max(f, 0), whole - 8) for f in first)
    part = image[:, top : top + round(span), left : left + round(span)]
    return F.interpolate(
        part[None], size=(rows, rows), mode="bilinear", align_corners=False, antialias=True
    )[0]


def _covered(crop: Tensor, generator: torch.Generator) -> Tensor:
    """Return a crop in which, now and then, something stands in front of the object."""
    draw = torch.rand(7, generator=generator)
    if draw[0] > _COVERED:
        return crop
    rows = crop.shape[-1]
    height, width = (int(rows * (0.15 + 0.3 * d)) for d in draw[1:3].tolist())
    top, left = int((rows - height) * draw[3]), int((rows - width) * draw[4])
    crop = crop.clone()
    colour = torch.rand(3, 1, 1, generator=generator)
    crop[:, top : top + height, left : left + width] = colour
    return crop


def _recoloured(crop: Tensor, generator: torch.Generator) -> Tensor:
    """Return a crop with another exposure, white balance, contrast and noise."""
    draw = torch.randn(6, generator=generator)
    gain = (0.25 * draw[0] + 0.08 * draw[1:4]).exp().reshape(3, 1, 1)
    gamma = float((0.2 * draw[4]).exp())
    noise = 0.02 * float(draw[5].abs())
    changed = (crop * gain).clamp(1e-3, 1) ** gamma
    return (changed + noise * torch.randn(crop.shape, generator=generator)).clamp(0, 1)


def _in_box(stored: np.ndarray, extent: np.ndarray) -> np.ndarray:
    """Return the stored points that lie in the box."""
    return stored[(np.abs(stored[:, :3]) <= extent / 2).all(1)]


def _points(
    stored: np.ndarray, count: int, generator: torch.Generator | None
) -> tuple[Float[Tensor, "points 3"], Float[Tensor, " points"]]:
    """Return some of the stored points, and 1 for those outside."""
    if generator is None:
        chosen = np.arange(min(count, len(stored)))
    else:
        chosen = torch.randint(len(stored), (count,), generator=generator).numpy()
    found = torch.from_numpy(stored[chosen].astype(np.float32))
    return found[:, :3], (found[:, 3] > 0).float()


def _cube(
    points: Tensor, outside: Tensor, extent: Tensor, generator: torch.Generator | None
) -> tuple[Tensor, Tensor]:
    """Return points that fill the cube [-0.7, 0.7]^3: those beyond the enlarged box are outside."""
    drawn = (2 * torch.rand(points.shape, generator=generator) - 1) * _CUBE
    far = (drawn.abs() > extent * SHAPE_MARGIN / 2).any(-1)
    return torch.where(far[:, None], drawn, points), torch.where(far, 1.0, outside)
