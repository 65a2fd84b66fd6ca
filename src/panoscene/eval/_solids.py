"""Objects as closed triangle meshes, and what two of them have in common."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import trimesh
from jaxtyping import Bool, Float, Int64
from scipy.spatial import QhullError

from panoscene.geometry import OrientedBoxes
from panoscene.scene import Mesh, Objects, box_mesh, place_vertices

SolidKind = Literal["mesh", "hull", "box"]


@dataclass(frozen=True, slots=True)
class Solid:
    """A closed triangle mesh in the world frame, faces pointing out."""

    triangles: Float[np.ndarray, "faces 3 3"]
    """Corners of each face in metres."""
    kind: SolidKind
    """What it is made of: the object's own mesh; its convex hull, where the mesh is not closed;
    the box, where there is no mesh, or a flat one."""


def object_solid(objects: Objects, index: int) -> Solid:
    """Return one object as a closed mesh in the world frame.

    A mesh is used as it is when it is closed (``is_closed``); its parts may be several and may
    overlap. Otherwise inside and outside are not defined, and the convex hull takes its place; a
    mesh without volume has no hull either and becomes the box.
    """
    boxes = objects.boxes[index]
    box = OrientedBoxes(
        boxes.centre.detach().cpu().double(),
        boxes.size.detach().cpu().double(),
        boxes.yaw.detach().cpu().double(),
    )
    mesh = objects.shapes.mesh[index] if objects.shapes.mesh else None
    if mesh is None or len(mesh.faces) == 0:
        return _box_solid(box)
    placed = Mesh(place_vertices(mesh.vertices.detach().cpu(), box), mesh.faces)
    own = mesh_solid(placed)
    if own is not None:
        return own
    try:
        hull = trimesh.convex.convex_hull(placed.vertices.numpy())
    except QhullError:
        return _box_solid(box)
    triangles = np.asarray(hull.triangles, dtype=np.float64)
    return Solid(triangles, "hull") if hull.volume > _SMALLEST_VOLUME else _box_solid(box)


def mesh_solid(mesh: Mesh) -> Solid | None:
    """Return what a mesh encloses; None when it is not closed (``is_closed``) or has no volume."""
    vertices = mesh.vertices.detach().cpu().double().numpy()
    if len(mesh.faces) == 0 or not np.isfinite(vertices).all() or not is_closed(mesh):
        return None
    triangles = vertices[mesh.faces.cpu().numpy()]
    volume = _volume(triangles)
    if abs(volume) <= _SMALLEST_VOLUME:
        return None
    return Solid(triangles if volume > 0 else triangles[:, ::-1], "mesh")


def is_closed(mesh: Mesh) -> bool:
    """Return whether the faces of a mesh enclose space: it has an inside and an outside.

    Every edge must be walked as often in one direction as in the other. This is less than what is
    asked of a manifold: several parts may touch in an edge. Vertices in the same place are one.
    """
    places = mesh.vertices.detach().cpu().double().numpy().round(6)
    _, same = np.unique(places, axis=0, return_inverse=True)
    corner = same.reshape(-1)[mesh.faces.cpu().numpy()]
    start, end = corner.reshape(-1), np.roll(corner, -1, axis=1).reshape(-1)
    edge = np.minimum(start, end) * len(places) + np.maximum(start, end)
    _, index = np.unique(edge, return_inverse=True)
    return not np.bincount(index.reshape(-1), np.sign(end - start)).any()


@dataclass(frozen=True, slots=True)
class CommonSpace:
    """The part of space that two solids share, as sampled by vertical lines."""

    volume: float
    """Cubic metres."""
    points: Float[np.ndarray, "points 3"]
    """The middle of every stretch of a line that is inside both."""


def common_space(
    first: Solid, other: Solid, corners: Float[np.ndarray, "4 2"], *, resolution: int
) -> CommonSpace:
    """Return the space that two solids share above a rectangle of the floor.

    Vertical lines on a regular grid are cut with all faces: exact along each line, sampled across.
    A point is inside a solid when the faces below it, counted with the sign of their direction,
    leave a positive winding number; so parts of one object may overlap. Lines on which a solid
    does not close (they graze an edge) are left out.

    Args:
        first: one solid.
        other: the other.
        corners: the rectangle, counter-clockwise, in metres; it must cover the common space.
        resolution: lines along each of its sides.
    """
    origin, right, front = corners[0], corners[1] - corners[0], corners[3] - corners[0]
    area = float(np.linalg.norm(right) * np.linalg.norm(front))
    nothing = CommonSpace(0.0, np.zeros((0, 3)))
    if area == 0.0:
        return nothing
    grid_from_plan = np.linalg.inv(np.stack([right, front], axis=1)) * resolution
    cuts = []
    for number, solid in enumerate((first, other)):
        plan = (solid.triangles[..., :2] - origin) @ grid_from_plan.T
        line, height, sign = _cuts(plan, solid.triangles[..., 2], resolution)
        cuts.append((line, height, np.full(len(line), number), sign))
    line, height, owner, sign = (np.concatenate(part) for part in zip(*cuts, strict=True))
    if len(line) == 0:
        return nothing
    order = np.lexsort((height, line))
    line, height, owner, sign = line[order], height[order], owner[order], sign[order]
    winding = np.stack([np.where(owner == number, sign, 0) for number in (0, 1)])
    # each line should come to zero, so sums of the whole list are those of its line
    closed = np.zeros(resolution**2, dtype=bool)
    open_by = np.stack([np.bincount(line, row, resolution**2) for row in winding])
    closed[:] = (open_by == 0).all(axis=0)
    kept = closed[line]
    line, height, winding = line[kept], height[kept], winding[:, kept].cumsum(axis=1)
    inside = (winding[:, :-1] > 0).all(axis=0) & (line[1:] == line[:-1]) if len(line) else kept[:0]
    low, high, line = height[:-1][inside], height[1:][inside], line[:-1][inside]
    if len(line) == 0:
        return nothing
    place = _line_places(line, resolution) / resolution
    plan = origin + place[:, :1] * right + place[:, 1:] * front
    volume = float((high - low).sum()) * area / int(closed.sum())
    solid_points = high - low > 0
    points = np.column_stack([plan, (low + high) / 2])[solid_points]
    return CommonSpace(volume, points)


_SMALLEST_VOLUME = 1e-9
"""Cubic metres (a millimetre cubed) below which a mesh is flat."""
_OFFSET = (0.5 + 0.0217, 0.5 - 0.0133)
"""Where in its cell a line stands: a little off the middle, where diagonals of faces run."""


def _cuts(
    plan: Float[np.ndarray, "faces 3 2"],
    height: Float[np.ndarray, "faces 3"],
    resolution: int,
) -> tuple[Int64[np.ndarray, " cuts"], Float[np.ndarray, " cuts"], Int64[np.ndarray, " cuts"]]:
    """Return line, height and sign (+1 into the solid, upwards) of all cuts with the faces."""
    # corner by corner: numpy is slow where it goes along an axis of three
    a, b, c = plan[:, 0], plan[:, 1], plan[:, 2]
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    first = np.ceil(low - _OFFSET).clip(0, resolution).astype(np.int64)
    last = np.floor(high - _OFFSET).clip(-1, resolution - 1).astype(np.int64)
    twice_area = _cross(b - a, c - a)
    spans = (last - first + 1).clip(min=0) * (twice_area != 0)[:, None]
    counts = spans[:, 0] * spans[:, 1]
    face = np.repeat(np.arange(len(plan)), counts)
    rank = np.arange(len(face)) - np.repeat(counts.cumsum() - counts, counts)
    rows = spans[face, 1]
    cell = first[face] + np.stack([rank // rows.clip(min=1), rank % rows.clip(min=1)], axis=1)
    point = cell + np.array(_OFFSET)
    inside, weight = _barycentric(point, a[face], b[face], c[face], twice_area[face])
    face, cell = face[inside], cell[inside]
    level = (height[face] * weight[inside]).sum(axis=1)
    # seen from above, a face that points down runs clockwise: there the line enters
    sign = np.where(twice_area[face] < 0, 1, -1)
    return cell[:, 0] * resolution + cell[:, 1], level, sign


def _barycentric(
    point: Float[np.ndarray, "cuts 2"],
    a: Float[np.ndarray, "cuts 2"],
    b: Float[np.ndarray, "cuts 2"],
    c: Float[np.ndarray, "cuts 2"],
    twice_area: Float[np.ndarray, " cuts"],
) -> tuple[Bool[np.ndarray, " cuts"], Float[np.ndarray, "cuts 3"]]:
    """Return whether points are in triangles of the plane, and their barycentric coordinates."""
    parts = np.stack([_cross(b - point, c - point), _cross(c - point, a - point)], axis=1)
    weight = parts / np.where(twice_area == 0, 1.0, twice_area)[:, None]
    weight = np.column_stack([weight, 1 - weight.sum(axis=1)])
    return (weight[:, 0] >= 0) & (weight[:, 1] >= 0) & (weight[:, 2] >= 0), weight


def _line_places(line: Int64[np.ndarray, " n"], resolution: int) -> Float[np.ndarray, "n 2"]:
    return np.stack([line // resolution, line % resolution], axis=1) + np.array(_OFFSET)


def _cross(a: Float[np.ndarray, "n 2"], b: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, " n"]:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _volume(triangles: Float[np.ndarray, "faces 3 3"]) -> float:
    """Return the volume that the faces enclose, in cubic metres; negative when they point in."""
    local = triangles - triangles[0, 0]
    return float((np.cross(local[:, 0], local[:, 1]) * local[:, 2]).sum() / 6)


def _box_solid(box: OrientedBoxes) -> Solid:
    mesh = box_mesh()
    vertices = place_vertices(mesh.vertices, box).numpy()
    return Solid(vertices[mesh.faces.numpy()], "box")
