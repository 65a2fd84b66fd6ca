"""Moving meshes apart that are still in each other, or leaving one of them out."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float64

from ._check import TOLERANCE, beyond
from ._contact import overlap
from ._scene import Scene
from ._walls import outside

_SPARE = 0.003
_STEP_UP = 0.03


def part(
    scene: Scene, start: Mapping[int, Float64[np.ndarray, " 3"]], farthest: float
) -> dict[int, str]:
    """Return why models were shifted or taken out, by index, after parting all of a room.

    Of two meshes that are in each other the smaller one that can move is shifted level, with all
    that stands on it; when that leads into something else, the other one; when neither helps, the
    smaller is taken out.

    Args:
        scene: Changed in place.
        start: Where the models were put.
        farthest: Greatest way from there, in metres.
    """
    reasons: dict[int, str] = {}
    for index in scene.order():
        if index in scene.solids and beyond(scene, index) > TOLERANCE:
            _out_of_wall(scene, index, start, farthest, reasons)
    worst = _worst(scene)
    while worst is not None:
        _part_pair(scene, worst, start, farthest, reasons)
        worst = _worst(scene)
    return reasons


def _worst(scene: Scene) -> tuple[int, int] | None:
    """Return the pair that is deepest in each other, if any is too deep."""
    found = [(scene.meets(*pair).depth, pair) for pair in scene.pairs()]
    deep = [item for item in found if item[0] > TOLERANCE]
    return max(deep)[1] if deep else None


def _out_of_wall(
    scene: Scene,
    index: int,
    start: Mapping[int, Float64[np.ndarray, " 3"]],
    farthest: float,
    reasons: dict[int, str],
) -> None:
    depth, move = outside(scene.solids[index], scene.room)
    if depth > TOLERANCE and _try_shift(scene, index, move, start, farthest):
        reasons[index] = f"was {depth:.3f} m in a wall"
    else:
        _take_out(scene, index, "reaches into a wall or the ceiling", reasons)


def _part_pair(
    scene: Scene,
    pair: tuple[int, int],
    start: Mapping[int, Float64[np.ndarray, " 3"]],
    farthest: float,
    reasons: dict[int, str],
) -> None:
    small, large = sorted(pair, key=lambda k: (scene.solids[k].volume, k))
    depth = scene.meets(*pair).depth
    for index, other in ((small, large), (large, small)):
        if scene.freedom[index] == "fixed" or other in scene.dependents(index):
            continue
        way = overlap(scene.solids[index], scene.solids[other], level=True).move
        length = float(np.linalg.norm(way))
        if length == 0.0 or length > farthest:
            continue
        if _try_shift(scene, index, way * (1 + _SPARE / length), start, farthest):
            reasons[index] = f"was {depth:.3f} m in {scene.placed[other].model}"
            return
    loser = large if scene.placed[small].opening is not None else small
    other = small if loser == large else large
    _take_out(scene, loser, f"is {depth:.3f} m in {scene.placed[other].model}", reasons)


def _try_shift(
    scene: Scene,
    index: int,
    move: Float64[np.ndarray, " 3"],
    start: Mapping[int, Float64[np.ndarray, " 3"]],
    farthest: float,
) -> bool:
    """Return whether a model could be shifted with what stands on it; all as before if not."""
    group = (index, *scene.dependents(index))
    before = {k: (scene.solids[k], scene.support[k]) for k in group}
    for k in group:
        scene.put(k, scene.solids[k].shifted(move))
    good = True
    for k in group:
        if scene.freedom[k] != "sliding":
            found = scene.rest(k, scene.dependents(k), _STEP_UP)
            good &= found.free and found.lift > -_STEP_UP
            if good:
                scene.put(k, scene.solids[k].shifted(np.array([0.0, 0.0, found.lift])))
                scene.support[k] = found.support
        way = float(np.linalg.norm(scene.solids[k].position - start[k]))
        good = good and way <= farthest and beyond(scene, k) <= TOLERANCE
    good = good and all(scene.meets(*pair).depth <= TOLERANCE for pair in scene.pairs(group))
    if not good:
        for k, (body, support) in before.items():
            scene.put(k, body)
            scene.support[k] = support
    return good


def _take_out(scene: Scene, index: int, reason: str, reasons: dict[int, str]) -> None:
    """Take a model out with all that stands on it."""
    for k in scene.dependents(index):
        scene.remove(k)
        reasons[k] = "lost what it stood on"
    scene.remove(index)
    reasons[index] = reason
