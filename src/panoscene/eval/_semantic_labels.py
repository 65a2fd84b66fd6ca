"""Which of the 12 PanoContext labels a scene shows in each viewing direction."""

import math
from typing import Literal

import torch
import trimesh
from jaxtyping import Bool, Float, Int64
from torch import Tensor
from trimesh.ray.ray_pyembree import RayMeshIntersector

from panoscene.geometry import (
    OrientedBoxes,
    box_contains,
    lonlat_from_direction,
    polygon_contains,
    polygon_problem,
    wall_distance,
)
from panoscene.scene import (
    CATEGORIES,
    PANOCONTEXT_12,
    PANOCONTEXT_LABELS,
    Scene,
    object_surface,
)

SemanticMethod = Literal["boxes", "surfaces"]

BACKGROUND = PANOCONTEXT_12.index("background")

FLUSH = 1e-3
"""An object is seen when it lies no more than this (metres) behind the room's own surface, so
that doors and pictures that are flush with their wall do not vanish by rounding."""

_LABEL_OF_CATEGORY = tuple(PANOCONTEXT_12.index(PANOCONTEXT_LABELS[name]) for name in CATEGORIES)


def sphere_directions(count: int) -> Float[Tensor, "count 3"]:
    """Return unit directions that are spread evenly over the sphere (a Fibonacci spiral).

    Every direction stands for the same solid angle, so shares of directions are shares of the
    sphere; the error falls faster than with random directions, and needs no seed.

    Raises:
        ValueError: ``count`` is not positive.

    Examples:
        >>> sphere_directions(1000).mean(0).abs().max() < 1e-3
        tensor(True)
    """
    if count < 1:
        raise ValueError(f"count: expected at least 1 direction, found {count}")
    number = torch.arange(count, dtype=torch.float64) + 0.5
    z = 1 - 2 * number / count
    across = (1 - z * z).clamp(min=0).sqrt()
    lon = number * (math.pi * (3 - math.sqrt(5)))
    return torch.stack((across * lon.sin(), across * lon.cos(), z), dim=-1).float()


def semantic_labels(
    scene: Scene, directions: Float[Tensor, "n 3"], method: SemanticMethod = "boxes"
) -> Int64[Tensor, " n"]:
    """Return the index into ``PANOCONTEXT_12`` of what the camera sees in each direction.

    ``boxes`` is the paper's protocol: boxes are drawn from far to near, by the distance of their
    centres, as filled outlines. The outline of a projected box is filled exactly where a ray
    hits it. Neither walls nor the true order of surfaces matter.

    ``surfaces`` takes the first surface that the ray meets: boxes of objects without a mesh,
    meshes, walls, floor and ceiling. A room that is not valid, or not around the camera, hides
    nothing.

    Convention:
        - objects of the categories that the table leaves out are drawn as background: they hide
          what is behind them
        - a box around the camera has no outline; it is not drawn, by either method, unless its
          shape is a mesh and the method is ``surfaces``

    Args:
        scene: Objects and room in the world frame.
        directions: Viewing directions in camera axes, of any length but zero.
        method: ``boxes`` or ``surfaces``.

    Raises:
        ValueError: the method is not known.

    Source: paper, Sec. 4, semantic segmentation; protocol of the authors' release.

    Examples:
        >>> from panoscene.scene import PANOCONTEXT_12, Layout, objects_from_boxes, scene_from_boxes
        >>> box = OrientedBoxes(torch.tensor([[0.0, 2.0, 1.6]]), torch.ones(1, 3), torch.zeros(1))
        >>> room = Layout(torch.tensor([[-3.0, -3.0], [3.0, -3.0], [3.0, 3.0], [-3.0, 3.0]]))
        >>> scene = scene_from_boxes(objects_from_boxes(box, ["bed"]), room)
        >>> ahead_and_back = torch.tensor([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
        >>> [PANOCONTEXT_12[k] for k in semantic_labels(scene, ahead_and_back)]
        ['bed', 'background']
    """
    if method not in ("boxes", "surfaces"):
        raise ValueError(f"method: expected 'boxes' or 'surfaces', found {method!r}")
    directions = directions / directions.norm(dim=-1, keepdim=True)
    centre = scene.objects.boxes.centre.detach().to("cpu", torch.float32)
    boxes = OrientedBoxes(
        centre - centre.new_tensor([0.0, 0.0, scene.panorama.camera_height]),
        scene.objects.boxes.size.detach().to("cpu", torch.float32),
        scene.objects.boxes.yaw.detach().to("cpu", torch.float32),
    )
    first = _first_object(scene, boxes, directions, method)
    table = torch.tensor(_LABEL_OF_CATEGORY)
    own = table[scene.objects.category.cpu()]
    return torch.cat((own, own.new_tensor([BACKGROUND])))[first]


