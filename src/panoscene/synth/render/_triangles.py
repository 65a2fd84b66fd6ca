"""Gathers everything in a scene into two meshes: what stops light, and what lets it through."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float32, Int32, Int64, UInt32

from panoscene.synth.assets import Material
from panoscene.synth.render._lamps import Lamps
from panoscene.synth.render._paint import linear
from panoscene.synth.render._records import PlacedModel, RenderScene

_SHADE_SHARE = 0.3
"""Part of a lamp's light that its shade seems to send out itself."""


@dataclass(frozen=True, slots=True)
class Triangles:
    """Triangles with all that goes with them; solids first, then veils."""

    vertices: Float32[np.ndarray, "vertices 3"]
    normals: Float32[np.ndarray, "vertices 3"]
    uv: Float32[np.ndarray, "vertices 2"]
    """v runs up."""
    faces: UInt32[np.ndarray, "faces 3"]
    material: UInt32[np.ndarray, " faces"]
    instance: Int32[np.ndarray, " faces"]
    glow: Float32[np.ndarray, "faces 3"]
    """Radiance."""
    solids: int
    """So many faces stop light. The others are glass, gauze, lamp shades and bulbs."""
    materials: list[Material]


@dataclass(slots=True)
class _Heap:
    """Triangles so far, piece by piece."""

    pieces: list[tuple[np.ndarray, ...]] = field(default_factory=list)
    materials: dict[int, tuple[int, Material]] = field(default_factory=dict)

    def add(
        self,
        corners: tuple[np.ndarray, np.ndarray, np.ndarray],
        faces: np.ndarray,
        *,
        instance: int,
        material: Material,
        glow: np.ndarray | None = None,
    ) -> None:
        """Append triangles of one material; the corners are vertices, normals and uv."""
        vertices, normals, uv = corners
        number, _ = self.materials.setdefault(id(material), (len(self.materials), material))
        count = len(faces)
        light = np.zeros((count, 3), np.float32) if glow is None else glow.astype(np.float32)
        self.pieces.append((
            vertices.astype(np.float32), normals.astype(np.float32), uv.astype(np.float32),
            faces, np.full(count, number, np.uint32), np.full(count, instance, np.int32), light,
            np.full(count, _is_veil(material)),
        ))  # fmt: skip

    def joined(self) -> Triangles:
        """Return all triangles, solids first."""
        starts = np.cumsum([0] + [len(p[0]) for p in self.pieces])
        faces = np.concatenate([p[3] + n for p, n in zip(self.pieces, starts, strict=False)])
        vertices, normals, uv = (np.concatenate([p[k] for p in self.pieces]) for k in range(3))
        rows = [np.concatenate([p[k] for p in self.pieces]) for k in range(4, 8)]
        order = np.argsort(rows[3], kind="stable")
        return Triangles(
            vertices, normals, uv, faces[order].astype(np.uint32), rows[0][order], rows[1][order],
            rows[2][order], int((~rows[3]).sum()), [m for _, m in self.materials.values()],
        )  # fmt: skip


def triangles_of(scene: RenderScene, lamps: Lamps) -> Triangles:
    """Return the scene's triangles.

    Raises:
        ValueError: if nothing in the scene stops light.
    """
    heap = _Heap()
    for part in scene.parts:
        normals = _face_normals(part.vertices, part.faces)
        flat = part.faces.reshape(-1)
        own = np.arange(len(flat)).reshape(-1, 3)
        corners = (part.vertices[flat], np.repeat(normals, 3, axis=0), part.uv[flat])
        heap.add(corners, own, instance=part.instance, material=part.material)
    windows = {pane.instance for pane in scene.panes}
    for index, placed in enumerate(scene.placed):
        own = np.flatnonzero(lamps.owner == index)
        _add_placed(heap, placed, lamps, own, placed.instance in windows)
    if not any((~piece[7]).any() for piece in heap.pieces):
        raise ValueError("the scene has no solid surface, expected at least the parts of a room")
    far = np.array([[0, 0, -1e4], [1e-3, 0, -1e4], [0, 1e-3, -1e4]])
    heap.add(
        (far, far, far[:, :2]), np.array([[0, 1, 2]]), instance=0, material=_BULB
    )  # there is always a veil
    return heap.joined()


