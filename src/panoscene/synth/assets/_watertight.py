"""Closed surfaces around models that are made of open sheets."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int64
from scipy import ndimage
from scipy.spatial import KDTree

from ._records import CadModel

RESOLUTION = 160
"""Voxels along the longest side."""
_SHELL = 0.75
"""The surface is laid this many voxels around the model's sheets."""
_MARGIN = 4
_MIN_THICKNESS = 0.02
_MAX_POINTS = 1_500_000


@dataclass(frozen=True, slots=True)
class ClosedSurface:
    """A watertight mesh and the field it is the zero level of.

    The frame is the object frame over ``scale``: the longest side of the model is 1 and the centre
    of its box is the origin.
    """

    vertices: Float64[np.ndarray, "vertices 3"]
    faces: Int64[np.ndarray, "faces 3"]
    field: Float32[np.ndarray, "nx ny nz"]
    """Negative inside; only its sign and zero level mean something."""
    origin: Float64[np.ndarray, "3"]
    """Of the first node of the field."""
    step: Float64[np.ndarray, "3"]
    """Between the nodes of the field, per axis."""
    scale: float
    """Metres per unit."""

    def inside(self, points: Float64[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
        """Return which points are inside."""
        index = ((points - self.origin) / self.step).T
        return ndimage.map_coordinates(self.field, index, order=1, cval=1.0) < 0


def close_surface(model: CadModel, resolution: int = RESOLUTION) -> ClosedSurface:
    """Return a watertight surface of a model, whatever holes and loose sheets it has.

    The distance to the sheets is computed on a grid; what cannot be reached from outside without
    coming within 3/4 of a voxel of a sheet is inside, and marching cubes (Lorensen and Cline
    1987) draws the border. Bodies open only below, where they stand, or only behind, where they
    hang, count as closed. The result is fitted to the model's box again, so only thin sheets
    become thicker. Axes of less than 2 cm are stretched to 2 cm first.

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
    near = _sheet_distance(corners, low, voxel, counts)
    shell = near < _SHELL * voxel
    reached = _reached(shell, None)
    floor = int(np.ceil((-thick[2] / 2 - low[2]) / voxel))
    reached &= _reached(shell, (2, floor))
    if model.placement == "wall":
        reached &= _reached(shell, (1, int(np.ceil((-thick[1] / 2 - low[1]) / voxel))))
    field = np.where(reached | shell, near - _SHELL * voxel, -voxel).astype(np.float32)
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


def _sheet_distance(
    corners: Float64[np.ndarray, "faces 3 3"],
    low: Float64[np.ndarray, "3"],
    voxel: float,
    counts: Int64[np.ndarray, "3"],
) -> Float64[np.ndarray, "nx ny nz"]:
    """Return the distance of every node to the triangles; far from them a larger number."""
    points = sheet_points(corners, 0.45 * voxel)
    cells = np.clip(np.round((points - low) / voxel).astype(np.int64), 0, counts - 1)
    occupied = np.zeros(counts, bool)
    occupied[tuple(cells.T)] = True
    band = ndimage.binary_dilation(occupied, np.ones((3, 3, 3), bool), iterations=2)
    distance = np.full(tuple(counts), 3.0 * voxel)
    nodes = np.argwhere(band)
    tree = KDTree(points, balanced_tree=False, compact_nodes=False)
    found = tree.query(nodes * voxel + low, distance_upper_bound=3.0 * voxel)[0]
    distance[tuple(nodes.T)] = np.minimum(np.asarray(found), 3.0 * voxel)
    return distance


def sheet_points(
    corners: Float64[np.ndarray, "faces 3 3"], spacing: float
) -> Float64[np.ndarray, "points 3"]:
    """Return points on triangles, on a regular pattern no wider than about ``spacing``.

    Args:
        corners: Of the triangles.
        spacing: Wanted distance of neighbours; larger when there would be too many points.
    """
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    while True:
        pieces = np.maximum(np.ceil(sides / spacing).astype(np.int64), 1)
        if ((pieces + 1) * (pieces + 2) // 2).sum() <= _MAX_POINTS * 2:
            break
        spacing *= 1.15
    found: list[np.ndarray] = []
    for count in np.unique(pieces):
        i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij")
        use = i + j <= count
        weights = np.stack([i[use], j[use], count - i[use] - j[use]], axis=1) / count
        found.append(np.einsum("wk,fkx->fwx", weights, corners[pieces == count]).reshape(-1, 3))
    points = np.concatenate(found)
    cells = np.round(points / (0.5 * spacing)).astype(np.int64)
    cells -= cells.min(axis=0)
    key = (cells[:, 0] << 42) | (cells[:, 1] << 21) | cells[:, 2]
    return points[np.unique(key, return_index=True)[1]]
