"""Lists of object views, for networks that look at one object at a time."""

import json
from pathlib import Path

from panoscene.scene import write_atomically

from ._format import SPLITS
from ._read import open_dataset
from ._sound import sound_items


def export_crops(root: Path | str, out: Path | str, *, most_hidden: float = 0.5) -> list[Path]:
    """Write ``crops_<split>.jsonl``, one object view a line; return the files.

    A line names picture, object, category, model and base (its shape), and gives the BFoVs to cut
    the crop with ``perspective_crop``, the rotation that makes the photo upright, the instance id
    of the mask, occlusion, and the box. Doors and windows that the building made have no model to
    learn a shape from and are left out.

    Args:
        root: Folder of the set.
        out: Folder for the files; made if it is not there.
        most_hidden: Objects that are hidden by more are left out; 1 keeps all.

    Raises:
        DatasetError: A file of the set is missing or damaged.
    """
    dataset = open_dataset(root)
    items = sound_items(dataset)
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for split in SPLITS:
        lines = []
        for item in items:
            if item.split != split:
                continue
            upright = item.scene().panorama.upright_from_photo
            for label in item.labels().objects:
                if not label.in_scene or label.occlusion > most_hidden:
                    continue
                if label.model.startswith("shell/"):
                    continue
                line = {
                    "panorama": item.name,
                    "image": item.image_file().relative_to(dataset.root).as_posix(),
                    "object": label.id,
                    "instance": label.instance,
                    "category": label.category,
                    "model": label.model,
                    "base": label.base,
                    "bfov": label.bfov_amodal,
                    "bfov_visible": label.bfov_visible,
                    "upright_from_photo": upright,
                    "occlusion": label.occlusion,
                    "box": label.box.model_dump(mode="json"),
                }
                lines.append(json.dumps(line) + "\n")
        if lines:
            path = folder / f"crops_{split}.jsonl"
            write_atomically(path, "".join(lines))
            files.append(path)
    return files
