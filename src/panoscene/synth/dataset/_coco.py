"""A set as COCO instances, for detectors."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from panoscene.scene import CATEGORIES, write_atomically
from panoscene.style import group_of

from ._format import SPLITS, ObjectLabel, Split
from ._maps import INSTANCE, read_map
from ._read import PanoramaItem, SynthDataset, open_dataset
from ._run_lengths import encode_mask
from ._sound import sound_items


def export_coco(root: Path | str, out: Path | str) -> list[Path]:
    """Write ``instances_<split>.json`` for every part that has panoramas; return the files.

    Convention:
        - category ids are the indices of ``CATEGORIES`` + 1; file names are relative to ``root``
        - the objects are those of scene.json, masks are compressed run lengths of the photo
        - ``bbox`` is around the mask in the picture; that of an object that crosses the seam is
          as wide as the picture, so ``bbox_circular`` has it too, running on past the right edge
        - ``panoscene`` holds what COCO has no field for: id, model, BFoVs, occlusion, box

    Args:
        root: Folder of the set.
        out: Folder for the files; made if it is not there.

    Raises:
        DatasetError: A file of the set is missing or damaged.
    """
    dataset = open_dataset(root)
    everything = sound_items(dataset)
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for split in SPLITS:
        items = [item for item in everything if item.split == split]
        if items:
            path = folder / f"instances_{split}.json"
            write_atomically(path, json.dumps(_document(dataset, split, items)))
            files.append(path)
    return files


def _document(dataset: SynthDataset, split: Split, items: list[PanoramaItem]) -> dict[str, Any]:
    images: list[dict[str, Any]] = []
    annotations: list[dict[str, Any]] = []
    for number, item in enumerate(items, start=1):
        instance = read_map(item.folder / INSTANCE, 16)
        images.append(
            {
                "id": number,
                "file_name": item.image_file().relative_to(dataset.root).as_posix(),
                "height": instance.shape[0],
                "width": instance.shape[1],
                "home": item.home,
            }
        )
        for label in item.labels().objects:
            if label.in_scene:
                annotations.append(_annotation(len(annotations) + 1, number, label, instance))
    index = dataset.info
    return {
        "info": {
            "description": f"{index.name}, {split}",
            "version": index.set_hash,
            "generator": index.generator,
        },
        "licenses": [],
        "images": images,
        "annotations": annotations,
        "categories": [
            {"id": k + 1, "name": name, "supercategory": group_of(name)}
            for k, name in enumerate(CATEGORIES)
        ],
    }


def _annotation(
    number: int, image: int, label: ObjectLabel, instance: np.ndarray
) -> dict[str, Any]:
    mask = instance == label.instance
    columns = np.flatnonzero(mask.any(axis=0))
    left, top, wide, high = label.box_2d
    if len(columns):
        first, last = int(columns[0]), int(columns[-1])
    else:
        first, last = left, left + wide - 1
    return {
        "id": number,
        "image_id": image,
        "category_id": CATEGORIES.index(label.category) + 1,
        "iscrowd": 0,
        "area": label.pixels,
        "bbox": [first, top, last - first + 1, high],
        "bbox_circular": [left, top, wide, high],
        "segmentation": encode_mask(mask),
        "panoscene": {
            "id": label.id,
            "model": label.model,
            "bfov_visible": label.bfov_visible,
            "bfov_amodal": label.bfov_amodal,
            "occlusion": label.occlusion,
            "inside_room": label.inside_room,
            "box": label.box.model_dump(mode="json"),
        },
    }