def _add_placed(
    heap: _Heap, placed: PlacedModel, lamps: Lamps, own: Int64[np.ndarray, " own"], is_window: bool
) -> None:
    model, matrix = placed.model, placed.world_from_object
    vertices = model.vertices @ matrix[:3, :3].T + matrix[:3, 3]
    normals = model.normals @ np.linalg.inv(matrix[:3, :3])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.where(length > 1e-12, normals / np.maximum(length, 1e-12), (0.0, 0.0, 1.0))
    for number, material in enumerate(model.materials):
        faces = model.faces[model.face_material == number]
        if len(faces) == 0 or (is_window and material.kind == "glass"):
            continue  # the panes of windows are rectangles of their own
        used, faces = np.unique(faces, return_inverse=True)
        faces, glow = faces.reshape(-1, 3), None
        if material.kind == "light":
            glow = _glowing(material, vertices[used], faces, lamps, own)
        corners = (vertices[used], normals[used], model.uv[used])
        heap.add(corners, faces, instance=placed.instance, material=material, glow=glow)
    for lamp in own:
        ball, faces = unit_ball()
        glow = np.broadcast_to(np.minimum(lamps.radiance[lamp], 12.0), (len(faces), 3))
        points = ball * lamps.radius[lamp] + lamps.position[lamp]
        uv = np.zeros((len(ball), 2))
        heap.add((points, ball, uv), faces, instance=placed.instance, material=_BULB, glow=glow)


def _glowing(material, vertices, faces, lamps, own) -> Float32[np.ndarray, "faces 3"]:
    """Return the light of a lamp shade: it glows most where it is near the bulb."""
    colour = linear(material.colour)
    if len(own) == 0:  # a screen or a strip without a lamp record: a weak light of its own
        weak = np.float32(0.12 * material.emission * colour)
        return np.broadcast_to(weak, (len(faces), 3))
    corners = vertices[faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = max(float(np.linalg.norm(cross, axis=1).sum() / 2), 0.02)
    centres = corners.mean(axis=1)
    apart = np.linalg.norm(centres[:, None] - lamps.position[own], axis=2)
    near = own[apart.argmin(axis=1)]
    mean = lamps.flux[near] / 1000.0 * _SHADE_SHARE / (np.pi * area) * max(material.emission, 0.2)
    reach = np.maximum(apart.min(axis=1), 0.03)
    fall = np.clip((np.median(reach) / reach) ** 1.2, 0.35, 2.5)
    tint = np.maximum(colour, 0.05) / max(float(colour.max()), 0.05)
    glow = np.minimum(mean * fall, 3.0)[:, None] * lamps.colour[near] * tint
    return glow.astype(np.float32)


_BULB = Material("bulb", (0.9, 0.9, 0.9), kind="light")


def _is_veil(material: Material) -> bool:
    return material.kind in ("glass", "light") or material.opacity < 0.95


def _face_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    a, b, c = vertices[faces[:, 0]], vertices[faces[:, 1]], vertices[faces[:, 2]]
    cross = np.cross(b - a, c - a)
    return cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-15)


def unit_ball(rings: int = 8, sides: int = 14) -> tuple[np.ndarray, np.ndarray]:
    """Return the vertices and triangles of a unit ball."""
    lat = np.linspace(-np.pi / 2, np.pi / 2, rings + 1)
    lon = np.arange(sides) * 2 * np.pi / sides
    lat, lon = (a.reshape(-1) for a in np.meshgrid(lat, lon, indexing="ij"))
    points = np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=1)
    i, j = (a.reshape(-1) for a in np.meshgrid(np.arange(rings), np.arange(sides), indexing="ij"))
    a, b = i * sides + j, i * sides + (j + 1) % sides
    first, second = np.stack([a, b, b + sides], 1), np.stack([a, b + sides, a + sides], 1)
    return points, np.concatenate([first, second])
