"""What in a scene is possible but unlikely: told, and then taken as it is."""

from collections.abc import Iterator
from pathlib import Path

from panoscene.cli._terminal import note
from panoscene.geometry import polygon_contains
from panoscene.scene import Scene

LARGEST = 100.0
"""Metres; no furnished room is wider, and few rooms are narrower in centimetres."""


def note_doubts(scene: Scene, file: Path) -> None:
    """Say on stderr what about a scene is probably a mistake."""
    for doubt in _doubts(scene):
        note(f"{file}: {doubt}")


def _doubts(scene: Scene) -> Iterator[str]:
    layout, height = scene.layout, scene.panorama.camera_height
    polygon = layout.floor_polygon.double()
    sides = (polygon.amax(0) - polygon.amin(0)).tolist()
    if max(sides) > LARGEST:
        found = f"{sides[0]:.6g} x {sides[1]:.6g} m"
        yield f"the room measures {found}; are these centimetres? They are taken as metres"
    if not bool(polygon_contains(polygon.new_zeros(1, 2), polygon)):
        yield "the camera, at x = 0 and y = 0, is outside the floor polygon"
    if layout.ceiling_height <= height:
        yield f"the ceiling, at {layout.ceiling_height:g} m, is below the camera at {height:g} m"
