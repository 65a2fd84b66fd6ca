"""The photo around the room: a sphere whose inside carries it."""

from io import BytesIO

import numpy as np
import torch
import trimesh
import viser
from jaxtyping import Float
from PIL import Image
from torch import Tensor
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from panoscene.geometry import direction_from_lonlat
from panoscene.scene import Scene

LARGEST = 4096
"""Columns of the picture that is sent to the browser."""
_ROWS, _COLUMNS = 64, 128


def draw_photo(
    scene: viser.SceneApi, image: Float[Tensor, "3 height width"], room: Scene
) -> viser.GlbHandle:
    """Return the hidden sphere with the photo, large enough to be around the room."""
    reach = float(room.layout.floor_polygon.norm(dim=-1).max())
    sphere = photo_sphere(image, room.panorama.camera_height, 3 * reach + 10)
    return scene.add_mesh_trimesh(
        "/photo", sphere, visible=False, cast_shadow=False, receive_shadow=False
    )


def photo_sphere(
    image: Float[Tensor, "3 height width"], camera_height: float, radius: float
) -> trimesh.Trimesh:
    """Return a sphere around the camera, seen from inside, that carries a panorama.

    Args:
        image: RGB in [0, 1].
        camera_height: metres above the floor; the sphere's centre is the camera.
        radius: metres.

    Convention:
        - world frame; texture coordinate 0, 0 is the lower left corner of the picture
    """
    u = torch.linspace(0, 1, _COLUMNS + 1, dtype=torch.float64)
    v = torch.linspace(0, 1, _ROWS + 1, dtype=torch.float64)
    grid_v, grid_u = torch.meshgrid(v, u, indexing="ij")
    lonlat = torch.stack([2 * torch.pi * (grid_u - 0.5), torch.pi * (0.5 - grid_v)], -1)
    vertices = radius * direction_from_lonlat(lonlat).reshape(-1, 3).numpy()
    vertices[:, 2] += camera_height
    number = np.arange((_ROWS + 1) * (_COLUMNS + 1)).reshape(_ROWS + 1, _COLUMNS + 1)
    # a column to the right is clockwise from above: seen from inside, right is right
    a, b, c, d = (
        x.ravel() for x in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    )
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    material = PBRMaterial(
        baseColorFactor=(0, 0, 0, 255),
        emissiveTexture=_picture(image),
        emissiveFactor=(1.0, 1.0, 1.0),
        metallicFactor=0.0,
        roughnessFactor=1.0,
    )
    uv = np.stack([grid_u.ravel().numpy(), 1 - grid_v.ravel().numpy()], 1)
    visual = TextureVisuals(uv=uv, material=material)
    return trimesh.Trimesh(vertices, faces, visual=visual, process=False)


def _picture(image: Float[Tensor, "3 height width"]) -> Image.Image:
    """Return the panorama as a JPEG picture of a size that browsers like."""
    pixels = (image.clamp(0, 1) * 255).round().to(torch.uint8).permute(1, 2, 0).cpu().numpy()
    picture = Image.fromarray(np.ascontiguousarray(pixels))
    if picture.width > LARGEST:
        picture = picture.resize((LARGEST, LARGEST // 2), Image.Resampling.LANCZOS)
    packed = BytesIO()
    picture.save(packed, "JPEG", quality=90)
    return Image.open(packed)
