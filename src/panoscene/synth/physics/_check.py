"""Whether a home is physically right, from the meshes alone."""

from pathlib import Path

from panoscene.synth.homes import Home

from ._records import Fault, Models
from ._scene import CARPET, Scene, scene_of
from ._shapes import CollisionShape
from ._walls import back_gap, outside

TOLERANCE = 0.01


def check_home(
    home: Home,
    models: Models,
    *,
    cache: Path | None = None,
    tolerance: float = TOLERANCE,
) -> tuple[Fault, ...]:
    """Return everything that floats or is in something else, by room, the worst first.

    No physics engine is used: meshes are cut by lines along the axes of both, and the depth of an
    overlap is the least way along these axes that would part them. Leaves of doors that stand
    open are left out.

    Args:
        home: To look at.
        models: By id.
        cache: Folder of the assets, for collision shapes; None keeps none.
        tolerance: Depths and gaps up to this many metres are right.

    Raises:
        ValueError: A model of the home is missing.
    """
    shapes: dict[str, CollisionShape] = {}
    faults: list[Fault] = []
    for room in range(len(home.rooms)):
        found = faults_of(scene_of(home, room, models, shapes, cache), tolerance)
        faults += sorted(found, key=lambda fault: -fault.depth)
    return tuple(faults)


def faults_of(scene: Scene, tolerance: float) -> list[Fault]:
    """Return what is wrong in a room."""
    faults: list[Fault] = []
    for first, second in scene.pairs():
        depth = scene.meets(first, second).depth
        if depth > tolerance:
            faults.append(Fault("penetration", first, second, depth))
    for index in sorted(scene.solids):
        depth = beyond(scene, index)
        if depth > tolerance:
            faults.append(Fault("outside", index, None, depth))
        gap = gap_of(scene, index)
        if gap > tolerance:
            faults.append(Fault("floating", index, None, gap))
    return faults


def beyond(scene: Scene, index: int) -> float:
    """Return how deep a model is in the walls, the floor or the ceiling of its room."""
    body, room = scene.solids[index], scene.room
    if scene.placed[index].opening is not None or scene.models[index].placement == "in_wall":
        return 0.0
    over = float(body.bounds[1, 2]) - room.ceiling_height
    return max(outside(body, room)[0], -body.low, over, 0.0)


def gap_of(scene: Scene, index: int) -> float:
    """Return the free height below a model, or the free depth behind one that hangs."""
    body, model = scene.solids[index], scene.models[index]
    if scene.placed[index].opening is not None or model.placement == "in_wall":
        return 0.0
    if model.category == CARPET:
        return max(body.low, 0.0)
    if scene.freedom[index] == "fixed":
        if model.placement == "ceiling":
            return max(scene.room.ceiling_height - float(body.bounds[1, 2]), 0.0)
        hung = back_gap(body, scene.room)
        return 1.0 if hung is None else max(hung[0], 0.0)
    if body.low <= 0.0:
        return 0.0
    return max(-scene.rest(index, (), most_lift=0.0).lift, 0.0)
