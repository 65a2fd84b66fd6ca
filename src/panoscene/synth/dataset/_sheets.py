"""Contact sheets: many panoramas in one picture."""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Literal

import matplotlib as mpl
import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageColor, ImageDraw, ImageFont

from panoscene.scene import write_atomically
from panoscene.style import GROUP_COLOURS, INK, PAPER, SMALL, group_of, words

from ._format import ObjectLabel
from ._maps import DISTANCE, INSTANCE, MILLIMETRES, jpeg_bytes, read_map, read_rgb
from ._read import PanoramaItem, open_dataset
from ._semantic import SEMANTIC_NAMES

Layer = Literal["rgb", "objects", "distance", "semantic"]
_CAPTION = 22
_LEAST_NAMED = 18
_GAP = 6


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
    return grid(tiles, columns)


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


def grid(tiles: Sequence[tuple[Image.Image, str]], columns: int) -> Image.Image:
    """Return pictures of one size in rows, each under its caption."""
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
