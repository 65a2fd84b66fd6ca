"""The photo that belongs to a scene file."""

from pathlib import Path

from jaxtyping import Float
from torch import Tensor

from panoscene.cli._errors import InputError
from panoscene.cli._terminal import note
from panoscene.scene import Scene, read_panorama


def photo_path(scene: Scene, file: Path, photo: Path | None) -> Path | None:
    """Return where the panorama of a scene is: the one given, or the one that the scene names.

    A photo that the scene names and that is not there is left out with a note; one that was
    asked for must be there.

    Raises:
        InputError: The photo that was asked for does not exist.
    """
    if photo is not None:
        if not photo.is_file():
            raise InputError(f"--photo {photo}: found no file there, expected a panorama")
        return photo
    if scene.panorama.file is None:
        return None
    named = file.parent / scene.panorama.file
    if named.is_file():
        return named
    note(f"{file}: its photo {scene.panorama.file} is not there and is left out")
    return None


def photo_image(
    scene: Scene, file: Path, photo: Path | None
) -> Float[Tensor, "3 height width"] | None:
    """Return the panorama of a scene as RGB in [0, 1], or None when it has none.

    Raises:
        InputError: The photo that was asked for does not exist.
        PanoramaError: It is not a panorama.
    """
    path = photo_path(scene, file, photo)
    return None if path is None else read_panorama(path)[0]
