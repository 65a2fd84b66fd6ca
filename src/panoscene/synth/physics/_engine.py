"""The physics engine: mujoco lets the furniture of one room come to rest."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from jaxtyping import Float64

Freedom = Literal["fixed", "sliding", "upright", "free"]
"""``fixed`` stays; ``sliding`` stands on the floor and moves and turns on it; ``upright`` stands on
something and moves up and down as well; ``free`` can tip over."""

_STEP = 0.005
_WARM = 40
_QUIET = 20
"""Steps without movement after which everything is at rest."""
_STILL = 0.004
_SKIN = 0.001
"""Boxes of what slides end this much before the surface, so that flush sides do not rub."""
_DENSITY = 200.0
_WALL = 0.3


@dataclass(frozen=True, slots=True)
class Body:
    """What the engine knows of a piece of furniture."""

    boxes: Float64[np.ndarray, "boxes 2 3"]
    """Lowest and highest corners in the object frame, after scaling, metres."""
    position: Float64[np.ndarray, " 3"]
    yaw: float
    freedom: Freedom


@dataclass(frozen=True, slots=True)
class Motion:
    """Where a body came to rest."""

    position: Float64[np.ndarray, " 3"]
    """Of the origin of its object frame."""
    yaw: float
    tilt: float
    """Radians between its axis and the vertical."""


def simulate(
    bodies: Sequence[Body], polygon: Float64[np.ndarray, "corners 2"], most_steps: int = 400
) -> tuple[list[Motion], int]:
    """Return where the bodies of a room come to rest, and after how many steps.

    The movement is heavily damped: nothing flies off when it starts in something else. The same
    bodies give the same bits on the same machine.

    Args:
        bodies: Furniture of the room.
        polygon: Corners of the room; a wall stands behind every side.
        most_steps: Steps of 5 ms after which it ends in any case.

    Raises:
        ModuleNotFoundError: The optional package mujoco is missing.
    """
    mujoco = _mujoco()
    spec = mujoco.MjSpec()
    spec.memory = 1 << 28
    spec.option.timestep = _STEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.iterations = 30
    spec.option.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL
    _add_room(mujoco, spec, polygon)
    moving = [k for k, body in enumerate(bodies) if body.freedom != "fixed"]
    for k, body in enumerate(bodies):
        _add_body(mujoco, spec, body, str(k))
    motions = [Motion(body.position, body.yaw, 0.0) for body in bodies]
    if not moving:
        return motions, 0
    model = spec.compile()
    data = mujoco.MjData(model)
    steps, quiet = 0, 0
    while steps < most_steps and quiet < _QUIET:
        mujoco.mj_step(model, data)
        steps += 1
        still = steps > _WARM and float(np.abs(data.qvel).max()) < _STILL
        quiet = quiet + 1 if still else 0
    mujoco.mj_kinematics(model, data)
    for k in moving:
        frame = data.body(str(k))
        matrix = frame.xmat.reshape(3, 3)
        yaw = float(np.arctan2(-matrix[0, 1], matrix[1, 1]))
        tilt = float(np.arccos(np.clip(matrix[2, 2], -1.0, 1.0)))
        motions[k] = Motion(frame.xpos.copy(), yaw, tilt)
    return motions, steps


def _mujoco() -> Any:
    try:
        import mujoco  # noqa: PLC0415 - optional
    except ModuleNotFoundError as error:
        hint = "settling furniture needs mujoco: pip install 'panoscene[synth]'"
        raise ModuleNotFoundError(hint, name="mujoco") from error
    # its own handler writes a log file into the user's folder
    engine: Any = mujoco
    engine.set_mju_user_warning(_say_nothing)
    return engine


def _say_nothing(message: str) -> None:
    """Pass over a warning of the engine: what went wrong is seen in where things end."""


def _add_room(mujoco: Any, spec: Any, polygon: Float64[np.ndarray, "corners 2"]) -> None:
    """Add the floor, for what can fall on it, and a box behind every wall."""
    world = spec.worldbody
    world.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[50, 50, 1], contype=2, conaffinity=2)
    for start, end in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        along = end - start
        length = float(np.hypot(*along))
        outwards = np.array([along[1], -along[0]]) / length
        middle = (start + end) / 2 + outwards * _WALL / 2
        angle = float(np.arctan2(along[1], along[0]))
        world.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, size=[length / 2, _WALL / 2, 2.5],
            pos=[*middle, 2.5], quat=_about_z(angle), contype=1, conaffinity=1,
        )  # fmt: skip


def _about_z(angle: float) -> list[float]:
    return [float(np.cos(angle / 2)), 0.0, 0.0, float(np.sin(angle / 2))]


def _add_body(mujoco: Any, spec: Any, body: Body, name: str) -> None:
    """Add a body with its boxes, joints and damping."""
    thing = spec.worldbody.add_body(name=name, pos=body.position.tolist(), quat=_about_z(body.yaw))
    kind = 3 if body.freedom in ("free", "upright") else 1
    skin = np.array([_SKIN, _SKIN, 0.0]) if body.freedom == "sliding" else np.zeros(3)
    half = np.maximum((body.boxes[:, 1] - body.boxes[:, 0]) / 2 - skin, 0.0008)
    middle = body.boxes.mean(axis=1)
    friction = [0.3, 0.005, 0.0001] if body.freedom == "sliding" else [0.8, 0.005, 0.0001]
    for centre, size in zip(middle.tolist(), half.tolist(), strict=True):
        thing.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX, size=size, pos=centre, contype=kind, conaffinity=kind,
            friction=friction, condim=3,
        )  # fmt: skip
    if body.freedom != "fixed":
        _let_move(mujoco, thing, body, middle, half)


def _let_move(
    mujoco: Any,
    thing: Any,
    body: Body,
    middle: Float64[np.ndarray, "boxes 3"],
    half: Float64[np.ndarray, "boxes 3"],
) -> None:
    """Give a body its mass and its joints."""
    volume = 8 * np.prod(half, axis=1)
    mass = float(np.clip(_DENSITY * volume.sum(), 0.3, 80.0))
    centre = (volume[:, None] * middle).sum(axis=0) / volume.sum()
    share = mass * volume / volume.sum()
    spread = (share[:, None] * ((middle - centre) ** 2 + half**2 / 3)).sum(axis=0)
    inertia = np.maximum(spread.sum() - spread, 1e-4 * mass)
    inertia = np.minimum(inertia, 0.999 * (inertia.sum() - inertia))  # what any body obeys
    thing.explicitinertial = True
    thing.mass, thing.ipos, thing.inertia = mass, centre.tolist(), inertia.tolist()
    thing.iquat = [1.0, 0.0, 0.0, 0.0]
    calm, grip = (20.0, 0.3 * 9.81) if body.freedom == "sliding" else (6.0, 0.0)
    axes = np.eye(3)[: 2 if body.freedom == "sliding" else 3]
    slide, hinge, ball = (
        mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_BALL,
    )  # fmt: skip
    for axis in axes:
        thing.add_joint(
            type=slide, axis=axis.tolist(), damping=[calm * mass, 0, 0], frictionloss=grip * mass
        )
    turn = float(inertia[2])
    radius = float(np.sqrt(turn / mass))
    if body.freedom == "free":
        thing.add_joint(type=ball, damping=[3.0 * float(inertia.max()), 0, 0])
    else:
        thing.add_joint(
            type=hinge, axis=[0, 0, 1], damping=[calm * turn, 0, 0],
            frictionloss=grip * mass * radius,
        )  # fmt: skip
