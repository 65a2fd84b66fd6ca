"""Closed pieces that furniture is put together from; metres, outward faces, uv in metres."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

Number = float | int
Point = Sequence[Number]
Points = Float[np.ndarray, "points 3"]


class Piece(NamedTuple):
    """A closed surface; vertices are repeated where the uv has a seam."""

    vertices: Float[np.ndarray, "vertices 3"]
    uv: Float[np.ndarray, "vertices 2"]
    faces: Int[np.ndarray, "faces 3"]


def volume(vertices: Float[np.ndarray, "vertices 3"], faces: Int[np.ndarray, "faces 3"]) -> float:
    """Return the signed volume; positive when the faces of a closed surface look outwards."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)


def outward(piece: Piece) -> Piece:
    """Return the piece without empty triangles and with its faces looking outwards."""
    a, b, c = (piece.vertices[piece.faces[:, k]] for k in range(3))
    faces = piece.faces[np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-12]
    centred = piece.vertices - piece.vertices.mean(axis=0)
    if volume(centred, faces) < 0.0:
        faces = faces[:, ::-1]
    return piece._replace(faces=faces)


def move(piece: Piece, offset: Sequence[Number] | Float[np.ndarray, " 3"]) -> Piece:
    """Return the piece shifted."""
    return piece._replace(vertices=piece.vertices + np.asarray(offset, float))


