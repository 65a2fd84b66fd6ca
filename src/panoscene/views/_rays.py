"""What rays hit: the surface, how far away, and which way it faces."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from jaxtyping import Float, Int32, Int64
from torch import Tensor

from panoscene.scene import Scene, Surface, scene_surfaces


@dataclass(frozen=True, slots=True)
class RayHits:
    """The nearest surface along each ray."""

    surface: Int64[Tensor, "*batch"]
    """Index into ``scene_surfaces(scene)``; -1 where the ray leaves the scene."""
    distance: Float[Tensor, "*batch"]
    """Metres along the ray; infinite where it leaves the scene."""
    normal: Float[Tensor, "*batch 3"]
    """World frame, unit length, out of objects and into the room, whichever side was hit; zero
    where the ray leaves the scene."""


def cast_rays(
    scene: Scene, origins: Float[Tensor, "*#batch 3"], directions: Float[Tensor, "*#batch 3"]
) -> RayHits:
    """Return the nearest surface along each ray; surfaces are seen from both sides.

    It makes exact maps of distance, category and normal: in a panorama's pixels with
    ``panorama_directions``, in a crop's with ``perspective_directions``. Computed in single
    precision, about 1e-6 of the room's size.

    Args:
        scene: what to look at.
        origins: where the rays start, world frame, metres.
        directions: where they go, world frame, any length but zero.

    Raises:
        ValueError: the floor polygon is not valid, a box is not finite, or a ray is not finite or
            has no direction.

    Examples:
        >>> from panoscene.sample import sample_room_path
        >>> from panoscene.scene import read_scene, scene_surfaces
        >>> scene = read_scene(sample_room_path())
        >>> down = torch.tensor([0.0, 0.0, -1.0])
        >>> hits = cast_rays(scene, torch.tensor([0.0, 0.0, 1.6]), down)
        >>> scene_surfaces(scene)[int(hits.surface)].kind, round(float(hits.distance), 3)
        ('floor', 1.6)
    """
    origins, directions = torch.broadcast_tensors(origins, directions)
    length = directions.norm(dim=-1, keepdim=True)
    if not bool(torch.isfinite(origins).all() & torch.isfinite(length).all() & (length > 0).all()):
        raise ValueError("rays: found numbers that are not finite, or a direction of length 0")
    surfaces = checked_surfaces(scene)
    soup = join_surfaces(surfaces)
    caster = RayCaster(soup)
    face, distance = caster.first_and_distance(_rays(origins), _rays(directions / length))
    hit = face >= 0
    surface = np.where(hit, soup.surface[face], -1)
    normal = np.where(hit[:, None], soup.normal[face], np.float32(0.0))
    shape, device, dtype = length.shape[:-1], length.device, length.dtype
    return RayHits(
        torch.as_tensor(surface).reshape(shape).to(device),
        torch.as_tensor(distance).reshape(shape).to(device, dtype),
        torch.as_tensor(normal).reshape(*shape, 3).to(device, dtype),
    )


@dataclass(frozen=True, slots=True)
class Soup:
    """The triangles of several surfaces in one list."""

    vertices: Float[np.ndarray, "vertices 3"]
    faces: Int32[np.ndarray, "faces 3"]
    normal: Float[np.ndarray, "faces 3"]
    """Unit length; zero for triangles without an area."""
    surface: Int64[np.ndarray, " faces"]
    """Which surface each triangle belongs to."""


class RayCaster:
    """Triangles sorted for ray casting; scenes that stay the same need only one."""

    def __init__(self, soup: Soup) -> None:
        self._empty = len(soup.faces) == 0
        self._scene = EmbreeScene(robust=True)
        if not self._empty:
            TriangleMesh(scene=self._scene, vertices=soup.vertices, indices=soup.faces)

    def first(
        self, origins: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]
    ) -> Int32[np.ndarray, " n"]:
        """Return the first triangle along each ray of unit length, or -1."""
        if self._empty or len(origins) == 0:
            return np.full(len(origins), -1, np.int32)
        return self._scene.run(origins, directions)

    def first_and_distance(
        self, origins: Float[np.ndarray, "n 3"], directions: Float[np.ndarray, "n 3"]
    ) -> tuple[Int32[np.ndarray, " n"], Float[np.ndarray, " n"]]:
        """Return the first triangle along each ray of unit length, or -1, and its distance."""
        count = len(origins)
        if self._empty or count == 0:
            return np.full(count, -1, np.int32), np.full(count, np.inf, np.float32)
        hits = self._scene.run(origins, directions, output=1)
        face = hits["primID"]
        return face, np.where(face >= 0, hits["tfar"], np.float32(np.inf))

    def clear_distance(
        self,
        origins: Float[np.ndarray, "n 3"],
        directions: Float[np.ndarray, "n 3"],
        reach: float,
    ) -> Float[np.ndarray, " n"]:
        """Return how far each ray of unit length gets, at most ``reach``."""
        limit = np.full(len(origins), reach, np.float32)
        if self._empty or len(origins) == 0:
            return limit
        distance = self._scene.run(origins, directions, dists=limit, query="DISTANCE")
        return np.minimum(distance, limit)


def checked_surfaces(scene: Scene) -> tuple[Surface, ...]:
    """Return the surfaces of a scene, or say what is not finite."""
    boxes, layout = scene.objects.boxes, scene.layout
    heights = torch.tensor([layout.floor_height, layout.ceiling_height])
    for name, values in (
        ("boxes.centre", boxes.centre),
        ("boxes.size", boxes.size),
        ("boxes.yaw", boxes.yaw),
        ("floor_polygon", layout.floor_polygon),
        ("floor_height, ceiling_height", heights),
    ):
        if not bool(torch.isfinite(values).all()):
            raise ValueError(f"{name}: found numbers that are not finite")
    return scene_surfaces(scene)


def join_surfaces(surfaces: Sequence[Surface]) -> Soup:
    """Return the triangles of the surfaces in one list."""
    counts = [len(surface.vertices) for surface in surfaces]
    starts = np.cumsum([0, *counts])
    vertices = np.zeros((starts[-1], 3), np.float32)
    faces = [np.zeros((0, 3), np.int32)]
    for surface, start in zip(surfaces, starts, strict=False):
        vertices[start : start + len(surface.vertices)] = surface.vertices.numpy(force=True)
        faces.append((surface.faces.numpy(force=True) + start).astype(np.int32))
    owner = np.repeat(np.arange(len(surfaces)), [len(surface.faces) for surface in surfaces])
    face = np.concatenate(faces)
    a, b, c = (vertices[face[:, k]].astype(np.float64) for k in range(3))
    across = np.cross(b - a, c - a)
    normal = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-30)
    return Soup(vertices, face, normal.astype(np.float32), owner)


def _rays(values: Tensor) -> Float[np.ndarray, "n 3"]:
    return np.ascontiguousarray(values.reshape(-1, 3).numpy(force=True).astype(np.float32))
