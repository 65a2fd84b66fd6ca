"""What a user should know before using a result."""

import math

from panoscene.geometry import boundary_from_layout
from panoscene.models.layout import LayoutPrediction
from panoscene.scene import Scene

from ._records import Flag
from ._sphere import SphereGaps

LEAST_COLUMNS = 512
"""Columns of a photo below which networks, which look at 1024, miss most of what there is."""
TOLD_TILT = math.radians(3.0)
"""Radians; from here on the user is told that the camera leant."""
LEAST_WALL_DEG = 45.0
"""Mean angle from floor to ceiling below which there may be no walls but the horizon."""
LEAST_CORNER = 0.5
"""Signal of the surest corner below which none was seen."""
WEAK_WALL = 0.2
"""Mean confidence of the walls below which a room may be none."""
WEAK_EMPTY_WALL = 0.45
"""The same where nothing was found in the room either."""


def photo_flags(gaps: SphereGaps, tilt: float, columns: int) -> tuple[Flag, ...]:
    """Return what is noteworthy about a photo.

    Args:
        gaps: what it lacks of the sphere.
        tilt: radians by which it was turned to stand upright.
        columns: of the photo.
    """
    flags: list[Flag] = []
    if columns < LEAST_COLUMNS:
        text = f"the photo is small: found {columns} columns, expected {LEAST_COLUMNS} or more"
        flags.append(Flag("low_resolution", text, {"columns": float(columns)}))
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


def scene_flags(read: LayoutPrediction | None, scene: Scene) -> tuple[Flag, ...]:
    """Return what is noteworthy about what was found in a photo.

    Args:
        read: the layout with the signals that it was read from; None when it was given.
        scene: the result.
    """
    flags: list[Flag] = []
    if read is not None and read.ambiguous:
        text = "the room can be read in two ways, perhaps because of an open doorway"
        flags.append(Flag("ambiguous_layout", text))
    if read is not None:
        flags.extend(_not_indoors(read, scene))
    if len(scene.objects.boxes) == 0:
        flags.append(Flag("nothing_found", "no object was found"))
    return tuple(flags)


def room_signs(read: LayoutPrediction, camera_height: float) -> dict[str, float]:
    """Return what tells rooms from other pictures, by name.

    ``wall_deg`` is the mean angle from floor to ceiling, ``corner`` the signal of the surest
    corner, ``wall_score`` the mean confidence of the walls.

    Args:
        read: the layout with the signals that it was read from.
        camera_height: metres.
    """
    layout = read.layout
    ceiling, floor = boundary_from_layout(
        layout.floor_polygon, layout.floor_height, layout.ceiling_height, camera_height
    )
    certain = 1.0 if layout.wall_score is None else float(layout.wall_score.mean())
    height = math.degrees(float((ceiling - floor).mean()))
    return {"wall_deg": height, "corner": float(read.corner.max()), "wall_score": certain}


def _not_indoors(read: LayoutPrediction, scene: Scene) -> tuple[Flag, ...]:
    """Return the flag for a picture that shows no walls, no corner, or none to be sure of."""
    signs = room_signs(read, scene.panorama.camera_height)
    least = WEAK_WALL if len(scene.objects.boxes) else WEAK_EMPTY_WALL
    if (
        signs["wall_deg"] >= LEAST_WALL_DEG
        and signs["corner"] >= LEAST_CORNER
        and signs["wall_score"] >= least
    ):
        return ()
    text = "the walls are uncertain: this may not be a room, or not an indoor photo"
    return (Flag("not_indoors", text, signs),)
