"""Relations as English sentences."""

import math

from panoscene.scene import Triple

ROUTINE = ("farther_than", "relative_yaw")
"""Relations that nearly every pair of objects has."""

_SIMPLE = {
    "touching": "touches",
    "on_floor": "rests on the",
    "under_ceiling": "touches the",
    "inside_room": "is inside the",
    "farther_than": "is farther from the camera than",
}
# by the angle from the object's front to the wall's, which looks into the room
_SIDE_TO_WALL = {
    0: "turns its back to",
    45: "turns its right rear corner to",
    90: "turns its right side to",
    135: "turns its right front corner to",
    180: "faces",
    -135: "turns its left front corner to",
    -90: "turns its left side to",
    -45: "turns its left rear corner to",
}


def sentence(triple: Triple) -> str:
    """Return a relation as a sentence, with its probability unless it is certain."""
    words = _turned(triple) if triple.angle is not None else _plain(triple)
    return words if triple.score >= 0.995 else f"{words} ({triple.score:.2f})"


def _plain(triple: Triple) -> str:
    return f"{triple.subject} {_SIMPLE[triple.predicate]} {triple.object}"


def _turned(triple: Triple) -> str:
    degrees = round(math.degrees(triple.angle or 0.0))
    if triple.object.startswith("wall-"):
        side = _SIDE_TO_WALL[180 if degrees == -180 else degrees]
        return f"{triple.subject} {side} {triple.object}"
    if degrees == 0:
        return f"{triple.subject} faces the same way as {triple.object}"
    if abs(degrees) == 180:
        return f"{triple.subject} faces the opposite way to {triple.object}"
    # the object's front as seen along the subject's; counter-clockwise is to the left
    side = "left" if degrees > 0 else "right"
    angle = f"{abs(degrees)} degrees to the {side}"
    return f"{triple.object} faces {angle} of where {triple.subject} faces"
