"""Edge points of a panorama, with subpixel places, on overlapping perspective views."""

import functools
import math
from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Float32, Float64, Int64
from torch import Tensor

from panoscene.geometry import camera_from_turned, perspective_directions, pixel_from_direction

from ._blocks import block_strength

FOV = math.radians(100)
"""Width and height of a view: a face of the cube and 5 degrees more on each side."""

_LOOK_AT = [(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5)]
_LUMINANCE = (0.299, 0.587, 0.114)
_MOST_COLUMNS = 1024
_BLUR = 0.9
_LEAST_SLOPE = 0.008
"""Change of luminance (0 to 1) per pixel of what counts as an edge."""
_BORDER = 4


@dataclass(frozen=True, slots=True)
class EdgePoints:
    """Points on edges, one for each pixel that an edge runs through."""

    view: Int64[np.ndarray, " n"]
    """Which view the point is on."""
    row: Int64[np.ndarray, " n"]
    column: Int64[np.ndarray, " n"]
    """The pixel of the point."""
    plane: Float32[np.ndarray, "n 2"]
    """Right and down on the view's image plane at distance one, located within the pixel."""
    turn: Float32[np.ndarray, " n"]
    """Angle of the brightness gradient on the image plane, in radians."""
    side: int
    """Rows and columns of a view."""
    camera_from_view: Float32[np.ndarray, "views 3 3"]
    """Columns: right, down and ahead of the view in camera axes."""
    pixel: float
    """Width of a pixel on the image plane at distance one."""
    blocks: float
    """Strength of JPEG blocks in the panorama, as in ``block_strength``."""


def edge_points(image: Float[Tensor, "3 height width"]) -> EdgePoints:
    """Return the edge points of a panorama; a large one is shrunk to 1024 columns first."""
    grey = torch.tensordot(torch.tensor(_LUMINANCE), image.detach().cpu().float(), 1)
    shrink = math.ceil(grey.shape[1] / _MOST_COLUMNS)
    if shrink > 1:
        size = (max(grey.shape[0] // shrink, 1), grey.shape[1] // shrink)
        grey = torch.nn.functional.interpolate(grey[None, None], size=size, mode="area")[0, 0]
    # as many pixels per radian in the middle of a view as the panorama has
    reach = math.tan(FOV / 2)
    side = max(round(2 * reach * grey.shape[1] / (2 * math.pi)), 4 * _BORDER)
    right, down = _slopes(_views(grey, side))
    view, row, column, offset = _crests(right, down)
    place = np.stack((column, row), axis=1) + np.float32(0.5) + offset
    frame = camera_from_turned(_looks()[:, :2]).numpy()
    pixel = 2 * reach / side
    return EdgePoints(
        view,
        row,
        column,
        ((place * pixel) - reach).astype(np.float32),
        np.arctan2(down[view, row, column], right[view, row, column]),
        side,
        np.stack((frame[..., 0], -frame[..., 2], frame[..., 1]), axis=-1),
        pixel,
        block_strength(grey.numpy()),
    )


def _looks() -> Float[Tensor, "views 4"]:
    """Return the BFoVs of the views."""
    return torch.tensor([(lon * math.pi, lat * math.pi, FOV, FOV) for lon, lat in _LOOK_AT])


def _views(
    grey: Float[Tensor, "height width"], side: int
) -> Float32[np.ndarray, "views rows columns"]:
    """Return the views; ``grid_sample`` is ten times as fast as exact sampling across the poles."""
    height, width = grey.shape
    over = torch.cat((grey[:1], grey, grey[-1:]))
    over = torch.cat((over[:, -1:], over, over[:, :1]), dim=1)
    grid = _grid(height, width, side)
    views = torch.nn.functional.grid_sample(
        over.expand(len(grid), 1, -1, -1), grid, align_corners=False
    )
    return views[:, 0].numpy()


@functools.lru_cache(maxsize=2)
def _grid(height: int, width: int, side: int) -> Float[Tensor, "views rows columns 2"]:
    """Return where the views' pixels lie in the panorama with one more pixel on each side."""
    uv = pixel_from_direction(perspective_directions(_looks(), (side, side)), height, width)
    return (uv + 1) * 2 / torch.tensor([width + 2, height + 2]) - 1


def _slopes(
    views: Float32[np.ndarray, "n rows columns"],
) -> tuple[Float32[np.ndarray, "n rows columns"], Float32[np.ndarray, "n rows columns"]]:
    """Return the derivatives of blurred views to the right and down."""
    reach = math.ceil(3 * _BLUR)
    at = np.arange(-reach, reach + 1)
    blur = np.exp(-0.5 * (at / _BLUR) ** 2)
    blur /= blur.sum()
    slope = at * blur
    slope /= (slope * at).sum()

    def along(across: np.ndarray, down: np.ndarray) -> np.ndarray:
        # a view at a time stays in the processor's cache
        return np.stack([_correlated(_correlated(view, across, 1), down, 0) for view in views])

    return along(slope, blur), along(blur, slope)


def _correlated(
    view: Float32[np.ndarray, "rows columns"], weights: Float64[np.ndarray, " n"], axis: int
) -> Float32[np.ndarray, "rows columns"]:
    """Return a view correlated with weights that are even or odd, its borders mirrored.

    The numbers are those of ``scipy.ndimage.correlate1d``, which takes long to import.
    """
    reach, size = len(weights) // 2, view.shape[axis]
    borders = [(0, 0), (0, 0)]
    borders[axis] = (reach, reach)
    wide = np.pad(view.astype(np.float64), borders, mode="symmetric")

    def moved(step: int) -> np.ndarray:
        part = slice(reach + step, reach + step + size)
        return wide[part] if axis == 0 else wide[:, part]

    combined = np.add if np.array_equal(weights, weights[::-1]) else np.subtract
    total = moved(0) * weights[reach]
    for step in range(-reach, 0):
        total += combined(moved(step), moved(-step)) * weights[reach + step]
    return total.astype(np.float32)


def _crests(
    right: Float32[np.ndarray, "n rows columns"], down: Float32[np.ndarray, "n rows columns"]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, Float32[np.ndarray, "points 2"]]:
    """Return view, row and column where the slope is steepest along its axis, and the offset.

    The axis is the one of the two that is nearer to the gradient; a parabola through the three
    slopes along it gives the crest within the pixel (Devernay 1995).
    """
    squared = right * right + down * down
    strong = squared > _LEAST_SLOPE**2
    for border in (slice(None, _BORDER), slice(-_BORDER, None)):
        strong[:, border] = strong[:, :, border] = False
    at = np.flatnonzero(strong)
    values = np.sqrt(squared, out=squared).reshape(-1)
    middle = values[at]
    horizontal = np.abs(right.reshape(-1)[at]) >= np.abs(down.reshape(-1)[at])
    step = np.where(horizontal, 1, right.shape[2])
    before, after = values[at - step], values[at + step]
    crest = (middle >= before) & (middle > after)
    at, middle, before, after = at[crest], middle[crest], before[crest], after[crest]
    horizontal = horizontal[crest]
    shift = 0.5 * (before - after) / (before + after - 2 * middle)
    offset = np.where(horizontal[:, None], (1.0, 0.0), (0.0, 1.0)) * shift[:, None]
    view, row, column = np.unravel_index(at, right.shape)
    return view, row, column, offset.astype(np.float32)
