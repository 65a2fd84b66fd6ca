"""Points on triangle surfaces, and how far points are from a surface."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Int64
from scipy.spatial import KDTree
from torch import Tensor

from panoscene.scene import Mesh

NEIGHBOURS = 8
"""Nearest samples and middles of triangles whose triangles are searched for the nearest point."""


@dataclass(frozen=True, slots=True)
class SurfaceSamples:
    """Points drawn evenly from the area of a mesh, and the triangles they came from."""

    point: Float[Tensor, "n 3"]
    face: Int64[Tensor, " n"]
    """Index of each point's triangle."""
    triangle: Float[Tensor, "faces 3 3"]
    normal: Float[Tensor, "faces 3"]
    """Unit normal of each triangle; zero where it has no area."""


@dataclass(frozen=True, slots=True)
class SurfaceDistance:
    """How far n points are from a sampled surface."""

    to_sample: Float[Tensor, " n"]
    """Distance to the nearest sample: never below the spacing of the samples, on average."""
    to_surface: Float[Tensor, " n"]
    """Distance to the surface itself, through the triangles of the nearest samples."""
    face: Int64[Tensor, " n"]
    """Triangle with the nearest point of the surface."""


def sample_surface(mesh: Mesh, count: int, generator: torch.Generator) -> SurfaceSamples:
    """Return points drawn evenly from the area of a mesh, in float64.

    A mesh whose triangles have no area gives points on its edges.

    Raises:
        ValueError: the mesh has no triangles or is not finite.

    Examples:
        >>> from panoscene.scene import box_mesh
        >>> drawn = sample_surface(box_mesh(), 100, torch.Generator().manual_seed(0))
        >>> bool(torch.all((drawn.point.abs().amax(1) - 0.5).abs() < 1e-12))
        True
    """
    triangle = mesh.vertices.detach().to("cpu", torch.float64)[mesh.faces.cpu()]
    if len(triangle) == 0 or not bool(triangle.isfinite().all()):
        raise ValueError(f"mesh: expected finite triangles, found {len(triangle)} faces")
    start, right, left = triangle.unbind(1)
    cross = torch.linalg.cross(right - start, left - start)
    double_area = cross.norm(dim=-1)
    if not float(double_area.sum()) > 0:
        double_area = torch.ones_like(double_area)
    chance = double_area.cumsum(0)
    draw = torch.rand(count, 3, generator=generator, dtype=torch.float64)
    face = torch.searchsorted(chance, draw[:, 0] * chance[-1], right=True)
    face = face.clamp(max=len(triangle) - 1)
    # the root makes places near the first corner as likely as their area
    away, along = draw[:, 1].sqrt(), draw[:, 2]
    weight = torch.stack((1 - away, away * (1 - along), away * along), dim=-1)
    point = (weight[..., None] * triangle[face]).sum(1)
    normal = torch.nn.functional.normalize(cross, dim=-1, eps=1e-300)
    return SurfaceSamples(point, face, triangle, normal)


def surface_distance(points: Float[Tensor, "n 3"], surface: SurfaceSamples) -> SurfaceDistance:
    """Return how far points are from a sampled surface.

    The distance to the surface is exact for the triangles that the nearest samples and middles of
    triangles belong to, and so is 0 for points of the same surface. It can only be too large, and
    then by less than the size of a triangle.
    """
    every = torch.arange(len(surface.triangle))
    landmark = torch.cat((surface.point, surface.triangle.mean(1)))
    owner = torch.cat((surface.face, every))
    away, index = _nearest(landmark, points, min(NEIGHBOURS, len(landmark)))
    # the nearest of all samples, unless those found are middles of triangles alone
    apart = torch.where(index < len(surface.point), away, torch.inf).amin(1)
    alone = (apart == torch.inf).nonzero()[:, 0]
    if len(alone):
        apart[alone] = _nearest(surface.point, points[alone], 1)[0][:, 0]
    face = owner[index]
    distance, best = triangle_distance(points[:, None], surface.triangle[face]).min(dim=1)
    nearest = face.gather(1, best[:, None])[:, 0]
    return SurfaceDistance(apart, distance, nearest)


