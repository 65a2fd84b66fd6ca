"""Reading a rendered set: items that load what is asked of them."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import overload

import torch
from jaxtyping import Float, Int64
from torch import Tensor

from panoscene.scene import Scene, read_scene

from ._errors import DatasetError
from ._format import SPLITS, PanoramaLabels, Split
from ._index import DatasetIndex, PanoramaEntry, read_index, read_labels
from ._maps import DISTANCE, INSTANCE, MILLIMETRES, SCENE, SEMANTIC, read_map, read_rgb
from ._write import PANORAMAS


@dataclass(frozen=True, slots=True)
class PanoramaItem:
    """One panorama of a set. Every call reads from disk; nothing is kept in memory."""

    folder: Path
    name: str
    home: str
    split: Split

    def scene(self) -> Scene:
        """Return layout, objects and relations.

        Raises:
            SceneFormatError: The file is missing or damaged.
        """
        return read_scene(self.folder / SCENE)

    def labels(self) -> PanoramaLabels:
        """Return camera, models, masks' ids, occlusion and more; see ``PanoramaLabels``.

        Raises:
            DatasetError: The file is missing or damaged.
        """
        return read_labels(self.folder)

    def image_file(self) -> Path:
        """Return the path of the picture, rgb.jpg or rgb.png."""
        lossless = self.folder / "rgb.png"
        return lossless if lossless.is_file() else self.folder / "rgb.jpg"

    def image(self) -> Float[Tensor, "3 height width"]:
        """Return the photo as RGB in [0, 1], as it was taken: not turned upright.

        Raises:
            DatasetError: The file is missing or damaged.
        """
        pixels = torch.from_numpy(read_rgb(self.image_file()))
        return pixels.permute(2, 0, 1).float().div_(255.0)

    def distance(self) -> Float[Tensor, "height width"]:
        """Return metres along each pixel's ray; 0 where nothing was hit.

        Raises:
            DatasetError: The file is missing or damaged.
        """
        return torch.from_numpy(read_map(self.folder / DISTANCE, 16)).float() / MILLIMETRES

    def instance(self) -> Int64[Tensor, "height width"]:
        """Return the instance id of each pixel, as in ``labels().objects``; 0 is nothing.

        Raises:
            DatasetError: The file is missing or damaged.
        """
        return torch.from_numpy(read_map(self.folder / INSTANCE, 16)).long()

    def semantic(self) -> Int64[Tensor, "height width"]:
        """Return the index into ``SEMANTIC_NAMES`` of each pixel; 255 where there is no label.

        Raises:
            DatasetError: The file is missing or damaged.
        """
        return torch.from_numpy(read_map(self.folder / SEMANTIC, 8)).long()


class SynthDataset(Sequence[PanoramaItem]):
    """The panoramas of a set, or of one part of it, in the order of their names.

    Attributes:
        root: Folder of the set.
        info: What dataset.json says.
    """

    def __init__(self, root: Path, index: DatasetIndex, entries: Sequence[PanoramaEntry]) -> None:
        self.root = root
        self.info = index
        self._items = tuple(
            PanoramaItem(root / PANORAMAS / entry.name, entry.name, entry.home, entry.split)
            for entry in entries
        )

    def __len__(self) -> int:
        """Return how many panoramas there are."""
        return len(self._items)

    @overload
    def __getitem__(self, index: int) -> PanoramaItem: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[PanoramaItem, ...]: ...
    def __getitem__(self, index: int | slice) -> PanoramaItem | tuple[PanoramaItem, ...]:
        """Return one panorama, or several."""
        return self._items[index]


def open_dataset(root: str | os.PathLike[str], split: str | None = None) -> SynthDataset:
    """Return a rendered set, or one part of it; only dataset.json is read now.

    Args:
        root: Folder of the set.
        split: ``train``, ``val``, ``test-seen`` or ``test-unseen``; None for all.

    Raises:
        DatasetError: dataset.json is missing or damaged.
        ValueError: There is no such split.
    """
    if split is not None and split not in SPLITS:
        raise ValueError(f"split: found {split!r}, expected one of {', '.join(SPLITS)}")
    folder = Path(root)
    index = read_index(folder)
    entries = [e for e in index.panoramas if split is None or e.split == split]
    missing = [e.name for e in entries if not (folder / PANORAMAS / e.name).is_dir()]
    if missing:
        raise DatasetError(folder, f"found no folder of {missing[0]}, which dataset.json lists")
    return SynthDataset(folder, index, entries)
