"""One panorama on disk: a folder that is there as a whole or not at all."""

import hashlib
import json
import secrets
import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from panoscene.scene import Scene, scene_to_json, write_scene

from ._format import PanoramaLabels, Split
from ._label import LabelledPanorama, label_hash
from ._maps import (
    ALBEDO,
    DISTANCE,
    INSTANCE,
    LABELS,
    NORMAL,
    SCENE,
    SEMANTIC,
    jpeg_bytes,
    millimetres,
    normal_picture,
    png_bytes,
)

PANORAMAS = "panoramas"
"""Folder of the panoramas in a data set."""
PARTIAL = ".part-"
"""Begin of the names of folders that are being written."""


@dataclass(frozen=True, slots=True)
class FileChoice:
    """What is written of a panorama, beyond the maps."""

    jpeg_quality: int | None = 92
    """None writes rgb.png, without loss and about six times as large."""
    normals: bool = False
    albedo: bool = False


def write_panorama(
    panorama: LabelledPanorama,
    root: Path | str,
    *,
    split: Split | None = None,
    files: FileChoice | None = None,
    extra: Callable[[Scene, Path], None] | None = None,
) -> Path:
    """Write the folder of a panorama and return it; an older one of its name is replaced.

    All files are written to a neighbour with another name, which is then renamed: whoever finds
    the folder finds all of it.

    Args:
        panorama: What to write.
        root: Folder of the data set.
        split: The part it belongs to, to be kept with the labels.
        files: What to write.
        extra: Writes further files, such as the scene as GLB: it gets the scene with its meshes
            and the folder. They are hashed as well.
    """
    files = files or FileChoice()
    parent = Path(root) / PANORAMAS
    parent.mkdir(parents=True, exist_ok=True)
    name = panorama.labels.name
    partial = parent / f"{PARTIAL}{name}-{secrets.token_hex(4)}"
    partial.mkdir()
    try:
        _write_files(panorama, partial, split, files, extra)
        target = parent / name
        if target.exists():
            old = parent / f"{PARTIAL}{name}-{secrets.token_hex(4)}"
            target.rename(old)
            partial.rename(target)
            shutil.rmtree(old)
        else:
            partial.rename(target)
    finally:
        shutil.rmtree(partial, ignore_errors=True)
    return parent / name


def is_written(root: Path | str, name: str) -> bool:
    """Return whether the folder of a panorama is there."""
    return (Path(root) / PANORAMAS / name / LABELS).is_file()


def file_hash(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def scene_text(scene: Scene) -> str:
    """Return a scene as the text that label hashes are made of."""
    return json.dumps(scene_to_json(scene), sort_keys=True, separators=(",", ":"))


def labels_text(labels: PanoramaLabels) -> str:
    """Return labels.json: one line for each object, so that people can read it."""
    document = labels.model_dump(mode="json", by_alias=True)
    parts = []
    for key, value in document.items():
        if isinstance(value, list) and value:
            rows = ",\n    ".join(json.dumps(row, ensure_ascii=False) for row in value)
            parts.append(f"  {json.dumps(key)}: [\n    {rows}\n  ]")
        else:
            parts.append(f"  {json.dumps(key)}: {json.dumps(value, ensure_ascii=False)}")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def _write_files(
    panorama: LabelledPanorama,
    folder: Path,
    split: Split | None,
    files: FileChoice,
    extra: Callable[[Scene, Path], None] | None,
) -> None:
    rendered = panorama.rendered
    picture = "rgb.png" if files.jpeg_quality is None else "rgb.jpg"
    distance = millimetres(rendered.distance)
    contents = {
        picture: png_bytes(rendered.rgb)
        if files.jpeg_quality is None
        else jpeg_bytes(rendered.rgb, files.jpeg_quality),
        DISTANCE: png_bytes(distance),
        INSTANCE: png_bytes(rendered.instance.astype("uint16")),
        SEMANTIC: png_bytes(panorama.semantic),
    }
    if files.normals:
        contents[NORMAL] = png_bytes(normal_picture(rendered.normal))
    if files.albedo:
        contents[ALBEDO] = jpeg_bytes(rendered.albedo, files.jpeg_quality or 92)
    for name, content in contents.items():
        (folder / name).write_bytes(content)
    scene = replace(panorama.scene, panorama=replace(panorama.scene.panorama, file=picture))
    write_scene(scene, folder / SCENE)
    if extra is not None:
        extra(panorama.with_meshes(), folder)
    hashes = {path.name: file_hash(path) for path in sorted(folder.iterdir())}
    digest = label_hash(scene_text(panorama.scene), distance, rendered.instance, panorama.semantic)
    labels = panorama.labels.model_copy(
        update={"files": hashes, "label_hash": digest, "split": split}
    )
    (folder / LABELS).write_text(labels_text(labels), encoding="utf-8")