def triangle_distance(
    points: Float[Tensor, "*#batch 3"], triangle: Float[Tensor, "*#batch 3 3"]
) -> Float[Tensor, "*batch"]:
    """Return the distance from points to the nearest point of a triangle each.

    Examples:
        >>> corner = torch.eye(3)[[0, 1]]
        >>> flat = torch.cat((torch.zeros(1, 3), corner))
        >>> triangle_distance(torch.tensor([[0.2, 0.2, 3.0], [0.0, -2.0, 0.0]]), flat)
        tensor([3., 2.])
    """
    start, right, left = (corner.unbind(-1) for corner in triangle.unbind(-2))
    ab = [b - a for a, b in zip(start, right, strict=True)]
    ac = [c - a for a, c in zip(start, left, strict=True)]
    ap = [p - a for a, p in zip(start, points.unbind(-1), strict=True)]
    bb, cc, bc = _dot(ab, ab), _dot(ac, ac), _dot(ab, ac)
    pb, pc, pp = _dot(ap, ab), _dot(ap, ac), _dot(ap, ap)

    def squared(v: Tensor, w: Tensor) -> Tensor:
        """Return the squared distance to the point a + v ab + w ac."""
        return pp + v * (v * bb - 2 * pb) + w * (w * cc - 2 * pc + 2 * v * bc)

    none = torch.zeros_like(pp)
    along = _share(pc - pb + bb - bc, bb + cc - 2 * bc)  # from b to c
    nearest = torch.minimum(squared(_share(pb, bb), none), squared(none, _share(pc, cc)))
    nearest = torch.minimum(nearest, squared(1 - along, along))
    area = bb * cc - bc * bc
    flat = area <= 1e-24 * bb * cc
    scale = 1 / torch.where(flat, 1.0, area)
    v, w = (cc * pb - bc * pc) * scale, (bb * pc - bc * pb) * scale
    inside = (v >= 0) & (w >= 0) & (v + w <= 1) & ~flat
    nearest = torch.where(inside, torch.minimum(nearest, squared(v, w)), nearest)
    return nearest.clamp(min=0).sqrt()


def _nearest(
    places: Float[Tensor, "m 3"], points: Float[Tensor, "n 3"], count: int
) -> tuple[Float[Tensor, "n k"], Int64[Tensor, "n k"]]:
    """Return distances and indices of the places nearest to points, the nearest first."""
    # points on flat faces split badly in the middle: such trees take three times as long
    tree = KDTree(places.numpy(), compact_nodes=False, balanced_tree=False)
    order = _along_a_curve(points.numpy())  # neighbours ask for the same part of the tree
    distance, index = tree.query(points.numpy()[order], k=range(1, count + 1))
    back = torch.from_numpy(order).argsort()
    return torch.from_numpy(distance)[back], torch.from_numpy(index)[back]


def _along_a_curve(points: Float[np.ndarray, "n 3"]) -> Int64[np.ndarray, " n"]:
    """Return an order in which neighbours follow each other: the bits of three axes in turn."""
    low = points.min(axis=0, initial=np.inf)
    side = max(float(np.ptp(points, axis=0).max(initial=0.0)), 1e-300) if len(points) else 1.0
    cell = ((points - low) / side * 1023).astype(np.int64)
    key = np.zeros(len(points), np.int64)
    for axis in range(3):
        bits = cell[:, axis]
        for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
            bits = (bits | (bits << shift)) & mask
        key |= bits << axis
    return np.argsort(key, kind="stable")


def _dot(first: list[Tensor], other: list[Tensor]) -> Tensor:
    return first[0] * other[0] + first[1] * other[1] + first[2] * other[2]


def _share(part: Tensor, whole: Tensor) -> Tensor:
    return (part / torch.where(whole > 0, whole, 1.0)).clamp(0, 1)
