"""The photo of a scene: where it is found from, and upright as the scene is."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry import rotate_panorama

from ._records import Panorama, Scene

MOST_TURNED = 4096
"""Columns that are kept of a photo that has to be turned: more than any view or texture shows."""


def upright_photo(
    image: Float[Tensor, "3 height width"], panorama: Panorama
) -> Float[Tensor, "3 _ _"]:
    """Return a photo as a camera that stands upright would have taken it.

    It is turned by ``panorama.upright_from_photo``. A photo that is upright already comes back as
    it is; another one has at most 4096 columns.

    Examples:
        >>> image = torch.rand(3, 32, 64)
        >>> upright_photo(image, Panorama(64, 32)) is image
        True
    """
    rotation = torch.tensor(panorama.upright_from_photo, dtype=torch.float64)
    if torch.equal(rotation, torch.eye(3, dtype=torch.float64)):
        return image
    if image.shape[-1] > MOST_TURNED:
        size = (MOST_TURNED // 2, MOST_TURNED)
        image = torch.nn.functional.interpolate(image[None], size=size, mode="area")[0]
    # files carry rounded numbers: the nearest rotation has none of their errors
    left, _, right = np.linalg.svd(rotation.numpy())
    return rotate_panorama(image, torch.as_tensor(left @ right))


def relocate_photo(
    scene: Scene, source: str | os.PathLike[str], target: str | os.PathLike[str]
) -> Scene:
    """Return a scene that was read from one file so that its photo is found from another one.

    Args:
        scene: its ``panorama.file`` is relative to ``source``, absolute or None.
        source: the file it was read from.
        target: the file it will be written to.

    Examples:
        >>> from panoscene.sample import sample_room_path
        >>> from panoscene.scene import read_scene
        >>> room = read_scene(sample_room_path())
        >>> room = replace(room, panorama=replace(room.panorama, file="photo.jpg"))
        >>> relocate_photo(room, "rooms/room.json", "new/room.json").panorama.file
        '../rooms/photo.jpg'
    """
    photo, source, target = scene.panorama.file, Path(source), Path(target)
    if photo is None or Path(photo).is_absolute():
        return scene
    try:
        photo = Path(os.path.relpath(source.parent / photo, target.parent)).as_posix()
    except ValueError:  # another drive
        photo = (source.parent / photo).resolve().as_posix()
    return replace(scene, panorama=replace(scene.panorama, file=photo))