def turn(piece: Piece, axis: str, angle: Number) -> Piece:
    """Return the piece turned about the x, y or z axis through the origin, counter-clockwise."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    vertices = piece.vertices.copy()
    vertices[:, i] = c * piece.vertices[:, i] - s * piece.vertices[:, j]
    vertices[:, j] = s * piece.vertices[:, i] + c * piece.vertices[:, j]
    return piece._replace(vertices=vertices)


def _box_faces() -> Int[np.ndarray, "44 3"]:
    """Return the triangles of a bevelled box; vertex 8 a + corner is on the face across axis a."""
    corner = np.array([[(k >> b) & 1 for b in range(3)] for k in range(8)]) * 2.0 - 1.0
    points = np.concatenate([np.where(np.eye(3)[a] > 0, 1.0, 0.9) * corner for a in range(3)])
    quads, triangles = [], []
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        quads += [
            [8 * a + s + k for k in (0, 1 << b, (1 << b) | (1 << c), 1 << c)] for s in (0, 1 << a)
        ]
        for s in (0, 1 << b):
            for r in (0, 1 << c):
                low, high = s + r, s + r + (1 << a)
                quads.append([8 * b + low, 8 * b + high, 8 * c + high, 8 * c + low])
    triangles = [[k, 8 + k, 16 + k] for k in range(8)]
    for q in quads:
        triangles += [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]
    faces = np.array(triangles)
    p, q, r = (points[faces[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(q - p, r - p), p + q + r) < 0
    faces[inward] = faces[inward, ::-1]
    return faces


_BOX = _box_faces()
_CORNERS = np.array([[(k >> b) & 1 for b in range(3)] for k in range(8)], float)


def box(low: Point, high: Point, bevel: Number = 0.0015) -> Piece:
    """Return a box with bevelled edges; u runs along its longest edges, as the grain of a board."""
    low_, high_ = np.minimum(low, high).astype(float), np.maximum(low, high).astype(float)
    size = high_ - low_
    inset = min(bevel, 0.3 * float(size.min()))
    vertices, uv = [], []
    for a in range(3):
        shrink = np.where(np.arange(3) == a, 0.0, inset)
        points = low_ + shrink + _CORNERS * (size - 2.0 * shrink)
        first, second = (a + 1) % 3, (a + 2) % 3
        if size[second] > size[first]:
            first, second = second, first
        flip = np.where(_CORNERS[:, a] > 0, 1.0, -1.0) * (1.0 if (a + 1) % 3 == first else -1.0)
        vertices.append(points)
        uv.append(np.stack([points[:, first], points[:, second] * flip], axis=1))
    return Piece(np.concatenate(vertices), np.concatenate(uv), _BOX)


def sheet(low: Point, high: Point) -> Piece:
    """Return a box whose front (+y) shows a whole picture; its other sides show the margin."""
    piece = box(low, high, 0.0005)
    low_, high_ = np.minimum(low, high), np.maximum(low, high)
    share = (piece.vertices - low_) / np.maximum(high_ - low_, 1e-9)
    front = np.zeros(len(share), bool)
    front[8:16] = _CORNERS[:, 1] > 0
    uv = np.stack([1.0 - share[:, 0], share[:, 2]], axis=1)
    return piece._replace(uv=np.where(front[:, None], uv, 0.004 + 0.0 * uv))


def rounded_box(low: Point, high: Point, radius: Number, bulge: Point = (0, 0, 0), steps: int = 3):
    """Return a box with round edges whose faces may swell by ``bulge`` along x, y and z."""
    centre, half = (np.add(low, high) / 2.0), np.abs(np.subtract(high, low)) / 2.0
    r = min(radius, float(half.min()) * 0.999)
    tangent = np.tan(np.linspace(np.pi / 4, 0.0, steps + 1))
    grids = []
    for h in half:
        inner = np.linspace(-(h - r), h - r, 6)[1:-1] if any(bulge) else np.zeros(0)
        grids.append(np.concatenate([-(h - r) - r * tangent, inner, (h - r) + r * tangent[::-1]]))
    vertices, uv, faces, count = [], [], [], 0
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        gb, gc = np.meshgrid(grids[b], grids[c], indexing="ij")
        for sign in (-1.0, 1.0):
            p = np.zeros((gb.size, 3))
            p[:, a], p[:, b], p[:, c] = sign * half[a], gb.ravel(), gc.ravel()
            inner = np.clip(p, -(half - r), half - r)
            away = p - inner
            q = inner + r * away / np.linalg.norm(away, axis=1, keepdims=True)
            swell = (1 - (p[:, b] / half[b]) ** 2) * (1 - (p[:, c] / half[c]) ** 2)
            q[:, a] += sign * bulge[a] * np.sqrt(np.maximum(swell, 0.0))
            first, second = (b, c) if half[b] >= half[c] else (c, b)
            vertices.append(q + centre)
            flip = sign if first == b else -sign
            uv.append(np.stack([p[:, first], p[:, second] * flip], axis=1))
            grid = _grid_faces(len(grids[b]), len(grids[c])) + count
            faces.append(grid if sign > 0 else grid[:, ::-1])
            count += len(q)
    return outward(Piece(np.concatenate(vertices), np.concatenate(uv), np.concatenate(faces)))


def _grid_faces(rows: int, columns: int) -> Int[np.ndarray, "faces 3"]:
    k = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]
    first, second = np.stack([a, b, c], -1), np.stack([a, c, d], -1)
    return np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)])


def loft(rings: Float[np.ndarray, "rings points 3"], joined: bool = False) -> Piece:
    """Return the surface through closed outlines one above the other, with lids at its ends.

    u runs from ring to ring, v along the rings. ``joined`` leads the last ring back to the first.
    """
    rings = np.concatenate([rings, rings[:1]]) if joined else rings
    closed = np.concatenate([rings, rings[:, :1]], axis=1)
    m, n = closed.shape[:2]
    up = np.linalg.norm(np.diff(closed, axis=0), axis=2).mean(axis=1)
    around = np.linalg.norm(np.diff(closed, axis=1), axis=2).max(axis=0)
    u, v = np.concatenate([[0.0], up.cumsum()]), np.concatenate([[0.0], around.cumsum()])
    uv = np.stack(np.meshgrid(u, v, indexing="ij"), axis=-1).reshape(-1, 2)
    vertices, faces = [closed.reshape(-1, 3)], [_grid_faces(m, n)]
    uvs, count = [uv], m * n
    for ring, sense in () if joined else ((rings[0], 1), (rings[-1], -1)):
        if np.ptp(ring, axis=0).max() < 1e-9:
            continue
        lid = np.concatenate([ring, ring.mean(axis=0, keepdims=True)])
        keep = np.argsort(np.ptp(ring, axis=0))[1:]
        k = np.arange(n - 1)
        fan = np.stack([k, np.full(n - 1, n - 1), (k + 1) % (n - 1)], axis=1)
        vertices.append(lid)
        uvs.append(lid[:, np.sort(keep)])
        faces.append((fan if sense > 0 else fan[:, ::-1])[:, ::-1] + count)
        count += n
    return outward(Piece(np.concatenate(vertices), np.concatenate(uvs), np.concatenate(faces)))


def circle(radius: Number, z: Number, segments: int = 32) -> Points:
    """Return the points of a level circle around the z axis."""
    t = 2.0 * np.pi * np.arange(segments) / segments
    return np.stack([radius * np.cos(t), radius * np.sin(t), np.full(segments, z)], axis=1)


def oval(
    width: Number, depth: Number, z: Number, power: Number = 4.0, segments: int = 40
) -> Points:
    """Return a level superellipse: power 2 is an ellipse, 8 nearly a rectangle."""
    t = 2.0 * np.pi * (np.arange(segments) + 0.5) / segments
    c, s = np.cos(t), np.sin(t)
    x = 0.5 * width * np.sign(c) * np.abs(c) ** (2.0 / power)
    y = 0.5 * depth * np.sign(s) * np.abs(s) ** (2.0 / power)
    return np.stack([x, y, np.full(segments, z)], axis=1)


def lathe(profile: Sequence[Sequence[Number]], segments: int = 32) -> Piece:
    """Return a surface of revolution about the z axis through (radius, z) points."""
    return loft(np.stack([circle(max(r, 0.0), z, segments) for r, z in profile]))


def cylinder(
    radius: Number, low: Number, high: Number, segments: int = 28, top: Number | None = None
):
    """Return an upright cylinder, or a cone when the radius at the top differs."""
    top = radius if top is None else top
    edge = 0.06 * min(radius, max(top, 1e-6), high - low)
    ring = [(0.0, low), (radius - edge, low), (radius, low + edge)]
    return lathe([*ring, (top, high - edge), (max(top - edge, 0.0), high), (0.0, high)], segments)


def prism(outline: Float[np.ndarray, "points 2"], low: Number, high: Number) -> Piece:
    """Return an upright prism over an outline that its mean point sees entirely."""
    rings = [np.column_stack([outline, np.full(len(outline), z)]) for z in (low, high)]
    return loft(np.stack(rings))


def tube(
    path: Sequence[Sequence[Number]] | Points, radius, segments: int = 10, joined: bool = False
):
    """Return a round rod along a path; the radius may be one number or one for every point."""
    p = np.asarray(path, float)
    tangent = np.roll(p, -1, 0) - np.roll(p, 1, 0) if joined else np.gradient(p, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    first = np.eye(3)[int(np.argmin(np.abs(tangent[0])))]
    normals = [first - tangent[0] * (first @ tangent[0])]
    for t in tangent[1:]:
        side = normals[-1] - t * (normals[-1] @ t)
        normals.append(side)
    side = np.array([n / np.linalg.norm(n) for n in normals])
    other = np.cross(tangent, side)
    angle = 2.0 * np.pi * np.arange(segments) / segments
    reach = np.broadcast_to(np.asarray(radius, float), (len(p),))[:, None, None]
    ring = (
        np.cos(angle)[None, :, None] * side[:, None] + np.sin(angle)[None, :, None] * other[:, None]
    )
    return loft(p[:, None] + reach * ring, joined)


def curve(
    points: Sequence[Sequence[Number]] | Points, count: int = 24, joined: bool = False
) -> Points:
    """Return a smooth line (Catmull-Rom) through points."""
    p = np.asarray(points, float)
    if joined:
        p = np.concatenate([p[-1:], p, p[:2]])
    else:
        p = np.concatenate([2 * p[:1] - p[1:2], p, 2 * p[-1:] - p[-2:-1]])
    t = np.linspace(0.0, len(p) - 3, count, endpoint=not joined)
    k = np.minimum(t.astype(int), len(p) - 4)
    s = (t - k)[:, None]
    a, b, c, d = p[k], p[k + 1], p[k + 2], p[k + 3]
    return 0.5 * (2 * b + (c - a) * s + (2 * a - 5 * b + 4 * c - d) * s**2
                  + (3 * b - a - 3 * c + d) * s**3)  # fmt: skip


def moulding(width: Number, height: Number, profile: Sequence[Sequence[Number]]) -> Piece:
    """Return a mitred frame in the x-z plane around the origin.

    The profile's points are (metres inwards from the outer edge, y), a closed outline.
    """
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]], float)
    half = np.array([width, height]) / 2.0
    rings = []
    for corner in corners:
        inside = [corner * (half - t) for t, _ in profile]
        rings.append([(x, y, z) for (x, z), (_, y) in zip(inside, profile, strict=True)])
    return loft(np.array(rings), joined=True)


def superellipsoid(
    size: Point, power_up: Number = 2.0, power_around: Number = 2.0, steps: int = 16
):
    """Return a superellipsoid around the origin; powers of 2 make an ellipsoid."""
    lat = np.linspace(-np.pi / 2, np.pi / 2, steps + 1)
    rings = []
    for angle in lat:
        reach = np.cos(angle) ** (2.0 / power_up) if abs(angle) < 1.57 else 0.0
        z = 0.5 * size[2] * np.sign(np.sin(angle)) * np.abs(np.sin(angle)) ** (2.0 / power_up)
        rings.append(oval(size[0] * reach, size[1] * reach, float(z), power_around, 2 * steps))
    return loft(np.stack(rings))


def pillow(width: Number, height: Number, thickness: Number, pinch: Number = 0.06, steps: int = 18):
    """Return a stuffed cushion in the x-z plane with seams at its rim and pointed corners."""
    s = np.sin(np.linspace(-np.pi / 2, np.pi / 2, steps + 1))
    x, z = np.meshgrid(s, s, indexing="ij")
    belly = np.maximum((1 - x**2) * (1 - z**2), 0.0) ** 0.42
    px = 0.5 * width * x * (1 - pinch * (1 - z**2) * np.abs(x) ** 3)
    pz = 0.5 * height * z * (1 - pinch * (1 - x**2) * np.abs(z) ** 3)
    pieces, uv, faces = [], [], []
    for k, sign in enumerate((1.0, -1.0)):
        pieces.append(np.stack([px, sign * 0.5 * thickness * belly, pz], -1).reshape(-1, 3))
        uv.append(np.stack([0.5 * width * x, 0.5 * height * z], -1).reshape(-1, 2))
        grid = _grid_faces(steps + 1, steps + 1) + k * x.size
        faces.append(grid if sign < 0 else grid[:, ::-1])
    return outward(Piece(np.concatenate(pieces), np.concatenate(uv), np.concatenate(faces)))
