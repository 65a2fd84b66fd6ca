"""Pictures of predicted shapes beside the true ones."""

from collections.abc import Sequence

import numpy as np
import torch
from jaxtyping import Float, UInt8
from torch import Tensor
from torch.nn import functional as F

from panoscene.data._shape_samples import Picture
from panoscene.data._shape_store import ModelShape
from panoscene.scene import Mesh

_ROWS = 160
_VIEW = (-0.6, 0.85, 0.5)
_PAPER, _SURFACE, _TRUTH = (0.97, 0.97, 0.96), (0.30, 0.52, 0.75), (0.72, 0.68, 0.60)


def mesh_sheet(
    chosen: Sequence[tuple[Picture, ModelShape]], meshes: Sequence[Mesh | None]
) -> UInt8[np.ndarray, "height width 3"]:
    """Return one row for each object: its picture, the predicted mesh, and the true one.

    Meshes are shown in the proportions of the true box, from the front on the right.

    Args:
        chosen: Pictures and what they show.
        meshes: Predicted ones in canonical space; None leaves a gap.
    """
    rows: list[np.ndarray] = []
    for (picture, shape), mesh in zip(chosen, meshes, strict=True):
        extent = torch.from_numpy(shape.extent)
        image = torch.from_numpy(picture.image.copy()).permute(2, 0, 1).float() / 255
        cells = [F.interpolate(image[None], (_ROWS, _ROWS), mode="bilinear")[0].permute(1, 2, 0)]
        found = torch.tensor(_PAPER).expand(_ROWS, _ROWS, 3)
        if mesh is not None:
            found = _drawn(mesh.vertices * extent, mesh.faces.numpy(), _SURFACE)
        truth = _drawn(torch.from_numpy(shape.vertices), shape.faces, _TRUTH)
        rows.append(torch.cat([*cells, found, truth], 1).numpy())
    return (np.concatenate(rows) * 255).astype(np.uint8)


def _drawn(
    vertices: Float[Tensor, "vertices 3"], faces: np.ndarray, colour: tuple[float, float, float]
) -> Float[Tensor, "rows rows 3"]:
    """Return a parallel view of a mesh under a lamp at the camera."""
    import trimesh  # noqa: PLC0415

    mesh = trimesh.Trimesh(vertices.numpy(), faces, process=False)
    back = F.normalize(torch.tensor(_VIEW), dim=0).double()
    right = F.normalize(torch.linalg.cross(torch.tensor([0.0, 0.0, 1.0]).double(), back), dim=0)
    up = torch.linalg.cross(back, right)
    step = (torch.arange(_ROWS).double() + 0.5) / _ROWS - 0.5
    x, y = torch.meshgrid(step, -step, indexing="xy")
    origin = 1.5 * (x[..., None] * right + y[..., None] * up).reshape(-1, 3) + 3 * back
    towards = (-back).expand(len(origin), 3)
    triangle, ray = mesh.ray.intersects_id(origin.numpy(), towards.numpy(), multiple_hits=False)
    lamp = F.normalize(torch.tensor([-0.2, 0.6, 0.9]), dim=0).double().numpy()
    normal = np.asarray(mesh.face_normals)[triangle]
    light = 0.35 + 0.5 * np.clip(normal @ lamp, 0, 1) + 0.2 * np.abs(normal @ back.numpy())
    picture = torch.tensor(_PAPER).repeat(_ROWS * _ROWS, 1)
    lit = torch.from_numpy(light).float()[:, None] * torch.tensor(colour)
    picture[torch.from_numpy(ray)] = lit.clamp(0, 1)
    return picture.reshape(_ROWS, _ROWS, 3)
