"""Colours of places on a model: light, photo, marks of fronts, occlusion."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, Int32
from torch import Tensor

from panoscene.geometry import pixel_from_direction, sample_panorama
from panoscene.style import INK, PAPER
from panoscene.views._cameras import Lens
from panoscene.views._light import face_light, head_light, occlusion_map
from panoscene.views._model import SHELL, Model, rgb

FINE = 3
"""Sub-pixels in a row of each pixel at an edge."""
_DARKEST = 0.55
"""How much of the light occlusion takes at most."""
_STRIP = 0.022
"""Metres of the line along a front's upper edge."""
_MARK = 0.65
"""How much ink is in the marks of fronts."""
_STRIDE = 2
"""Occlusion is measured in every second row and column."""


@dataclass(frozen=True, slots=True)
class Shade:
    """How to draw."""

    rays: int
    """Occlusion rays for each measured point; 0 for none."""
    lines: bool
    """Whether there are outlines."""
    image: Float[Tensor, "3 height width"] | None
    """The photo, for the room's shell."""
    camera_height: float
    """Of the photo's camera."""
    alarmed: frozenset[int] = frozenset()
    """Objects that are outlined in the colour of collisions."""


@dataclass(frozen=True, slots=True)
class Painted:
    colour: Float[np.ndarray, "n 3"]
    label: Int32[np.ndarray, " n"]
    """Twice the triangle's facet, plus one on the mark of a front; negative for nothing."""


