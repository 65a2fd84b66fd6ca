"""Where the sample photo lies."""

from pathlib import Path


def sample_photo_path() -> Path:
    """Return the path of ``photo.jpg``: a panorama of a studio flat, 1024 x 512 pixels.

    It was rendered by ``panoscene synth render configs/synth/demo.yaml`` and is in no set that a
    network was trained, chosen or tested on. The makers of its furniture are named in the file
    ``ATTRIBUTION`` next to it.

    Examples:
        >>> sample_photo_path().name
        'photo.jpg'
    """
    return Path(__file__).with_name("photo.jpg")


def sample_photo_truth_path() -> Path:
    """Return the path of ``photo_truth.json``: what the sample photo truly shows.

    Examples:
        >>> from panoscene.scene import read_scene
        >>> len(read_scene(sample_photo_truth_path()).layout.floor_polygon)
        6
    """
    return Path(__file__).with_name("photo_truth.json")
