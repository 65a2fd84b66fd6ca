"""Collision shapes: a model as a few boxes that enclose its surface, and which space is solid."""

import hashlib
import io
import zipfile
import zlib
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path
from tokenize import TokenError

import numpy as np
from jaxtyping import Bool, Float64, Int64, UInt8
from scipy import ndimage

from panoscene.scene import write_atomically
from panoscene.synth.assets import CadModel

from ._columns import Columns, column_hits

FREE, SURFACE, INSIDE = 0, 1, 2
_VERSION = 2
_FINEST, _COARSEST = 0.008, 0.025
_VOXELS = 40
"""Along the longest side, within the two limits."""
MOST_BOXES = 160
_COARSER = 1.35
_THINNEST = 0.002


@dataclass(frozen=True, slots=True)
class CollisionShape:
    """Boxes and voxels of a model in its object frame, unscaled, in metres."""

    boxes: Float64[np.ndarray, "boxes 2 3"]
    """Lowest and highest corners. Together they contain the surface and what it encloses."""
    state: UInt8[np.ndarray, "nx ny nz"]
    """0 where there is nothing, 1 where the surface runs, 2 inside of a body."""
    low: Float64[np.ndarray, " 3"]
    """Lowest corner of the first voxel."""
    step: Float64[np.ndarray, " 3"]
    """Extent of a voxel."""

    def states(self, points: Float64[np.ndarray, "n 3"]) -> UInt8[np.ndarray, " n"]:
        """Return the state of the voxels that points are in; 0 outside of the grid."""
        index = np.floor((points - self.low) / self.step).astype(np.int64)
        known = np.asarray(((index >= 0) & (index < self.state.shape)).all(axis=1))
        index = np.where(known[:, None], index, 0)
        x, y, z = index.T
        return np.where(known, self.state[x, y, z], np.uint8(FREE))


def collision_shape(
    model: CadModel, cache: Path | None = None, most_boxes: int = MOST_BOXES
) -> CollisionShape:
    """Return the collision shape of a model, from the cache where it is known.

    The surface is sampled along the three axes; every voxel keeps the bounds of what is in it, so
    boxes end where the surface ends and not where the voxel does. Voxels that cannot be reached
    from the sides or from above are solid. Solid and surface voxels are merged greedily; where
    that gives too many boxes, the voxels grow.

    Args:
        model: Any model.
        cache: Folder of the assets; shapes are kept in its subfolder ``collision``.
        most_boxes: Greatest number of boxes.
    """
    if cache is None:
        return _make(model, most_boxes)
    path = cache / "collision" / f"{_key(model, most_boxes)}.npz"
    found = _read(path)
    if found is None:
        found = _make(model, most_boxes)
        _write(path, found)
    return found


def _key(model: CadModel, most_boxes: int) -> str:
    digest = hashlib.sha256(f"{_VERSION} {most_boxes} {model.id}".encode())
    digest.update(np.ascontiguousarray(model.vertices).tobytes())
    digest.update(np.ascontiguousarray(model.faces).tobytes())
    return digest.hexdigest()[:32]


def _read(path: Path) -> CollisionShape | None:
    """Return a shape of the cache; None when there is none or when it is damaged."""
    try:
        with np.load(path, allow_pickle=False) as found:
            return CollisionShape(found["boxes"], found["state"], found["low"], found["step"])
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error,
            TokenError, SyntaxError):  # fmt: skip
        return None


def _write(path: Path, shape: CollisionShape) -> None:
    stream = io.BytesIO()
    np.savez_compressed(
        stream, boxes=shape.boxes, state=shape.state, low=shape.low, step=shape.step
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, stream.getvalue())


def _make(model: CadModel, most_boxes: int) -> CollisionShape:
    triangles = model.vertices.astype(np.float64)[model.faces]
    if not len(triangles):
        raise ValueError(f"model: {model.id} has no faces, expected a surface")
    low, high = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    extent = high - low
    step = float(np.clip(extent.max() / _VOXELS, _FINEST, _COARSEST))
    points = _surface_points(triangles, low, extent, step / 4)
    shape = _voxels(points, low, extent, step, most_boxes)
    while shape is None:
        step *= _COARSER
        shape = _voxels(points, low, extent, step, most_boxes)
    return shape


def _surface_points(
    triangles: Float64[np.ndarray, "faces 3 3"],
    low: Float64[np.ndarray, " 3"],
    extent: Float64[np.ndarray, " 3"],
    spacing: float,
) -> Float64[np.ndarray, "n 3"]:
    """Return corners and the points where lines along the three axes meet the surface."""
    found = [triangles.reshape(-1, 3)]
    for axis in range(3):
        order = [(axis + 1) % 3, (axis + 2) % 3, axis]
        span = np.maximum(extent[order[:2]], 1e-6)
        rows, columns = np.ceil(span / spacing).astype(int).tolist()
        width, depth = (span / (rows, columns)).tolist()
        corner = (float(low[order[0]]), float(low[order[1]]))
        lines = Columns(corner, (width, depth), (rows, columns))
        hits = column_hits(triangles[..., order], lines)
        turned = np.column_stack([lines.places(hits.cell), hits.height])
        found.append(turned[:, np.argsort(order)])
    return np.concatenate(found)


