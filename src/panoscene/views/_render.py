"""Rendered reconstructions: the room as an architect's model, in panorama view or from anywhere."""

import numpy as np
import torch
from jaxtyping import Bool, Float, Int32
from torch import Tensor

from panoscene.scene import Scene
from panoscene.views._cameras import FreeCamera, Lens, free_lens, panorama_lens
from panoscene.views._model import Model, build_model, rgb
from panoscene.views._outlines import edges, outlines
from panoscene.views._painter import FINE, Painter, Shade


def render_panorama(
    scene: Scene,
    *,
    height: int = 512,
    image: Float[Tensor, "3 rows columns"] | None = None,
    occlusion: bool = True,
    lines: bool = True,
) -> Float[Tensor, "3 {height} 2*{height}"]:
    """Return what the scene's own camera would see: RGB in [0, 1], equirectangular.

    Objects wear the colours of their groups; the front of a box is darker, with a dark upper
    edge and an arrow on its top. The result is the same every time.

    Args:
        scene: what to look at.
        height: rows; twice as many columns.
        image: the photo; walls, floor and ceiling then show what it shows in their direction, so
            places that furniture hides from the photo show the furniture.
        occlusion: whether corners and contacts are darker. It takes most of the time.
        lines: whether objects, their faces and the parts of the room have thin dark outlines.

    Convention:
        - boxes around the camera, and walls whose other side the camera sees, are left out

    Raises:
        ValueError: the floor polygon is not valid, a box is not finite, or there are no pixels.
    """
    lens = panorama_lens(scene.panorama.camera_height, height)
    model = build_model(scene, lens.eye, cut=False)
    shade = Shade(4 if occlusion else 0, lines, image, scene.panorama.camera_height)
    return render_model(model, lens, shade)


def render_view(
    scene: Scene,
    camera: FreeCamera,
    *,
    size_px: tuple[int, int] = (1024, 768),
    image: Float[Tensor, "3 rows columns"] | None = None,
    occlusion: bool = True,
    lines: bool = True,
) -> Float[Tensor, "3 height width"]:
    """Return what a free camera would see: RGB in [0, 1].

    Args:
        scene: what to look at.
        camera: where from; ``default_view`` finds a good place.
        size_px: width and height.
        image: as in ``render_panorama``.
        occlusion: as in ``render_panorama``.
        lines: as in ``render_panorama``.

    Convention:
        - walls, floor and ceiling that face away from the camera are left out, so a camera outside
          looks into the room as into a doll's house
        - boxes around the camera are left out

    Raises:
        ValueError: the floor polygon is not valid, a box is not finite, or there are no pixels.
    """
    lens = free_lens(camera, size_px)
    model = build_model(scene, lens.eye, cut=True)
    shade = Shade(6 if occlusion else 0, lines, image, scene.panorama.camera_height)
    return render_model(model, lens, shade)


def render_model(model: Model, lens: Lens, shade: Shade) -> Float[Tensor, "3 height width"]:
    """Return the picture of a model through a lens."""
    painter = Painter(model, lens, shade)
    v, u = np.meshgrid(
        np.arange(lens.rows, dtype=np.float32) + 0.5,
        np.arange(lens.columns, dtype=np.float32) + 0.5,
        indexing="ij",
    )
    colour, label = painter.base(u, v)
    edge = edges(label, circular=lens.circular)
    fine = painter.fine(u[edge], v[edge])
    colour[edge] = fine.colour.reshape(-1, FINE**2, 3).mean(axis=1)
    if shade.lines:
        facet = fine_map(label, edge, fine.label) >> 1  # nothing stays negative
        for line, ink in outlines(facet, model, shade.alarmed, circular=lens.circular):
            drawn = line > 0
            colour[drawn] += line[drawn][:, None] * (np.float32(rgb(ink)) - colour[drawn])
    return torch.as_tensor(np.moveaxis(colour, -1, 0).clip(0.0, 1.0).copy())


def fine_map(
    label: Int32[np.ndarray, "rows columns"],
    edge: Bool[np.ndarray, "rows columns"],
    fine: Int32[np.ndarray, " n"],
) -> Int32[np.ndarray, "fine_rows fine_columns"]:
    """Return the labels of all sub-pixels, which were looked at only where there are edges."""
    rows, columns = label.shape
    labels = np.repeat(np.repeat(label, FINE, axis=0), FINE, axis=1)
    blocks = labels.reshape(rows, FINE, columns, FINE).swapaxes(1, 2)
    blocks[edge] = fine.reshape(-1, FINE, FINE)
    return labels
