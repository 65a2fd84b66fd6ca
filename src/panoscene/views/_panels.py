"""How the page is divided: one panel for each room, all at one scale, and the key."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from panoscene.geometry import polygon_turn
from panoscene.scene import Scene
from panoscene.views._far import far_objects
from panoscene.views._key import longest_key
from panoscene.views._labels import Label
from panoscene.views._pieces import TOLERANCE, Bounds, Plan, View, make_plan, scene_bounds

KEY_WIDTH = 256.0
HEADER, FOOTER = 74.0, 54.0
AROUND = 54.0
"""Pixels around a room for dimensions and numbers."""
ONE_WIDTH, SEVERAL_WIDTH, LOWEST, HIGHEST, LARGEST = 1200, 1600, 560, 1000, 10000
"""Pixels: usual widths, limits of usual heights, and the largest width or height."""
WORTH_TURNING = 1.15
"""So much larger a room must become by another quarter turn."""


@dataclass(frozen=True, slots=True)
class Panel:
    """The part of the page that one scene has, and what is drawn in it."""

    left: float
    right: float
    view: View
    plan: Plan
    content: Bounds
    """What room and objects take, in pixels; at the same place in every panel."""
    far: frozenset[int]
    """Objects outside of what is shown."""

    @property
    def near(self) -> Plan:
        """The plan without the objects outside of what is shown."""
        pieces = tuple(piece for piece in self.plan.pieces if piece.index not in self.far)
        return replace(self.plan, pieces=pieces)


def make_panels(
    scenes: Sequence[tuple[str, Scene]],
    reference: Scene | None,
    relations: bool,
    size_px: tuple[int, int],
    tolerance: float = TOLERANCE,
) -> list[Panel]:
    """Return the panels: equally wide, rooms in their middle, at one scale and turn."""
    width = (size_px[0] - KEY_WIDTH) / len(scenes)
    height = size_px[1] - HEADER - FOOTER
    free = _free(size_px, len(scenes))
    if min(free) < 50:
        raise ValueError(f"size_px: found {size_px}, too small for {len(scenes)} picture(s)")
    shown = [scene for _, scene in scenes] + ([] if reference is None else [reference])
    turn, scale, (low_x, low_y, high_x, high_y) = fit_rooms(shown, free)
    panels = []
    for k, (_, scene) in enumerate(scenes):
        middle = (k + 0.5) * width, FOOTER + height / 2
        x, y = scale * (high_x - low_x) / 2, scale * (high_y - low_y) / 2
        offset = middle[0] - x - scale * low_x, middle[1] - y - scale * low_y
        view = View(turn, scale, offset)
        plan = make_plan(scene, view, relations=relations, tolerance=tolerance)
        content = middle[0] - x, middle[1] - y, middle[0] + x, middle[1] + y
        far = far_objects(plan, content)
        # the line to an object out of sight would cross the room
        near = tuple(contact for contact in plan.contacts if far.isdisjoint(contact.objects))
        plan = replace(plan, contacts=near)
        panels.append(Panel(k * width, (k + 1) * width, view, plan, content, far))
    return panels


def _free(size_px: tuple[int, int], count: int) -> tuple[float, float]:
    """Return width and height in pixels that a room of each panel may take."""
    width = (size_px[0] - KEY_WIDTH) / count
    return width - 2 * AROUND, size_px[1] - HEADER - FOOTER - 2 * AROUND


def natural_size(scenes: Sequence[Scene], reference: Scene | None, width: int) -> tuple[int, int]:
    """Return the size of a page without empty strips above and below rooms and key."""
    shown = [*scenes, *([] if reference is None else [reference])]
    _, scale, (_, low, _, high) = fit_rooms(shown, _free((width, HIGHEST), len(scenes)))
    rooms = HEADER + FOOTER + 2 * AROUND + scale * (high - low)
    key = max(longest_key([int(k) for k in scene.objects.category]) for scene in scenes)
    return width, int(min(max(rooms, key, LOWEST), HIGHEST))


def fit_rooms(scenes: Sequence[Scene], free: tuple[float, float]) -> tuple[float, float, Bounds]:
    """Return turn, scale and bounds of the room that fit into this many pixels.

    +y points up as far as the walls allow, unless another quarter turn makes the room clearly
    larger.
    """
    upright = polygon_turn(scenes[0].layout.floor_polygon)
    options = []
    for turn in (upright, upright - math.copysign(math.pi / 2, upright)):
        low_x, low_y, high_x, high_y = bounds = scene_bounds(scenes, turn)
        scale = min(free[0] / (high_x - low_x), free[1] / (high_y - low_y))
        options.append((turn, scale, bounds))
    return options[1] if options[1][1] > WORTH_TURNING * options[0][1] else options[0]


def number_objects(panels: list[Panel], names: list[dict[int, Label]]) -> list[dict[int, str]]:
    """Return the number of each object that has no name in one of the panels, for each panel.

    The number of an object is its place in the scene, from 0 as in names such as chair_4, so it
    is the same in all pictures of a scene.
    """
    nameless = {
        piece.index
        for panel, named in zip(panels, names, strict=True)
        for piece in panel.near.pieces
        if piece.index not in named
    }
    return [
        {piece.index: str(piece.index) for piece in panel.plan.pieces if piece.index in nameless}
        for panel in panels
    ]
