"""Colours of models: a group of categories shares one, and so do all walls."""

from types import MappingProxyType

from panoscene.scene import CATEGORIES, Scene, SurfaceKind
from panoscene.style import FLOOR, GROUP_COLOURS, PAPER, WALL, group_of

ROOM_COLOURS = MappingProxyType({"wall": WALL, "floor": FLOOR, "ceiling": PAPER})


def surface_colour(scene: Scene, kind: SurfaceKind, index: int) -> tuple[str, str]:
    """Return name and sRGB colour of the material of an object or a part of the room."""
    if kind != "object":
        return kind, ROOM_COLOURS[kind]
    group = group_of(CATEGORIES[int(scene.objects.category[index])])
    return group, GROUP_COLOURS[group]
