"""Closed surfaces around models that are made of open sheets."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int64
from scipy import ndimage

from ._records import CadModel

RESOLUTION = 128
"""Voxels along the longest side."""
_SHELL = 1.0
"""Openings narrower than twice this many voxels are closed."""
_COAT = 0.75
"""Voxels by which sheets that bound nothing are thickened on both sides."""
_MARGIN = 4
_MIN_THICKNESS = 0.02
_BODY = 0.7
"""What is deeper than this somewhere, in voxels, is a body: its surface is where its sheets are."""
_SKIN = 0.05
_LEAST = 1e-3
"""Nodes are at least this far from the surface, or marching cubes leaves cracks."""
_FAR = 2.0
"""Distances are known up to so many voxels."""
_SPACING = 0.5
"""Voxels between points on sheets, at most."""
_MAX_POINTS = 3_000_000


@dataclass(frozen=True, slots=True)
class ClosedSurface:
    """A watertight mesh and the field it is the zero level of.

    The frame is the object frame over ``scale``: the longest side of the model is 1 and the centre
    of its box is the origin.
    """

    vertices: Float64[np.ndarray, "vertices 3"]
    faces: Int64[np.ndarray, "faces 3"]
    field: Float32[np.ndarray, "nx ny nz"]
    """Distance in nodes, negative inside; right within one node of the surface."""
    origin: Float64[np.ndarray, "3"]
    """Of the first node of the field."""
    step: Float64[np.ndarray, "3"]
    """Between the nodes of the field, per axis."""
    scale: float
    """Metres per unit."""

    def depth(self, points: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, " n"]:
        """Return about the signed distance of points within a voxel of the surface.

        Further away only the sign means something: negative inside.
        """
        index = ((points - self.origin) / self.step).T
        nodes = ndimage.map_coordinates(self.field, index, order=1, cval=_FAR)
        return nodes.astype(np.float64) * float(self.step.mean())

    def inside(self, points: Float64[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
        """Return which points are inside."""
        return self.depth(points) < 0


def close_surface(model: CadModel, resolution: int = RESOLUTION) -> ClosedSurface:
    """Return a watertight surface of a model, whatever holes and loose sheets it has.

    The distance to the sheets is computed on a grid; what cannot be reached from outside without
    coming within a voxel of a sheet is inside. The surface of what is inside is where its sheets
    are; sheets that bound nothing become 1.5 voxels thick. Marching cubes (Lorensen and
    Cline 1987) draws the border. Bodies open only below, where they stand, or only behind, where
    they hang, count as closed. The result is fitted to the model's box again. Axes of less than
    2 cm are stretched to 2 cm first.

    Args:
        model: To close.
        resolution: Voxels along the longest side.
    """
    from skimage.measure import marching_cubes  # noqa: PLC0415 (it takes a second)

    extent = np.ptp(model.vertices, axis=0).astype(np.float64)
    scale = float(extent.max())
    thick = np.maximum(extent, _MIN_THICKNESS) / scale
    stretch = np.where(extent > 1e-6, thick / np.maximum(extent / scale, 1e-9), 1.0)
    corners = model.vertices[model.faces].astype(np.float64) / scale * stretch
    voxel = 1.0 / resolution
    counts = np.ceil(thick * resolution).astype(int) + 2 * _MARGIN + 1
    low = -(counts - 1) / 2 * voxel
    corners = (corners - low) / voxel
    points, face, far = _sheet_points(corners, _SPACING)
    near = _splat(points, tuple(counts.tolist()))
    shell = near < _SHELL
    reached = _reached(shell, None)
    floor = int(np.ceil((-thick[2] / 2 - low[2]) / voxel))
    reached &= _reached(shell, (2, floor))
    if model.placement == "wall":
        reached &= _reached(shell, (1, int(np.ceil((-thick[1] / 2 - low[1]) / voxel))))
    field = _taut(near, np.where(reached | shell, near - _SHELL, -_FAR).astype(np.float32))
    field = _with_loose_sheets(field, corners, points[far], face[far])
    vertices, faces, _, _ = marching_cubes(field, 0.0, gradient_direction="descent")
    outer = np.ptp(vertices, axis=0)
    fit = thick / (outer * voxel)
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    step = fit * voxel
    return ClosedSurface(
        vertices=(vertices - middle).astype(np.float64) * step,
        faces=faces.astype(np.int64),
        field=field,
        origin=(-middle * step).astype(np.float64),
        step=step.astype(np.float64),
        scale=scale,
    )


def _reached(
    shell: Bool[np.ndarray, "nx ny nz"], sealed: tuple[int, int] | None
) -> Bool[np.ndarray, "nx ny nz"]:
    """Return the nodes that are open to the outside; ``sealed`` is (axis, first free layer)."""
    free = ~shell
    axis, layer = sealed if sealed is not None else (0, 0)
    closed = [slice(None)] * 3
    closed[axis] = slice(0, layer)
    free[tuple(closed)] = False
    label = np.zeros(shell.shape, np.int32)
    ndimage.label(free, output=label)
    reached = label == label[-1, -1, -1]
    reached[tuple(closed)] = ~shell[tuple(closed)]
    return reached


def _taut(
    near: Float32[np.ndarray, "nx ny nz"], wide: Float32[np.ndarray, "nx ny nz"]
) -> Float32[np.ndarray, "nx ny nz"]:
    """Return a field in voxels whose bodies end at their sheets; other sheets get a thin coat.

    Args:
        near: Distance to the sheets in voxels.
        wide: Field in voxels that is negative in bodies and in a thick coat around all sheets.
    """
    from skimage.measure import marching_cubes  # noqa: PLC0415 (it takes a second)

    outer = marching_cubes(wide, 0.0, gradient_direction="descent")[0]
    away = _splat(outer.astype(np.float64), wide.shape)
    exact = _SHELL + np.where(wide < 0, -away, away)
    body = np.asarray(ndimage.maximum_filter(exact < -_BODY, 3), bool) & (exact < -_SKIN)
    close = ndimage.maximum_filter(body, 3)
    return np.where(close, exact, near - _COAT).astype(np.float32)


def _with_loose_sheets(
    field: Float32[np.ndarray, "nx ny nz"],
    corners: Float64[np.ndarray, "faces 3 3"],
    points: Float64[np.ndarray, "n 3"],
    face: Int64[np.ndarray, " n"],
) -> Float32[np.ndarray, "nx ny nz"]:
    """Return a field that is negative on all sheets: those without a body behind get a coat.

    Args:
        field: In voxels.
        corners: Of the triangles, in voxels.
        points: On the triangles, not at their edges: edges of bodies have no body behind.
        face: On which triangle each point lies.
    """
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal *= _COAT / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    places, step = (
        np.concatenate([points, corners.mean(axis=1)]),
        np.concatenate([normal[face], normal]),
    )
    loose = np.ones(len(places), bool)
    for side in (places + step, places - step):
        loose &= ndimage.map_coordinates(field, side.T, order=1) > 0
    field = np.minimum(field, _splat(places[loose], field.shape) - np.float32(_COAT))
    return np.where(np.abs(field) < _LEAST, -np.float32(_LEAST), field)


def _splat(
    points: Float64[np.ndarray, "n 3"], shape: tuple[int, ...]
) -> Float32[np.ndarray, "nx ny nz"]:
    """Return the distance of every node to the nearest point; 2 where it is more.

    Args:
        points: In voxels from the first node, at least a voxel from the border and two from the
            last node.
        shape: Of the grid.
    """
    cell = np.floor(points).astype(np.int64)
    rest = (points - cell).astype(np.float32)
    node = np.ravel_multi_index(tuple(cell.T), shape)
    squared = np.full(int(np.prod(shape)), _FAR * _FAR, np.float32)
    steps = (-1, 0, 1, 2)
    dx, dy, dz = ([(rest[:, axis] - step) ** 2 for step in steps] for axis in range(3))
    for i, x in enumerate(steps):
        for j, y in enumerate(steps):
            flat, beside = node + (x * shape[1] + y) * shape[2], dx[i] + dy[j]
            for k, z in enumerate(steps):
                np.minimum.at(squared, flat + z, beside + dz[k])
    return np.sqrt(squared).reshape(shape)


def _sheet_points(
    corners: Float64[np.ndarray, "faces 3 3"], spacing: float
) -> tuple[
    Float64[np.ndarray, "points 3"], Int64[np.ndarray, " points"], Bool[np.ndarray, " points"]
]:
    """Return points on triangles, in rows along their longest sides, and whose they are.

    The last tells which are further than a voxel from the edges of wide triangles.

    Args:
        corners: Of the triangles.
        spacing: Of the rows and in them, at most; larger when there would be too many points.
    """
    face = np.arange(len(corners))
    sides = np.roll(corners, -1, axis=1) - corners
    first = np.linalg.norm(sides, axis=2).argmax(axis=1)
    start, along = corners[face, first], sides[face, first]
    lift = corners[face, (first + 2) % 3] - start
    length = np.maximum(np.linalg.norm(along, axis=1), 1e-12)
    twice = np.linalg.norm(np.cross(along, lift), axis=1)
    height = twice / length
    while ((height / spacing + 2) * (length / spacing / 2 + 2)).sum() > _MAX_POINTS:
        spacing *= 1.15
    of_row, up = _numbered(np.ceil(height / spacing).astype(np.int64) + 1)
    row, right = _numbered(np.ceil(length[of_row] * (1 - up) / spacing).astype(np.int64) + 1)
    chosen, up = of_row[row], up[row]
    right = right * (1 - up)
    found = start[chosen] + up[:, None] * lift[chosen] + right[:, None] * along[chosen]
    share = np.stack([up, right, 1 - up - right], axis=1)
    third = np.linalg.norm(sides, axis=2)[face[:, None], (first[:, None] + [0, 2, 1]) % 3]
    inner = (share * (twice[:, None] / np.maximum(third, 1e-12))[chosen]).min(axis=1)
    radius = twice / np.maximum(third.sum(axis=1), 1e-12)
    return found, chosen, inner > np.minimum(1.0, 0.9 * radius)[chosen]


def _numbered(
    counts: Int64[np.ndarray, " rows"],
) -> tuple[Int64[np.ndarray, " all"], Float64[np.ndarray, " all"]]:
    """Return which row each of so many points belongs to, and its share of the way along it."""
    row = np.repeat(np.arange(len(counts)), counts)
    number = np.arange(len(row)) - (np.cumsum(counts) - counts)[row]
    return row, number / np.maximum(counts - 1, 1)[row]
