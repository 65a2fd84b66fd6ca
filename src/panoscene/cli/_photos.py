"""The photo that belongs to a scene file, upright as the scene is."""

from pathlib import Path

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.cli._errors import InputError
from panoscene.cli._terminal import note
from panoscene.geometry import rotate_panorama
from panoscene.scene import Panorama, Scene, read_panorama

MOST_TURNED = 4096
"""Columns that are kept of a photo that has to be turned: more than any view or texture shows."""


def photo_image(
    scene: Scene, file: Path, photo: Path | None
) -> Float[Tensor, "3 height width"] | None:
    """Return the panorama of a scene as upright RGB in [0, 1], or None when it has none.

    A photo that the scene names and that is not there is left out with a note; one that was
    asked for must be there. Both are turned by the scene's ``upright_from_photo``.

    Args:
        scene: what the photo belongs to.
        file: where the scene is from; photos are named relative to it.
        photo: the photo that was asked for, if any.

    Raises:
        InputError: The photo that was asked for does not exist.
        PanoramaError: It is not a panorama.
    """
    path = _photo_path(scene, file, photo)
    return None if path is None else upright(read_panorama(path)[0], scene.panorama)


def upright(image: Float[Tensor, "3 height width"], panorama: Panorama) -> Float[Tensor, "3 _ _"]:
    """Return a photo as a camera that stands upright would have taken it.

    A photo that is upright already comes back as it is; another one has at most 4096 columns.
    """
    rotation = torch.tensor(panorama.upright_from_photo, dtype=torch.float64)
    if torch.equal(rotation, torch.eye(3, dtype=torch.float64)):
        return image
    if image.shape[-1] > MOST_TURNED:
        size = (MOST_TURNED // 2, MOST_TURNED)
        image = torch.nn.functional.interpolate(image[None], size=size, mode="area")[0]
    # files carry rounded numbers: the nearest rotation has none of their errors
    left, _, right = torch.linalg.svd(rotation)
    return rotate_panorama(image, left @ right)


def _photo_path(scene: Scene, file: Path, photo: Path | None) -> Path | None:
    if photo is not None:
        if not photo.is_file():
            raise InputError(f"--photo {photo}: found no file there, expected a panorama")
        return photo
    if scene.panorama.file is None:
        return None
    named = file.parent / scene.panorama.file
    try:
        if named.is_file():
            return named
    except OSError:  # such as a name that is too long
        pass
    note(f"{file}: its photo {scene.panorama.file} is not there and is left out")
    return None
