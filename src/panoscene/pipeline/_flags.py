"""What a user should know before using a result."""

import math

from panoscene.models.layout import LayoutPrediction
from panoscene.scene import Layout, Scene

from ._records import Flag
from ._sphere import SphereGaps

TOLD_TILT = math.radians(3.0)
"""Radians; from here on the user is told that the camera leant."""
WEAK_WALL = 0.4
"""Mean confidence of the walls below which a room may be none."""


def photo_flags(gaps: SphereGaps, tilt: float) -> tuple[Flag, ...]:
    """Return what is noteworthy about a photo.

    Args:
        gaps: what it lacks of the sphere.
        tilt: radians by which it was turned to stand upright.
    """
    flags: list[Flag] = []
    if not gaps.whole:
        numbers = {
            "top_deg": math.degrees(gaps.top),
            "bottom_deg": math.degrees(gaps.bottom),
            "sides_deg": math.degrees(gaps.sides),
            "pole_spread": gaps.spread,
        }
        where = gaps.where or "it seems to be stretched"
        text = f"the photo does not show the whole sphere: {where}"
        flags.append(Flag("not_full_sphere", text, numbers))
    if tilt >= TOLD_TILT:
        degrees = math.degrees(tilt)
        text = f"the camera was tilted by {degrees:.0f} degrees; the photo was turned"
        flags.append(Flag("tilted", text, {"tilt_deg": degrees}))
    return tuple(flags)


def scene_flags(read: LayoutPrediction | None, layout: Layout, scene: Scene) -> tuple[Flag, ...]:
    """Return what is noteworthy about what was found in a photo.

    Args:
        read: the layout with the signals that it was read from; None when it was given.
        layout: the room.
        scene: the result.
    """
    flags: list[Flag] = []
    if read is not None and read.ambiguous:
        text = "the room can be read in two ways, perhaps because of an open doorway"
        flags.append(Flag("ambiguous_layout", text))
    certain = 1.0 if layout.wall_score is None else float(layout.wall_score.mean())
    if certain < WEAK_WALL:
        text = "the walls are uncertain: this may not be a room, or not an indoor photo"
        flags.append(Flag("not_indoors", text, {"wall_score": certain}))
    if len(scene.objects.boxes) == 0:
        flags.append(Flag("nothing_found", "no object was found"))
    return tuple(flags)
