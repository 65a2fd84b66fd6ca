"""Category sheets: many objects of one category in one picture, with the fronts of their boxes."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
import torch
from PIL import Image, ImageDraw

from panoscene.geometry import (
    OrientedBoxes,
    box_corners,
    perspective_directions,
    pixel_from_direction,
    pixel_in_perspective,
    sample_panorama,
)
from panoscene.scene import CATEGORIES, Scene, category_index, write_atomically
from panoscene.style import ALARM, PAPER

from ._format import ObjectLabel
from ._maps import jpeg_bytes
from ._read import PanoramaItem, open_dataset
from ._sheets import grid

_EDGES = [(a, a | bit) for bit in (1, 2, 4) for a in range(8) if not a & bit]
_HIDDEN = 0.6
"""Objects of which more is hidden are not shown."""
Sight = tuple[PanoramaItem, ObjectLabel]


def category_sheet(
    root: Path | str, category: str, *, count: int = 40, columns: int = 8, size: int = 200
) -> Image.Image | None:
    """Return views of objects of a category with their boxes, fronts in red; None without any.

    Each model comes once before any comes twice. The red rectangle is the front face of the box:
    whoever looks sees at once when a model faces the wrong way.

    Args:
        root: Folder of the set.
        category: One of the 57.
        count: Views at most.
        columns: Views in a row.
        size: Of a view, in pixels.

    Raises:
        DatasetError: A file of the set is missing or damaged.
        ValueError: There is no such category.
    """
    category_index(category)
    return _sheet(_sights(open_dataset(root))[category], count, columns, size)


def write_category_sheets(
    root: Path | str, out: Path | str, *, count: int = 40, columns: int = 8, size: int = 200
) -> list[Path]:
    """Write a sheet for every category that is seen, as category-chair.jpg; return the files.

    The labels are read once. Arguments are those of ``category_sheet``.

    Raises:
        DatasetError: A file of the set is missing or damaged.
    """
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for category, sights in _sights(open_dataset(root)).items():
        sheet = _sheet(sights, count, columns, size)
        if sheet is not None:
            files.append(folder / f"category-{category}.jpg")
            write_atomically(files[-1], jpeg_bytes(np.asarray(sheet), 88))
    return files


def _sights(items: Iterable[PanoramaItem]) -> dict[str, list[Sight]]:
    """Return the objects that are seen well, by category."""
    found: dict[str, list[Sight]] = {category: [] for category in CATEGORIES}
    for item in items:
        for label in item.labels().objects:
            if label.in_scene and label.occlusion < _HIDDEN:
                found[label.category].append((item, label))
    return found


def _sheet(sights: list[Sight], count: int, columns: int, size: int) -> Image.Image | None:
    times: dict[str, int] = {}
    ranked = []
    for item, label in sorted(sights, key=lambda sight: sight[1].occlusion):
        times[label.model] = times.get(label.model, 0) + 1
        ranked.append((times[label.model], item, label))
    ranked.sort(key=lambda entry: entry[0])
    tiles = [_object_tile(item, label, size) for _, item, label in ranked[:count]]
    return grid(tiles, columns) if tiles else None


def _object_tile(item: PanoramaItem, label: ObjectLabel, size: int) -> tuple[Image.Image, str]:
    scene = item.scene()
    lon, lat, wide, high = label.bfov_amodal
    reach = min(max(wide, high, 0.1) * 1.35, 2.4)
    bfov = torch.tensor([lon, lat, reach, reach])
    upright = torch.tensor(scene.panorama.upright_from_photo)
    rays = perspective_directions(bfov, (size, size)) @ upright
    image = item.image()
    uv = pixel_from_direction(rays, *image.shape[-2:])
    crop = sample_panorama(image, uv)
    pixels = (crop * 255 + 0.5).clamp(0, 255).byte().permute(1, 2, 0).numpy()
    picture = Image.fromarray(pixels)
    _draw_box(picture, scene, label, bfov)
    name = label.model.rsplit("/", 2)
    return picture, "/".join(name[-2:])[-26:]


def _draw_box(picture: Image.Image, scene: Scene, label: ObjectLabel, bfov: torch.Tensor) -> None:
    box = OrientedBoxes(
        torch.tensor(label.box.centre), torch.tensor(label.box.size), torch.tensor(label.box.yaw)
    )
    eye = torch.tensor([0.0, 0.0, scene.panorama.camera_height])
    corners = box_corners(box) - eye
    ahead = corners @ _forward(bfov)
    uv, _ = pixel_in_perspective(corners, bfov.expand(8, 4), (picture.height, picture.width))
    draw = ImageDraw.Draw(picture)
    for a, b in _EDGES:
        if min(float(ahead[a]), float(ahead[b])) > 0.05:
            front = bool(a & 2 and b & 2)
            ends = [tuple(uv[k].tolist()) for k in (a, b)]
            draw.line(ends, fill=ALARM if front else PAPER, width=2 if front else 1)


def _forward(bfov: torch.Tensor) -> torch.Tensor:
    return perspective_directions(bfov, (1, 1))[0, 0]
