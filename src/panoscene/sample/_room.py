"""Where the sample room lies."""

from pathlib import Path


def sample_room_path() -> Path:
    """Return the path of ``room.json``: a bedroom of 27 m² with 6 corners and 17 objects.

    Boxes and relations are exact. ``examples/make_sample_room.py`` made it.

    Examples:
        >>> sample_room_path().name
        'room.json'
    """
    return Path(__file__).with_name("room.json")