def _voxels(
    points: Float64[np.ndarray, "n 3"],
    low: Float64[np.ndarray, " 3"],
    extent: Float64[np.ndarray, " 3"],
    step: float,
    most_boxes: int,
) -> CollisionShape | None:
    """Return the shape at a voxel size; None when it has too many boxes."""
    counts = np.ceil(np.round(extent / step, 6)).astype(np.int64).clip(min=1)
    steps = np.maximum(extent, 1e-6) / counts
    index = np.floor((points - low) / steps).astype(np.int64).clip(0, counts - 1)
    flat = np.ravel_multi_index((index[:, 0], index[:, 1], index[:, 2]), counts)
    total = int(np.prod(counts))
    lows, highs = np.full((total, 3), np.inf), np.full((total, 3), -np.inf)
    order = np.argsort(flat, kind="stable")
    cells, starts = np.unique(flat[order], return_index=True)
    lows[cells] = np.minimum.reduceat(points[order], starts, axis=0)
    highs[cells] = np.maximum.reduceat(points[order], starts, axis=0)
    surface = np.isfinite(lows[:, 0]).reshape(counts)
    inside = ~surface & ~_reached(surface)
    lows, highs = lows.reshape(*counts, 3), highs.reshape(*counts, 3)
    _grow_inwards(lows, highs, inside, low, steps)
    boxes = _merged(surface | inside, lows, highs, most_boxes)
    if boxes is None:
        return None
    thin = np.maximum(_THINNEST - (boxes[:, 1] - boxes[:, 0]), 0.0) / 2
    boxes = np.stack([boxes[:, 0] - thin, boxes[:, 1] + thin], axis=1)
    state = np.where(surface, SURFACE, np.where(inside, INSIDE, FREE)).astype(np.uint8)
    return CollisionShape(boxes, state, low, steps)


def _reached(surface: Bool[np.ndarray, "nx ny nz"]) -> Bool[np.ndarray, "nx ny nz"]:
    """Return the empty voxels that are connected with the sides or the top, not only the bottom."""
    padded = np.pad(~surface, ((1, 1), (1, 1), (0, 1)), constant_values=True)
    labels = np.zeros(padded.shape, np.int32)
    ndimage.label(padded, output=labels)
    return (labels == labels[0, 0, -1])[1:-1, 1:-1, :-1]


def _grow_inwards(
    lows: Float64[np.ndarray, "nx ny nz 3"],
    highs: Float64[np.ndarray, "nx ny nz 3"],
    inside: Bool[np.ndarray, "nx ny nz"],
    low: Float64[np.ndarray, " 3"],
    steps: Float64[np.ndarray, " 3"],
) -> None:
    """Fill solid voxels, and let surface voxels reach the solid ones beside them."""
    where = np.argwhere(inside)
    lows[inside], highs[inside] = low + where * steps, low + (where + 1) * steps
    surface = np.isfinite(lows[..., 0]) & ~inside
    for axis in range(3):
        corner = low[axis] + np.arange(inside.shape[axis]) * steps[axis]
        corner = corner.reshape([-1 if k == axis else 1 for k in range(3)])
        before = np.roll(inside, 1, axis)
        np.moveaxis(before, axis, 0)[0] = False
        after = np.roll(inside, -1, axis)
        np.moveaxis(after, axis, 0)[-1] = False
        lows[..., axis] = np.where(surface & before, corner, lows[..., axis])
        highs[..., axis] = np.where(surface & after, corner + steps[axis], highs[..., axis])


def _merged(
    full: Bool[np.ndarray, "nx ny nz"],
    lows: Float64[np.ndarray, "nx ny nz 3"],
    highs: Float64[np.ndarray, "nx ny nz 3"],
    most: int,
) -> Float64[np.ndarray, "boxes 2 3"] | None:
    """Return the bounds of blocks of full voxels, from the order of axes that needs the fewest.

    None when all orders need more than ``most``.
    """
    best: np.ndarray | None = None
    for order in permutations(range(3)):
        limit = most if best is None else len(best) - 1
        blocks = _blocks(np.ascontiguousarray(full.transpose(order)), limit)
        if blocks is not None:
            best = blocks[:, :, np.argsort(order)]
    if best is None:
        return None
    cut = [tuple(slice(int(a), int(b)) for a, b in zip(*block, strict=True)) for block in best]
    return np.array(
        [[lows[part].min(axis=(0, 1, 2)), highs[part].max(axis=(0, 1, 2))] for part in cut]
    )


def _blocks(
    full: Bool[np.ndarray, "nx ny nz"], most: int
) -> Int64[np.ndarray, "blocks 2 3"] | None:
    """Return first and last + 1 index of blocks that cover the full voxels, each once.

    None when there are more than ``most``.
    """
    left = full.copy()
    flat = left.reshape(-1)
    found: list[tuple[tuple[int, int, int], tuple[int, int, int]]] = []
    start = 0
    while True:
        ahead = int(np.argmax(flat[start:])) + start
        if not flat[ahead]:
            break
        if len(found) == most:
            return None
        start = ahead
        x, rest = divmod(ahead, left.shape[1] * left.shape[2])
        y, z = divmod(rest, left.shape[2])
        row = np.asarray(left[x, y, z:])
        z1 = z + (len(row) if row.all() else int(np.argmin(row)))
        rows = np.asarray(left[x, y:, z:z1].all(axis=1))
        y1 = y + (len(rows) if rows.all() else int(np.argmin(rows)))
        slabs = np.asarray(left[x:, y:y1, z:z1].all(axis=(1, 2)))
        x1 = x + (len(slabs) if slabs.all() else int(np.argmin(slabs)))
        left[x:x1, y:y1, z:z1] = False
        found.append(((x, y, z), (x1, y1, z1)))
    return np.array(found, np.int64).reshape(-1, 2, 3)
