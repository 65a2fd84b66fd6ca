"""Settling a furnished home: the engine first, then the meshes have the last word."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from panoscene.synth.homes import Home, Placed

from ._check import beyond, gap_of
from ._engine import Motion, simulate
from ._partings import part
from ._records import Models, ObjectReport, Outcome, SettleReport
from ._rest import rest
from ._room_beside import room_beside
from ._scene import CARPET, CARPET_THICKNESS, SOFT, Scene, scene_of
from ._shapes import CollisionShape
from ._walls import back_gap

FARTHEST = 0.3
_TILT = np.radians(10.0)
_FELL = 0.15
_SOFT_LIFT = 0.1
"""How far cushions are lifted out of what they are put in: they may lie on pillows."""
_SAME_PLACE = 0.003
_SAME_YAW = 0.005


@dataclass(slots=True)
class _Notes:
    """What happened to the models of a home, by index."""

    outcome: dict[int, Outcome] = field(default_factory=dict)
    reason: dict[int, str] = field(default_factory=dict)
    tilt: dict[int, float] = field(default_factory=dict)
    reports: dict[int, ObjectReport] = field(default_factory=dict)
    steps: int = 0


def settle_home(
    home: Home,
    models: Models,
    *,
    cache: Path | None = None,
    farthest: float = FARTHEST,
) -> tuple[Home, SettleReport]:
    """Return the home with everything at rest, and what happened to each model.

    What hangs is put flush with its wall or ceiling; carpets are pressed to at most 1 cm and lie
    under the furniture. Then the engine (mujoco) moves the rest of each room: furniture on the
    floor slides and turns, things on it can fall over. Afterwards all stand upright again and are
    let down on the meshes below them; meshes that are still in each other by more than 1 cm are
    moved apart. What fell over or off, moved too far or cannot be parted is left out, together
    with what stood on it. The same home gives the same bits on the same machine.

    Args:
        home: Furnished.
        models: By id; all models of the home.
        cache: Folder of the assets, where collision shapes are kept; None keeps none.
        farthest: A model that moves farther than this many metres is left out.

    Returns:
        The settled home, with ``support`` and ``opening`` renumbered, and the report, which has
        the numbers of the home that was given.

    Raises:
        ModuleNotFoundError: The optional package mujoco is missing.
        ValueError: A model of the home is missing.
    """
    shapes: dict[str, CollisionShape] = {}
    notes = _Notes()
    settled: dict[int, Placed] = {}
    for room in range(len(home.rooms)):
        scene = scene_of(_pressed(home, room, models), room, models, shapes, cache)
        _settle_room(scene, notes, farthest)
        settled |= _results(scene, home, notes)
    for index, placed in enumerate(home.placed):
        if index not in notes.reports:  # leaves of doors that stand open
            settled[index] = placed
            notes.reports[index] = ObjectReport(index, placed.model, "fixed")
    numbers = {old: new for new, old in enumerate(sorted(settled))}
    kept = tuple(
        replace(placed, support=None if placed.support is None else numbers.get(placed.support))
        for _, placed in sorted(settled.items())
    )
    reports = tuple(report for _, report in sorted(notes.reports.items()))
    return replace(home, placed=kept), SettleReport(reports, notes.steps)


def _pressed(home: Home, room: int, models: Models) -> Home:
    """Return the home with the carpets of a room thin enough to be walked on, on the floor."""
    placed = list(home.placed)
    for index, piece in enumerate(placed):
        if piece.room != room or piece.model not in models:
            continue
        model = models[piece.model]
        if model.category != CARPET:
            continue
        height = max(model.size[2], 1e-6)
        squeeze = min(piece.scale[2], CARPET_THICKNESS / height)
        bottom = float(model.vertices[:, 2].min()) * squeeze
        placed[index] = replace(
            piece,
            scale=(piece.scale[0], piece.scale[1], squeeze),
            position=(piece.position[0], piece.position[1], -bottom),
        )
    return replace(home, placed=tuple(placed))


def _settle_room(scene: Scene, notes: _Notes, farthest: float) -> None:
    start = {index: body.position for index, body in scene.solids.items()}
    _fix(scene, notes)
    _lay_down(scene, notes, farthest)
    keys = sorted(scene.solids)
    bodies = [scene.body(k) for k in keys if scene.models[k].category != CARPET]
    keys = [k for k in keys if scene.models[k].category != CARPET]
    motions, steps = simulate(bodies, scene.room.polygon)
    notes.steps += steps
    _accept(scene, notes, dict(zip(keys, motions, strict=True)), start, farthest)
    for index, reason in part(scene, start, farthest).items():
        notes.reason[index] = reason
        if index in scene.solids:
            notes.outcome[index] = "shifted"


def _fix(scene: Scene, notes: _Notes) -> None:
    """Put what hangs flush with its wall or ceiling, and take out what hangs on nothing."""
    for index in sorted(scene.solids):
        if scene.freedom[index] != "fixed":
            continue
        notes.outcome[index] = "fixed"
        model, body = scene.models[index], scene.solids[index]
        if scene.placed[index].opening is not None or model.category == CARPET:
            continue
        if model.placement == "ceiling":
            up = scene.room.ceiling_height - float(body.bounds[1, 2])
            scene.put(index, body.shifted(np.array([0.0, 0.0, up])))
        elif model.placement == "wall":
            hung = back_gap(body, scene.room)
            if hung is None:
                _drop_out(scene, notes, index, "hangs on no wall")
                continue
            _, move, yaw = hung
            scene.place(index, body.position + move, yaw)


def _drop_out(scene: Scene, notes: _Notes, index: int, reason: str) -> None:
    scene.remove(index)
    notes.reason[index] = reason


def _lay_down(scene: Scene, notes: _Notes, farthest: float) -> None:
    """Put all that stands exactly on what is under it, and note what that is."""
    for index in scene.order():
        body = scene.solids[index]
        if scene.freedom[index] == "sliding":
            scene.put(index, body.shifted(np.array([0.0, 0.0, -body.low])))
            continue
        above = {index, *scene.dependents(index)}
        others = {k: other for k, other in scene.solids.items() if k not in above}
        found = scene.rest(index, above)
        scene.put(index, body.shifted(np.array([0.0, 0.0, found.lift])))
        if not found.free:
            below = scene.support[index]
            under = None if below is None else others.get(below)
            beside = None if under is None else room_beside(body, others, under, farthest)
            if beside is not None:
                at, found = beside
                scene.put(index, at)
            elif scene.models[index].category in SOFT:
                found = rest(body, others, most_lift=_SOFT_LIFT)
                scene.put(index, body.shifted(np.array([0.0, 0.0, found.lift])))
            notes.reason[index] = "no room for it where it was put"
        if not found.free:
            scene.remove(index)
            continue
        scene.support[index] = found.support


def _accept(
    scene: Scene,
    notes: _Notes,
    motions: Mapping[int, Motion],
    start: Mapping[int, Float64[np.ndarray, " 3"]],
    farthest: float,
) -> None:
    """Take over where the engine left things, upright and on the meshes below."""
    order = scene.order()
    for place, index in enumerate(order):
        motion, body = motions[index], scene.solids[index]
        notes.tilt[index] = motion.tilt
        move = motion.position - body.position
        turn = abs((motion.yaw - body.yaw + np.pi) % (2 * np.pi) - np.pi)
        fallen = _failure(motion, move, motion.position - start[index], farthest)
        if fallen:
            _drop_out(scene, notes, index, fallen)
            continue
        still = float(np.hypot(move[0], move[1])) < _SAME_PLACE and turn < _SAME_YAW
        notes.outcome[index] = "kept" if still else "settled"
        if index in notes.reason:
            notes.outcome[index] = "shifted"
        if scene.freedom[index] == "sliding":
            move[2] = 0.0
        if still:
            move[:2] = 0.0
        scene.place(index, body.position + move, body.yaw if still else motion.yaw)
        if scene.freedom[index] == "sliding":
            continue
        found = scene.rest(index, order[place:])
        if not found.free or found.lift < -_FELL:
            gone = "lost what it stood on" if found.free else "no room for it where it came to rest"
            _drop_out(scene, notes, index, gone)
            continue
        scene.put(index, scene.solids[index].shifted(np.array([0.0, 0.0, found.lift])))
        scene.support[index] = found.support


def _failure(
    motion: Motion,
    move: Float64[np.ndarray, " 3"],
    way: Float64[np.ndarray, " 3"],
    farthest: float,
) -> str:
    """Return what is wrong with how a model moved, in the engine and altogether, or ""."""
    if not np.isfinite(motion.position).all():
        return "the engine lost it"
    if motion.tilt > _TILT:
        return f"fell over: {np.degrees(motion.tilt):.0f} degrees"
    if move[2] < -_FELL:
        return f"fell {-move[2]:.2f} m"
    if np.linalg.norm(way) > farthest:
        return f"moved {np.linalg.norm(way):.2f} m"
    return ""


def _results(scene: Scene, home: Home, notes: _Notes) -> dict[int, Placed]:
    """Return the models that are left, and report on all of the room."""
    depth = dict.fromkeys(scene.solids, 0.0)
    for first, second in scene.pairs():
        found = scene.meets(first, second).depth
        depth[first], depth[second] = max(depth[first], found), max(depth[second], found)
    settled: dict[int, Placed] = {}
    for index, placed in scene.placed.items():
        if index not in scene.solids:
            reason = notes.reason.get(index, "")
            tilt = notes.tilt.get(index, 0.0)
            notes.reports[index] = ObjectReport(
                index, placed.model, "removed", tilt=tilt, reason=reason
            )
            continue
        body = scene.solids[index]
        move = body.position - np.array(home.placed[index].position)
        x, y, z = (float(v) for v in body.position)
        settled[index] = replace(
            placed, position=(x, y, z), yaw=body.yaw, support=scene.support[index]
        )
        notes.reports[index] = ObjectReport(
            index,
            placed.model,
            notes.outcome.get(index, "kept"),
            moved=float(np.linalg.norm(move)),
            turned=float((body.yaw - home.placed[index].yaw + np.pi) % (2 * np.pi) - np.pi),
            tilt=notes.tilt.get(index, 0.0),
            penetration=max(depth[index], beyond(scene, index)),
            gap=gap_of(scene, index),
            reason=notes.reason.get(index, ""),
        )
    return settled
