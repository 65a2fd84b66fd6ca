"""The photo that belongs to a scene file, upright as the scene is."""

from pathlib import Path

from jaxtyping import Float
from torch import Tensor

from panoscene.cli._errors import InputError
from panoscene.cli._terminal import note
from panoscene.scene import Scene, read_panorama, upright_photo


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
    return None if path is None else upright_photo(read_panorama(path)[0], scene.panorama)


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
