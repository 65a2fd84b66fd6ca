"""What can be seen in a home, by instance id: labelled objects with their meshes, and the rest."""

import math
from dataclasses import dataclass

import numpy as np
import shapely
from jaxtyping import Float64, Int32

from panoscene.synth.render import Camera, PlacedModel, RenderScene, ShellPart, WindowPane

_THINNEST = 1e-3
"""Metres; boxes of flat things are not thinner."""
_GLASS = 0.02
"""Metres of depth of a window of which only the pane is known."""


@dataclass(frozen=True, slots=True)
class Thing:
    """A labelled object as it stands in a home."""

    instance: int
    category: str
    model: str
    base: str
    licence: str
    creator: str
    source: str
    room: int
    home_from_object: Float64[np.ndarray, "4 4"]
    vertices: Float64[np.ndarray, "vertices 3"]
    """In the home's frame."""
    faces: Int32[np.ndarray, "faces 3"]


@dataclass(frozen=True, slots=True)
class Box:
    """An upright box in the world frame."""

    centre: tuple[float, float, float]
    size: tuple[float, float, float]
    yaw: float


def home_from_world(camera: Camera) -> Float64[np.ndarray, "4 4"]:
    """Return the transform from a panorama's world frame to the plan of its home.

    Examples:
        >>> there = home_from_world(Camera((3.0, 2.0, 1.6), yaw=np.pi / 2)) @ (0.0, 1.0, 0.0, 1.0)
        >>> there.round(6).tolist()
        [2.0, 2.0, 0.0, 1.0]
    """
    cos, sin = math.cos(camera.yaw), math.sin(camera.yaw)
    matrix = np.eye(4)
    matrix[:2, :2] = [[cos, -sin], [sin, cos]]
    matrix[:2, 3] = camera.position[:2]
    return matrix


def things_of(scene: RenderScene, wanted: set[int]) -> list[Thing]:
    """Return the labelled objects whose instance ids are wanted, by rising id.

    Models without a category are decoration and left out. A door that the building made itself
    counts as a door, and a pane as a window; parts that share the id of a model belong to it.
    """
    shell = _shell_by_instance(scene)
    panes = {pane.instance: pane for pane in scene.panes}
    things = []
    placed = {model.instance: model for model in scene.placed}
    for instance in sorted(wanted):
        parts = shell.get(instance, [])
        if instance in placed:
            if placed[instance].model.category:
                things.append(_from_model(placed[instance], parts, panes.get(instance)))
        elif instance in panes:
            things.append(_from_pane(panes[instance], parts))
        elif parts and parts[0].kind == "door":
            things.append(_from_door(parts, scene))
    return things


def tight_box(
    vertices: Float64[np.ndarray, "vertices 3"], world_from_object: Float64[np.ndarray, "4 4"]
) -> Box:
    """Return the smallest upright box around world-frame vertices with the object's own yaw.

    The yaw is that of the object's front; of a piece that lies on its back, that of its right.
    """
    front, right = world_from_object[:3, 1], world_from_object[:3, 0]
    if np.hypot(*front[:2]) > 0.5 * np.linalg.norm(front):
        yaw = math.atan2(-front[0], front[1])
    else:
        yaw = math.atan2(right[1], right[0])
    cos, sin = math.cos(yaw), math.sin(yaw)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    local = vertices @ turn
    low, high = local.min(axis=0), local.max(axis=0)
    centre = turn @ ((low + high) / 2)
    size = np.maximum(high - low, _THINNEST)
    yaw = (yaw + math.pi) % (2 * math.pi) - math.pi
    return Box(tuple(centre.tolist()), tuple(size.tolist()), yaw)


def moved(
    matrix: Float64[np.ndarray, "4 4"], points: Float64[np.ndarray, "n 3"]
) -> Float64[np.ndarray, "n 3"]:
    """Return points after a transform."""
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def _shell_by_instance(scene: RenderScene) -> dict[int, list[ShellPart]]:
    found: dict[int, list[ShellPart]] = {}
    for part in scene.parts:
        found.setdefault(part.instance, []).append(part)
    return found


def _from_model(placed: PlacedModel, parts: list[ShellPart], pane: WindowPane | None) -> Thing:
    model = placed.model
    matrix = np.asarray(placed.world_from_object, dtype=np.float64)
    meshes = [(moved(matrix, model.vertices.astype(np.float64)), model.faces)]
    meshes += [(part.vertices, part.faces) for part in parts]
    if pane is not None:
        meshes.append(_pane_mesh(pane))
    return Thing(
        placed.instance, model.category, model.id, model.base, model.licence, model.creator,
        model.source, placed.room, matrix, *_joined(meshes),
    )  # fmt: skip


def _from_pane(pane: WindowPane, parts: list[ShellPart]) -> Thing:
    vertices, faces = _joined([_pane_mesh(pane), *((p.vertices, p.faces) for p in parts)])
    # its right is to the left of somebody who faces it
    right = np.cross(pane.normal, (0.0, 0.0, 1.0))
    matrix = np.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 3] = right, pane.normal, pane.centre
    if not parts:
        thick = np.array(pane.normal) * (_GLASS / 2)
        vertices = np.concatenate([vertices, vertices + thick, vertices - thick])
    name = f"shell/window/{pane.instance}"
    return Thing(
        pane.instance, "window", name, "shell/window", "", "", "", pane.room, matrix, vertices,
        faces,
    )  # fmt: skip


def _from_door(parts: list[ShellPart], scene: RenderScene) -> Thing:
    """Return a door; its front is the side of its leaf that the room is on."""
    vertices, faces = _joined([(part.vertices, part.faces) for part in parts])
    corners = shapely.get_coordinates(
        shapely.minimum_rotated_rectangle(shapely.MultiPoint(vertices[:, :2]))
    )[:4]
    sides = np.roll(corners, -1, axis=0) - corners
    along = sides[np.linalg.norm(sides, axis=1).argmax()]
    along = along / np.linalg.norm(along)
    middle = corners.mean(axis=0)
    front = np.array([-along[1], along[0]])
    room = shapely.get_coordinates(shapely.Polygon(scene.polygons[parts[0].room]).centroid)[0]
    if front @ (room - middle) < 0:
        front, along = -front, -along
    matrix = np.eye(4)
    matrix[:2, 0], matrix[:2, 1], matrix[:2, 3] = along, front, middle
    matrix[2, 3] = (vertices[:, 2].min() + vertices[:, 2].max()) / 2
    name = f"shell/door/{parts[0].instance}"
    return Thing(
        parts[0].instance, "door", name, "shell/door", "", "", "", parts[0].room, matrix, vertices,
        faces,
    )  # fmt: skip


def _pane_mesh(
    pane: WindowPane,
) -> tuple[Float64[np.ndarray, "4 3"], Int32[np.ndarray, "2 3"]]:
    centre, u, v = (np.array(side) for side in (pane.centre, pane.half_u, pane.half_v))
    corners = np.stack([centre - u - v, centre + u - v, centre + u + v, centre - u + v])
    return corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def _joined(
    meshes: list[tuple[np.ndarray, np.ndarray]],
) -> tuple[Float64[np.ndarray, "vertices 3"], Int32[np.ndarray, "faces 3"]]:
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
    faces = [faces + start for (_, faces), start in zip(meshes, starts, strict=False)]
    vertices = np.concatenate([vertices for vertices, _ in meshes]).astype(np.float64)
    return vertices, np.concatenate(faces).astype(np.int32)
