"""Turns a furnished home into the scene that is rendered."""

from collections.abc import Sequence

import numpy as np
import shapely
from jaxtyping import Float64

from panoscene.synth.assets import CadModel, LightSource, Material
from panoscene.synth.homes._records import Home, Placed
from panoscene.synth.render._openings import wall_depth, wall_frame
from panoscene.synth.render._records import PlacedModel, RenderScene, RoomFinish
from panoscene.synth.render._shell import build_shell
from panoscene.synth.render._triangles import unit_ball


def scene_from_home(
    home: Home,
    drawn: Sequence[CadModel],
    finishes: Sequence[RoomFinish],
    *,
    poses: Float64[np.ndarray, "placed 4 4"] | None = None,
) -> RenderScene:
    """Return a home as it is drawn.

    Instance ids: ``home.placed[k]`` has k + 1, and the parts of the rooms follow. The glass of a
    window has the id of the placed window that is in its opening. A room without any lamp gets a
    plain pendant; their ids come last.

    Args:
        home: rooms, openings and what is placed where.
        drawn: the model of each placed piece, recoloured.
        finishes: what each room is covered with.
        poses: world_from_object of each piece, with its size jitter, where settling has moved
            them; by default from ``home.placed``.

    Raises:
        ValueError: if a sequence has a wrong length.
    """
    if len(drawn) != len(home.placed):
        raise ValueError(
            f"drawn must be one model for each of the {len(home.placed)} placed pieces, "
            f"found {len(drawn)}"
        )
    if poses is not None and len(poses) != len(home.placed):
        raise ValueError(f"poses must be {len(home.placed)} matrices, found {len(poses)}")
    models = [
        PlacedModel(model, world_from_placed(p) if poses is None else poses[k], k + 1, p.room)
        for k, (model, p) in enumerate(zip(drawn, home.placed, strict=True))
    ]
    fitted = {}
    for index in range(len(home.openings)):
        fit = _in_opening(home, index, models)
        if fit is not None:
            fitted[index] = fit
    shell = build_shell(home, finishes, len(home.placed) + 1, fitted)
    number = shell.next_instance
    lit = {m.room for m in models if m.model.lights}
    for room in sorted(set(range(len(home.rooms))) - lit):
        models.append(_pendant(home, room, number))
        number += 1
    return RenderScene(
        tuple(shell.parts),
        tuple(models),
        tuple(shell.panes),
        tuple(np.asarray(room.polygon, dtype=np.float64) for room in home.rooms),
        tuple(room.ceiling_height for room in home.rooms),
        tuple(shell.links),
    )


def world_from_placed(placed: Placed) -> Float64[np.ndarray, "4 4"]:
    """Return the matrix that turns, scales and moves a placed model.

    Examples:
        >>> sofa = Placed("sofa", 0, (1.0, 2.0, 0.4), np.pi / 2, (2.0, 1.0, 1.0))
        >>> (world_from_placed(sofa) @ (0.5, 0.0, 0.0, 1.0)).round(6).tolist()
        [1.0, 3.0, 0.4, 1.0]
    """
    cos, sin = np.cos(placed.yaw), np.sin(placed.yaw)
    matrix = np.eye(4)
    matrix[:2, :2] = [[cos, -sin], [sin, cos]]
    matrix[:3, :3] *= np.array(placed.scale)
    matrix[:3, 3] = placed.position
    return matrix


def _in_opening(home: Home, index: int, models: list[PlacedModel]) -> tuple[int, float] | None:
    """Return the instance of the door or window in an opening, and how far out its glass is.

    The distance is from the inner face of the wall; the middle of the model if it has no glass.
    """
    o = home.openings[index]
    frame = wall_frame(home.rooms[o.room].polygon, o.wall)
    centre = frame.place(o.start + o.width / 2, 0.0, (o.bottom + o.top) / 2)
    best = None
    for k, placed in enumerate(home.placed):
        apart = float(np.linalg.norm(models[k].world_from_object[:2, 3] - centre[:2]))
        if o.model and placed.model == o.model and apart < (best[1] if best else 1.2):
            best = (k, apart)
    if best is None:
        return None
    placed = models[best[0]]
    kinds = np.array([m.kind == "glass" for m in placed.model.materials])
    glass = placed.model.faces[kinds[placed.model.face_material]].reshape(-1)
    points = placed.model.vertices[glass] if len(glass) else np.zeros((1, 3), np.float32)
    world = points @ placed.world_from_object[:3, :3].T + placed.world_from_object[:3, 3]
    out = float(np.median((world[:, :2] - frame.origin) @ frame.outward))
    return placed.instance, float(np.clip(out, 0.01, wall_depth(home, index) - 0.01))


def _pendant(home: Home, room: int, instance: int) -> PlacedModel:
    """Return a white globe under the middle of a room's ceiling."""
    ball, faces = unit_ball(12, 20)
    radius, drop = 0.12, 0.4
    globe = (ball * radius).astype(np.float32)
    cord = np.array([[x, y, z] for z in (radius, drop) for x, y in _CORD], np.float32)
    sides = [[k, (k + 1) % 3, 3 + (k + 1) % 3] for k in range(3)]
    sides += [[k, 3 + (k + 1) % 3, 3 + k] for k in range(3)]
    vertices = np.concatenate([globe, cord])
    outward = np.concatenate([ball, np.repeat([[1.0, 0, 0]], 6, axis=0)]).astype(np.float32)
    materials = (
        Material("globe", (0.95, 0.95, 0.92), kind="light", emission=1.0),
        Material("cord", (0.9, 0.9, 0.9)),
    )
    model = CadModel(
        "parametric/pendant",
        "parametric/pendant",
        "",
        vertices,
        outward,
        np.zeros((len(vertices), 2), np.float32),
        np.concatenate([faces, np.array(sides) + len(globe)]).astype(np.int32),
        np.array([0] * len(faces) + [1] * len(sides), np.int16),
        materials,
        (2 * radius, 2 * radius, drop + radius),
        "ceiling",
        lights=(LightSource((0.0, 0.0, 0.0), 0.1),),
        has_front=False,
    )
    matrix = np.eye(4)
    matrix[:2, 3] = _middle(home.rooms[room].polygon)
    matrix[2, 3] = home.rooms[room].ceiling_height - drop
    return PlacedModel(model, matrix, instance, room)


_CORD = ((0.006, 0.0), (-0.003, 0.005), (-0.003, -0.005))


def _middle(polygon: Float64[np.ndarray, "corners 2"]) -> tuple[float, float]:
    """Return the point that is farthest from all walls, on a 10 cm grid."""
    shape = shapely.Polygon(polygon)
    low, high = polygon.min(axis=0), polygon.max(axis=0)
    x, y = (
        a.reshape(-1)
        for a in np.meshgrid(np.arange(low[0], high[0], 0.1), np.arange(low[1], high[1], 0.1))
    )
    points = shapely.points(x, y)
    apart = np.where(shapely.contains(shape, points), shapely.distance(shape.exterior, points), -1)
    best = int(apart.argmax())
    return float(x[best]), float(y[best])