def boxes_around_camera(scene: Scene) -> Bool[Tensor, " n"]:
    """Return which boxes the camera is in; they have no outline."""
    boxes = scene.objects.boxes
    camera = boxes.centre.new_tensor([0.0, 0.0, scene.panorama.camera_height])
    return box_contains(boxes, camera.expand(len(boxes), 1, 3))[:, 0]


def _first_object(
    scene: Scene, boxes: OrientedBoxes, directions: Float[Tensor, "n 3"], method: SemanticMethod
) -> Int64[Tensor, " n"]:
    """Return the object that each direction shows, or the number of objects where it is none."""
    direction, box = _pairs_near(boxes, directions)
    entry = _entry_distance(boxes[box], directions[direction])
    hit = entry > 0
    if method == "boxes":
        order = boxes.centre.norm(dim=-1)[box]
        nothing = torch.full((len(directions),), torch.inf)
        return _nearest(direction[hit], box[hit], order[hit], nothing, len(boxes))[0]
    solid = _objects_with_mesh(scene)
    hit &= ~solid[box]
    room = _room_distance(scene, directions) + FLUSH
    first, near = _nearest(direction[hit], box[hit], entry[hit], room, len(boxes))
    if not bool(solid.any()):
        return first
    mesh, mesh_distance = _first_mesh(scene, torch.nonzero(solid)[:, 0].tolist(), directions)
    return torch.where(mesh_distance < near, mesh, first)


def _nearest(
    direction: Int64[Tensor, " pairs"],
    box: Int64[Tensor, " pairs"],
    distance: Float[Tensor, " pairs"],
    limit: Float[Tensor, " n"],
    count: int,
) -> tuple[Int64[Tensor, " n"], Float[Tensor, " n"]]:
    """Return the nearest box in each direction and its distance; ``count`` beyond the limit."""
    near = limit.scatter_reduce(0, direction, distance, "amin")
    wins = distance <= near[direction]
    # of objects at exactly the same distance, the first one
    first = torch.full((len(limit),), count)
    return first.scatter_reduce_(0, direction[wins], box[wins], "amin"), near


def _objects_with_mesh(scene: Scene) -> Bool[Tensor, " n"]:
    """Return which objects have a shape of their own."""
    meshes = scene.objects.shapes.mesh or (None,) * len(scene.objects.boxes)
    has = [mesh is not None and len(mesh.faces) > 0 for mesh in meshes]
    return torch.tensor(has, dtype=torch.bool)


def _pairs_near(
    boxes: OrientedBoxes, directions: Float[Tensor, "n 3"]
) -> tuple[Int64[Tensor, " pairs"], Int64[Tensor, " pairs"]]:
    """Return the directions and boxes where a ray meets the sphere around the box."""
    radius = boxes.size.norm(dim=-1) / 2
    distance = boxes.centre.norm(dim=-1)
    outside = distance > radius
    sine = torch.where(outside, radius / torch.where(outside, distance, 1.0), 1.0)
    # a little wider, since single precision blurs small angles
    least = torch.where(outside, (1 - sine * sine).clamp(min=0).sqrt() - 1e-4, -2.0)
    towards = boxes.centre / distance.clamp(min=1e-9)[:, None]
    box, direction = torch.nonzero(towards @ directions.T >= least[:, None], as_tuple=True)
    return direction, box


