"""Floor plans as DXF, for CAD: one drawing unit is a metre."""

import os
from pathlib import Path

from panoscene.exports._floor_plan import floor_plan
from panoscene.scene import Scene, write_atomically


def write_floor_plan_dxf(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Write the floor plan of a scene as DXF (R2010); the file appears complete or not at all.

    Layers part walls, doors, windows, furniture, dimensions and texts; every piece of furniture
    is a block, inserted at its middle and turned with it, so that it can be moved as a whole;
    dimensions are real ones, which follow when they are stretched.

    Convention:
        - one drawing unit is a metre, and the header says so
        - the room is turned as ``floor_plan`` turns it; the camera is at the origin

    Raises:
        SceneFormatError: the scene has numbers that are not finite or a room that is none.
    """
    from panoscene.exports._plan_drawing import dxf_text  # noqa: PLC0415 (ezdxf takes its time)

    write_atomically(Path(path), dxf_text(floor_plan(scene)))
