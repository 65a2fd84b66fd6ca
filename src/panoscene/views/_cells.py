"""The small pictures of a comparison sheet, as pixels: rooms from above, and pictures in frames."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image
from torch import Tensor

from panoscene.scene import Scene
from panoscene.style import GROUP_COLOURS
from panoscene.views._drawing import draw_room
from panoscene.views._far import draw_arrow_head, far_objects, place_pointers
from panoscene.views._page import Page
from panoscene.views._panels import fit_rooms
from panoscene.views._pictures import fitted_pixels
from panoscene.views._pieces import TOLERANCE, View, make_plan

_FINER = 2
"""Times as large as they are shown rooms are drawn, so that their lines are as fine as the room."""
_AROUND = 26.0
"""Pixels around the room, as it is drawn, for arrows to far objects."""


def room_cell(
    scene: Scene,
    group: Sequence[Scene],
    width: int,
    height: int,
    *,
    reference: Scene | None = None,
    tolerance: float = TOLERANCE,
) -> UInt8[np.ndarray, "{height} {width} 3"]:
    """Return a room from above without text; rooms of one group at one scale, turn and place.

    Args:
        scene: what to draw.
        group: all scenes that are shown of this room.
        width: of the cell in pixels.
        height: of the cell in pixels.
        reference: a scene whose boxes are outlined.
        tolerance: metres of overlap from which boxes collide.
    """
    page = Page(_FINER * width, _FINER * height)
    free = page.width - 2 * _AROUND, page.height - 2 * _AROUND
    turn, scale, (left, low, right, high) = fit_rooms(group, free)
    x, y = scale * (right - left) / 2, scale * (high - low) / 2
    offset = page.width / 2 - x - scale * left, page.height / 2 - y - scale * low
    view = View(turn, scale, offset)
    plan = make_plan(scene, view, relations=False, tolerance=tolerance)
    content = page.width / 2 - x, page.height / 2 - y, page.width / 2 + x, page.height / 2 + y
    page.clip((content[0] - 4, content[1] - 4, content[2] + 4, content[3] + 4))
    draw_room(page, plan, reference, view)
    page.clip(None)
    far = far_objects(plan, content)
    pointers = place_pointers(
        plan, far, content, numbers={}, scale=scale, measure=lambda _: (0.0, 0.0)
    )
    for pointer in pointers:
        if pointer.group is not None:
            draw_arrow_head(page, pointer.arrow, pointer.direction, GROUP_COLOURS[pointer.group])
    return np.array(Image.fromarray(page.pixels()).reduce(_FINER))


def framed(
    image: Float[Tensor, "3 image_height image_width"], width: int, height: int
) -> UInt8[np.ndarray, "shown_height shown_width 3"]:
    """Return a picture as large as a cell allows, at its own proportions."""
    scale = min(width / image.shape[2], height / image.shape[1])
    shown = [max(1, round(scale * side)) for side in (image.shape[2], image.shape[1])]
    return fitted_pixels(image, min(shown[0], width), min(shown[1], height))