def _entry_distance(
    boxes: OrientedBoxes, directions: Float[Tensor, "pairs 3"]
) -> Float[Tensor, " pairs"]:
    """Return the distance at which each ray enters its box; -1 where it does not.

    Rays start at the origin; a ray that starts inside does not enter.
    """
    cos, sin = torch.cos(boxes.yaw), torch.sin(boxes.yaw)
    x, y, z = directions.unbind(-1)
    centre_x, centre_y, centre_z = boxes.centre.unbind(-1)
    half_x, half_y, half_z = (boxes.size / 2).unbind(-1)
    first: list[Tensor] = []
    last: list[Tensor] = []
    for along, middle, half in (
        (cos * x + sin * y, cos * centre_x + sin * centre_y, half_x),
        (cos * y - sin * x, cos * centre_y - sin * centre_x, half_y),
        (z, centre_z, half_z),
    ):
        inverse = 1 / torch.where(along.abs() < 1e-9, 1e-9, along)
        nearest, reach = middle * inverse, half * inverse.abs()
        first.append(nearest - reach)
        last.append(nearest + reach)
    enter = torch.maximum(torch.maximum(first[0], first[1]), first[2])
    leave = torch.minimum(torch.minimum(last[0], last[1]), last[2])
    return torch.where((enter > 0) & (enter <= leave), enter, -1.0)


def _room_distance(scene: Scene, directions: Float[Tensor, "n 3"]) -> Float[Tensor, " n"]:
    """Return the distance to wall, floor or ceiling; infinity where no room is seen."""
    layout, camera = scene.layout, scene.panorama.camera_height
    corners = layout.floor_polygon.detach().to("cpu", torch.float32)
    seen = (
        layout.floor_height < camera < layout.ceiling_height
        and polygon_problem(corners) is None
        and bool(polygon_contains(corners.new_zeros(1, 2), corners))
    )
    if not seen:
        return torch.full((len(directions),), torch.inf)
    level = torch.hypot(directions[:, 0], directions[:, 1]).clamp(min=1e-9)
    wall = wall_distance(corners, lonlat_from_direction(directions)[:, 0]) / level
    rise = directions[:, 2]
    rise = torch.where(rise.abs() < 1e-9, 1e-9, rise)
    height = torch.where(rise > 0, layout.ceiling_height - camera, layout.floor_height - camera)
    return torch.minimum(wall, height / rise)


def _first_mesh(
    scene: Scene, chosen: list[int], directions: Float[Tensor, "n 3"]
) -> tuple[Int64[Tensor, " n"], Float[Tensor, " n"]]:
    """Return the first object with a mesh that each ray meets, and the distance in metres."""
    vertices: list[Tensor] = []
    faces: list[Tensor] = []
    owners: list[Tensor] = []
    offset = 0
    for k in chosen:
        surface = object_surface(scene, k)
        vertices.append(surface.vertices.detach().cpu().double())
        faces.append(surface.faces.cpu() + offset)
        owners.append(torch.full((len(surface.faces),), k))
        offset += len(surface.vertices)
    corner = torch.cat(vertices)[torch.cat(faces)]
    corner[..., 2] -= scene.panorama.camera_height
    soup = trimesh.Trimesh(
        corner.reshape(-1, 3).numpy(),
        torch.arange(3 * len(corner)).reshape(-1, 3).numpy(),
        process=False,
    )
    rays = directions.double()
    origins = torch.zeros_like(rays)
    found = RayMeshIntersector(soup).intersects_first(origins.numpy(), rays.numpy())
    face = torch.as_tensor(found).long()
    met = face >= 0
    triangle = corner[face.clamp(min=0)]
    normal = torch.linalg.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0])
    towards = (normal * rays).sum(-1)
    distance = (normal * triangle[:, 0]).sum(-1) / torch.where(towards == 0, 1.0, towards)
    owner = torch.cat(owners)[face.clamp(min=0)]
    return owner, torch.where(met & (towards != 0), distance, torch.inf).float()
