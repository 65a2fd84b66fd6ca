"""Scenes as triangles: every object, wall, floor and ceiling in the world frame."""

from dataclasses import dataclass, replace
from typing import Literal

import shapely
import torch
from jaxtyping import Float, Int64
from torch import Tensor

from panoscene.geometry import OrientedBoxes

from ._numbers import numbers_from_tensor
from ._openings import opened_wall, wall_openings
from ._records import Layout, Mesh, Objects, Scene
from ._triples import object_names, wall_names

SurfaceKind = Literal["object", "wall", "floor", "ceiling"]

_BOX_FACES = (
    (0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4),
    (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Surface:
    """The triangles of one object or one part of the room, in the world frame."""

    name: str
    """Unique in its scene: the object's name, ``wall-0``, ``floor`` or ``ceiling``."""
    kind: SurfaceKind
    index: int
    """Of the object or wall; 0 for floor and ceiling."""
    vertices: Float[Tensor, "vertices 3"]
    """World x, y, z in metres."""
    faces: Int64[Tensor, "faces 3"]
    """Vertex indices, counter-clockwise seen from the side that faces out of an object or into
    the room."""


def box_mesh() -> Mesh:
    """Return the canonical box, the proxy of a shape that is not known.

    Convention:
        - vertices in the corner order of ``box_corners`` (bit 0 = x, bit 1 = y, bit 2 = z);
          faces point out

    Examples:
        >>> mesh = box_mesh()
        >>> mesh.vertices[5].tolist(), len(mesh.faces)
        ([0.5, -0.5, 0.5], 12)
    """
    corner = torch.arange(8)
    bits = torch.stack([(corner >> axis) & 1 for axis in range(3)], dim=-1)
    return Mesh(bits.to(torch.float32) - 0.5, torch.tensor(_BOX_FACES))


def object_mesh(objects: Objects, index: int) -> Mesh:
    """Return the canonical mesh of one object: its shape, or the box where it has none."""
    mesh = objects.shapes.mesh[index] if objects.shapes.mesh else None
    return box_mesh() if mesh is None or len(mesh.faces) == 0 else mesh


def place_vertices(
    vertices: Float[Tensor, "vertices 3"], box: OrientedBoxes
) -> Float[Tensor, "vertices 3"]:
    """Return canonical vertices in the world frame of one box (batch shape ()).

    Examples:
        >>> box = OrientedBoxes(torch.tensor([1.0, 0.0, 0.5]), torch.ones(3), torch.tensor(0.0))
        >>> place_vertices(torch.tensor([[0.5, 0.5, 0.5]]), box)
        tensor([[1.5000, 0.5000, 1.0000]])
    """
    local = vertices.to(box.size) * box.size
    cos, sin = torch.cos(box.yaw), torch.sin(box.yaw)
    x, y, z = local.unbind(dim=-1)
    return torch.stack([cos * x - sin * y, sin * x + cos * y, z], dim=-1) + box.centre


def object_surface(scene: Scene, index: int) -> Surface:
    """Return the triangles of one object in the world frame."""
    mesh = object_mesh(scene.objects, index)
    vertices = place_vertices(mesh.vertices, scene.objects.boxes[index])
    return Surface(object_names(scene.objects)[index], "object", index, vertices, mesh.faces)


def room_surfaces(layout: Layout) -> tuple[Surface, ...]:
    """Return floor, ceiling and walls, seen from inside the room; walls as in the polygon's order.

    Raises:
        ValueError: the floor polygon is not valid.
    """
    corners = layout.floor_polygon
    n = len(corners)
    triangles = _polygon_triangles(corners)
    low = torch.cat([corners, torch.full_like(corners[:, :1], layout.floor_height)], dim=1)
    high = torch.cat([corners, torch.full_like(corners[:, :1], layout.ceiling_height)], dim=1)
    quad = torch.tensor([[0, 2, 1], [0, 3, 2]])
    walls = tuple(
        Surface(
            name,
            "wall",
            k,
            torch.stack([low[k], low[(k + 1) % n], high[(k + 1) % n], high[k]]),
            quad,
        )
        for k, name in enumerate(wall_names(n))
    )
    return (
        Surface("floor", "floor", 0, low, triangles),
        Surface("ceiling", "ceiling", 0, high, triangles.flip(-1)),
        *walls,
    )


def scene_surfaces(scene: Scene) -> tuple[Surface, ...]:
    """Return all surfaces of a scene: the room's, then one for each object.

    Walls are open where doors and windows stand in them, and where other things have sunk in.

    Raises:
        ValueError: the floor polygon is not valid.
    """
    layout = scene.layout
    floor, ceiling, *walls = room_surfaces(layout)
    opened = [
        _opened(wall, layout, openings) if len(openings) else wall
        for wall, openings in zip(walls, wall_openings(scene), strict=True)
    ]
    objects = (object_surface(scene, k) for k in range(len(scene.objects.boxes)))
    return (floor, ceiling, *opened, *objects)


def _opened(wall: Surface, layout: Layout, openings: Float[Tensor, "openings 4"]) -> Surface:
    start, end = wall.vertices[0, :2], wall.vertices[1, :2]
    vertices, faces = opened_wall(start, end, layout.floor_height, layout.ceiling_height, openings)
    return replace(wall, vertices=vertices, faces=faces)


def _polygon_triangles(corners: Float[Tensor, "corners 2"]) -> Int64[Tensor, "faces 3"]:
    """Return triangles of the corners, counter-clockwise, without corners of their own."""
    points = corners.detach().to("cpu", torch.float64)
    polygon = shapely.Polygon(numbers_from_tensor(points)) if len(points) >= 3 else None
    if polygon is None or not polygon.is_valid or polygon.area <= 0:
        raise ValueError("layout.floor_polygon: expected a simple polygon; see polygon_problem")
    pieces = shapely.get_coordinates(shapely.constrained_delaunay_triangles(polygon))
    corner = torch.tensor(pieces.tolist(), dtype=torch.float64).reshape(-1, 4, 2)[:, :3]
    faces = torch.cdist(corner.flatten(0, 1), points).argmin(dim=-1).reshape(-1, 3)
    (ax, ay), (bx, by), (cx, cy) = (place.unbind(-1) for place in points[faces].unbind(1))
    clockwise = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax) < 0
    return torch.where(clockwise[:, None], faces.flip([-1]), faces).to(corners.device)