class Painter:
    """Colours rays of one lens; measures occlusion once."""

    def __init__(self, model: Model, lens: Lens, shade: Shade) -> None:
        self._model, self._lens, self._shade = model, lens, shade
        self._light = face_light(model)
        corner = model.soup.vertices[model.soup.faces[:, 0]]
        self._plane = ((corner - lens.eye) * model.soup.normal).sum(1).astype(np.float32)
        self._occlusion: Float[np.ndarray, "rows columns"] | None = None
        self._facet: Int32[np.ndarray, "rows columns"] | None = None

    def base(
        self, u: Float[np.ndarray, "rows columns"], v: Float[np.ndarray, "rows columns"]
    ) -> tuple[Float[np.ndarray, "rows columns 3"], Int32[np.ndarray, "rows columns"]]:
        """Return colours and labels of the pixels' centres."""
        face, direction = self._cast(u.ravel(), v.ravel())
        if self._shade.rays > 0:
            self._measure(face, direction)
        painted = self._paint(u.ravel(), v.ravel(), face, direction)
        return painted.colour.reshape(*u.shape, 3), painted.label.reshape(u.shape)

    def fine(self, u: Float[np.ndarray, " n"], v: Float[np.ndarray, " n"]) -> Painted:
        """Return colours and labels of the sub-pixels of some pixels, row by row."""
        step = (np.arange(FINE, dtype=np.float32) + 0.5) / FINE - 0.5
        fine_v, fine_u = (grid.ravel() for grid in np.meshgrid(step, step, indexing="ij"))
        u, v = (u[:, None] + fine_u).ravel(), (v[:, None] + fine_v).ravel()
        return self._paint(u, v, *self._cast(u, v))

    def _cast(
        self, u: Float[np.ndarray, " n"], v: Float[np.ndarray, " n"]
    ) -> tuple[Int32[np.ndarray, " n"], Float[np.ndarray, "n 3"]]:
        direction = np.ascontiguousarray(self._lens.directions(u, v), np.float32)
        eye = np.broadcast_to(self._lens.eye.astype(np.float32), direction.shape)
        face = self._model.caster.first(np.ascontiguousarray(eye), direction)
        return face, direction

    def _measure(
        self,
        face: Int32[np.ndarray, " n"],
        direction: Float[np.ndarray, "n 3"],
    ) -> None:
        def coarse(values: np.ndarray) -> np.ndarray:
            grid = values.reshape(self._lens.rows, self._lens.columns, *values.shape[1:])
            return grid[::_STRIDE, ::_STRIDE]

        face, direction = coarse(face), coarse(direction)
        normal = self._model.soup.normal[face]
        facing = (normal * direction).sum(-1, keepdims=True)
        normal = np.where(facing > 0, -normal, normal)
        points = self._points(face, direction)
        self._occlusion = occlusion_map(
            self._model, points, face, normal, self._shade.rays, circular=self._lens.circular
        )
        self._facet = np.where(face >= 0, self._model.facet[face], -1)

    def _points(
        self, face: Int32[np.ndarray, "*n"], direction: Float[np.ndarray, "*n 3"]
    ) -> Float[np.ndarray, "*n 3"]:
        """Return where rays meet the planes of their triangles."""
        along = (self._model.soup.normal[face] * direction).sum(-1)
        along = np.where(np.abs(along) < 1e-6, np.float32(1e-6), along)
        distance = np.where(face >= 0, self._plane[face] / along, np.float32(0.0))
        return self._lens.eye.astype(np.float32) + distance[..., None] * direction

    def _paint(
        self,
        u: Float[np.ndarray, " n"],
        v: Float[np.ndarray, " n"],
        face: Int32[np.ndarray, " n"],
        direction: Float[np.ndarray, "n 3"],
    ) -> Painted:
        model = self._model
        hit = face >= 0
        facing = np.einsum("nk,nk->n", model.soup.normal[face], direction)
        light = self._light[face] + head_light(facing)
        facet = model.facet[face]
        colour = model.colour[face]
        marked = self._marked(face, direction)
        colour[marked] += np.float32(_MARK) * (np.float32(rgb(INK)) - colour[marked])
        if self._shade.image is not None:
            shell = hit & (model.kind[face] == SHELL)
            colour[shell] = self._photo(self._points(face[shell], direction[shell]))
            light[shell] = 1.0
        if self._occlusion is not None:
            light *= 1.0 - _DARKEST * self._look_up(u, v, facet)
        colour *= light[:, None]
        colour[~hit] = np.float32(rgb(PAPER))
        return Painted(colour, np.where(hit, 2 * facet + marked, -1).astype(np.int32))

    def _marked(
        self,
        face: Int32[np.ndarray, " n"],
        direction: Float[np.ndarray, "n 3"],
    ) -> Bool[np.ndarray, " n"]:
        """Return which points lie on the mark of a front."""
        marked = np.zeros(len(face), bool)
        size = self._model.mark[face]
        near = np.flatnonzero((size != 0) & (face >= 0))
        index, size = face[near], size[near]
        place = self._points(index, direction[near])
        across, behind = self._model.across[index], self._model.behind[index]
        right = (across[:, :3] * place).sum(1) + across[:, 3]
        back = (behind[:, :3] * place).sum(1) + behind[:, 3]
        length = np.abs(size)
        strip = back < np.minimum(_STRIP, 0.2 * length)
        along = back / length - 0.3
        arrow = (size > 0) & (along > 0) & (along < 1) & (np.abs(right) < 0.8 * along * length)
        marked[near] = strip | arrow
        return marked

    def _photo(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
        """Return what the photo shows at points of the world."""
        image = self._shade.image
        if image is None or len(points) == 0:
            return np.zeros((len(points), 3), np.float32)
        camera = np.array([0.0, 0.0, self._shade.camera_height], np.float32)
        rays = torch.as_tensor(points - camera)
        uv = pixel_from_direction(rays, *image.shape[-2:])[:, None]
        photo = sample_panorama(image.detach().cpu().float(), uv)
        return photo[..., 0].T.numpy()

    def _look_up(
        self,
        u: Float[np.ndarray, " n"],
        v: Float[np.ndarray, " n"],
        facet: Int32[np.ndarray, " n"],
    ) -> Float[np.ndarray, " n"]:
        """Return the occlusion at pixels, from the measured places on the same facet."""
        occlusion, facets = self._occlusion, self._facet
        if occlusion is None or facets is None:
            return np.zeros_like(u)
        rows, columns = occlusion.shape
        x, y = (u - 0.5) / _STRIDE, (v - 0.5) / _STRIDE
        left, top = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
        x, y = (x - left).astype(np.float32), (y - top).astype(np.float32)
        total, weight = np.zeros_like(x), np.zeros_like(x)
        for down, part_y in ((0, 1 - y), (1, y)):
            row = np.clip(top + down, 0, rows - 1)
            for right, part_x in ((0, 1 - x), (1, x)):
                column = left + right
                column = column % columns if self._lens.circular else column.clip(0, columns - 1)
                place = row * columns + column
                same = np.where(facets.ravel()[place] == facet, np.float32(1), np.float32(1e-4))
                part = (part_x * part_y + np.float32(1e-3)) * same
                total += part * occlusion.ravel()[place]
                weight += part
        return total / weight
