"""Scenes as files for the browser."""

from pathlib import Path
from tempfile import TemporaryDirectory

from panoscene.scene import Scene, write_scene


def scene_bytes(scene: Scene) -> bytes:
    """Return what ``write_scene`` writes.

    Raises:
        SceneFormatError: the scene cannot be a scene file.
    """
    with TemporaryDirectory() as folder:
        path = Path(folder) / "scene.json"
        write_scene(scene, path)
        return path.read_bytes()
