"""Contact sheets: many panoramas, or many objects of one category, in one picture."""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Literal

import matplotlib as mpl
import numpy as np
import torch
from jaxtyping import UInt8
from PIL import Image, ImageColor, ImageDraw, ImageFont

from panoscene.geometry import (
    OrientedBoxes,
    box_corners,
    perspective_directions,
    pixel_from_direction,
    pixel_in_perspective,
    sample_panorama,
)
from panoscene.scene import Scene, category_index, write_atomically
from panoscene.style import ALARM, GROUP_COLOURS, INK, PAPER, SMALL, group_of, words

from ._format import ObjectLabel
from ._maps import DISTANCE, INSTANCE, MILLIMETRES, jpeg_bytes, read_map, read_rgb
from ._read import PanoramaItem, open_dataset
from ._semantic import SEMANTIC_NAMES

Layer = Literal["rgb", "objects", "distance", "semantic"]
_CAPTION = 22
_LEAST_NAMED = 18
_GAP = 6
_EDGES = [(a, a | bit) for bit in (1, 2, 4) for a in range(8) if not a & bit]


def contact_sheet(
    root: Path | str,
    *,
    names: Sequence[str] | None = None,
    layer: Layer = "rgb",
    columns: int = 4,
    width: int = 480,
) -> Image.Image:
    """Return panoramas side by side, with their names, parts and rooms.

    Args:
        root: Folder of the set.
        names: Panoramas to show; all when not given.
        layer: ``rgb``; ``objects``, the photo with outlines and names of the objects in the
            colours of their groups; ``distance``, nearer is lighter; or ``semantic``.
        columns: Pictures in a row.
        width: Of a picture, in pixels.

    Raises:
        DatasetError: A file of the set is missing or damaged.
        ValueError: There is no panorama of a name, or none at all.
    """
    items = {item.name: item for item in open_dataset(root)}
    chosen = list(items) if names is None else list(names)
    unknown = [name for name in chosen if name not in items]
    if unknown or not chosen:
        found = repr(unknown[0]) if unknown else "none"
        raise ValueError(f"names: found {found}, expected panoramas of the set")
    tiles = [_tile(items[name], layer, width) for name in chosen]
    return _grid(tiles, columns)


def write_contact_sheets(
    root: Path | str, out: Path | str, *, layer: Layer = "rgb", each: int = 20, columns: int = 4
) -> list[Path]:
    """Write contact sheets of the whole set, ``each`` panoramas on one; return the files.

    Raises:
        DatasetError: A file of the set is missing or damaged.
    """
    names = [item.name for item in open_dataset(root)]
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for number, start in enumerate(range(0, len(names), each)):
        sheet = contact_sheet(root, names=names[start : start + each], layer=layer, columns=columns)
        files.append(folder / f"{layer}-{number:03d}.jpg")
        write_atomically(files[-1], jpeg_bytes(np.asarray(sheet), 90))
    return files


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
    found = [
        (item, label)
        for item in open_dataset(root)
        for label in item.labels().objects
        if label.category == category and label.in_scene and label.occlusion < 0.6
    ]
    seen: dict[str, int] = {}
    ranked = []
    for item, label in sorted(found, key=lambda pair: pair[1].occlusion):
        seen[label.model] = seen.get(label.model, 0) + 1
        ranked.append((seen[label.model], item, label))
    ranked.sort(key=lambda entry: entry[0])
    tiles = [_object_tile(item, label, size) for _, item, label in ranked[:count]]
    return _grid(tiles, columns) if tiles else None


def _tile(item: PanoramaItem, layer: Layer, width: int) -> tuple[Image.Image, str]:
    labels = item.labels()
    kept = [label for label in labels.objects if label.in_scene]
    caption = f"{item.name}  {item.split}  {labels.camera.room_kind}  {len(kept)} objects"
    size = (width, width // 2)
    if layer == "distance":
        distance = read_map(item.folder / DISTANCE, 16) / MILLIMETRES
        near = np.where(distance > 0, 255 * np.exp(-distance / 4), 0).astype(np.uint8)
        return Image.fromarray(near).resize(size, Image.Resampling.BOX).convert("RGB"), caption
    if layer == "semantic":
        picture = Image.fromarray(_palette()[item.semantic().numpy()])
        return picture.resize(size, Image.Resampling.NEAREST), caption
    rgb = read_rgb(item.image_file())
    if layer == "rgb":
        return Image.fromarray(rgb).resize(size, Image.Resampling.BOX), caption
    return _outlined(item, rgb, kept, size), caption


def _outlined(
    item: PanoramaItem,
    rgb: UInt8[np.ndarray, "height columns 3"],
    kept: list[ObjectLabel],
    size: tuple[int, int],
) -> Image.Image:
    instance = read_map(item.folder / INSTANCE, 16)
    table = np.zeros((65536, 3), np.uint8)
    for label in kept:
        table[label.instance] = ImageColor.getrgb(GROUP_COLOURS[group_of(label.category)])
    known = np.zeros(65536, bool)
    known[[label.instance for label in kept]] = True
    thick = max(1, round(rgb.shape[1] / size[0] * 0.75))
    edge = np.zeros(instance.shape, bool)
    for axis in (0, 1):
        for step in range(1, thick + 1):
            other = np.roll(instance, step, axis)
            differs = instance != other
            edge |= differs & (known[instance] | known[other])
    owner = np.where(known[instance], instance, np.roll(instance, 1, 1))
    owner = np.where(known[owner], owner, np.roll(instance, 1, 0))
    picture = np.where(edge[..., None], table[owner], rgb)
    image = Image.fromarray(picture.astype(np.uint8)).resize(size, Image.Resampling.BOX)
    draw = ImageDraw.Draw(image)
    scale = size[0] / rgb.shape[1]
    for label in sorted(kept, key=lambda one: -one.pixels):
        left, top, wide, high = label.box_2d
        if wide * scale < _LEAST_NAMED:
            continue  # its name would hide it
        x = min(max((left + wide / 2) % rgb.shape[1] * scale, 24), size[0] - 24)
        draw.text((x, (top + high / 2) * scale), words(label.category), INK, _font(10.0), "mm",
                  stroke_width=2, stroke_fill=PAPER)  # fmt: skip
    return image


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


def _grid(tiles: Sequence[tuple[Image.Image, str]], columns: int) -> Image.Image:
    columns = min(columns, len(tiles))
    wide, high = tiles[0][0].size
    rows = -(-len(tiles) // columns)
    step = (wide + _GAP, high + _CAPTION)
    sheet = Image.new("RGB", (columns * step[0] + _GAP, rows * step[1] + _GAP), PAPER)
    draw = ImageDraw.Draw(sheet)
    size = min(SMALL, wide / 14)
    for k, (picture, caption) in enumerate(tiles):
        left, top = _GAP + k % columns * step[0], k // columns * step[1] + _CAPTION
        sheet.paste(picture, (left, top))
        draw.text((left, top - 4), caption, INK, _font(size), "ls")
    return sheet


@lru_cache
def _font(size: float) -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(str(Path(mpl.get_data_path()) / "fonts/ttf/DejaVuSans.ttf"), size)


@lru_cache
def _palette() -> UInt8[np.ndarray, "256 3"]:
    table = np.zeros((256, 3), np.uint8)
    for value, name in enumerate(SEMANTIC_NAMES[:57]):
        base = np.array(ImageColor.getrgb(GROUP_COLOURS[group_of(name)]))
        table[value] = base * (0.75 + 0.25 * ((value * 7) % 5) / 4)
    table[57:60] = [(120, 100, 80), (215, 210, 200), (245, 245, 245)]
    return table
