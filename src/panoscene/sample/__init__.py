"""A furnished sample room that comes with the package, as a scene.json file."""

from panoscene.sample._room import sample_room_path as sample_room_path
