"""Layouts in the text files that HorizonNet is trained on."""

import math
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float64

from panoscene.geometry import rotate_panorama
from panoscene.scene import Scene, write_atomically

from ._format import SPLITS
from ._maps import jpeg_bytes
from ._read import PanoramaItem, open_dataset
from ._sound import sound_items


def horizonnet_corners(scene: Scene) -> Float64[np.ndarray, "twice_corners 2"]:
    """Return the corners of a room in the pixels of its upright panorama, as HorizonNet has them.

    Convention:
        - ceiling and floor corner in turn, clockwise from above, from the smallest x on; corners
          that a wall hides are there too, and there x may go back
        - a pixel's centre has whole numbers: x = u - 1/2, y = v - 1/2, which is HorizonNet's own
          ``((x + 0.5) / width - 0.5) * 2 pi``

    Examples:
        >>> from panoscene.sample import sample_room_path
        >>> from panoscene.scene import read_scene
        >>> corners = horizonnet_corners(read_scene(sample_room_path()))
        >>> len(corners) % 2, bool((corners[0::2, 1] < corners[1::2, 1]).all())
        (0, True)
    """
    panorama, layout = scene.panorama, scene.layout
    corners = layout.floor_polygon.to(torch.float64).numpy()[::-1]
    lon = np.arctan2(corners[:, 0], corners[:, 1])
    apart = np.maximum(np.hypot(corners[:, 0], corners[:, 1]), 1e-9)
    x = (lon / (2 * math.pi) + 0.5) * panorama.width - 0.5
    rows = []
    for height in (layout.ceiling_height, layout.floor_height):
        lat = np.arctan((height - panorama.camera_height) / apart)
        rows.append((0.5 - lat / math.pi) * panorama.height - 0.5)
    start = int(x.argmin())
    pairs = np.stack([np.stack([x, y], axis=1) for y in rows], axis=1)
    return np.roll(pairs, -start, axis=0).reshape(-1, 2)


def export_horizonnet(root: Path | str, out: Path | str) -> list[Path]:
    """Write ``<split>/img`` and ``<split>/label_cor`` as HorizonNet reads them; return the texts.

    Pictures of tilted cameras are turned upright; the others are copied.

    Args:
        root: Folder of the set.
        out: Folder for the files; made if it is not there.

    Raises:
        DatasetError: A file of the set is missing or damaged.
    """
    items = sound_items(open_dataset(root))
    return [
        _export_item(item, Path(out) / split)
        for split in SPLITS
        for item in items
        if item.split == split
    ]


def _export_item(item: PanoramaItem, folder: Path) -> Path:
    scene = item.scene()
    for name in ("img", "label_cor"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    rotation = torch.tensor(scene.panorama.upright_from_photo, dtype=torch.float64)
    source = item.image_file()
    if torch.equal(rotation, torch.eye(3, dtype=torch.float64)):
        write_atomically(folder / "img" / (item.name + source.suffix), source.read_bytes())
    else:
        left, _, right = torch.linalg.svd(rotation)
        turned = rotate_panorama(item.image(), left @ right)
        pixels = (turned * 255 + 0.5).clamp(0, 255).byte().permute(1, 2, 0).numpy()
        write_atomically(folder / "img" / f"{item.name}.jpg", jpeg_bytes(pixels, 95))
    path = folder / "label_cor" / f"{item.name}.txt"
    lines = "".join(f"{x:.4f} {y:.4f}\n" for x, y in horizonnet_corners(scene))
    write_atomically(path, lines)
    return path
